"""How a route is walked, in closed form: the speed's raised-cosine ramps, the way walked, the turns."""

import math

PAPER_SPEED = 12.0 / 13.0
"""Walking speed of paper B's routes between starting and stopping, m/s: 12 m in 14 s with ramps of 1 s."""
SLOWEST, FASTEST = 0.2, 2.0
"""Walking speeds that a person can have, m/s: a shuffle and a jog."""


def speed_at(t: float, cruise: float, duration: float, ramp: float) -> float:
    """Return the walking speed at time t, m/s.

    Args:
        t: s.
        cruise: speed between the ramps, m/s.
        duration: of the walk, s.
        ramp: length of the start and of the stop, s.
    """
    edge = min(t, duration - t)
    if edge <= 0.0:
        return 0.0
    if edge >= ramp:
        return cruise
    return cruise * 0.5 * (1.0 - math.cos(math.pi * edge / ramp))


def walked_at(t: float, distance: float, cruise: float, duration: float, ramp: float) -> float:
    """Return the way walked until time t, m, of a walk of `distance` (m); the other arguments are as in `speed_at`."""
    t = min(max(t, 0.0), duration)
    edge = min(t, duration - t)
    if edge >= ramp:
        way = cruise * (edge - 0.5 * ramp)
    else:
        way = cruise * 0.5 * (edge - ramp / math.pi * math.sin(math.pi * edge / ramp))
    return way if edge == t else distance - way


def turned_at(t: float, start: float, duration: float, angle: float) -> float:
    """Return how far a turn by `angle` (rad) from `start` on for `duration` (s) has come at time t, rad."""
    share = (t - start) / duration
    if share <= 0.0:
        return 0.0
    return angle if share >= 1.0 else angle * 0.5 * (1.0 - math.cos(math.pi * share))
