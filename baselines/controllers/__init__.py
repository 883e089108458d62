"""Controllers: from an estimated (bearing, distance) to the robot's twist; each is registered in its own file."""

from baselines.controllers.base import CONTROLLERS, Controller

__all__ = ["CONTROLLERS", "Controller"]
