"""The walker's routes: a path and a speed profile, sampled once, evaluated at any time.

A route is written as heading(t) and walked(t) in closed form; the position is their integral. It is tabulated at
10 Hz by Simpson's rule and evaluated by cubic Hermite interpolation (position error below 0.1 mm), so that it does
not depend on the control rate.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from follow_env.config import choose
from follow_env.scene import Scene

TABLE_STEP = 0.1
"""Spacing of the table, s."""

CLEARANCE = 0.50
"""Least distance between a route and anything solid, m (the person's capsule has a radius of 0.25 m)."""

CORNER_CUT = 0.15
"""How far a smooth turn passes inside the corner of its outline at most, m."""

LARGEST_TURN = math.radians(50.0)
"""Paper B's limit on a turn and on the heading against the start, rad."""


@dataclass(frozen=True)
class Turn:
    """A smooth change of heading: begins at `start` (s), lasts `duration` (s), turns by `angle` (rad, ccw)."""

    start: float
    duration: float
    angle: float


class Route:
    """A walked path in the world frame.

    Args:
        start: (x, y, heading) at t = 0, m and rad.
        distance: path length, m.
        duration: time from the first to the last motion, s.
        ramp: the person starts and stops with raised-cosine speed ramps of this length, s.
        turns: changes of heading.
    """

    def __init__(
        self,
        start: tuple[float, float, float],
        distance: float = 12.0,
        duration: float = 14.0,
        ramp: float = 1.0,
        turns: tuple[Turn, ...] = (),
    ) -> None:
        if not (distance >= 0.0 and duration >= 2.0 * ramp > 0.0):
            raise ValueError(
                f"a route of {distance!r} m in {duration!r} s with ramps of {ramp!r} s is impossible; "
                "expected distance >= 0 and duration >= 2 ramp > 0"
            )
        self.start, self.distance, self.duration, self.turns = start, distance, duration, turns
        self._ramp = ramp
        self._cruise = distance / (duration - ramp)
        self._table = self._tabulate()

    def speed(self, t: float) -> float:
        """Walking speed at time t, m/s."""
        edge = min(t, self.duration - t)
        if edge <= 0.0:
            return 0.0
        if edge >= self._ramp:
            return self._cruise
        return self._cruise * 0.5 * (1.0 - math.cos(math.pi * edge / self._ramp))

    def walked(self, t: float) -> float:
        """Distance walked until time t, m."""
        t = min(max(t, 0.0), self.duration)
        if t > self.duration / 2.0:
            return self.distance - self.walked(self.duration - t)
        if t >= self._ramp:
            return self._cruise * (t - 0.5 * self._ramp)
        return self._cruise * 0.5 * (t - self._ramp / math.pi * math.sin(math.pi * t / self._ramp))

    def heading(self, t: float) -> float:
        """Heading at time t, rad, ccw from the world's x axis."""
        heading = self.start[2]
        for turn in self.turns:
            share = min(max((t - turn.start) / turn.duration, 0.0), 1.0)
            heading += turn.angle * 0.5 * (1.0 - math.cos(math.pi * share))
        return heading

    def velocity(self, t: float) -> tuple[float, float]:
        """Velocity at time t in the world frame, m/s."""
        speed, heading = self.speed(t), self.heading(t)
        return speed * math.cos(heading), speed * math.sin(heading)

    def pose(self, t: float) -> tuple[float, float, float]:
        """Pose (x, y, heading) at time t in the world frame, m and rad."""
        t = min(max(t, 0.0), self.duration)
        i = min(int(t / TABLE_STEP), len(self._table) - 2)
        x0, y0, vx0, vy0 = self._table[i]
        x1, y1, vx1, vy1 = self._table[i + 1]
        s = t / TABLE_STEP - i
        h01 = s * s * (3.0 - 2.0 * s)
        h10, h11 = s * (1.0 - s) * (1.0 - s) * TABLE_STEP, s * s * (s - 1.0) * TABLE_STEP
        x = x0 + h01 * (x1 - x0) + h10 * vx0 + h11 * vx1
        y = y0 + h01 * (y1 - y0) + h10 * vy0 + h11 * vy1
        return x, y, self.heading(t)

    def points(self) -> np.ndarray:
        """Positions along the route, one each table step, (n, 2) in m."""
        return np.array(self._table)[:, :2]

    def _tabulate(self) -> list[tuple[float, float, float, float]]:
        x, y, _ = self.start
        vx0, vy0 = self.velocity(0.0)
        table = [(x, y, vx0, vy0)]
        for i in range(math.ceil(self.duration / TABLE_STEP)):
            t = i * TABLE_STEP
            vxm, vym = self.velocity(t + 0.5 * TABLE_STEP)
            vx1, vy1 = self.velocity(t + TABLE_STEP)
            x += TABLE_STEP / 6.0 * (vx0 + 4.0 * vxm + vx1)
            y += TABLE_STEP / 6.0 * (vy0 + 4.0 * vym + vy1)
            table.append((x, y, vx1, vy1))
            vx0, vy0 = vx1, vy1
        return table


def paper_route(scene: Scene, start: tuple[float, float, float], rng: np.random.Generator) -> Route:
    """Return a route of paper B (section 3): 12 m in 14 s, one or two turns of 20-50 deg over 0.8-1.6 s each.

    The heading stays within +-50 deg of the start; the walker starts and stops over 1 s. Half of the routes have one
    turn, half have two. Candidates that pass nearer than `CLEARANCE` to an obstacle are drawn again.
    """
    count = int(rng.integers(1, 3))
    for _ in range(1000):
        turns = _draw_turns(count, rng)
        outline = _outline(start, turns)
        if outline is None or scene.clearance(outline) < CLEARANCE - CORNER_CUT:
            continue
        route = Route(start, turns=turns)
        if scene.clearance(route.points()[::3]) >= CLEARANCE:
            return route
    raise ValueError(f"no route of 12 m with turns of 20-50 deg fits the scene {scene.name!r}; widen its free lane")


def _draw_turns(count: int, rng: np.random.Generator) -> tuple[Turn, ...]:
    """Draw `count` turns, in the order of time, within 1.5-12 s."""
    begins = sorted(float(t) for t in rng.uniform(1.5, 12.0, count))
    angles = rng.uniform(math.radians(20.0), LARGEST_TURN, count) * (1.0 - 2.0 * rng.integers(0, 2, count))
    durations = rng.uniform(0.8, 1.6, count)
    return tuple(Turn(b, float(d), float(a)) for b, d, a in zip(begins, durations, angles, strict=True))


def _outline(start: tuple[float, float, float], turns: tuple[Turn, ...]) -> np.ndarray | None:
    """Return the route with sharp corners as points (n, 2), or None when the turns overlap or go beyond 50 deg.

    Cheap enough to throw most candidates away before the exact path is integrated.
    """
    x, y, heading = start
    corners, walked, turned, last_end = [(0.0, x, y)], 0.0, 0.0, 0.0
    for turn in (*turns, Turn(14.0, 0.0, 0.0)):
        length = 12.0 * (turn.start + 0.5 * turn.duration) / 14.0 - walked
        walked += length
        x, y = x + length * math.cos(heading + turned), y + length * math.sin(heading + turned)
        corners.append((walked, x, y))
        turned += turn.angle
        if turn.start < last_end or abs(turned) > LARGEST_TURN:
            return None
        last_end = turn.start + turn.duration
    table = np.array(corners)
    along = np.arange(0.0, 12.0, 0.4)
    return np.stack([np.interp(along, table[:, 0], table[:, i]) for i in (1, 2)], axis=1)


def straight_route(scene: Scene, start: tuple[float, float, float], rng: np.random.Generator) -> Route:
    """Return a straight walk of 12 m in 14 s along the start heading."""
    return Route(start)


def standing_route(scene: Scene, start: tuple[float, float, float], rng: np.random.Generator) -> Route:
    """Return 14 s of standing still."""
    return Route(start, distance=0.0)


ROUTES: dict[str, Callable[[Scene, tuple[float, float, float], np.random.Generator], Route]] = {
    "paper": paper_route,
    "straight": straight_route,
    "standing": standing_route,
}
"""Route name -> function (scene, start pose of the person, random generator) -> Route."""


def make_route(name: str, scene: Scene, start: tuple[float, float, float], rng: np.random.Generator) -> Route:
    """Return the route `name` from `start`; a ValueError names the nearest when there is none."""
    return ROUTES[choose("route", name, ROUTES)](scene, start, rng)
