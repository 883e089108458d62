"""Paper A's two tracking experiments, made again in the cabin."""
