"""Paper B's corridor (figure 4): long, narrow, doors on both sides, uneven light."""

from follow_env.world.scene import Box, Light, Material, Scene
from follow_env.world.scenes import SCENES

WALL = Material((0.86, 0.84, 0.78))
SKIRTING = Material((0.32, 0.30, 0.28))
DOOR = Material((0.50, 0.33, 0.20), 0.2, "wood")
FRAME = Material((0.92, 0.92, 0.90))
CEILING = Material((0.95, 0.95, 0.95))
FLOOR = Material((0.62, 0.62, 0.60), 0.4, "tiles")
LAMP = Material((1.0, 1.0, 0.95))
RADIATOR = Material((0.93, 0.93, 0.95))

LENGTH = (-3.0, 20.0)
WIDTH = 3.6
HEIGHT = 2.7


@SCENES.register("corridor")
def corridor() -> Scene:
    """Return a corridor of 23 m x 3.6 m x 2.7 m along +x with eight doors, radiators and four unequal lamps."""
    x0, x1 = LENGTH
    middle, length, half = 0.5 * (x0 + x1), x1 - x0, 0.5 * WIDTH
    parts: list[Box] = []
    for side in (-1.0, 1.0):
        parts.append(Box((middle, side * (half + 0.05), HEIGHT / 2), (length, 0.1, HEIGHT), WALL))
        parts.append(Box((middle, side * (half - 0.01), 0.06), (length, 0.02, 0.12), SKIRTING, solid=False))
        for x in (0.5, 5.5, 10.5, 15.5):
            x += 1.2 * side
            parts.append(Box((x, side * (half - 0.015), 1.03), (1.02, 0.03, 2.06), FRAME, solid=False))
            parts.append(Box((x, side * (half - 0.025), 1.00), (0.90, 0.05, 2.00), DOOR, solid=False))
    parts += [Box((x, half - 0.06, 0.45), (1.1, 0.12, 0.6), RADIATOR) for x in (4.2, 14.2)]
    parts += [
        Box((x0 - 0.05, 0.0, HEIGHT / 2), (0.1, WIDTH + 0.2, HEIGHT), WALL),
        Box((x1 + 0.05, 0.0, HEIGHT / 2), (0.1, WIDTH + 0.2, HEIGHT), WALL),
        Box((x1 - 0.02, 0.0, 1.05), (1.6, 0.04, 2.1), DOOR, yaw=1.5707963267948966, solid=False),
        Box((middle, 0.0, HEIGHT + 0.05), (length, WIDTH + 0.2, 0.1), CEILING),
    ]
    lights = (
        Light((-1.0, 0.0, 2.6), 0.9),
        Light((4.5, 0.0, 2.6), 0.35),
        Light((9.0, 0.0, 2.6), 1.0),
        Light((16.0, 0.0, 2.6), 0.5),
    )
    parts += [Box((*light.position[:2], HEIGHT - 0.02), (1.2, 0.3, 0.04), LAMP, solid=False) for light in lights]
    return Scene("corridor", tuple(parts), FLOOR, lights, 0.30, (x0, x1, -half, half))
