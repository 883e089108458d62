"""The walking person: the body that is seen and the gait that moves it (the collision body is in `physics`)."""
