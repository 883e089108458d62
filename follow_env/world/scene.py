"""`Scene`: the immutable geometry of a place. The one source for physics and cameras.

World frame: x along the scene's main direction, y left, z up, floor at z = 0, meters.
"""

import functools
import math
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any, TypeAlias

import numpy as np

CELL = 0.2
"""Side of the cells of a scene's table of clearances, m."""
CELL_REACH = 0.15
"""The clearance differs by less than this within half a cell's diagonal, m."""


@dataclass(frozen=True)
class Material:
    """A surface: color as sRGB in [0, 1], a specular share in [0, 1] and a texture.

    The textures are named in `camera.raster.textures.TEXTURES`; a renderer without them draws the plain color.
    """

    color: tuple[float, float, float]
    specular: float = 0.1
    texture: str = "plain"


@dataclass(frozen=True)
class Box:
    """A box: center (m), full size (m), yaw about z (rad). `solid=False` is decoration without collision."""

    center: tuple[float, float, float]
    size: tuple[float, float, float]
    material: Material
    yaw: float = 0.0
    solid: bool = True

    def __post_init__(self) -> None:
        _check(self, (*self.center, self.yaw), self.size)

    @property
    def bottom(self) -> float:
        """Height of the lowest point, m."""
        return self.center[2] - 0.5 * self.size[2]


@dataclass(frozen=True)
class Cylinder:
    """An upright cylinder: center (m), radius (m), height (m)."""

    center: tuple[float, float, float]
    radius: float
    height: float
    material: Material
    solid: bool = True

    def __post_init__(self) -> None:
        _check(self, self.center, (self.radius, self.height))

    @property
    def bottom(self) -> float:
        """Height of the lowest point, m."""
        return self.center[2] - 0.5 * self.height


@dataclass(frozen=True)
class Sphere:
    """A sphere: center (m), radius (m)."""

    center: tuple[float, float, float]
    radius: float
    material: Material
    solid: bool = True

    def __post_init__(self) -> None:
        _check(self, self.center, (self.radius,))

    @property
    def bottom(self) -> float:
        """Height of the lowest point, m."""
        return self.center[2] - self.radius


@dataclass(frozen=True)
class Capsule:
    """An upright capsule: center (m), radius (m), height from tip to tip (m), greater than the diameter."""

    center: tuple[float, float, float]
    radius: float
    height: float
    material: Material
    solid: bool = True

    def __post_init__(self) -> None:
        _check(self, self.center, (self.radius, self.height))
        if self.height <= 2.0 * self.radius:
            raise ValueError(
                f"a capsule of radius {self.radius!r} m has the height {self.height!r} m; expected more than the "
                "diameter, or use a Sphere"
            )

    @property
    def bottom(self) -> float:
        """Height of the lowest point, m."""
        return self.center[2] - 0.5 * self.height

    @property
    def straight(self) -> float:
        """Height of the part between the two half spheres, m."""
        return self.height - 2.0 * self.radius


Primitive: TypeAlias = Box | Cylinder | Sphere | Capsule


@dataclass(frozen=True)
class Light:
    """A lamp: position (m) and intensity relative to the scene's ambient light of 1."""

    position: tuple[float, float, float]
    intensity: float


@dataclass(frozen=True)
class Scene:
    """Primitives, floor, lights and the free region in which people walk.

    Attributes:
        name: scene name.
        primitives: what stands on the floor, and walls and ceiling.
        floor: the floor's material.
        lights: lamps.
        ambient: ambient light in [0, 1].
        bounds: (x_min, x_max, y_min, y_max) of the floor, m.
        start: (x, y, heading) of the robot at the start of a route, m and rad.
        start_width: routes start up to this far to either side of `start`, m.
    """

    name: str
    primitives: tuple[Primitive, ...]
    floor: Material
    lights: tuple[Light, ...]
    ambient: float
    bounds: tuple[float, float, float, float]
    start: tuple[float, float, float] = (0.0, 0.0, 0.0)
    start_width: float = 0.3

    def obstacles(self) -> tuple[Primitive, ...]:
        """Solid primitives that a person or the robot could run into (those whose lowest point is below 2 m)."""
        return tuple(p for p in self.primitives if p.solid and p.bottom < 2.0)

    def clearance(self, points: np.ndarray) -> float:
        """Least horizontal distance between any of the points (n, 2) and any obstacle, m; 0 inside one.

        Round obstacles count with their full radius; without obstacles the clearance is infinite.
        """
        return float(distances(points, self._footprints).min())

    def is_clear(self, points: np.ndarray, least: float) -> bool:
        """Whether `clearance(points) >= least` (m); a table decides about most of the points (n, 2)."""
        table, origin, last = self._table
        cells = np.minimum(np.maximum((points - origin) * (1.0 / CELL), 0.0), last).astype(np.intp)
        about = table[cells[:, 0], cells[:, 1]]
        if (about < least - CELL_REACH).any():
            return False
        undecided = ~(about > least + CELL_REACH)
        return not undecided.any() or self.clearance(points[undecided]) >= least

    @functools.cached_property
    def _table(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Clearance at the middle of each cell, framed by cells that say NaN: unknown; its corner and last indices."""
        x0, x1, y0, y1 = self.bounds
        origin = np.array((x0 - CELL, y0 - CELL))
        table = np.full((math.ceil((x1 - x0) / CELL) + 2, math.ceil((y1 - y0) / CELL) + 2), np.nan)
        middles = origin + CELL * (np.moveaxis(np.indices(table.shape), 0, -1) + 0.5)
        for column, points in zip(table[1:-1, 1:-1], middles[1:-1, 1:-1], strict=True):
            column[:] = distances(points, self._footprints)
        return table, origin, np.array(table.shape) - 1.0

    @functools.cached_property
    def _footprints(self) -> np.ndarray:
        return footprints(self.obstacles())

    def illumination(self, x: float, y: float) -> float:
        """Relative brightness at the floor point (x, y): lamps with inverse-square falloff, about 1 under a lamp."""
        total = 0.0
        for light in self.lights:
            dx, dy, dz = light.position[0] - x, light.position[1] - y, light.position[2] - 1.0
            total += light.intensity * dz * dz / (dx * dx + dy * dy + dz * dz)
        return total


def footprints(obstacles: Iterable[Primitive]) -> np.ndarray:
    """Return obstacles as seen from above, each once, (n, 7): the arguments of `gap` behind the point's, x and y first.

    Columns: x, y, half length, half width, cosine and sine of the yaw, radius; m.
    """
    rows = {
        (*p.center[:2], 0.5 * p.size[0], 0.5 * p.size[1], math.cos(p.yaw), math.sin(p.yaw), 0.0)
        if isinstance(p, Box)
        else (*p.center[:2], 0.0, 0.0, 1.0, 0.0, p.radius)
        for p in obstacles
    }
    return np.array(sorted(rows)).reshape(-1, 7)


def gap(dx: Any, dy: Any, length: Any, width: Any, cosine: Any, sine: Any, radius: Any) -> Any:
    """Return the horizontal distance from a point to a rectangle (half sizes) grown by `radius`, m; 0 inside.

    Args:
        dx: from the rectangle's middle to the point along x, m; like all arguments a number, or an array that
            broadcasts.
        dy: along y, m.
        length: half size along the rectangle's own x axis, m.
        width: half size along its y axis, m.
        cosine: of the rectangle's yaw.
        sine: of the rectangle's yaw.
        radius: m.
    """
    along = np.maximum(np.abs(dx * cosine + dy * sine) - length, 0.0)
    across = np.maximum(np.abs(dy * cosine - dx * sine) - width, 0.0)
    return np.maximum(np.sqrt(along * along + across * across) - radius, 0.0)


def distances(points: np.ndarray, obstacles: np.ndarray) -> np.ndarray:
    """Return how far each of the points (n, 2) is from the next of the footprints (m, 7), m; infinite without any."""
    offset = points[:, None, :] - obstacles[:, :2]
    least: np.ndarray = gap(offset[..., 0], offset[..., 1], *obstacles[:, 2:].T).min(axis=1, initial=math.inf)
    return least


def _check(primitive: Primitive, place: tuple[float, ...], lengths: tuple[float, ...]) -> None:
    if not (all(map(math.isfinite, (*place, *lengths))) and min(lengths) > 0.0):
        raise ValueError(f"{primitive!r} cannot be; expected finite meters and radians, and sizes > 0")
