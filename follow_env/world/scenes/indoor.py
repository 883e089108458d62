"""Paper B's indoor scene (figure 5): an office with furniture and clutter on both sides of the route."""

from follow_env.world.scene import Box, Cylinder, Light, Material, Primitive, Scene
from follow_env.world.scenes import SCENES

WALL = Material((0.88, 0.87, 0.82))
BRICK = Material((0.66, 0.45, 0.36), texture="brick")
CEILING = Material((0.95, 0.95, 0.95))
FLOOR = Material((0.55, 0.45, 0.34), 0.2, "carpet")
WOOD = Material((0.62, 0.44, 0.27), 0.2, "wood")
STEEL = Material((0.55, 0.57, 0.60), 0.5)
DARK = Material((0.15, 0.15, 0.17))
SCREEN = Material((0.05, 0.06, 0.10), 0.6)
FABRIC = Material((0.20, 0.32, 0.50))
RED = Material((0.65, 0.20, 0.18))
BOOKS = Material((0.45, 0.30, 0.42), texture="spines")
LEAF = Material((0.16, 0.42, 0.18))
POT = Material((0.58, 0.35, 0.24))
CARTON = Material((0.72, 0.58, 0.40))
LAMP = Material((1.0, 0.97, 0.88))

X0, X1, HALF, HEIGHT = -3.0, 19.0, 4.5, 2.8


@SCENES.register("indoor")
def indoor() -> Scene:
    """Return an office of 22 m x 9 m x 2.8 m: desks, chairs, shelves, plants, pillars and boxes beside the route."""
    middle, length = 0.5 * (X0 + X1), X1 - X0
    parts: list[Primitive] = [
        Box((middle, HALF + 0.05, HEIGHT / 2), (length, 0.1, HEIGHT), WALL),
        Box((middle, -HALF - 0.05, HEIGHT / 2), (length, 0.1, HEIGHT), WALL),
        Box((X0 - 0.05, 0.0, HEIGHT / 2), (0.1, 2 * HALF + 0.2, HEIGHT), BRICK),
        Box((X1 + 0.05, 0.0, HEIGHT / 2), (0.1, 2 * HALF + 0.2, HEIGHT), BRICK),
        Box((middle, 0.0, HEIGHT + 0.05), (length, 2 * HALF + 0.2, 0.1), CEILING),
    ]
    for x, y, yaw in ((1.5, 2.6, 0.1), (5.2, -2.7, -0.15), (8.8, 2.7, 0.0), (12.4, -2.6, 0.1), (15.6, 2.5, -0.1)):
        parts += _desk(x, y, yaw)
    for x, y, yaw in ((1.6, 1.75, 0.4), (5.0, -1.85, -0.3), (8.9, 1.85, 0.2), (12.6, -1.75, 0.5)):
        parts += _chair(x, y, yaw)
    for x, y in ((2.0, -3.9), (9.6, -3.9), (5.8, 3.9), (13.0, 3.9)):
        parts += _shelf(x, y)
    for x, y in ((3.7, 1.9), (7.2, -2.0), (10.9, 2.0), (14.4, -2.1), (17.6, 1.6)):
        parts += _plant(x, y)
    parts += [Cylinder((x, y, HEIGHT / 2), 0.2, HEIGHT, WALL) for x, y in ((3.6, -2.1), (10.6, -2.1), (13.4, 2.1))]
    parts += [
        Box((6.6, 2.2, 0.20), (0.5, 0.4, 0.40), CARTON, yaw=0.5),
        Box((6.6, 2.2, 0.55), (0.4, 0.35, 0.30), CARTON, yaw=0.2),
        Box((16.8, -1.9, 0.45), (1.9, 0.8, 0.45), RED, yaw=0.05),
        Box((16.8, -2.3, 0.75), (1.9, 0.2, 0.55), RED, yaw=0.05),
        Box((X1 - 0.6, -0.6, 0.9), (0.5, 1.6, 1.8), WOOD),
    ]
    lights = (Light((1.0, 1.5, 2.7), 0.9), Light((8.0, -1.5, 2.7), 0.8), Light((15.0, 1.0, 2.7), 0.7))
    parts += [Box((*light.position[:2], HEIGHT - 0.02), (0.6, 0.6, 0.04), LAMP, solid=False) for light in lights]
    return Scene("indoor", tuple(parts), FLOOR, lights, 0.38, (X0, X1, -HALF, HALF))


def _desk(x: float, y: float, yaw: float) -> list[Primitive]:
    return [
        Box((x, y, 0.73), (1.6, 0.8, 0.04), WOOD, yaw),
        Box((x, y, 0.36), (1.4, 0.05, 0.70), STEEL, yaw),
        Box((x, y + 0.1, 1.00), (0.55, 0.05, 0.34), SCREEN, yaw),
    ]


def _chair(x: float, y: float, yaw: float) -> list[Primitive]:
    return [
        Box((x, y, 0.46), (0.46, 0.46, 0.08), FABRIC, yaw),
        Box((x, y + (-0.2 if y > 0 else 0.2), 0.78), (0.44, 0.06, 0.50), FABRIC, yaw),
        Cylinder((x, y, 0.22), 0.05, 0.44, STEEL),
        Cylinder((x, y, 0.03), 0.24, 0.05, DARK),
    ]


def _shelf(x: float, y: float) -> list[Primitive]:
    board = [Box((x, y, z), (1.8, 0.4, 0.03), WOOD) for z in (0.1, 0.55, 1.0, 1.45, 1.9)]
    sides = [Box((x + dx, y, 0.95), (0.03, 0.4, 1.9), WOOD) for dx in (-0.9, 0.9)]
    books = [Box((x + dx, y, z), (0.5, 0.25, 0.28), BOOKS) for dx, z in ((-0.5, 0.26), (0.3, 0.71), (-0.2, 1.16))]
    return [*board, *sides, *books]


def _plant(x: float, y: float) -> list[Primitive]:
    return [
        Cylinder((x, y, 0.2), 0.16, 0.4, POT),
        Cylinder((x, y, 0.75), 0.05, 0.7, LEAF),
        Cylinder((x, y, 1.25), 0.30, 0.6, LEAF),
    ]
