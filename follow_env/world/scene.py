"""`Scene`: the immutable geometry of a place. The one source for physics and cameras.

World frame: x along the scene's main direction, y left, z up, floor at z = 0, meters.
"""

import functools
import math
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np

CELL = 0.2
"""Side of the cells of a scene's table of clearances, m."""
CELL_REACH = 0.15
"""The clearance differs by less than this within half a cell's diagonal, m."""


FOOTPRINT = np.dtype([(name, np.float64) for name in ("x", "y", "length", "width", "cosine", "sine", "radius")])
"""An obstacle seen from above: a rectangle (middle, half sizes, yaw) grown by a radius, m."""


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
        return float(self._distances(points).min(initial=math.inf))

    def is_clear(self, points: np.ndarray, least: float) -> bool:
        """Whether `clearance(points) >= least` (m); a table decides about most of the points (n, 2)."""
        table, origin, last = self._table
        cells = np.minimum(np.maximum((points - origin) * (1.0 / CELL), 0.0), last).astype(np.intp)
        about = table[cells[:, 0], cells[:, 1]]
        if (about < least - CELL_REACH).any():
            return False
        undecided = ~(about > least + CELL_REACH)
        return not undecided.any() or self.clearance(points[undecided]) >= least

    def _distances(self, points: np.ndarray) -> np.ndarray:
        from follow_env.world.clearance import distances  # compiled: only for those who ask

        return distances(points, self._footprints)

    @functools.cached_property
    def _table(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Clearance at the middle of each cell, framed by cells that say NaN: unknown; its corner and last indices."""
        x0, x1, y0, y1 = self.bounds
        origin = np.array((x0 - CELL, y0 - CELL))
        table = np.full((math.ceil((x1 - x0) / CELL) + 2, math.ceil((y1 - y0) / CELL) + 2), np.nan)
        middles = origin + CELL * (np.moveaxis(np.indices(table.shape), 0, -1) + 0.5)
        for column, points in zip(table[1:-1, 1:-1], middles[1:-1, 1:-1], strict=True):
            column[:] = self._distances(points)
        return table, origin, np.array(table.shape) - 1.0

    @functools.cached_property
    def _footprints(self) -> np.ndarray:
        return np.array(sorted({footprint(p) for p in self.obstacles()}), FOOTPRINT)

    def illumination(self, x: float, y: float) -> float:
        """Relative brightness at the floor point (x, y): lamps with inverse-square falloff, about 1 under a lamp."""
        total = 0.0
        for light in self.lights:
            dx, dy, dz = light.position[0] - x, light.position[1] - y, light.position[2] - 1.0
            total += light.intensity * dz * dz / (dx * dx + dy * dy + dz * dz)
        return total


def footprint(p: Primitive) -> tuple[float, float, float, float, float, float, float]:
    """Return a primitive as seen from above: the numbers of a `FOOTPRINT`."""
    x, y, _ = p.center
    if isinstance(p, Box):
        return x, y, 0.5 * p.size[0], 0.5 * p.size[1], math.cos(p.yaw), math.sin(p.yaw), 0.0
    return x, y, 0.0, 0.0, 1.0, 0.0, p.radius


def _check(primitive: Primitive, place: tuple[float, ...], lengths: tuple[float, ...]) -> None:
    if not (all(map(math.isfinite, (*place, *lengths))) and min(lengths) > 0.0):
        raise ValueError(f"{primitive!r} cannot be; expected finite meters and radians, and sizes > 0")
