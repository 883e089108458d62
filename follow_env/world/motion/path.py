"""`Path`: a way of one's own, straight lines and rounded corners, with stops."""

import math
from bisect import bisect_right
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from follow_env.world.motion.base import MOTIONS, Pose
from follow_env.world.motion.profile import PAPER_SPEED, speed_at, walked_at
from follow_env.world.scene import Scene

RAMP = 1.0
"""The person starts and stops within this time, s."""


@dataclass(frozen=True)
class _Piece:
    """A straight line, or an arc: where it begins on the way (m), its pose there, its curvature (1/m, ccw)."""

    begins: float
    x: float
    y: float
    heading: float
    curvature: float

    def pose(self, along: float) -> Pose:
        s = along - self.begins
        if self.curvature == 0.0:
            return self.x + s * math.cos(self.heading), self.y + s * math.sin(self.heading), self.heading
        heading = self.heading + self.curvature * s
        x = self.x + (math.sin(heading) - math.sin(self.heading)) / self.curvature
        return x, self.y - (math.cos(heading) - math.cos(self.heading)) / self.curvature, heading


@dataclass(frozen=True)
class _Walk:
    """From one stop to the next: when it begins (s), where (m), how far (m), how long (s), how fast (m/s)."""

    begins: float
    start: float
    distance: float
    duration: float
    cruise: float


class Path:
    """A way along points, corners rounded, walked at one speed, with stops.

    Args:
        start: (x, y, heading) at t = 0, m and rad.
        points: (x, y) of the corners and of the end in the frame of the start (x ahead, y left), m.
        speed: between starting and stopping, m/s.
        stops: (way walked in m, seconds to stand there).
        radius: of the rounded corners, m.

    Attributes:
        duration: until the person stands at the end, s.

    Raises:
        ValueError: if the points leave no room for the corners, or a stop is not on the way.
    """

    def __init__(
        self,
        start: Pose,
        points: Sequence[Sequence[float]],
        speed: float = PAPER_SPEED,
        stops: Sequence[Sequence[float]] = (),
        radius: float = 0.5,
    ) -> None:
        self._pieces, self.distance = _pieces(start, points, radius)
        self._begins = [piece.begins for piece in self._pieces]
        self._walks: list[_Walk] = []
        clock, place = 0.0, 0.0
        for where, wait in (*sorted((float(a), float(b)) for a, b in stops), (self.distance, 0.0)):
            if not (place < where <= self.distance and 0.0 <= wait < math.inf):
                raise ValueError(
                    f"stops are {stops!r}; expected (m, s) pairs on the way of {self.distance:.2f} m, times >= 0"
                )
            cruise = min(speed, (where - place) / RAMP)
            walk = _Walk(clock, place, where - place, (where - place) / cruise + RAMP, cruise)
            self._walks.append(walk)
            clock, place = clock + walk.duration + wait, where
        self._starts = [walk.begins for walk in self._walks]
        self.duration = clock

    def walked(self, t: float) -> float:
        """Return the way walked until time t, m."""
        walk = self._walk(t)
        return walk.start + walked_at(t - walk.begins, walk.distance, walk.cruise, walk.duration, RAMP)

    def speed(self, t: float) -> float:
        """Return the walking speed at time t, m/s."""
        walk = self._walk(t)
        return speed_at(t - walk.begins, walk.cruise, walk.duration, RAMP)

    def pose(self, t: float) -> Pose:
        """Return (x, y, heading) at time t, m and rad."""
        along = self.walked(t)
        return self._pieces[bisect_right(self._begins, along) - 1].pose(along)

    def velocity(self, t: float) -> tuple[float, float]:
        """Return the velocity at time t, m/s."""
        speed, heading = self.speed(t), self.pose(t)[2]
        return speed * math.cos(heading), speed * math.sin(heading)

    def _walk(self, t: float) -> _Walk:
        return self._walks[max(bisect_right(self._starts, t) - 1, 0)]


def _pieces(start: Pose, points: Sequence[Sequence[float]], radius: float) -> tuple[list[_Piece], float]:
    """Return the pieces of a way and its length, m."""
    x, y, heading = start
    corners = [(0.0, 0.0), *((float(a), float(b)) for a, b in points)]
    cuts = [0.0]
    legs = [(math.hypot(b[0] - a[0], b[1] - a[1]), math.atan2(b[1] - a[1], b[0] - a[0])) for a, b in pairwise(corners)]
    turns = [math.remainder(second - first, math.tau) for (_, first), (_, second) in pairwise(legs)]
    cuts += [radius * math.tan(0.5 * abs(turn)) for turn in turns]
    cuts.append(0.0)
    made: list[_Piece] = []
    along, heading = 0.0, heading + (legs[0][1] if legs else 0.0)
    for k, (length, _) in enumerate(legs):
        straight = length - cuts[k] - cuts[k + 1]
        if not (length > 0.0 and straight >= 0.0):
            raise ValueError(
                f"the points {points!r} leave no room for corners of {radius!r} m; expected points farther apart, or a "
                "smaller radius"
            )
        made.append(_Piece(along, x, y, heading, 0.0))
        along += straight
        x, y, _ = made[-1].pose(along)
        if k < len(turns) and turns[k] != 0.0:
            made.append(_Piece(along, x, y, heading, math.copysign(1.0 / radius, turns[k])))
            along += radius * abs(turns[k])
            x, y, heading = made[-1].pose(along)
    if not made:
        raise ValueError(f"the points are {points!r}; expected at least one (x, y) ahead of the start")
    return made, along


@MOTIONS.register("path")
def path(
    scene: Scene,
    start: Pose,
    rng: np.random.Generator,
    speed: float = PAPER_SPEED,
    points: Sequence[Sequence[float]] = ((12.0, 0.0),),
    stops: Sequence[Sequence[float]] = (),
    radius: float = 0.5,
) -> Path:
    """Return the way along points in the frame of the start; see `Path`."""
    return Path(start, points, speed, stops, radius)
