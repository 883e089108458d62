"""`follow watch`: an episode as a video and a contact sheet, with what the follower believes drawn beside the truth."""

from __future__ import annotations

import math
from pathlib import Path

import cv2
import numpy as np

from baselines.benchmark.assembly import driver, environment_kwargs
from baselines.benchmark.cells import Cell
from follow_env.env import FollowEnv
from follow_env.view import Dashboard

CAMERA = (320, 240)
SHEET_PICTURES = 4
CODEC = "mp4v"
"""MPEG-4 part 2: the one MP4 codec that every OpenCV wheel can write quickly."""


def watch(cell: Cell, seed: int, video: Path, camera: tuple[int, int] = CAMERA) -> str:
    """Play an episode, write a video and a contact sheet, and return a summary.

    Args:
        cell: perception, scene and estimator.
        seed: of the episode.
        video: the MP4 file; the sheet is the PNG of the same name.
        camera: width and height of the robot's picture, px.

    Raises:
        ValueError: if the video cannot be written.
    """
    if video.suffix != ".mp4":
        raise ValueError(f"--video is {str(video)!r}; expected a name that ends in .mp4")
    sheet = video.with_suffix(".png")
    if not video.parent.is_dir():
        raise ValueError(f"the folder {video.parent} of --video does not exist; make it first or name another")
    size = {"width": camera[0], "height": camera[1]}
    env = FollowEnv(**{**environment_kwargs(cell), "camera": size})
    dashboard = Dashboard(
        env.scene,
        env.camera,
        env.robot_config.camera_forward,
        f"{cell.scene}, {cell.perception}, {cell.estimator} + PI",
    )
    policy, state = driver(cell, size), None
    observation, info = env.reset(seed=seed)
    pictures: list[np.ndarray] = []
    writer = _Writer(video, round(1.0 / env.dt))
    try:
        ended = False
        while True:
            action, state = policy.predict(observation, state)
            seen = env.observed or env.frame()
            box = tuple(observation["box"].tolist()) if cell.perception == "mask" else seen.person_box()
            estimate = None if state.estimate is None else (state.estimate.bearing, state.estimate.distance)
            dashboard.update(info, seen, box, estimate)
            pictures.append(dashboard.image())
            writer.write(pictures[-1])
            if ended:
                break
            observation, _, terminated, truncated, info = env.step(action)
            ended = terminated or truncated
    finally:
        writer.close()
        env.close()
    if not cv2.imwrite(str(sheet), _contact_sheet(pictures)[:, :, ::-1]):
        raise ValueError(f"the contact sheet {sheet} cannot be written; check the folder's permissions")
    reason = "collision" if info["collision"] else "person lost" if terminated else "the route's end"
    success = "yes" if info["is_success"] else "no"
    return (
        f"{len(pictures)} frames, {info['time']:.1f} s, ended by {reason}, success {success}\n"
        f"{video} ({video.stat().st_size / 1e6:.1f} MB) and {sheet}"
    )


class _Writer:
    """An MP4 file, opened with the first picture."""

    def __init__(self, path: Path, rate: int) -> None:
        self._path, self._rate = path, rate
        self._video: cv2.VideoWriter | None = None

    def write(self, image: np.ndarray) -> None:
        """Append a picture (H, W, 3) uint8 RGB."""
        if self._video is None:
            self._video = self._open((image.shape[1], image.shape[0]))
        self._video.write(image[:, :, ::-1])

    def close(self) -> None:
        """Finish the file."""
        if self._video is not None:
            self._video.release()

    def _open(self, size: tuple[int, int]) -> cv2.VideoWriter:
        video = cv2.VideoWriter(str(self._path), cv2.VideoWriter.fourcc(*CODEC), self._rate, size)
        if video.isOpened():
            return video
        raise ValueError(f"the video {self._path} cannot be written; check the folder's permissions")


def _contact_sheet(pictures: list[np.ndarray]) -> np.ndarray:
    """Return evenly spaced pictures at half size, two columns."""
    chosen = [pictures[round(i * (len(pictures) - 1) / (SHEET_PICTURES - 1))] for i in range(SHEET_PICTURES)]
    half = [cv2.resize(p, None, fx=0.75, fy=0.75, interpolation=cv2.INTER_AREA) for p in chosen]
    rows = math.ceil(len(half) / 2)
    return np.vstack([np.hstack(half[2 * r : 2 * r + 2]) for r in range(rows)])
