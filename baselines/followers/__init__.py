"""Who drives: followers, references and learned agents."""
