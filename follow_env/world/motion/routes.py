"""The walker's routes: a path and a speed profile, sampled once, evaluated at any time.

A route is written as heading(t) and walked(t) in closed form; the position is their integral. It is tabulated at
10 Hz by Simpson's rule and evaluated by cubic Hermite interpolation (position error below 0.1 mm), so that it does
not depend on the control rate.
"""

import math
import numbers
from bisect import bisect_left, bisect_right
from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from follow_env.envs.task import SET_POINT
from follow_env.registry import choose
from follow_env.world.motion.profile import speed_at, turned_at, walked_at
from follow_env.world.scene import Scene

TABLE_STEP = 0.1
"""Spacing of the table, s."""

CLEARANCE = 0.50
"""Least distance between a route and anything solid, m (the person's capsule has a radius of 0.25 m)."""

CORNER_CUT = 0.15
"""How far a smooth turn passes inside the corner of its outline at most, m."""

SMALLEST_TURN, LARGEST_TURN = math.radians(20.0), math.radians(50.0)
"""Paper B's limits on a turn; the larger one also on the heading against the start, rad."""

EARLIEST_TURN, LATEST_TURN = 1.5, 12.0
"""Between these a turn of the paper's routes begins, s."""

QUICKEST_TURN, SLOWEST_TURN = 0.8, 1.6
"""Between these it lasts, s."""

PAPER_DISTANCE, PAPER_DURATION, PAPER_RAMP = 12.0, 14.0, 1.0
"""Paper B's routes: m, s and s."""

ATTEMPTS = 1000
"""So many candidates are drawn before a scene counts as too narrow."""

OUTLINE_STEP = 0.4
"""An outline is sampled this often, m of the way."""

PAPER_SPEED = 12.0 / 13.0
"""Walking speed of paper B's routes between starting and stopping, m/s: 12 m in 14 s with ramps of 1 s."""

SLOWEST, FASTEST = 0.2, 2.0
"""Walking speeds that a route can have, m/s: a shuffle and a jog."""

OUTLINE = np.arange(0.0, PAPER_DISTANCE, OUTLINE_STEP)
"""Where an outline is sampled, m of the way."""


@dataclass(frozen=True)
class Turn:
    """A smooth change of heading: begins at `start` (s), lasts `duration` (s), turns by `angle` (rad, ccw)."""

    start: float
    duration: float
    angle: float

    def turned(self, t: float) -> float:
        """Return by how much the heading has changed at time t, rad."""
        return turned_at(t, self.start, self.duration, self.angle)


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
        distance: float = PAPER_DISTANCE,
        duration: float = PAPER_DURATION,
        ramp: float = PAPER_RAMP,
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
        self._positions, self._table = self._tabulate()

    def speed(self, t: float) -> float:
        """Walking speed at time t, m/s."""
        return speed_at(t, self._cruise, self.duration, self._ramp)

    def walked(self, t: float) -> float:
        """Distance walked until time t, m."""
        return walked_at(t, self.distance, self._cruise, self.duration, self._ramp)

    def heading(self, t: float) -> float:
        """Heading at time t, rad, ccw from the world's x axis."""
        heading = self.start[2]
        for turn in self.turns:
            heading += turn.turned(t)
        return heading

    def at_speed(self, speed: float) -> "Route":
        """Return the same path walked at another speed (m/s, between the ramps): all its times stretch by one factor.

        Standing still stays as it is.
        """
        stretch = self._cruise / speed
        if stretch in (0.0, 1.0):
            return self
        turns = tuple(Turn(stretch * turn.start, stretch * turn.duration, turn.angle) for turn in self.turns)
        return Route(self.start, self.distance, stretch * self.duration, stretch * self._ramp, turns)

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
        return self._positions.copy()

    def _tabulate(self) -> tuple[np.ndarray, list[tuple[float, float, float, float]]]:
        """Return the positions (n, 2) and the rows (x, y, v_x, v_y), one each table step."""
        times, speeds = _speeds(self._cruise, self.duration, self._ramp)
        headings = [self.start[2]] * len(times)
        for turn in self.turns:
            first, last = bisect_right(times, turn.start), bisect_left(times, turn.start + turn.duration)
            headings[first:last] = [
                h + turn.turned(t) for h, t in zip(headings[first:last], times[first:last], strict=True)
            ]
            headings[last:] = [h + turn.angle for h in headings[last:]]
        velocities = speeds * np.array(([math.cos(h) for h in headings], [math.sin(h) for h in headings]))
        before, middle, after = velocities[:, :-2:2], velocities[:, 1::2], velocities[:, 2::2]
        steps = TABLE_STEP / 6.0 * (before + 4.0 * middle + after)
        start = np.array(self.start[:2])[:, None]
        positions = np.cumsum(np.concatenate((start, steps), axis=1), axis=1)
        return positions.T, list(zip(*positions.tolist(), *velocities[:, ::2].tolist(), strict=True))


@lru_cache(maxsize=64)
def _speeds(cruise: float, duration: float, ramp: float) -> tuple[tuple[float, ...], np.ndarray]:
    """Return the times of the table and of the middles between its rows, in order, and the speeds then."""
    times = [0.0]
    for i in range(math.ceil(duration / TABLE_STEP)):
        t = i * TABLE_STEP
        times += [t + 0.5 * TABLE_STEP, t + TABLE_STEP]
    return tuple(times), np.array([speed_at(t, cruise, duration, ramp) for t in times])


def paper_route(scene: Scene, start: tuple[float, float, float], rng: np.random.Generator) -> Route:
    """Return a route of paper B (section 3): 12 m in 14 s, one or two turns of 20-50 deg over 0.8-1.6 s each.

    The heading stays within +-50 deg of the start; the walker starts and stops over 1 s. Half of the routes have one
    turn, half have two. Candidates that pass nearer than `CLEARANCE` to an obstacle are drawn again.
    """
    count = int(rng.integers(1, 3))
    for _ in range(ATTEMPTS):
        turns = _draw_turns(count, rng)
        outline = _outline(start, turns)
        if outline is None or not scene.is_clear(outline, CLEARANCE - CORNER_CUT):
            continue
        route = Route(start, turns=turns)
        if scene.is_clear(route.points()[::3], CLEARANCE):
            return route
    raise ValueError(f"no route of 12 m with turns of 20-50 deg fits the scene {scene.name!r}; widen its free lane")


def _draw_turns(count: int, rng: np.random.Generator) -> tuple[Turn, ...]:
    """Draw `count` turns, in the order of time."""
    begins = sorted(rng.uniform(EARLIEST_TURN, LATEST_TURN, count).tolist())
    sizes = rng.uniform(SMALLEST_TURN, LARGEST_TURN, count).tolist()
    right = rng.integers(0, 2, count).tolist()
    durations = rng.uniform(QUICKEST_TURN, SLOWEST_TURN, count).tolist()
    return tuple(Turn(begins[k], durations[k], -sizes[k] if right[k] else sizes[k]) for k in range(count))


def _outline(start: tuple[float, float, float], turns: tuple[Turn, ...]) -> np.ndarray | None:
    """Return the route with sharp corners as points (n, 2), or None when the turns overlap or go beyond 50 deg.

    Cheap enough to throw most candidates away before the exact path is integrated.
    """
    turned, last_end = 0.0, 0.0
    for turn in turns:
        turned += turn.angle
        if turn.start < last_end or abs(turned) > LARGEST_TURN:
            return None
        last_end = turn.start + turn.duration
    x, y, heading = start
    along, xs, ys, turned = [0.0], [x], [y], 0.0
    for turn in (*turns, Turn(PAPER_DURATION, 0.0, 0.0)):
        length = PAPER_DISTANCE * (turn.start + 0.5 * turn.duration) / PAPER_DURATION - along[-1]
        x, y = x + length * math.cos(heading + turned), y + length * math.sin(heading + turned)
        along.append(along[-1] + length)
        xs.append(x)
        ys.append(y)
        turned += turn.angle
    return np.array((np.interp(OUTLINE, along, xs), np.interp(OUTLINE, along, ys))).T


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


def choose_route(name: str, scene: Scene) -> str:
    """Return the name of a route; a ValueError names the nearest, or says that the scene is too short for it."""
    choose("route", name, ROUTES)
    if name != "standing" and scene.clearance(Route(scene.start, SET_POINT + PAPER_DISTANCE).points()) < CLEARANCE:
        raise ValueError(
            f"the route {name!r} needs 12 m of free way, which the scene {scene.name!r} lacks; take route='standing' "
            "or another scene"
        )
    return name


def check_walking_speed(speed: float) -> float:
    """Return the speed, m/s; a ValueError says what is expected."""
    if not (isinstance(speed, numbers.Real) and SLOWEST <= speed <= FASTEST):
        raise ValueError(f"walking_speed is {speed!r}; expected m/s from {SLOWEST} to {FASTEST}")
    return float(speed)


def make_route(
    name: str,
    scene: Scene,
    start: tuple[float, float, float],
    rng: np.random.Generator,
    walking_speed: float = PAPER_SPEED,
) -> Route:
    """Return the route `name` from `start`, walked at a speed (m/s); a ValueError names the nearest if there is none.

    The draws, and with them the path, do not depend on the speed.
    """
    return ROUTES[choose("route", name, ROUTES)](scene, start, rng).at_speed(walking_speed)
