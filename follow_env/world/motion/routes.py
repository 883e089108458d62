"""The walker's routes: a path and a speed profile, sampled once, evaluated at any time.

A route is written as heading(t) and walked(t) in closed form; the position is their integral. It is tabulated at
10 Hz by Simpson's rule and evaluated by cubic Hermite interpolation (position error below 0.1 mm), so that it does
not depend on the control rate.
"""

import math
import numbers
from bisect import bisect_left, bisect_right
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from follow_env.world.motion.base import MOTIONS, Pose
from follow_env.world.motion.profile import PAPER_SPEED, speed_at, turned_at, walked_at
from follow_env.world.scene import Scene

TABLE_STEP = 0.1
"""Spacing of the table, s."""

CLEARANCE = 0.50
"""Least distance between a route and anything solid, m (the person's capsule has a radius of 0.25 m)."""

CORNER_CUT = 0.15
"""How far a smooth turn passes inside the corner of its outline at most, m."""

SMALLEST_TURN, LARGEST_TURN = math.radians(20.0), math.radians(50.0)
"""Paper B's limits on a turn; the larger one also on the heading against the start, rad."""

MOST_TURNS = 6
"""More turns than this do not fit into 12 m."""

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


@MOTIONS.register("paper")
def paper_route(
    scene: Scene,
    start: Pose,
    rng: np.random.Generator,
    speed: float = PAPER_SPEED,
    turns: int | None = None,
    least_turn_deg: float = 20.0,
    largest_turn_deg: float = 50.0,
    quickest_turn: float = QUICKEST_TURN,
    slowest_turn: float = SLOWEST_TURN,
) -> Route:
    """Return a route of paper B (section 3): 12 m in 14 s, one or two turns of 20-50 deg over 0.8-1.6 s each.

    The heading stays within `largest_turn_deg` of the start; the walker starts and stops over 1 s. Half of the routes
    have one turn, half have two. Candidates that pass nearer than `CLEARANCE` to an obstacle are drawn again. The
    draws, and with them the path, do not depend on the speed.

    Args:
        scene: where it walks.
        start: (x, y, heading) at t = 0, m and rad.
        rng: what the turns are drawn from.
        speed: between starting and stopping, m/s; all times stretch with it.
        turns: how many, 0 to 6; None draws one or two.
        least_turn_deg: smallest turn, degrees.
        largest_turn_deg: largest turn, degrees.
        quickest_turn: shortest time of a turn at `PAPER_SPEED`, s.
        slowest_turn: longest time of a turn at `PAPER_SPEED`, s.

    Raises:
        ValueError: if a setting is impossible, or no such route fits the scene.
    """
    if turns is not None and not (isinstance(turns, numbers.Integral) and 0 <= turns <= MOST_TURNS):
        raise ValueError(f"turns is {turns!r}; expected a whole number from 0 to {MOST_TURNS}, or None for one or two")
    if not 0.0 <= least_turn_deg <= largest_turn_deg <= 180.0:
        raise ValueError(
            f"least_turn_deg, largest_turn_deg are {least_turn_deg!r}, {largest_turn_deg!r}; expected 0 <= least <= "
            "largest <= 180 degrees"
        )
    if not 0.0 < quickest_turn <= slowest_turn <= EARLIEST_TURN + 1.5:
        raise ValueError(
            f"quickest_turn, slowest_turn are {quickest_turn!r}, {slowest_turn!r}; expected 0 < quickest <= slowest "
            f"<= {EARLIEST_TURN + 1.5} s"
        )
    sizes = math.radians(least_turn_deg), math.radians(largest_turn_deg)
    count = int(rng.integers(1, 3)) if turns is None else int(turns)
    for _ in range(ATTEMPTS):
        drawn = _draw_turns(count, sizes, (quickest_turn, slowest_turn), rng)
        outline = _outline(start, drawn, sizes[1])
        if outline is None or not scene.is_clear(outline, CLEARANCE - CORNER_CUT):
            continue
        route = Route(start, turns=drawn)
        if scene.is_clear(route.points()[::3], CLEARANCE):
            return route.at_speed(speed)
    raise ValueError(
        f"no route of 12 m with {'one or two' if turns is None else turns} turns of {least_turn_deg:g} to "
        f"{largest_turn_deg:g} deg fits the scene {scene.name!r}; take route='standing', other turns, or another scene"
    )


def _draw_turns(
    count: int, sizes: tuple[float, float], times: tuple[float, float], rng: np.random.Generator
) -> tuple[Turn, ...]:
    """Draw `count` turns, in the order of time."""
    begins = sorted(rng.uniform(EARLIEST_TURN, LATEST_TURN, count).tolist())
    angles = rng.uniform(*sizes, count).tolist()
    right = rng.integers(0, 2, count).tolist()
    durations = rng.uniform(*times, count).tolist()
    return tuple(Turn(begins[k], durations[k], -angles[k] if right[k] else angles[k]) for k in range(count))


def _outline(start: Pose, turns: tuple[Turn, ...], largest: float) -> np.ndarray | None:
    """Return the route with sharp corners as points (n, 2), or None when the turns overlap or go too far.

    Cheap enough to throw most candidates away before the exact path is integrated.
    """
    turned, last_end = 0.0, 0.0
    for turn in turns:
        turned += turn.angle
        if turn.start < last_end or abs(turned) > largest:
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


@MOTIONS.register("straight")
def straight_route(scene: Scene, start: Pose, rng: np.random.Generator, speed: float = PAPER_SPEED) -> Route:
    """Return a straight walk of 12 m in 14 s (at `PAPER_SPEED`) along the start heading."""
    return Route(start).at_speed(speed)


@MOTIONS.register("standing")
def standing_route(scene: Scene, start: Pose, rng: np.random.Generator, speed: float = PAPER_SPEED) -> Route:
    """Return 14 s of standing still."""
    return Route(start, distance=0.0)
