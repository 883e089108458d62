"""Triangle meshes that a renderer draws: what stays the same from frame to frame, and one placed in the world."""

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Mesh:
    """The part of a body that stays the same from frame to frame.

    Attributes:
        faces: (F, 3) int32, vertex indices, counter-clockwise seen from outside.
        colours: (F, 3) float32, sRGB albedo of a face in [0, 1].
        pattern: (F,) uint8, 0 = plain, 1 = stripes, 2 = checks.
        anchors: (V, 3) float32, rest-pose vertex positions in m; patterns are drawn in these coordinates.
    """

    faces: np.ndarray
    colours: np.ndarray
    pattern: np.ndarray
    anchors: np.ndarray


@dataclass(frozen=True)
class Placed:
    """A mesh in the world for one frame.

    Attributes:
        mesh: what is drawn.
        vertices: (V, 3) float32, world frame, m.
        normals: (V, 3) float32, unit, smooth.
        id: 1 = the person to follow, 2 and more = others.
    """

    mesh: Mesh
    vertices: np.ndarray
    normals: np.ndarray
    id: int
