"""The places: functions that return a `Scene`."""

from collections.abc import Callable

from follow_env.config import choose
from follow_env.scene import Scene
from follow_env.scenes.corridor import corridor
from follow_env.scenes.indoor import indoor

SCENES: dict[str, Callable[[], Scene]] = {"corridor": corridor, "indoor": indoor}
"""Scene name -> function that builds it."""


def make_scene(name: str) -> Scene:
    """Return the scene `name`; a ValueError names the nearest when there is none."""
    return SCENES[choose("scene", name, SCENES)]()
