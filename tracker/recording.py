"""`Recording`: a folder of color and depth pictures that somebody recorded, read frame by frame.

Layout of the folder::

    camera.json     {"width": 640, "height": 480, "fx": 525.0, "fy": 525.0, "cx": 319.5, "cy": 239.5, "fps": 30,
                     "depth_scale": 0.001, "mounting": {"forward": 0.1, "height": 1.0}}
    color/ or rgb/  PNG or JPEG pictures
    depth/          16-bit PNG pictures, registered to the color pictures and equally large; 0 = no reading

Widths, focal lengths and the principal point are px, `depth_scale` is meters per unit of the depth pictures (0.001 when
absent: millimeters) and `mounting` places the camera on the robot (at the origin when absent), m. Pictures make a pair
if they have the same name; or, where no names agree and all are times in seconds, if they are nearest in time and no
further apart than half a period; or, where there are equally many of each, by the order of their names.
"""

from __future__ import annotations

import json
import math
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from follow_env.geometry import CAMERA_FRAME, CameraMount, Intrinsics

CAMERA_FILE = "camera.json"
COLOR_FOLDERS = ("color", "rgb")
DEPTH_FOLDER = "depth"
COLOR_SUFFIXES = (".png", ".jpg", ".jpeg")
MILLIMETER = 0.001


class UnreadableFrame(ValueError):
    """A picture of the recording is missing or damaged; the others may be well."""


@dataclass(frozen=True, slots=True)
class Recording:
    """A recording's camera and the files of its frames.

    Attributes:
        folder: Where it is.
        intrinsics: Of color and depth.
        mount: Of the camera on the robot.
        rate: Frames/s.
        depth_scale: Meters per unit of the depth pictures.
        frames: Files (color, depth) of each frame.
    """

    folder: Path
    intrinsics: Intrinsics
    mount: CameraMount
    rate: float
    depth_scale: float
    frames: tuple[tuple[Path, Path], ...]

    @classmethod
    def open(cls, folder: Path) -> Recording:
        """Read the camera file and pair the pictures.

        Raises:
            ValueError: If a folder or the camera file is missing or not as described above.
        """
        if not folder.is_dir():
            raise ValueError(f"the recording {folder} is not a folder; name one with {CAMERA_FILE}, color and depth.")
        color_folder = next((folder / name for name in COLOR_FOLDERS if (folder / name).is_dir()), None)
        depth_folder = folder / DEPTH_FOLDER
        if color_folder is None or not depth_folder.is_dir():
            raise ValueError(
                f"the recording {folder} holds no folders color (or rgb) and depth; expected one of pictures for each."
            )
        settings = _camera_settings(folder / CAMERA_FILE)
        color = sorted(path for path in color_folder.iterdir() if path.suffix.lower() in COLOR_SUFFIXES)
        depth = sorted(path for path in depth_folder.iterdir() if path.suffix.lower() == ".png")
        for where, files, kind in ((color_folder, color, "PNG or JPEG"), (depth_folder, depth, "16-bit PNG")):
            if not files:
                raise ValueError(f"{where} holds no picture; expected {kind} files.")
        rate = _number(settings, "fps")
        return cls(
            folder,
            _intrinsics(settings),
            _mount(settings.get("mounting")),
            rate,
            _number({"depth_scale": MILLIMETER, **settings}, "depth_scale"),
            _pairs(color, depth, rate),
        )

    def read(self, index: int) -> tuple[NDArray[np.uint8], NDArray[np.float32]]:
        """Return color (H, W, 3) uint8 RGB and depth (H, W) float32 m of a frame.

        Raises:
            UnreadableFrame: If one of the two files cannot be read or decoded.
            ValueError: If a picture is not of the camera's size or the depth not 16-bit.
        """
        color_file, depth_file = self.frames[index]
        color, depth = _decoded(color_file, cv2.IMREAD_COLOR), _decoded(depth_file, cv2.IMREAD_UNCHANGED)
        if depth.ndim != 2 or depth.dtype != np.uint16:
            raise ValueError(f"{depth_file} is not a 16-bit gray picture; expected depth as 16-bit PNG.")
        size = (self.intrinsics.width, self.intrinsics.height)
        if color.shape[:2] != depth.shape:
            raise ValueError(
                f"{color_file} is {_size(color)} but {depth_file} is {_size(depth)}; "
                "expected depth registered to the color picture, equally large."
            )
        if depth.shape[::-1] != size:
            raise ValueError(
                f"{depth_file} is {_size(depth)} but {CAMERA_FILE} is for {size[0]}x{size[1]}; correct it."
            )
        return np.ascontiguousarray(color[:, :, ::-1]), depth.astype(np.float32) * np.float32(self.depth_scale)


def _camera_settings(file: Path) -> dict[str, Any]:
    try:
        settings = json.loads(file.read_text(encoding="utf-8"))
    except FileNotFoundError:
        raise ValueError(
            f"the camera's intrinsics {file} are missing; expected a JSON file with width, height, fx, fy, cx, cy, fps."
        ) from None
    except (OSError, ValueError) as error:
        raise ValueError(f"{file} cannot be read as JSON ({error}); correct it.") from error
    if not isinstance(settings, dict):
        raise ValueError(f"{file} holds {type(settings).__name__}; expected an object with width, height, fx, fy, ....")
    return settings


def _number(settings: dict[str, Any], name: str, positive: bool = True) -> float:
    value = settings.get(name)
    fits = isinstance(value, int | float) and not isinstance(value, bool) and math.isfinite(value)
    if not fits or (positive and value <= 0.0):  # type: ignore[operator]
        found = "missing" if value is None else repr(value)
        raise ValueError(
            f"{name} of {CAMERA_FILE} is {found}; expected a {'positive ' if positive else ''}finite number."
        )
    return float(value)  # type: ignore[arg-type]


def _intrinsics(settings: dict[str, Any]) -> Intrinsics:
    width, height = _number(settings, "width"), _number(settings, "height")
    if width != int(width) or height != int(height):
        raise ValueError(f"width and height of {CAMERA_FILE} are {width} and {height}; expected whole pixels.")
    fx, fy = _number(settings, "fx"), _number(settings, "fy")
    return Intrinsics(fx, fy, _number(settings, "cx", False), _number(settings, "cy", False), int(width), int(height))


def _mount(mounting: Any) -> CameraMount:
    if mounting is None:
        return CAMERA_FRAME
    if not isinstance(mounting, dict) or mounting.keys() != {"forward", "height"}:
        raise ValueError(f'mounting of {CAMERA_FILE} is {mounting!r}; expected {{"forward": m, "height": m}}.')
    return CameraMount(_number(mounting, "forward", False), _number(mounting, "height", False))


def _pairs(color: list[Path], depth: list[Path], rate: float) -> tuple[tuple[Path, Path], ...]:
    if {path.stem for path in color} & {path.stem for path in depth}:
        return tuple((path, depth[0].with_name(f"{path.stem}.png")) for path in color)
    color_times, depth_times = _times(color), _times(depth)
    if color_times is not None and depth_times is not None:
        gaps = np.abs(depth_times - color_times[:, None])
        nearest = gaps.argmin(axis=1)
        near = [
            (path, depth[j]) for i, (path, j) in enumerate(zip(color, nearest, strict=True)) if gaps[i, j] <= 0.5 / rate
        ]
        if near:
            return tuple(near)
    if len(color) == len(depth):
        return tuple(zip(color, depth, strict=True))
    raise ValueError(
        f"{len(color)} color and {len(depth)} depth pictures make no pairs; expected equal names, "
        "names that are times in seconds, or equally many of each."
    )


def _times(files: list[Path]) -> NDArray[np.float64] | None:
    try:
        times = np.array([float(path.stem) for path in files])
    except ValueError:
        return None
    return times if bool(np.isfinite(times).all()) else None


def _decoded(file: Path, flags: int) -> NDArray[Any]:
    try:
        data = file.read_bytes()
    except OSError as error:
        raise UnreadableFrame(f"{file} cannot be read ({error.strerror})") from error
    picture = cv2.imdecode(np.frombuffer(data, np.uint8), flags) if data else None
    if picture is None:
        raise UnreadableFrame(f"{file} is not a whole picture ({len(data)} bytes)")
    return picture


def _size(picture: NDArray[Any]) -> str:
    return f"{picture.shape[1]}x{picture.shape[0]}"
