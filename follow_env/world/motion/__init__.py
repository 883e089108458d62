"""How people move: paths with a speed profile."""
