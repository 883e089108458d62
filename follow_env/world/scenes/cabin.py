"""A space station's module for paper A's experiments: racks on both sides, stowage and handrails, a hatch at each end.

Nobody walks 12 m in it: it has no routes, only people who stand, turn and float before a camera.
"""

from follow_env.world.scene import Box, Cylinder, Light, Material, Scene
from follow_env.world.scenes import SCENES

RACK = Material((0.82, 0.82, 0.78), 0.2)
DRAWERS = (
    Material((0.90, 0.89, 0.85), 0.2),
    Material((0.74, 0.76, 0.78), 0.3),
    Material((0.68, 0.62, 0.52), 0.2),
    Material((0.52, 0.56, 0.62), 0.3),
    Material((0.30, 0.32, 0.36), 0.3),
)
CLOSEOUT = Material((0.88, 0.88, 0.86), 0.2, "tiles")
FLOOR = Material((0.66, 0.67, 0.70), 0.3, "tiles")
HATCH = Material((0.70, 0.72, 0.74), 0.4)
DARK = Material((0.10, 0.11, 0.13))
RAIL = Material((0.20, 0.36, 0.66), 0.3)
SCREEN = Material((0.05, 0.08, 0.14), 0.6)
BAG = Material((0.93, 0.92, 0.88), 0.0)
HOSE = Material((0.80, 0.62, 0.22))
BOTTLE = Material((0.72, 0.16, 0.14), 0.3)
LAMP = Material((1.0, 1.0, 0.97))

X0, X1, HALF, HEIGHT = -4.2, 4.2, 1.5, 2.4
RACKS = 8


@SCENES.register("cabin")
def cabin() -> Scene:
    """Return a module of 8.4 m x 3 m x 2.4 m along +x: eight racks a side, handrails, laptops, stowage, two hatches."""
    middle, length = 0.5 * (X0 + X1), X1 - X0
    parts: list[Box | Cylinder] = [
        Box((middle, HALF + 0.05, HEIGHT / 2), (length, 0.1, HEIGHT), RACK),
        Box((middle, -HALF - 0.05, HEIGHT / 2), (length, 0.1, HEIGHT), RACK),
        Box((X0 - 0.05, 0.0, HEIGHT / 2), (0.1, 2 * HALF + 0.2, HEIGHT), CLOSEOUT),
        Box((X1 + 0.05, 0.0, HEIGHT / 2), (0.1, 2 * HALF + 0.2, HEIGHT), CLOSEOUT),
        Box((middle, 0.0, HEIGHT + 0.05), (length, 2 * HALF + 0.2, 0.1), CLOSEOUT),
    ]
    for side in (-1.0, 1.0):
        for number in range(RACKS):
            parts += _rack(X0 + (number + 0.5) * length / RACKS, side, number + (0 if side > 0 else 3))
        parts.append(Box((middle, side * (HALF - 0.09), 0.62), (length - 1.2, 0.03, 0.03), RAIL, solid=False))
        parts.append(Box((middle, side * (HALF - 0.09), 1.78), (length - 1.2, 0.03, 0.03), RAIL, solid=False))
        parts.append(Box((middle, side * (HALF - 0.16), HEIGHT - 0.10), (length, 0.20, 0.08), LAMP, solid=False))
    for end in (X0, X1):
        inward = 0.02 if end < 0 else -0.02
        parts.append(Box((end + inward, 0.0, 1.15), (0.04, 1.5, 1.7), HATCH, solid=False))
        parts.append(Box((end + 2 * inward, 0.0, 1.15), (0.04, 1.1, 1.3), DARK, solid=False))
    parts += [
        Box((2.3, 1.20, 0.35), (0.7, 0.5, 0.5), BAG, yaw=0.1),
        Box((2.4, 1.22, 0.78), (0.6, 0.45, 0.36), BAG, yaw=-0.1),
        Box((-2.6, -1.22, 0.30), (0.9, 0.45, 0.4), BAG, yaw=0.05),
        Box((3.6, -1.18, 1.45), (0.5, 0.5, 0.4), BAG),
        Box((0.9, -1.22, 1.25), (0.36, 0.04, 0.26), SCREEN, yaw=0.2),
        Box((0.9, -1.30, 1.12), (0.36, 0.20, 0.02), DARK, yaw=0.2),
        Box((-1.3, 1.22, 1.30), (0.36, 0.04, 0.26), SCREEN, yaw=-0.2),
        Cylinder((-0.2, -1.36, 0.45), 0.08, 0.5, BOTTLE),
        Cylinder((3.2, 1.34, 1.3), 0.04, 1.6, HOSE),
        Cylinder((-3.5, 1.34, 1.2), 0.04, 2.0, HOSE),
    ]
    lights = (Light((-2.6, 0.0, 2.2), 0.7), Light((0.2, 0.0, 2.2), 0.8), Light((2.8, 0.0, 2.2), 0.6))
    return Scene("cabin", tuple(parts), FLOOR, lights, 0.40, (X0, X1, -HALF, HALF), (-3.0, 0.0, 0.0), 0.2)


def _rack(x: float, side: float, number: int) -> list[Box | Cylinder]:
    """Return the drawers of a rack: two to four panels above each other, with dark seams between them."""
    width = (X1 - X0) / RACKS - 0.08
    count = 2 + number % 3
    high = 2.0 / count
    return [
        Box(
            (x, side * (HALF - 0.02), 0.12 + (k + 0.5) * high),
            (width, 0.04, high - 0.05),
            DRAWERS[(2 * number + 3 * k) % len(DRAWERS)],
            solid=False,
        )
        for k in range(count)
    ]
