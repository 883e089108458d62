"""How far points are from obstacles, seen from above."""

import math
from typing import Any

import numpy as np
from numba import njit

from follow_env.compilation import compilable


def gap(o: Any, x: float, y: float) -> float:
    """Return the horizontal distance from a point to an obstacle's footprint, m; 0 inside.

    Args:
        o: has the middle `x`, `y`, the half sizes `length` and `width`, `cosine` and `sine` of the yaw, and the
            `radius` by which the rectangle grows; m.
        x: of the point, m.
        y: of the point, m.
    """
    dx, dy = x - o.x, y - o.y
    along = max(abs(dx * o.cosine + dy * o.sine) - o.length, 0.0)
    across = max(abs(dy * o.cosine - dx * o.sine) - o.width, 0.0)
    return max(math.sqrt(along * along + across * across) - o.radius, 0.0)


compilable(gap)


@njit(cache=True, nogil=True)
def distances(points: np.ndarray, footprints: np.ndarray) -> np.ndarray:
    """Return how far each of the points (n, 2) is from the next of the footprints, (n,), m; infinite without any.

    Args:
        points: (n, 2), m.
        footprints: (m,) records with the entries of `follow_env.world.scene.FOOTPRINT`.
    """
    least = np.full(len(points), np.inf)
    for i in range(len(points)):
        for k in range(len(footprints)):
            least[i] = min(least[i], gap(footprints[k], points[i, 0], points[i, 1]))
    return least
