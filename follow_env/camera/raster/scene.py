"""Pack a `Scene` into the arrays that the drawing kernels read, once."""

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from follow_env.camera.raster.shade import SOFT
from follow_env.camera.raster.textures import TEXTURES
from follow_env.registry import choose
from follow_env.world.scene import Box, Capsule, Cylinder, Light, Material, Scene, Sphere

FLOOR_THICKNESS = 0.1
FACES = 6
"""Faces of a box in the order -x, +x, -y, +y, -z, +z of its own frame."""
CYLINDER_PARTS = 3
"""Side, top and bottom of a cylinder."""
SEAM = 1e-4
"""How far the ends of a capsule overlap its straight part, in radii."""


class ScenePack(NamedTuple):
    """A scene as arrays.

    Attributes:
        boxes: (B, 8) float64, center, half size (m), cosine and sine of the yaw; the floor is the first.
        cylinders: (C, 6) float64, x, y, lower and upper end, radius (m), and 1 if the ends are closed: the straight
            part of a capsule is open.
        balls: (N, 6) float64, center, radius and the lowest and highest z of the part that counts, m: a sphere, or
            the upper or lower half of one.
        surfaces: (S, 17) float32, how each surface is shaded: normal (3) and its growth along x and y, plane offset,
            texture axes s (3 + 1) and t (3 + 1), albedo (3), the normal's growth along z; row 0 stands for nothing,
            then six rows a box, three a cylinder and one a ball.
        textures: (S,) uint8, index into `TEXTURES`.
        lamps: (L, 4) float32, position (m) and strength, such that a surface that faces the lamp 1 m above the floor
            right below it gets its intensity, as in `Scene.illumination`.
        ambient: ambient light.
    """

    boxes: np.ndarray
    cylinders: np.ndarray
    balls: np.ndarray
    surfaces: np.ndarray
    textures: np.ndarray
    lamps: np.ndarray
    ambient: np.float32


def pack_scene(scene: Scene) -> ScenePack:
    """Return the arrays of `scene`; a ValueError names a value that is not finite or a texture that does not exist."""
    x0, x1, y0, y1 = scene.bounds
    center, size = (0.5 * (x0 + x1), 0.5 * (y0 + y1), -0.5 * FLOOR_THICKNESS), (x1 - x0, y1 - y0, FLOOR_THICKNESS)
    boxes = [Box(center, size, scene.floor), *(p for p in scene.primitives if isinstance(p, Box))]
    capsules = [p for p in scene.primitives if isinstance(p, Capsule)]
    cylinders = [
        *(p for p in scene.primitives if isinstance(p, Cylinder)),
        *(Cylinder(p.center, p.radius, p.straight, p.material) for p in capsules),
    ]
    closed = len(cylinders) - len(capsules)
    balls = [_ball(p, 0) for p in scene.primitives if isinstance(p, Sphere)]
    for capsule in capsules:
        x, y, z = capsule.center
        balls += [
            _ball(Sphere((x, y, z + half * 0.5 * capsule.straight), capsule.radius, capsule.material), half)
            for half in (-1, 1)
        ]
    surfaces: list[list[float]] = [[0.0] * 17]
    textures = [0]

    def add(
        material: Material,
        origin: tuple[float, float, float],
        normal: list[float],
        axes: tuple[tuple[float, float, float], tuple[float, float, float]],
        swell: float = 0.0,
    ) -> None:
        surfaces.append([*normal, *_axis(axes[0], origin), *_axis(axes[1], origin), *material.color, swell])
        textures.append(TEXTURES.index(choose("texture", material.texture, TEXTURES)))

    for box in boxes:
        c, s = math.cos(box.yaw), math.sin(box.yaw)
        frame = ((c, s, 0.0), (-s, c, 0.0), (0.0, 0.0, 1.0))
        for face in range(FACES):
            axis, sign = face // 2, 2 * (face % 2) - 1
            normal = [sign * value for value in frame[axis]]
            offset = _dot(normal, box.center) + 0.5 * box.size[axis]
            first, second = (k for k in range(3) if k != axis)
            if box.material.texture == "wood" and box.size[first] < box.size[second]:
                first, second = second, first  # the grain runs along the longer side
            add(box.material, box.center, [*normal, 0.0, offset], (frame[first], frame[second]))
    around = (math.sqrt(0.5), math.sqrt(0.5), 0.0), (0.0, 0.0, 1.0)
    for cylinder in cylinders:
        x, y, z = cylinder.center
        bend, half = 1.0 / cylinder.radius, 0.5 * cylinder.height
        add(cylinder.material, cylinder.center, [-x * bend, -y * bend, 0.0, bend, 0.0], around)
        for up in (1.0, -1.0):
            flat = [0.0, 0.0, up, 0.0, up * z + half]
            add(cylinder.material, cylinder.center, flat, ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0)))
    for ball, _, _ in balls:
        bend = 1.0 / ball.radius
        add(ball.material, ball.center, [*(-v * bend for v in ball.center), bend, 0.0], around, bend)
    pack = ScenePack(
        _table([[*b.center, *(0.5 * v for v in b.size), math.cos(b.yaw), math.sin(b.yaw)] for b in boxes], 8),
        _table(
            [
                [x, y, z - c.height / 2, z + c.height / 2, c.radius, k < closed]
                for k, c in enumerate(cylinders)
                for x, y, z in [c.center]
            ],
            6,
        ),
        _table([[*b.center, b.radius, low, high] for b, low, high in balls], 6),
        _table(surfaces, 17).astype(np.float32),
        np.array(textures, np.uint8),
        _table([_lamp(m) for m in scene.lights], 4).astype(np.float32),
        np.float32(scene.ambient),
    )
    for name, array in pack._asdict().items():
        if not np.isfinite(array).all():
            raise ValueError(f"the scene {scene.name!r} has {name} that are not finite; expected finite meters")
    return pack


def _ball(sphere: Sphere, half: int) -> tuple[Sphere, float, float]:
    """Return a sphere with its lowest and highest z: all of it (0), or the lower (-1) or upper (1) half.

    A half reaches a hair too far, where it lies less than 1e-8 radii inside a capsule's straight part: no crack.
    """
    z, radius = sphere.center[2], sphere.radius
    return sphere, z - (SEAM if half > 0 else 2.0) * radius, z + (SEAM if half < 0 else 2.0) * radius


def _lamp(light: Light) -> list[float]:
    return [*light.position, light.intensity * ((light.position[2] - 1.0) ** 2 + float(SOFT))]


def _axis(axis: tuple[float, float, float], origin: tuple[float, float, float]) -> list[float]:
    """Return (ax, ay, az, a0) such that ax x + ay y + az z + a0 is the coordinate along `axis` from `origin`."""
    return [*axis, -_dot(axis, origin)]


def _dot(one: Sequence[float], other: Sequence[float]) -> float:
    """Return the scalar product, added from the left: Python's `sum` of floats is not the same in every version."""
    return one[0] * other[0] + one[1] * other[1] + one[2] * other[2]


def _table(rows: list[list[float]], columns: int) -> np.ndarray:
    return np.array(rows, np.float64).reshape(-1, columns)
