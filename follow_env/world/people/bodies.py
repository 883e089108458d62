"""Bodies that are seen: skinned, clothed people, read from `assets/`, and what they wear.

LICENSES.md beside the assets says where they come from.

Rest frame: origin on the floor below the pelvis, x forward, y left, z up, m.
"""

from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

import numpy as np

from follow_env.registry import Registry, choose
from follow_env.world.people.mesh import Mesh

ASSETS = Path(__file__).parent / "assets"
BODIES: Registry[Path] = Registry("body")
"""Files of the bodies; each has short or long sleeves and a hair style of its own."""
for _name in ("man", "man_tall", "man_heavy", "woman", "woman_slim", "woman_old", "child"):
    BODIES.register(_name)(ASSETS / f"{_name}.npz")
DETAILS = ("low", "high")
"""Levels of detail: about 1.2k and 3k triangles."""
MATERIALS = ("skin", "hair", "shirt", "trousers", "shoes", "eyes")
PATTERNS = ("plain", "stripes", "checks")

Color = tuple[float, float, float]


@dataclass(frozen=True)
class Outfit:
    """Colors of a person, sRGB in [0, 1], and the pattern of the shirt (one of `PATTERNS`)."""

    skin: Color = (0.80, 0.60, 0.48)
    hair: Color = (0.17, 0.11, 0.07)
    shirt: Color = (0.16, 0.30, 0.62)
    trousers: Color = (0.20, 0.20, 0.24)
    shoes: Color = (0.10, 0.10, 0.11)
    eyes: Color = (0.10, 0.07, 0.05)
    pattern: str = "plain"

    def __post_init__(self) -> None:
        choose("pattern", self.pattern, PATTERNS)
        for name in MATERIALS:
            color = getattr(self, name)
            if len(color) != 3 or not all(0.0 <= value <= 1.0 for value in color):
                raise ValueError(f"{name} is {color}; expected three sRGB values in [0, 1]")


OUTFITS: Registry[Outfit] = Registry("outfit")
"""Outfits by name."""
for _name, _outfit in {
    "blue": Outfit(),
    "green": Outfit((0.62, 0.42, 0.30), (0.06, 0.05, 0.05), (0.16, 0.48, 0.28), (0.34, 0.30, 0.24), (0.28, 0.18, 0.11)),
    "orange": Outfit((0.86, 0.68, 0.58), (0.45, 0.29, 0.14), (0.85, 0.45, 0.12), (0.15, 0.20, 0.34)),
    "red": Outfit((0.36, 0.23, 0.16), (0.05, 0.04, 0.04), (0.66, 0.12, 0.14), (0.42, 0.44, 0.50), (0.85, 0.85, 0.83)),
    "white": Outfit((0.74, 0.53, 0.38), (0.08, 0.07, 0.07), (0.88, 0.88, 0.86), (0.12, 0.17, 0.32)),
    "stripes": Outfit(
        (0.88, 0.70, 0.60), (0.62, 0.46, 0.24), (0.80, 0.80, 0.84), (0.13, 0.13, 0.15), pattern="stripes"
    ),
    "checks": Outfit((0.82, 0.63, 0.52), (0.50, 0.48, 0.46), (0.55, 0.20, 0.22), (0.30, 0.25, 0.18), pattern="checks"),
    "gray": Outfit((0.50, 0.33, 0.23), (0.10, 0.07, 0.05), (0.45, 0.47, 0.50), (0.30, 0.31, 0.34)),
}.items():
    OUTFITS.register(_name)(_outfit)
SUITS: dict[str, Outfit] = {
    name: Outfit(shirt=color, trousers=color)
    for name, color in {
        "green": (0.16, 0.48, 0.28),
        "blue": (0.13, 0.33, 0.70),
        "indigo": (0.18, 0.16, 0.42),
    }.items()
}
"""Paper A's three spacesuits: shirt and trousers of one color."""


@dataclass(frozen=True)
class Body:
    """A skinned person of V vertices, F faces and J bones.

    Attributes:
        name: one of `BODIES`.
        height: standing height with shoes and hair, m.
        mesh: faces, colors and rest vertices.
        bones: (V, 4) int32, the bones that move a vertex.
        weights: (V, 4) float32, their shares, sum 1.
        joints: (J, 3) float64, rest position of each bone's head.
        parents: (J,) int32, -1 for the pelvis; a parent comes before its children.
        bone_names: J names.
    """

    name: str
    height: float
    mesh: Mesh
    bones: np.ndarray
    weights: np.ndarray
    joints: np.ndarray
    parents: np.ndarray
    bone_names: tuple[str, ...]


def load_body(name: str = "man", outfit: str | Outfit = "blue", detail: str = "low") -> Body:
    """Return a body.

    Args:
        name: one of `BODIES`.
        outfit: one of `OUTFITS`, or colors.
        detail: one of `DETAILS`.

    Raises:
        ValueError: there is no such body, outfit or detail; the message names the nearest.
    """
    choose("detail", detail, DETAILS)
    if isinstance(outfit, str):
        outfit = OUTFITS.get(outfit)
    arrays = _read(BODIES.get(name))
    count = int(arrays["low_vertices"]) if detail == "low" else len(arrays["vertices"])
    materials = arrays[f"{detail}_materials"]
    palette = np.array([getattr(outfit, material) for material in MATERIALS], np.float32)
    mesh = Mesh(
        faces=_frozen(arrays[f"{detail}_faces"].astype(np.int32)),
        colors=_frozen(palette[materials]),
        pattern=_frozen(
            np.where(materials == MATERIALS.index("shirt"), PATTERNS.index(outfit.pattern), 0).astype(np.uint8)
        ),
        anchors=_frozen(arrays["vertices"][:count].copy()),
    )
    return Body(
        name=name,
        height=float(arrays["height"]),
        mesh=mesh,
        bones=_frozen(arrays["bones"][:count].astype(np.int32)),
        weights=_frozen(arrays["weights"][:count].copy()),
        joints=_frozen(arrays["joints"].astype(np.float64)),
        parents=_frozen(arrays["parents"].astype(np.int32)),
        bone_names=tuple(arrays["names"].tolist()),
    )


@lru_cache(maxsize=16)
def _read(file: Path) -> dict[str, np.ndarray]:
    with np.load(file) as archive:
        return {key: archive[key] for key in archive.files}


def _frozen(array: np.ndarray) -> np.ndarray:
    array.flags.writeable = False
    return array
