"""Zhang et al.: visual tracking of an astronaut (Tables 2 and 3, figures 11 and 16 to 18)."""
