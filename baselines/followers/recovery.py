"""What a follower does while the person is lost: stand still, or look where it saw the person last."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Protocol

from follow_env.config import EnvConfig
from follow_env.registry import Registry
from tracker.estimators.base import Pair

LOOK_RATE, LOOK_TIME = 0.5, 2.0
"""A robot that looks for the person it lost turns this fast (rad/s) to one side for this long (s), the width of the
picture, and then sweeps twice as far to either side in turn."""


class Recovery(Protocol):
    """Drives while there is no measurement."""

    def command(self, bearing: float, missing: float) -> Pair | None:
        """Return the twist (v m/s, omega rad/s), or None to leave the controller to its estimate.

        Args:
            bearing: of the person when it was measured last, rad.
            missing: time since then, s.
        """


RECOVERIES: Registry[Callable[..., Recovery]] = Registry("recovery")
"""Functions (`EnvConfig`, **settings) that return a recovery."""


@RECOVERIES.register("none")
class NoRecovery:
    """Leaves the controller to its estimate, whatever is missing."""

    def __init__(self, config: EnvConfig) -> None:
        self.config = config

    def command(self, bearing: float, missing: float) -> Pair | None:
        """Return None."""
        return None


@RECOVERIES.register("look")
class Look:
    """Stops and turns to the side where the person was seen last, then sweeps to either side.

    Args:
        config: of the environment.
        patience: for so long nothing is done, s.
        rate: of turning, rad/s.
        time: to one side, s.
    """

    def __init__(
        self, config: EnvConfig, patience: float = 0.5, rate: float = LOOK_RATE, time: float = LOOK_TIME
    ) -> None:
        self._patience, self._rate, self._time = patience, rate, time

    def command(self, bearing: float, missing: float) -> Pair | None:
        """Return the twist that looks for the person."""
        if missing <= self._patience:
            return None
        return 0.0, look_rate(bearing, missing - self._patience, self._rate, self._time)


def look_rate(bearing: float, looked: float, rate: float = LOOK_RATE, time: float = LOOK_TIME) -> float:
    """Return the turning rate (rad/s) after having looked for so long (s): first to the side of the bearing (rad)."""
    back = int((looked + time) / (2.0 * time)) % 2
    return math.copysign(rate, -bearing if back else bearing)
