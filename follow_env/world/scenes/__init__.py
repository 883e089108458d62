"""The places: functions that return a `Scene`, and the light they are seen in."""

import dataclasses
import itertools
from collections.abc import Callable

from follow_env.registry import choose
from follow_env.world.scene import Light, Scene
from follow_env.world.scenes.cabin import cabin
from follow_env.world.scenes.corridor import corridor
from follow_env.world.scenes.indoor import indoor

SCENES: dict[str, Callable[[], Scene]] = {"corridor": corridor, "indoor": indoor, "cabin": cabin}
"""Scene name -> function that builds it."""
LIGHTS: dict[str, tuple[float, tuple[float, ...]]] = {
    "normal": (1.0, (1.0,)),
    "dim": (0.15, (0.15,)),
    "uneven": (0.3, (1.2, 0.1)),
}
"""Name of a light -> what is left of the ambient light, and of the lamps in turn, as shares of the scene's own."""


def make_scene(name: str, light: str = "normal") -> Scene:
    """Return the scene `name` in the light `light`; a ValueError names the nearest when there is none."""
    scene = SCENES[choose("scene", name, SCENES)]()
    ambient, shares = LIGHTS[choose("light", light, LIGHTS)]
    lamps = tuple(
        Light(lamp.position, share * lamp.intensity)
        for lamp, share in zip(scene.lights, itertools.cycle(shares), strict=False)
    )
    return dataclasses.replace(scene, ambient=ambient * scene.ambient, lights=lamps)
