"""Controllers: from an estimated (bearing, distance) to the robot's twist."""

from __future__ import annotations

from collections.abc import Callable
from typing import Protocol

from follow_env.registry import Registry


class Controller(Protocol):
    """What every controller offers; the robot's limits are applied by the robot, not here."""

    def reset(self) -> None:
        """Forget everything but the settings."""

    def command(self, bearing: float, distance: float, dt: float) -> tuple[float, float]:
        """Return the twist (v m/s forward, omega rad/s counter-clockwise) for the next dt seconds.

        Args:
            bearing: Of the target, rad, positive to the left.
            distance: Forward distance to the target, m.
            dt: Control period, s, positive.
        """


CONTROLLERS: Registry[Callable[..., Controller]] = Registry("controller", "baselines.controllers")
"""Functions (`EnvConfig`, **settings) that return a fresh controller for that robot, rate and set point."""
