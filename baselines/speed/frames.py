"""Frames of one room and one person by each renderer.

All draw the same walk: the camera follows the person at 1.5 m. Lights, textures and ids are on, sensor errors are not
part of a frame. The person's mesh is the same, triangle for triangle. `skinned` bends it anew for each frame and counts
that; `rigid` moves it as it is, which is all that PyBullet's TinyRenderer can do.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from baselines.speed.timing import Cost, measure
from follow_env.camera import RENDERERS, CameraPose, PinholeCamera, Renderer, make_renderer
from follow_env.config import CameraConfig
from follow_env.world.people.bodies import load_body
from follow_env.world.people.mesh import Placed
from follow_env.world.people.walker import Walker
from follow_env.world.scenes import make_scene

SCENE = "indoor"
PEER = "tiny"
MOMENTS = 50
SPEED = 0.9
"""Of the person, m/s."""


@dataclass(frozen=True)
class FrameCost:
    """Cost of a frame.

    Attributes:
        renderer: Name of the renderer.
        person: `skinned` or `rigid`.
        width, height: Size of the picture, px.
        cost: Of a frame, s.
        peer_cost: Of a frame of the same size by TinyRenderer in the same run, s.
    """

    renderer: str
    person: str
    width: int
    height: int
    cost: Cost
    peer_cost: Cost


def measure_frames(width: int, height: int, count: int) -> tuple[list[FrameCost], dict[str, str]]:
    """Return the cost of frames of this size (px) by every renderer, and why the others cannot draw here."""
    renderers, unavailable = _renderers(width, height)
    operations = {
        (name, person): drawing(renderer, person)
        for name, renderer in renderers.items()
        for person in (("rigid",) if name == PEER else ("skinned", "rigid"))
    }
    costs = measure({" ".join(key): operation for key, operation in operations.items()}, count)
    for renderer in renderers.values():
        renderer.close()
    peer = costs[f"{PEER} rigid"]
    return [FrameCost(*key, width, height, costs[" ".join(key)], peer) for key in operations], unavailable


def make(name: str, width: int, height: int) -> Renderer:
    """Return a renderer of the room; a ValueError says why there is none."""
    return make_renderer(name, make_scene(SCENE), PinholeCamera(CameraConfig(width=width, height=height)))


def drawing(renderer: Renderer, person: str) -> Callable[[], object]:
    """Return a function that draws the walk's next frame, the person `skinned` or `rigid`."""
    walker = Walker(load_body())
    stiff = walker.place(0.0, 0.0, 0.0, 0.3, SPEED)
    moments = itertools.cycle(range(MOMENTS))

    def draw() -> None:
        k = next(moments)
        walked, y = 0.15 * k, 0.2 * math.sin(0.3 * k)
        if person == "skinned":
            placed = walker.place(1.6 + walked, y, 0.0, walked, SPEED)
        else:
            shift = np.array((1.6 + walked, y, 0.0), np.float32)
            placed = Placed(stiff.mesh, stiff.vertices + shift, stiff.normals, stiff.id, (1.6 + walked, y, 0.0))
        renderer.render(CameraPose(0.1 + walked, 0.0, 1.0, 0.1 * math.sin(0.2 * k)), (placed,))

    return draw


def _renderers(width: int, height: int) -> tuple[dict[str, Renderer], dict[str, str]]:
    renderers: dict[str, Renderer] = {}
    unavailable: dict[str, str] = {}
    for name in RENDERERS:
        try:
            renderers[name] = make(name, width, height)
        except ValueError as error:
            unavailable[name] = str(error)
    return renderers, unavailable
