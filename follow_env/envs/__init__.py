"""The Gymnasium environments: they compose the world, the camera and the sensors."""
