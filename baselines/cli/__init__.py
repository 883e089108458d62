"""What `follow` can do: a module for each command, whose `add` declares its words; it imports the rest when it runs."""
