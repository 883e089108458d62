"""The RGB-D camera: `PinholeCamera`, `RGBDFrame`, the `Renderer` interface and the depth sensor's errors."""

from collections.abc import Callable, Sequence
from typing import Protocol

from follow_env.camera.frame import RGBDFrame
from follow_env.camera.pinhole import CameraPose, PinholeCamera
from follow_env.registry import Registry
from follow_env.world.people.mesh import Placed
from follow_env.world.scene import Scene

__all__ = ["RENDERERS", "CameraPose", "PinholeCamera", "RGBDFrame", "Renderer", "make_renderer"]


class Renderer(Protocol):
    """Draws a scene and the people in it from a camera pose."""

    def render(self, camera: CameraPose, people: Sequence[Placed] = ()) -> RGBDFrame:
        """Return the frame that the camera sees, without sensor errors."""

    def close(self) -> None:
        """Free what the renderer holds; a second call does nothing."""


RENDERERS: Registry[Callable[[Scene, PinholeCamera], Renderer]] = Registry("renderer")
"""Functions (scene, camera) that make a `Renderer`, or say in one sentence what this machine lacks."""


@RENDERERS.register("raster")
def _raster(scene: Scene, camera: PinholeCamera) -> Renderer:
    from follow_env.camera.raster.renderer import RasterRenderer

    return RasterRenderer(scene, camera)


@RENDERERS.register("tiny")
def _tiny(scene: Scene, camera: PinholeCamera) -> Renderer:
    from follow_env.camera.tiny import TinyRenderer

    return TinyRenderer(scene, camera)


@RENDERERS.register("opengl")
def _opengl(scene: Scene, camera: PinholeCamera) -> Renderer:
    from follow_env.camera.opengl.renderer import OpenGLRenderer

    return OpenGLRenderer(scene, camera)


def make_renderer(name: str, scene: Scene, camera: PinholeCamera) -> Renderer:
    """Return the renderer `name`; a ValueError names the nearest when there is none, or what this machine lacks."""
    return RENDERERS.get(name)(scene, camera)
