"""`TableMotion`: a recorded motion, (time, x, y), interpolated."""

import math
from bisect import bisect_right
from collections.abc import Sequence

import numpy as np

from follow_env.world.motion.base import MOTIONS, Pose
from follow_env.world.motion.profile import PAPER_SPEED
from follow_env.world.scene import Scene

STANDS = 0.05
"""Slower than this nobody turns: the heading stays, m/s."""


class TableMotion:
    """A motion through given places, straight and uniform between two of them.

    Args:
        start: (x, y, heading) of the frame that the places are in, m and rad.
        t: times, s, rising from 0.
        x, y: places then, m.

    Attributes:
        duration: the last time, s.

    Raises:
        ValueError: if the columns differ in length, hold fewer than two rows, or the times do not rise from 0.
    """

    def __init__(self, start: Pose, t: Sequence[float], x: Sequence[float], y: Sequence[float]) -> None:
        times = [float(value) for value in t]
        if not (len(times) == len(x) == len(y) >= 2 and times[0] == 0.0 and all(np.diff(times) > 0.0)):
            raise ValueError(
                f"the table has {len(times)} times, {len(x)} x and {len(y)} y; expected at least two rows of each, "
                "with times that rise from 0"
            )
        cosine, sine = math.cos(start[2]), math.sin(start[2])
        places = [
            (start[0] + cosine * float(a) - sine * float(b), start[1] + sine * float(a) + cosine * float(b))
            for a, b in zip(x, y, strict=True)
        ]
        self.duration = times[-1]
        self._times, self._places = times, places
        self._velocities: list[tuple[float, float]] = []
        self._headings: list[float] = []
        self._ways = [0.0]
        heading = start[2]
        for k in range(len(times) - 1):
            (x0, y0), (x1, y1), step = places[k], places[k + 1], times[k + 1] - times[k]
            way = math.hypot(x1 - x0, y1 - y0)
            if way > STANDS * step:
                heading += math.remainder(math.atan2(y1 - y0, x1 - x0) - heading, math.tau)
            self._velocities.append(((x1 - x0) / step, (y1 - y0) / step))
            self._headings.append(heading)
            self._ways.append(self._ways[-1] + way)

    def pose(self, t: float) -> Pose:
        """Return (x, y, heading) at time t, m and rad."""
        k, since = self._row(t)
        (x, y), (vx, vy) = self._places[k], self._velocities[k]
        return x + vx * since, y + vy * since, self._headings[k]

    def velocity(self, t: float) -> tuple[float, float]:
        """Return the velocity at time t, m/s."""
        return self._velocities[self._row(t)[0]]

    def speed(self, t: float) -> float:
        """Return the walking speed at time t, m/s."""
        return math.hypot(*self.velocity(t))

    def walked(self, t: float) -> float:
        """Return the way walked until time t, m."""
        k, since = self._row(t)
        return self._ways[k] + math.hypot(*self._velocities[k]) * since

    def _row(self, t: float) -> tuple[int, float]:
        t = min(max(t, 0.0), self.duration)
        k = min(bisect_right(self._times, t) - 1, len(self._velocities) - 1)
        return k, t - self._times[k]


@MOTIONS.register("table")
def table(
    scene: Scene,
    start: Pose,
    rng: np.random.Generator,
    speed: float = PAPER_SPEED,
    t: Sequence[float] = (),
    x: Sequence[float] = (),
    y: Sequence[float] = (),
) -> TableMotion:
    """Return the motion through (t, x, y) in the frame of the start; its times stay, whatever the walking speed."""
    return TableMotion(start, t, x, y)
