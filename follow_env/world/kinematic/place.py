# mypy: disable-error-code="no-untyped-def"
"""The place seen from above: how far the next obstacle is, what the robot touches, what hides the person.

A grid holds the distance from each cell's center to the next obstacle. The distance at a point differs from it by the
way to the center at most, which settles nearly every question; the rest is computed exactly.
"""

import math
from typing import NamedTuple

import numpy as np
from numba import njit

from follow_env.world.clearance import distances, gap
from follow_env.world.people import dimensions
from follow_env.world.scene import FOOTPRINT, Scene, footprint

CELL = 0.1
"""Size of the grid's cells, m."""

PERSON_RADIUS = dimensions.RADIUS
PERSON_LOW = 0.5 * dimensions.HEIGHT - 0.5 * dimensions.STRAIGHT
"""Height of the center of the lower half-sphere of the person's capsule, m."""
COLLISIONS = ("none", "wall", "person")
"""What a robot touches, by the number that `touched` returns."""
OBSTACLE = np.dtype(FOOTPRINT.descr + [(name, "<f8") for name in ("low", "high", "reach")])
"""An upright prism: a footprint between two heights, within `reach` of (x, y); m."""


class Place(NamedTuple):
    """Obstacles of a scene, and grids (columns, rows) of the distance from cell centers to the next of them.

    `sight` are the obstacles between the camera's height and that of the person's chest.
    """

    obstacles: np.ndarray
    sight: np.ndarray
    distance: np.ndarray
    sight_distance: np.ndarray
    x0: float
    y0: float


def pack_place(scene: Scene, camera_height: float, chest_height: float) -> Place:
    """Return the obstacles of `scene` for a camera at `camera_height` (m) that looks at `chest_height` (m)."""
    rows = []
    for p in scene.obstacles():
        seen = footprint(p)
        _, _, length, width, _, _, radius = seen
        reach = math.sqrt(length * length + width * width) + radius
        rows.append((*seen, p.bottom, 2.0 * p.center[2] - p.bottom, reach))
    obstacles = np.array(rows, OBSTACLE)
    low, high = sorted((camera_height, chest_height))
    sight = obstacles[(obstacles["low"] <= high) & (obstacles["high"] >= low)]
    grids = _grid(scene.bounds, obstacles), _grid(scene.bounds, sight)
    return Place(obstacles, sight, *grids, scene.bounds[0], scene.bounds[2])


def _grid(bounds: tuple[float, float, float, float], obstacles: np.ndarray) -> np.ndarray:
    """Return the distance from the middle of each cell to the next obstacle, (columns, rows), m."""
    x0, x1, y0, y1 = bounds
    cells = np.empty((math.ceil((x1 - x0) / CELL), math.ceil((y1 - y0) / CELL)))
    x, y = (start + (np.arange(count) + 0.5) * CELL for start, count in zip((x0, y0), cells.shape, strict=True))
    for i, column in enumerate(cells):
        column[:] = distances(np.column_stack((np.full(len(y), x[i]), y)), obstacles)
    return cells


_jit = njit(nogil=True, error_model="numpy", forceinline=True)


@_jit
def _bounds(distance, place, x, y):
    """Return the least and the largest distance that the next obstacle of a grid can have from a point, m."""
    i = min(max(int((x - place.x0) / CELL), 0), distance.shape[0] - 1)
    j = min(max(int((y - place.y0) / CELL), 0), distance.shape[1] - 1)
    dx, dy = x - (place.x0 + (i + 0.5) * CELL), y - (place.y0 + (j + 0.5) * CELL)
    off = math.sqrt(dx * dx + dy * dy)
    return distance[i, j] - off, distance[i, j] + off


@_jit
def nearer_than(place, x, y, radius):
    """Whether any obstacle is nearer than `radius` to the point."""
    least, most = _bounds(place.distance, place, x, y)
    if least >= radius or most < radius:
        return most < radius
    for k in range(len(place.obstacles)):  # noqa: SIM110  numba inlines no generators
        if gap(place.obstacles[k], x, y) < radius:
            return True
    return False


@_jit
def touches_place(place, hull, x, y, cosine, sine):
    """Whether the level robot overlaps an obstacle: chassis, two wheels, caster and mast, each exactly."""
    if _bounds(place.distance, place, x, y)[0] > hull.reach:
        return False
    for k in range(len(place.obstacles)):
        o = place.obstacles[k]
        dx, dy = o.x - x, o.y - y
        if dx * dx + dy * dy > (o.reach + hull.reach) ** 2:
            continue
        for side in (-hull.half_track, hull.half_track):
            if gap(o, x - side * sine, y + side * cosine) < _ball(hull.wheel_radius, o.low, o.high):
                return True
        if gap(o, x + hull.caster * cosine, y + hull.caster * sine) < _ball(hull.caster_radius, o.low, o.high):
            return True
        beside_mast = o.low < hull.mast_high and o.high > hull.mast_low
        if beside_mast and gap(o, x + hull.mast * cosine, y + hull.mast * sine) < hull.mast_radius:
            return True
        if o.low < hull.high and o.high > hull.low and _chassis_overlaps(o, hull, x, y, cosine, sine):
            return True
    return False


@_jit
def _ball(radius, low, high):
    """Return how near a ball that lies on the floor may come to a wall between two heights; 0 if it fits under."""
    off = max(low - radius, radius - high, 0.0)
    return math.sqrt(max(radius * radius - off * off, 0.0))


@_jit
def _chassis_overlaps(o, hull, x, y, cosine, sine):
    """Whether the chassis' rectangle overlaps an obstacle's footprint (separating axes; a disc by its distance)."""
    dx, dy = o.x - (x + hull.middle * cosine), o.y - (y + hull.middle * sine)
    along, across = abs(dx * cosine + dy * sine), abs(dy * cosine - dx * sine)
    if o.radius > 0.0:
        along, across = max(along - hull.length, 0.0), max(across - hull.width, 0.0)
        return along * along + across * across < o.radius * o.radius
    c, s = abs(cosine * o.cosine + sine * o.sine), abs(sine * o.cosine - cosine * o.sine)
    if along > hull.length + o.length * c + o.width * s or across > hull.width + o.length * s + o.width * c:
        return False
    along, across = abs(dx * o.cosine + dy * o.sine), abs(dy * o.cosine - dx * o.sine)
    return along <= o.length + hull.length * c + hull.width * s and across <= o.width + hull.length * s + hull.width * c


@_jit
def touches_person(hull, x, y, cosine, sine, person_x, person_y):
    """Whether the level robot overlaps the person's capsule."""
    dx, dy = person_x - x, person_y - y
    along, across = dx * cosine + dy * sine, dy * cosine - dx * sine
    if along * along + across * across > (hull.reach + PERSON_RADIUS) ** 2:
        return False
    for middle, offset, radius in (
        (0.0, hull.half_track, hull.wheel_radius),
        (0.0, -hull.half_track, hull.wheel_radius),
        (hull.caster, 0.0, hull.caster_radius),
    ):
        rise = max(PERSON_LOW - radius, 0.0)
        if (along - middle) ** 2 + (across - offset) ** 2 + rise * rise < (PERSON_RADIUS + radius) ** 2:
            return True
    if (along - hull.mast) ** 2 + across * across < (PERSON_RADIUS + hull.mast_radius) ** 2:
        return True
    rise = PERSON_LOW - hull.high
    beyond = max(abs(along - hull.middle) - hull.length, 0.0), max(abs(across) - hull.width, 0.0)
    return beyond[0] ** 2 + beyond[1] ** 2 + rise * rise < PERSON_RADIUS * PERSON_RADIUS


@_jit
def touched(place, hull, x, y, cosine, sine, person_x, person_y):
    """Return what the level robot touches: 0 = nothing, 1 = an obstacle, 2 = the person."""
    if touches_person(hull, x, y, cosine, sine, person_x, person_y):
        return 2
    return 1 if touches_place(place, hull, x, y, cosine, sine) else 0


@_jit
def free_sight(place, eye, point):
    """Whether no obstacle meets the straight line between two points (x, y, z)."""
    x, y, z = eye
    dx, dy, dz = point[0] - x, point[1] - y, point[2] - z
    length = math.sqrt(dx * dx + dy * dy)
    if _bounds(place.sight_distance, place, x + 0.5 * dx, y + 0.5 * dy)[0] > 0.5 * length:
        return True
    for k in range(len(place.sight)):
        o = place.sight[k]
        mx, my = x + 0.5 * dx - o.x, y + 0.5 * dy - o.y
        if mx * mx + my * my < (o.reach + 0.5 * length) ** 2 and _meets(o, x, y, z, dx, dy, dz):
            return False
    return True


@_jit
def _meets(o, x, y, z, dx, dy, dz):
    """Whether the line from (x, y, z) to its end (dx, dy, dz) further on enters an obstacle.

    A line that begins inside does not enter, as in PyBullet's `rayTest`.
    """
    first, last = _slab(z - 0.5 * (o.low + o.high), dz, 0.5 * (o.high - o.low), -math.inf, 1.0)
    ox, oy = x - o.x, y - o.y
    if o.radius > 0.0:
        a, b, c = dx * dx + dy * dy, ox * dx + oy * dy, ox * ox + oy * oy - o.radius * o.radius
        root = b * b - a * c
        if root <= 0.0 or a == 0.0:
            return False
        root = math.sqrt(root)
        first, last = max(first, (-b - root) / a), min(last, (-b + root) / a)
        return 0.0 <= first < last
    first, last = _slab(ox * o.cosine + oy * o.sine, dx * o.cosine + dy * o.sine, o.length, first, last)
    first, last = _slab(oy * o.cosine - ox * o.sine, dy * o.cosine - dx * o.sine, o.width, first, last)
    return 0.0 <= first < last


@_jit
def _slab(start, way, half, first, last):
    """Return the part of the line's [first, last] within -half..half on one axis; empty if first >= last."""
    if abs(way) < 1e-12:
        return (first, last) if abs(start) < half else (1.0, 0.0)
    one, other = (-half - start) / way, (half - start) / way
    return max(first, min(one, other)), min(last, max(one, other))
