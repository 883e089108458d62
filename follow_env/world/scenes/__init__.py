"""The places: functions that return a `Scene`, each registered in its own file, and the light they are seen in."""

import dataclasses
import itertools
from collections.abc import Callable
from typing import Any

from follow_env.registry import Registry
from follow_env.world.scene import Light, Scene

SCENES: Registry[Callable[..., Scene]] = Registry("scene", __name__)
"""Functions that build a scene."""
LIGHTS: Registry[tuple[float, tuple[float, ...]]] = Registry("light")
"""What is left of the ambient light, and of the lamps in turn, as shares of the scene's own."""
LIGHTS.register("normal")((1.0, (1.0,)))
LIGHTS.register("dim")((0.15, (0.15,)))
LIGHTS.register("uneven")((0.3, (1.2, 0.1)))


def make_scene(scene: Any, light: str = "normal") -> Scene:
    """Return a scene in a light.

    Args:
        scene: a registered name, `"module:object"`, a mapping `{"name": ..., **settings}`, or a `Scene`.
        light: a registered name.

    Raises:
        ValueError: for an unknown name (the nearest is named), or what is no scene.
    """
    made = SCENES.build(scene)
    if not isinstance(made, Scene):
        raise ValueError(f"scene is {scene!r}; expected a Scene, or one of {', '.join(map(repr, SCENES))}")
    ambient, shares = LIGHTS.get(light)
    lamps = tuple(
        Light(lamp.position, share * lamp.intensity)
        for lamp, share in zip(made.lights, itertools.cycle(shares), strict=False)
    )
    return dataclasses.replace(made, ambient=ambient * made.ambient, lights=lamps)
