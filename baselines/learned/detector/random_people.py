"""How the people of the training pictures look: bodies, clothes and postures by chance."""

from typing import NamedTuple

import numpy as np

from baselines.learned.detector.random_scenes import draw_color
from follow_env.world.people.bodies import OUTFITS, SUITS, Outfit

DRAWN_BODIES = ("man", "man_tall", "man_heavy", "woman", "woman_slim", "woman_old", "child")
DRAWN_OUTFITS = ("blue", "green", "orange", "red", "white", "stripes", "checks", "gray")
DRAWN_SUITS = ("green", "blue", "indigo")
DRAWN_POSTURES = ("walk", "stand", "crouch", "arms_raised", "sideways", "bent", "floating", "head_down")
DRAWN_PATTERNS = ("plain", "stripes", "checks")
"""What training pictures draw from: whatever the package gets later changes no old picture."""
HARD_POSTURES = {"crouch": 2, "arms_raised": 2, "sideways": 2, "bent": 2, "floating": 4, "head_down": 3}
"""How often these are drawn for every time that one of the others is."""


class Look(NamedTuple):
    """A body (one of `DRAWN_BODIES`), its level of detail, and its clothes."""

    body: str
    detail: str
    outfit: Outfit


def draw_look(rng: np.random.Generator) -> Look:
    """Return any body in any clothes."""
    name, detail = DRAWN_BODIES[rng.integers(len(DRAWN_BODIES))], "high" if rng.random() < 0.25 else "low"
    named = [*map(OUTFITS.get, DRAWN_OUTFITS), *(SUITS[name] for name in DRAWN_SUITS)]
    outfit = named[rng.integers(len(named))] if rng.random() < 0.25 else _draw_outfit(rng)
    return Look(name, detail, outfit)


def draw_posture(rng: np.random.Generator) -> str:
    """Return any posture, the hard ones more often."""
    urn = [posture for posture in DRAWN_POSTURES for _ in range(HARD_POSTURES.get(posture, 1))]
    return urn[rng.integers(len(urn))]


def _draw_outfit(rng: np.random.Generator) -> Outfit:
    """Return clothes of any colors; a fifth are overalls of one color, as a spacesuit is."""
    dark, light = np.array((0.22, 0.14, 0.10)), np.array((0.92, 0.75, 0.66))
    red, green, blue = (dark + (light - dark) * rng.random()).tolist()
    shirt = draw_color(rng)
    return Outfit(
        skin=(red, green, blue),
        hair=draw_color(rng, 0.6),
        shirt=shirt,
        trousers=shirt if rng.random() < 0.2 else draw_color(rng, 0.7),
        shoes=draw_color(rng, 0.7),
        pattern="plain" if rng.random() < 0.6 else DRAWN_PATTERNS[rng.integers(len(DRAWN_PATTERNS))],
    )
