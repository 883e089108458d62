"""The visible body: segments as smooth tapered solids, a clothed adult of 1.75 m.

A segment lives in its own frame: origin at its proximal joint, -z along the segment, x forward, y left.
"""

import math
from dataclasses import dataclass

import numpy as np

Colour = tuple[float, float, float]

THIGH, SHIN, FOOT = 0.42, 0.42, 0.26
FOOT_PROFILE = ((0.0, 0.03, 0.02), (0.06, 0.04, 0.035), (0.5, 0.048, 0.04), (0.9, 0.042, 0.028), (1.0, 0.02, 0.015))
HIP_WIDTH, SHOULDER_WIDTH = 0.09, 0.20
TRUNK, UPPER_ARM, FOREARM = 0.50, 0.29, 0.26

CLOTHES: dict[str, tuple[Colour, Colour]] = {
    "blue": ((0.16, 0.30, 0.62), (0.20, 0.20, 0.24)),
    "green": ((0.16, 0.48, 0.28), (0.34, 0.30, 0.24)),
    "orange": ((0.85, 0.45, 0.12), (0.15, 0.20, 0.34)),
}
"""Clothes by name: colours of shirt and trousers."""
SKIN: Colour = (0.82, 0.62, 0.50)
HAIR: Colour = (0.20, 0.13, 0.09)
SHOE: Colour = (0.12, 0.12, 0.13)


@dataclass(frozen=True)
class Segment:
    """A solid of revolution stretched along x and y.

    Attributes:
        name: for example "thigh_left".
        length: along -z, m.
        profile: (share of the length, half-width y in m, half-depth x in m) from top to bottom.
        colour: sRGB in [0, 1].
    """

    name: str
    length: float
    profile: tuple[tuple[float, float, float], ...]
    colour: Colour

    def mesh(self, sides: int = 14) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return vertices (n, 3) m, unit normals (n, 3) and triangle indices (m * 3,)."""
        rows = [(0.0, 0.0, 0.0), *self.profile, (1.0, 0.0, 0.0)]
        rows[0], rows[-1] = (rows[1][0], 0.0, 0.0), (rows[-2][0], 0.0, 0.0)
        ring = [(math.cos(2 * math.pi * k / sides), math.sin(2 * math.pi * k / sides)) for k in range(sides)]
        vertices = np.array([(d * c, w * s, -share * self.length) for share, w, d in rows for c, s in ring])
        indices = []
        for i in range(len(rows) - 1):
            for k in range(sides):
                a, b = i * sides + k, i * sides + (k + 1) % sides
                c, d = a + sides, b + sides
                indices += [a, c, b, b, c, d]
        faces = np.array(indices).reshape(-1, 3)
        normals = np.zeros_like(vertices)
        face_normals = np.cross(
            vertices[faces[:, 1]] - vertices[faces[:, 0]], vertices[faces[:, 2]] - vertices[faces[:, 0]]
        )
        for corner in range(3):
            np.add.at(normals, faces[:, corner], face_normals)
        seam = normals.reshape(len(rows), sides, 3)
        seam[0], seam[-1] = (0.0, 0.0, 1.0), (0.0, 0.0, -1.0)
        length = np.sqrt((normals**2).sum(axis=1, keepdims=True))
        return vertices, normals / np.maximum(length, 1e-12), faces.reshape(-1)


def _limb(name: str, length: float, top: float, bottom: float, colour: Colour) -> Segment:
    rounded = ((-0.06, 0.45 * top, 0.45 * top), (0.0, 0.95 * top, 0.95 * top), (0.25, top, top))
    return Segment(name, length, (*rounded, (0.97, bottom, bottom), (1.05, 0.5 * bottom, 0.5 * bottom)), colour)


def segments(clothes: str = "blue") -> tuple[Segment, ...]:
    """Return the segments of a person who wears `clothes` (a key of `CLOTHES`); `gait.pose` gives their order."""
    shirt, trousers = CLOTHES[clothes]
    trunk = (
        (-0.03, 0.07, 0.06),
        (0.02, 0.15, 0.085),
        (0.10, 0.185, 0.10),
        (0.30, 0.18, 0.115),
        (0.60, 0.155, 0.105),
        (0.80, 0.155, 0.105),
        (1.0, 0.165, 0.11),
        (1.05, 0.16, 0.105),
    )
    hips = ((0.0, 0.163, 0.11), (0.35, 0.175, 0.12), (0.75, 0.16, 0.11), (1.05, 0.08, 0.07))
    head = (
        (0.0, 0.03, 0.03),
        (0.10, 0.062, 0.072),
        (0.35, 0.078, 0.097),
        (0.60, 0.076, 0.095),
        (0.85, 0.055, 0.08),
        (1.0, 0.03, 0.05),
    )
    hair = ((-0.10, 0.03, 0.03), (0.05, 0.068, 0.080), (0.35, 0.084, 0.104), (0.70, 0.082, 0.100), (0.95, 0.05, 0.06))
    pair = []
    for side in ("left", "right"):
        pair += [
            _limb(f"thigh_{side}", THIGH, 0.088, 0.058, trousers),
            _limb(f"shin_{side}", SHIN, 0.060, 0.042, trousers),
            Segment(f"foot_{side}", FOOT, FOOT_PROFILE, SHOE),
            _limb(f"upper_arm_{side}", UPPER_ARM, 0.052, 0.042, shirt),
            _limb(f"forearm_{side}", FOREARM, 0.042, 0.030, shirt),
            Segment(f"hand_{side}", 0.17, ((0.0, 0.02, 0.025), (0.4, 0.022, 0.045), (1.0, 0.012, 0.025)), SKIN),
        ]
    return (
        Segment("trunk", TRUNK, trunk, shirt),
        Segment("hips", 0.20, hips, trousers),
        Segment("neck", 0.14, ((0.0, 0.045, 0.05), (1.0, 0.055, 0.055)), SKIN),
        Segment("head", 0.24, head, SKIN),
        Segment("hair", 0.19, hair, HAIR),
        *pair,
    )
