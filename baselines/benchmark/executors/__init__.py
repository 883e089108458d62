"""Where trials are played: in this process or in worker processes."""
