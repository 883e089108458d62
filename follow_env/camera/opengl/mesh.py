"""Scenes and people as triangles, for `OpenGLRenderer`."""

import math
from collections.abc import Callable, Iterable, Sequence
from typing import NamedTuple

import numpy as np

from follow_env.camera.raster.scene import FLOOR_THICKNESS
from follow_env.camera.raster.textures import TEXTURES
from follow_env.world.people.mesh import Mesh
from follow_env.world.scene import Box, Capsule, Cylinder, Material, Scene, Sphere

SIDES, ROWS = 48, 12
"""Sides of the prism that stands for a cylinder, which lies within 0.22 % of the radius; rows of a half sphere."""


class Triangles(NamedTuple):
    """Triangles and how they look.

    Attributes:
        vertices: (V, 6) float32, position (m) and unit normal, world frame; people bring theirs with every picture.
        anchors: (V, 3) float32; of a scene the texture coordinates (m) and 1 where the surface is curved, of a person
            the vertices of the body at rest (m).
        faces: (F, 3) int32, counter-clockwise seen from outside.
        looks: (F, 4) float32, albedo and an index into `TEXTURES`, or minus a person's pattern.
    """

    vertices: np.ndarray
    anchors: np.ndarray
    faces: np.ndarray
    looks: np.ndarray


def scene_triangles(scene: Scene) -> Triangles:
    """Return the floor and the primitives of `scene` as triangles."""
    x0, x1, y0, y1 = scene.bounds
    center, size = (0.5 * (x0 + x1), 0.5 * (y0 + y1), -0.5 * FLOOR_THICKNESS), (x1 - x0, y1 - y0, FLOOR_THICKNESS)
    parts = []
    for primitive in (Box(center, size, scene.floor), *scene.primitives):
        parts += [_colored(patch, primitive.material) for patch in _PATCHES[type(primitive)](primitive)]
    return _joined(parts)


def person_triangles(mesh: Mesh) -> Triangles:
    """Return what does not move of a person's `mesh`; the vertices are zeros."""
    looks = np.column_stack((mesh.colors, -mesh.pattern.astype(np.float32)))
    return Triangles(np.zeros((len(mesh.anchors), 6), np.float32), mesh.anchors, mesh.faces, looks)


class _Patch(NamedTuple):
    """A smooth piece of surface: positions, normals, anchors (V, 3) and faces (F, 3) of either orientation."""

    positions: np.ndarray
    normals: np.ndarray
    anchors: np.ndarray
    faces: np.ndarray


def _box(box: Box) -> Iterable[_Patch]:
    """Yield the six faces; texture coordinates run along the box's own axes."""
    c, s = math.cos(box.yaw), math.sin(box.yaw)
    frame, half = np.array([(c, s, 0.0), (-s, c, 0.0), (0.0, 0.0, 1.0)]), 0.5 * np.array(box.size)
    for axis in range(3):
        first, second = (k for k in range(3) if k != axis)
        if box.material.texture == "wood" and box.size[first] < box.size[second]:
            first, second = second, first  # the grain runs along the longer side
        for sign in (-1.0, 1.0):
            own = np.zeros((4, 3))
            own[:, axis] = sign * half[axis]
            own[:, first] = half[first] * np.array((-1.0, 1.0, 1.0, -1.0))
            own[:, second] = half[second] * np.array((-1.0, -1.0, 1.0, 1.0))
            anchors = np.column_stack((own[:, first], own[:, second], np.zeros(4)))
            normals = np.tile(sign * frame[axis], (4, 1))
            yield _Patch(box.center + own @ frame, normals, anchors, np.array([(0, 1, 2), (0, 2, 3)]))


def _cylinder(cylinder: Cylinder) -> Iterable[_Patch]:
    """Yield the side and the two ends."""
    radius, half = cylinder.radius, 0.5 * cylinder.height
    yield _turned(cylinder.center, [(radius, -half, 1.0, 0.0), (radius, half, 1.0, 0.0)], curved=True)
    for up in (-1.0, 1.0):
        yield _turned(cylinder.center, [(0.0, up * half, 0.0, up), (radius, up * half, 0.0, up)], curved=False)


def _sphere(sphere: Sphere) -> Iterable[_Patch]:
    yield _turned(sphere.center, [*_quarter(sphere.radius, -1), *_quarter(sphere.radius, 1)[1:]], curved=True)


def _capsule(capsule: Capsule) -> Iterable[_Patch]:
    """Yield the straight part and the two half spheres."""
    (x, y, z), radius, half = capsule.center, capsule.radius, 0.5 * capsule.straight
    yield _turned(capsule.center, [(radius, -half, 1.0, 0.0), (radius, half, 1.0, 0.0)], curved=True)
    for up in (-1, 1):
        yield _turned((x, y, z + up * half), _quarter(radius, up), curved=True)


_PATCHES: dict[type, Callable[..., Iterable[_Patch]]] = {
    Box: _box,
    Cylinder: _cylinder,
    Sphere: _sphere,
    Capsule: _capsule,
}


def _quarter(radius: float, up: int) -> list[tuple[float, float, float, float]]:
    """Return the profile of a half sphere, upwards: the lower (-1) or the upper (1) one."""
    first = ROWS if up > 0 else 0
    turns = [0.5 * math.pi * (first + k - ROWS) / ROWS for k in range(ROWS + 1)]
    return [(radius * math.cos(a), radius * math.sin(a), math.cos(a), math.sin(a)) for a in turns]


def _turned(
    center: tuple[float, float, float], profile: Sequence[tuple[float, float, float, float]], curved: bool
) -> _Patch:
    """Return the surface that a profile makes when it turns about the upright axis through `center`.

    Args:
        center: m.
        profile: radius and height (m), and the normal's parts outward and upward, of each corner of the profile.
        curved: whether the texture runs around the axis; on a flat end it lies in the plane.
    """
    turn = 2.0 * math.pi / SIDES * np.arange(SIDES)
    ring = np.column_stack((np.cos(turn), np.sin(turn)))
    table = np.array(profile)[:, None, :]
    own = np.concatenate((table[..., :1] * ring, np.broadcast_to(table[..., 1:2], (len(profile), SIDES, 1))), axis=-1)
    normals = np.concatenate(
        (table[..., 2:3] * ring, np.broadcast_to(table[..., 3:], (len(profile), SIDES, 1))), axis=-1
    )
    own, normals = own.reshape(-1, 3), normals.reshape(-1, 3)
    texture = ((own[:, 0] + own[:, 1]) * math.sqrt(0.5), own[:, 2]) if curved else (own[:, 0], own[:, 1])
    k = np.arange(SIDES)
    low = np.concatenate([SIDES * row + k for row in range(len(profile) - 1)])
    after = np.concatenate([SIDES * row + (k + 1) % SIDES for row in range(len(profile) - 1)])
    faces = np.concatenate(
        (np.column_stack((low, after, after + SIDES)), np.column_stack((low, after + SIDES, low + SIDES)))
    )
    return _Patch(own + center, normals, np.column_stack((*texture, np.full(len(own), float(curved)))), faces)


def _colored(patch: _Patch, material: Material) -> Triangles:
    """Leave out faces without area, turn the others outward and give them the material's look."""
    a, b, c = (patch.positions[patch.faces[:, k]] for k in range(3))
    outward = (np.cross(b - a, c - a) * patch.normals[patch.faces].sum(axis=1)).sum(axis=1)
    faces = np.where(outward[:, None] < 0.0, patch.faces[:, ::-1], patch.faces)[np.abs(outward) > 1e-12]
    return Triangles(
        np.hstack((patch.positions, patch.normals)).astype(np.float32),
        patch.anchors.astype(np.float32),
        faces.astype(np.int32),
        np.tile(np.array((*material.color, TEXTURES.index(material.texture)), np.float32), (len(faces), 1)),
    )


def _joined(parts: Sequence[Triangles]) -> Triangles:
    starts = np.cumsum([0, *(len(part.vertices) for part in parts[:-1])])
    return Triangles(
        np.concatenate([part.vertices for part in parts]),
        np.concatenate([part.anchors for part in parts]),
        np.concatenate([part.faces + np.int32(start) for part, start in zip(parts, starts, strict=True)]),
        np.concatenate([part.looks for part in parts]),
    )
