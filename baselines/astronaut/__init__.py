"""Paper A's experiments, made again in the cabin."""
