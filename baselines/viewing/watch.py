"""`follow watch`: an episode as a video and a contact sheet.

The video shows what the follower believes beside the truth, or, in any size, the robot's view alone.
"""

from __future__ import annotations

import contextlib
import dataclasses
import math
from pathlib import Path

import cv2
import numpy as np

from baselines.benchmark.build import policy_of, settings_of, title_of
from baselines.benchmark.cells import Cell
from baselines.benchmark.trial import Trial
from baselines.followers.tracking_follower import TrackingState
from baselines.viewing.video import VideoWriter
from follow_env.camera import PinholeCamera, Renderer, make_renderer
from follow_env.config import CameraConfig
from follow_env.envs.dashboard import Dashboard
from follow_env.envs.follow import FollowEnv
from follow_env.world.scene import Scene

CAMERA = (320, 240)
SHEET_PICTURES, SHEET_WIDTH = 4, 720


def watch(
    played: Cell | Trial,
    seed: int,
    video: Path,
    camera: tuple[int, int] = CAMERA,
    renderer: str = "raster",
    size: tuple[int, int] | None = None,
    shadows: bool = False,
) -> str:
    """Play an episode, write a video and a contact sheet, and return a summary.

    Args:
        played: perception, scene and estimator, or a follower in a scenario.
        seed: of the episode.
        video: the MP4 file; the sheet is the PNG of the same name.
        camera: width and height of the robot's picture, px.
        renderer: who draws the pictures.
        size: width and height of a video of the robot's view alone, px; None = the dashboard. The episode is the same.
        shadows: whether the lamps cast shadows in that view; only with the renderer `"opengl"`.

    Raises:
        ValueError: if the video cannot be written, or the renderer cannot draw it.
    """
    if video.suffix != ".mp4":
        raise ValueError(f"--video is {str(video)!r}; expected a name that ends in .mp4")
    sheet = video.with_suffix(".png")
    if not video.parent.is_dir():
        raise ValueError(f"the folder {video.parent} of --video does not exist; make it first or name another")
    if shadows and (renderer != "opengl" or size is None):
        raise ValueError("--shadows needs --renderer opengl and --size, for example --size 1280x720")
    if size is not None and any(side % 2 for side in size):
        raise ValueError(f"--size is {size[0]}x{size[1]}; expected even numbers, which MPEG-4 wants")
    picture_size = {"width": camera[0], "height": camera[1]}
    env = FollowEnv(**{**settings_of(played, picture_size), "renderer": renderer})
    view = None if size is None else _make_view(renderer, env.scene, env.camera.config, size, shadows)
    title = title_of(played)
    dashboard = Dashboard(env.scene, env.camera, env.config.robot.camera_forward, title)
    policy, state = policy_of(played, env, picture_size), None
    observation, info = env.reset(seed=seed)
    if not env.domain.is_fixed:
        policy = policy_of(played, env, picture_size)  # the episode has drawn the robot, the sensor, ...
    small: list[np.ndarray] = []
    with contextlib.ExitStack() as parts:
        writer = parts.enter_context(VideoWriter(video, round(1.0 / env.dt)))
        for part in (env, view):
            if part is not None:
                parts.callback(part.close)
        ended = False
        while True:
            action, state = policy.predict(observation, state)
            if view is None:
                seen = env.observed or env.frame()
                box = tuple(observation["box"].tolist()) if env.config.obs == "rgbd_box" else seen.person_box()
                if isinstance(state, TrackingState) and state.track is not None:
                    box, dashboard.title = state.track.box, f"{title}: {state.track.state}"
                told = getattr(state, "estimate", None)
                estimate = None if told is None else (told.bearing, told.distance)
                dashboard.update(info, seen, box, estimate)
                picture = dashboard.image()
            else:
                picture = view.render(env.camera_pose(), env.people()).rgb
            writer.write(picture)
            small.append(_shrunk(picture))
            if ended:
                break
            observation, _, terminated, truncated, info = env.step(action)
            ended = terminated or truncated
    if not cv2.imwrite(str(sheet), _contact_sheet(small)[:, :, ::-1]):
        raise ValueError(f"the contact sheet {sheet} cannot be written; check the folder's permissions")
    reason = "collision" if info["collision"] else "person lost" if terminated else "the route's end"
    success = "yes" if info["is_success"] else "no"
    return (
        f"{len(small)} frames, {info['time']:.1f} s, ended by {reason}, success {success}\n"
        f"{video} ({video.stat().st_size / 1e6:.1f} MB) and {sheet}"
    )


def _make_view(name: str, scene: Scene, camera: CameraConfig, size: tuple[int, int], shadows: bool) -> Renderer:
    """Return the robot's camera in another size, with smooth edges where the renderer can draw them."""
    supersample = 1 if name == "tiny" else 2
    larger = PinholeCamera(dataclasses.replace(camera, width=size[0], height=size[1], supersample=supersample))
    if not shadows:
        return make_renderer(name, scene, larger)
    from follow_env.camera.opengl.renderer import OpenGLRenderer

    return OpenGLRenderer(scene, larger, shadows=True)


def _shrunk(picture: np.ndarray) -> np.ndarray:
    height = round(SHEET_WIDTH * picture.shape[0] / picture.shape[1])
    return cv2.resize(picture, (SHEET_WIDTH, height), interpolation=cv2.INTER_AREA)


def _contact_sheet(pictures: list[np.ndarray]) -> np.ndarray:
    """Return evenly spaced pictures in two columns."""
    chosen = [pictures[round(i * (len(pictures) - 1) / (SHEET_PICTURES - 1))] for i in range(SHEET_PICTURES)]
    rows = math.ceil(len(chosen) / 2)
    return np.vstack([np.hstack(chosen[2 * r : 2 * r + 2]) for r in range(rows)])
