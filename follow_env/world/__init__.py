"""The world without Gymnasium: scenes, people and how they move, robots, and the physics."""
