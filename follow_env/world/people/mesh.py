"""`Mesh` and `Placed`: what a renderer needs to know of a person's surface."""

import functools
from dataclasses import dataclass

import numpy as np

PLAIN, STRIPES, CHECKS = 0, 1, 2
"""Patterns of a face: `Mesh.pattern`."""
BORDER_RINGS = 2
"""Rings of triangles along an open border that are drawn from both sides; deeper insides are all but never seen."""


@dataclass(frozen=True)
class Mesh:
    """The part of a surface that does not move: triangles and how they look.

    Attributes:
        faces: (F, 3) int32, vertex indices, counter-clockwise seen from outside.
        colors: (F, 3) float32, sRGB albedo in [0, 1] of each face.
        pattern: (F,) uint8, 0 = plain, 1 = stripes, 2 = checks, drawn in the coordinates `anchors`.
        anchors: (V, 3) float32, vertices of the body at rest, m.
    """

    faces: np.ndarray
    colors: np.ndarray
    pattern: np.ndarray
    anchors: np.ndarray

    def __post_init__(self) -> None:
        faces, vertices = len(self.faces), len(self.anchors)
        _check("faces", self.faces, np.int32, (faces, 3))
        _check("colors", self.colors, np.float32, (faces, 3))
        _check("pattern", self.pattern, np.uint8, (faces,))
        _check("anchors", self.anchors, np.float32, (vertices, 3))
        if faces and not 0 <= self.faces.min() <= self.faces.max() < vertices:
            raise ValueError(
                f"mesh faces name the vertices {self.faces.min()}..{self.faces.max()}; expected 0..{vertices - 1}"
            )
        if faces and self.pattern.max() > CHECKS:
            raise ValueError(f"mesh pattern is {self.pattern.max()}; expected 0 (plain), 1 (stripes) or 2 (checks)")

    @functools.cached_property
    def near_border(self) -> np.ndarray:
        """(F,) bool: triangles so near an open border (cuff, hem, collar) that their inside can be seen through it."""
        ends = self.faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2).astype(np.int64)
        vertices = len(self.anchors)
        edges, uses = np.unique(ends.min(axis=1) * vertices + ends.max(axis=1), return_counts=True)
        near, reached = np.zeros(len(self.faces), np.bool_), np.array(np.divmod(edges[uses == 1], vertices))
        for _ in range(BORDER_RINGS):
            near |= np.isin(self.faces, reached).any(axis=1)
            reached = self.faces[near].reshape(-1)
        return near


@dataclass(frozen=True)
class Placed:
    """A mesh in the world at one moment.

    Attributes:
        mesh: the surface.
        vertices: (V, 3) float32, world frame, m.
        normals: (V, 3) float32, unit, outward.
        id: 1 = the person to follow, 2.. = others; at most 255.
        pose: (x, y, heading) of the body on the floor, m and rad: what a renderer of rigid bodies moves.
    """

    mesh: Mesh
    vertices: np.ndarray
    normals: np.ndarray
    id: int
    pose: tuple[float, float, float] = (0.0, 0.0, 0.0)

    def __post_init__(self) -> None:
        shape = self.mesh.anchors.shape
        _check("vertices", self.vertices, np.float32, shape)
        _check("normals", self.normals, np.float32, shape)
        if not 1 <= self.id <= 255:
            raise ValueError(f"the id of a placed mesh is {self.id!r}; expected a whole number from 1 to 255")


def _check(name: str, array: np.ndarray, dtype: type, shape: tuple[int, ...]) -> None:
    if array.dtype != dtype or array.shape != shape:
        raise ValueError(
            f"mesh {name} are {array.dtype} of shape {array.shape}; expected {np.dtype(dtype)} of shape {shape}"
        )
