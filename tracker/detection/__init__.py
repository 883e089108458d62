"""Finding people in pictures."""
