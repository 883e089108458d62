"""The RGB-D camera: `PinholeCamera`, `RGBDFrame`, the `Renderer` interface and the depth sensor's errors."""

from typing import Protocol

from follow_env.camera.frame import RGBDFrame
from follow_env.camera.pinhole import CameraPose, PinholeCamera
from follow_env.config import choose
from follow_env.person.gait import SegmentPose
from follow_env.scene import Scene

__all__ = ["RENDERERS", "CameraPose", "PinholeCamera", "RGBDFrame", "Renderer", "make_renderer"]

RENDERERS = ("tiny",)


class Renderer(Protocol):
    """Draws a scene and a person from a camera pose."""

    def render(self, camera: CameraPose, person: list[SegmentPose]) -> RGBDFrame:
        """Return the frame that the camera sees, without sensor errors."""

    def dress(self, clothes: str) -> None:
        """Give the person these clothes, a key of `follow_env.person.body.CLOTHES`."""

    def close(self) -> None:
        """Free what the renderer holds; a second call does nothing."""


def make_renderer(name: str, scene: Scene, camera: PinholeCamera, clothes: str) -> Renderer:
    """Return the renderer `name`; a ValueError names the nearest when there is none."""
    choose("renderer", name, RENDERERS)
    from follow_env.camera.tiny import TinyRenderer

    return TinyRenderer(scene, camera, clothes)
