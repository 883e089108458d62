"""Rooms that nobody designed: size, colors, textures, furniture and lamps by chance, so that a detector learns people.

The shipped scenes get other light and other colors; a room of chance has everything by chance.
"""

import colorsys
import dataclasses
import math

import numpy as np

from follow_env.camera.raster.textures import TEXTURES
from follow_env.world.scene import Box, Cylinder, Light, Material, Scene
from follow_env.world.scenes import make_scene

Color = tuple[float, float, float]
DRAWN_SCENES = ("corridor", "indoor", "cabin")
"""Scenes that training pictures show: a new scene of the package changes no old picture."""


def draw_scene(rng: np.random.Generator) -> Scene:
    """Return one of the shipped scenes (each with probability 0.15) or a room of chance, in a light of chance."""
    pick = int(rng.random() / 0.15)
    scene = _recolored(make_scene(DRAWN_SCENES[pick]), rng) if pick < len(DRAWN_SCENES) else draw_room(rng)
    strength = rng.uniform(0.4, 1.5)
    lights = tuple(Light(m.position, m.intensity * strength * float(rng.uniform(0.3, 1.5))) for m in scene.lights)
    return dataclasses.replace(scene, lights=lights, ambient=float(rng.uniform(0.15, 0.6)))


def draw_room(rng: np.random.Generator) -> Scene:
    """Return a room with furniture, pictures on the walls, and people's rivals: upright things of a person's size.

    Nearly a third of them are all but empty.
    """
    length, width, height = rng.uniform(4.0, 13.0), rng.uniform(2.8, 9.0), rng.uniform(2.3, 3.4)
    x, y, z = 0.5 * length, 0.5 * width, 0.5 * height
    parts: list[Box | Cylinder] = [
        Box((0.0, y + 0.05, z), (length, 0.1, height), draw_material(rng)),
        Box((0.0, -y - 0.05, z), (length, 0.1, height), draw_material(rng)),
        Box((x + 0.05, 0.0, z), (0.1, width + 0.2, height), draw_material(rng)),
        Box((-x - 0.05, 0.0, z), (0.1, width + 0.2, height), draw_material(rng)),
        Box((0.0, 0.0, height + 0.05), (length, width + 0.2, 0.1), draw_material(rng)),
    ]
    bare = rng.random() < 0.3
    for _ in range(rng.integers(0, 3) if bare else rng.integers(2, 9)):
        parts.append(_picture(rng, x, y, height))
    for _ in range(rng.integers(0, 3) if bare else rng.integers(2, 14)):
        parts += _furniture(rng, rng.uniform(-x, x), rng.uniform(-y, y), height)
    lights = tuple(
        Light((rng.uniform(-x, x), rng.uniform(-y, y), height - 0.1), rng.uniform(0.3, 1.0))
        for _ in range(rng.integers(1, 4))
    )
    return Scene("room", tuple(parts), draw_material(rng), lights, 0.3, (-x, x, -y, y))


def draw_material(rng: np.random.Generator) -> Material:
    """Return a material of any color, plain ones more often than any texture."""
    texture = "plain" if rng.random() < 0.4 else TEXTURES[rng.integers(len(TEXTURES))]
    return Material(draw_color(rng), 0.1, texture)


def draw_color(rng: np.random.Generator, vivid: float = 1.0) -> Color:
    """Return a color, sRGB in [0, 1]; the saturation goes up to `vivid`, and pale ones are more frequent."""
    return colorsys.hsv_to_rgb(rng.random(), vivid * rng.random() ** 1.7, rng.uniform(0.05, 1.0))


def _picture(rng: np.random.Generator, x: float, y: float, height: float) -> Box:
    """Return a flat rectangle on a wall: a door, a window, a poster."""
    broad, high = rng.uniform(0.3, 1.8), rng.uniform(0.3, min(2.1, height))
    z = 0.5 * high if rng.random() < 0.5 else rng.uniform(0.5 * high, height - 0.5 * high)
    side = rng.choice((-1.0, 1.0))
    if rng.random() < 0.5:
        return Box((rng.uniform(-x, x), side * (y - 0.02), z), (broad, 0.04, high), draw_material(rng), solid=False)
    return Box((side * (x - 0.02), rng.uniform(-y, y), z), (0.04, broad, high), draw_material(rng), solid=False)


def _furniture(rng: np.random.Generator, x: float, y: float, height: float) -> list[Box | Cylinder]:
    kind, yaw = rng.integers(6), rng.uniform(0.0, math.pi)
    if kind == 0:  # a chest, a carton, a cupboard
        sizes = rng.uniform((0.2, 0.2, 0.2), (1.4, 0.8, 2.0))
        return [Box((x, y, 0.5 * sizes[2]), (sizes[0], sizes[1], sizes[2]), draw_material(rng), yaw)]
    if kind == 1:  # a table
        broad, deep, top = rng.uniform(0.6, 2.0), rng.uniform(0.5, 1.0), rng.uniform(0.4, 1.0)
        material = draw_material(rng)
        legs = [
            Box((x + s * 0.45 * broad * math.cos(yaw), y + s * 0.45 * broad * math.sin(yaw), 0.5 * top),
                (0.05, 0.9 * deep, top), material, yaw)
            for s in (-1.0, 1.0)
        ]  # fmt: skip
        return [Box((x, y, top), (broad, deep, 0.05), material, yaw), *legs]
    if kind == 2:  # a pillar or a pole
        return [Cylinder((x, y, 0.5 * height), rng.uniform(0.02, 0.3), height, draw_material(rng))]
    if kind == 3:  # a chair
        seat, material = rng.uniform(0.38, 0.5), draw_material(rng)
        back = (x - 0.2 * math.sin(yaw), y + 0.2 * math.cos(yaw), seat + 0.3)
        return [
            Box((x, y, seat), (0.45, 0.45, 0.07), material, yaw),
            Box(back, (0.45, 0.05, 0.5), material, yaw),
            Cylinder((x, y, 0.5 * seat), rng.uniform(0.02, 0.2), seat, draw_material(rng)),
        ]
    if kind == 4:  # a shelf
        broad, high, material = rng.uniform(0.6, 2.0), rng.uniform(0.8, 2.1), draw_material(rng)
        boards = [Box((x, y, z), (broad, 0.35, 0.03), material, yaw) for z in np.arange(0.1, high, 0.4).tolist()]
        books = Material(draw_color(rng), 0.1, "spines")
        return [*boards, *(Box((x, y, b.center[2] + 0.15), (0.8 * broad, 0.2, 0.26), books, yaw) for b in boards[::2])]
    # a person's rival: slim parts upon each other, as a plant, a coat stand or a floor lamp
    parts: list[Box | Cylinder] = []
    z = 0.0
    for _ in range(rng.integers(2, 4)):
        high, radius = rng.uniform(0.2, 0.9), rng.uniform(0.05, 0.3)
        material = draw_material(rng)
        parts.append(
            Cylinder((x, y, z + 0.5 * high), radius, high, material)
            if rng.random() < 0.6
            else Box((x, y, z + 0.5 * high), (2.0 * radius, radius, high), material, yaw)
        )
        z += high
    return parts


def _recolored(scene: Scene, rng: np.random.Generator) -> Scene:
    """Return the scene with each of its materials half-way, at most, to a color of chance."""
    changed: dict[Material, Material] = {}

    def other(material: Material) -> Material:
        if material not in changed:
            share, aim = 0.5 * rng.random(), draw_color(rng)
            red, green, blue = (c + share * (a - c) for c, a in zip(material.color, aim, strict=True))
            changed[material] = dataclasses.replace(material, color=(red, green, blue))
        return changed[material]

    parts = tuple(dataclasses.replace(part, material=other(part.material)) for part in scene.primitives)
    return dataclasses.replace(scene, primitives=parts, floor=other(scene.floor))
