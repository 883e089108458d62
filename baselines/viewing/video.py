"""`VideoWriter`: pictures into an MP4 file."""

from __future__ import annotations

from pathlib import Path
from types import TracebackType

import cv2
import numpy as np

CODEC = "mp4v"
"""MPEG-4 part 2: the one MP4 codec that every OpenCV wheel can write quickly."""


class VideoWriter:
    """An MP4 file, opened with the first picture; a context that finishes the file.

    Args:
        path: Of the file.
        rate: Frames/s.
    """

    def __init__(self, path: Path, rate: float) -> None:
        self._path, self._rate = path, rate
        self._video: cv2.VideoWriter | None = None

    def __enter__(self) -> VideoWriter:
        """Return the writer."""
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Finish the file."""
        if self._video is not None:
            self._video.release()

    def write(self, image: np.ndarray) -> None:
        """Append a picture (H, W, 3) uint8 RGB.

        Raises:
            ValueError: If the file cannot be written.
        """
        if self._video is None:
            self._video = self._open((image.shape[1], image.shape[0]))
        self._video.write(np.ascontiguousarray(image[:, :, ::-1]))

    def _open(self, size: tuple[int, int]) -> cv2.VideoWriter:
        video = cv2.VideoWriter(str(self._path), cv2.VideoWriter.fourcc(*CODEC), self._rate, size)
        if video.isOpened():
            return video
        raise ValueError(f"the video {self._path} cannot be written; check the folder's permissions")
