"""Postures that do not walk: named joint angles on top of standing upright with hanging arms.

Angles are rotations of whole segments in the body's frame (x forward, y left, z up), in degrees: `forward` swings a
hanging limb to the front or bends the trunk forward, `left` swings it or leans to the left, `turn` is to the left.
"""

import math
from dataclasses import dataclass, field

import numpy as np

Swing = tuple[float, float, float]
"""Forward, left, turn; degrees."""

SEGMENTS = ("pelvis", "chest", "head", "upper_arm", "forearm", "thigh", "shin", "foot")


@dataclass(frozen=True)
class Posture:
    """A posture.

    Attributes:
        trunk: swings of "pelvis", "chest" and "head"; what is missing is upright.
        left: swings of the left limbs' "upper_arm", "forearm", "thigh", "shin", "foot"; what is missing hangs.
        right: the same for the right limbs; None mirrors the left.
        clearance: height of the lowest point above the floor, as a share of the body's height.
    """

    trunk: dict[str, Swing] = field(default_factory=dict)
    left: dict[str, Swing] = field(default_factory=dict)
    right: dict[str, Swing] | None = None
    clearance: float = 0.0


_ARMS_DOWN: dict[str, Swing] = {"upper_arm": (0, 10, 0), "forearm": (12, 8, 0)}

POSTURES: dict[str, Posture] = {
    "crouch": Posture(
        trunk={"pelvis": (20, 0, 0), "chest": (38, 0, 0), "head": (10, 0, 0)},
        left={"upper_arm": (35, 14, 0), "forearm": (85, 4, 0), "thigh": (92, 14, 0), "shin": (-42, 6, 0)},
    ),
    "arms_raised": Posture(
        left={"upper_arm": (10, 158, 0), "forearm": (4, 172, 0), "thigh": (0, 4, 0), "shin": (0, 4, 0)}
    ),
    "sideways": Posture(
        trunk={"pelvis": (0, 0, 0), "chest": (4, -34, 0), "head": (2, -40, 0)},
        left={"upper_arm": (4, 20, 0), "forearm": (16, 22, 0), "thigh": (0, 10, 0), "shin": (0, 10, 0)},
        right={"upper_arm": (4, -46, 0), "forearm": (14, -42, 0), "thigh": (0, -10, 0), "shin": (0, -10, 0)},
    ),
    "bent": Posture(
        trunk={"pelvis": (38, 0, 0), "chest": (82, 0, 0), "head": (70, 0, 0)},
        left={"upper_arm": (22, 9, 0), "forearm": (30, 6, 0), "thigh": (2, 4, 0), "shin": (-6, 4, 0)},
    ),
    "floating": Posture(
        trunk={"pelvis": (22, 6, 0), "chest": (32, 10, 6), "head": (14, 6, 10)},
        left={
            "upper_arm": (62, 38, 0),
            "forearm": (92, 22, 0),
            "thigh": (58, 12, 0),
            "shin": (-18, 8, 0),
            "foot": (-38, 0, 0),
        },
        right={
            "upper_arm": (44, -50, 0),
            "forearm": (80, -34, 0),
            "thigh": (38, -12, 0),
            "shin": (-46, -10, 0),
            "foot": (-55, 0, 0),
        },
        clearance=0.22,
    ),
    "head_down": Posture(
        trunk={"pelvis": (172, 0, 0), "chest": (176, 0, 0), "head": (168, 0, 0)},
        left={
            "upper_arm": (205, 24, 0),
            "forearm": (225, 16, 0),
            "thigh": (186, 8, 0),
            "shin": (166, 6, 0),
            "foot": (140, 0, 0),
        },
        clearance=0.06,
    ),
}
"""Postures by name; "stand" and "walk" are the gait's."""


def rotations(posture: Posture) -> tuple[dict[str, np.ndarray], dict[str, np.ndarray], dict[str, np.ndarray]]:
    """Return the rotation matrices (3, 3) of trunk, left and right segments; missing ones stand upright or hang."""
    mirrored = {name: (f, -side, -turn) for name, (f, side, turn) in (_ARMS_DOWN | posture.left).items()}
    right = (
        mirrored if posture.right is None else {n: (f, -s, -t) for n, (f, s, t) in _ARMS_DOWN.items()} | posture.right
    )
    return (
        {name: _swing(posture.trunk.get(name, (0, 0, 0)), trunk=True) for name in SEGMENTS[:3]},
        {name: _swing((_ARMS_DOWN | posture.left).get(name, (0, 0, 0)), trunk=False) for name in SEGMENTS[3:]},
        {name: _swing(right.get(name, (0, 0, 0)), trunk=False) for name in SEGMENTS[3:]},
    )


def _swing(angles: Swing, trunk: bool) -> np.ndarray:
    """Return turn * forward * left; the top of an upright trunk goes forward where a hanging limb's end would."""
    forward, left, turn = (math.radians(a) for a in angles)
    sign = -1.0 if trunk else 1.0
    c, s = math.cos(forward), sign * math.sin(forward)
    pitch = np.array([[c, 0.0, -s], [0.0, 1.0, 0.0], [s, 0.0, c]])
    c, s = math.cos(left), sign * math.sin(left)
    roll = np.array([[1.0, 0.0, 0.0], [0.0, c, -s], [0.0, s, c]])
    c, s = math.cos(turn), math.sin(turn)
    yaw = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
    return np.asarray(_product(yaw, _product(pitch, roll)))


def _product(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    return (a[:, :, None] * b[None]).sum(axis=1)
