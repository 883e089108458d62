"""The rate of the physics, which both engines keep."""

PHYSICS_HZ = 240
"""Physics steps in a second."""
