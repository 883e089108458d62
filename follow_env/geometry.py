"""Pinhole geometry between pixels, depth and the robot's (bearing, distance): paper B, eqs. (24)-(31).

Frames: the camera looks along +z with x to the right and y down; paper B's "world" frame is parallel to it with its
origin in the robot (here: the axle midpoint), so x_w right, y_w down, z_w forward. Bearings follow REP-103, positive to
the left: `bearing = -theta_paper`.

Pixels: u runs to the right and v down, counted from the picture's upper left *corner*; the pixel in column i and row j
covers [i, i+1) x [j, j+1), its center is (i + 0.5, j + 0.5), and the middle of the picture is (width/2, height/2).
Resizing a picture therefore scales all its intrinsics alike.
"""

from __future__ import annotations

import math
from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Intrinsics:
    """Pinhole intrinsics without distortion, all in pixels.

    Attributes:
        fx: Focal length along u.
        fy: Focal length along v.
        cx: Principal point's u (u0 in the paper).
        cy: Principal point's v (v0 in the paper).
        width: Picture width.
        height: Picture height.

    Raises:
        ValueError: If a size or focal length is not positive, or the principal point not finite.
    """

    fx: float
    fy: float
    cx: float
    cy: float
    width: int
    height: int

    def __post_init__(self) -> None:
        if not (0.0 < self.fx < math.inf and 0.0 < self.fy < math.inf):
            raise ValueError(f"focal lengths are ({self.fx}, {self.fy}) pixels, expected positive finite numbers.")
        if self.width < 1 or self.height < 1:
            raise ValueError(f"picture size is {self.width}x{self.height}, expected at least one pixel each way.")
        if not (math.isfinite(self.cx) and math.isfinite(self.cy)):
            raise ValueError(f"principal point is ({self.cx}, {self.cy}), expected finite pixel coordinates.")

    @classmethod
    def from_hfov(cls, width: int, height: int, hfov: float) -> Intrinsics:
        """Build intrinsics of square pixels, centered, from the horizontal field of view: fx = (width/2) / tan(hfov/2).

        Args:
            width: Picture width, pixels.
            height: Picture height, pixels.
            hfov: Horizontal field of view, rad, in (0, pi).

        Raises:
            ValueError: If the field of view lies outside (0, pi) or the size is not positive.
        """
        if not 0.0 < hfov < math.pi:
            raise ValueError(f"horizontal field of view is {hfov} rad, expected one in (0, pi); give radians.")
        focal_length = width / 2.0 / math.tan(hfov / 2.0)
        return cls(focal_length, focal_length, width / 2.0, height / 2.0, width, height)

    @property
    def hfov(self) -> float:
        """Horizontal field of view, rad."""
        return math.atan2(self.cx, self.fx) + math.atan2(self.width - self.cx, self.fx)

    def scaled(self, width: int, height: int) -> Intrinsics:
        """Return the intrinsics of the same picture resized (or binned) to width x height pixels."""
        across, down = width / self.width, height / self.height
        return Intrinsics(self.fx * across, self.fy * down, self.cx * across, self.cy * down, width, height)


XTION_PRO = Intrinsics.from_hfov(640, 480, math.radians(57.5))
"""Asus Xtion Pro of paper B by its stated field of view, fx = 583.3 px; `scaled(320, 240)` is its binning."""

DONG_2018 = Intrinsics(271.33, 271.33, 160.0, 120.0, 320, 240)
"""Paper B's calibrated f = 271.33 px, which belongs to 320x240 (61.05 deg); at 640x480 it would mean 99.4 deg."""


@dataclass(frozen=True, slots=True)
class CameraMount:
    """Where the camera sits on the robot, axes parallel (R = I and T = [0, T_Y, T_Z] of eq. (26)).

    Attributes:
        forward: Camera ahead of the axle midpoint, m; T_Z = -forward.
        height: Camera above the robot frame's origin, m; T_Y = height.

    Raises:
        ValueError: If an offset is not finite.
    """

    forward: float
    height: float

    def __post_init__(self) -> None:
        if not (math.isfinite(self.forward) and math.isfinite(self.height)):
            raise ValueError(f"camera mount is ({self.forward}, {self.height}) m, expected finite offsets.")


CAMERA_FRAME = CameraMount(forward=0.0, height=0.0)
"""Mount at the origin: points are then in the camera's own frame."""


def project(
    point: tuple[float, float, float], intrinsics: Intrinsics, mount: CameraMount = CAMERA_FRAME
) -> tuple[float, float]:
    """Return the pixel (u, v) of a point (x right, y down, z forward; m), eqs. (24)-(26), be it in the picture or not.

    Raises:
        ValueError: If the point is not in front of the camera.
    """
    x, y, z = point
    x_c, y_c, z_c = x, y + mount.height, z - mount.forward
    _check_depth(z_c)
    return intrinsics.cx + intrinsics.fx * x_c / z_c, intrinsics.cy + intrinsics.fy * y_c / z_c


def back_project(
    u: float, v: float, z_c: float, intrinsics: Intrinsics, mount: CameraMount = CAMERA_FRAME
) -> tuple[float, float, float]:
    """Return the point (x_w right, y_w down, z_w forward; m) seen at pixel (u, v) with depth z_c (m), eqs. (27)-(29).

    Raises:
        ValueError: If the depth is not positive and finite.
    """
    _check_depth(z_c)
    x_w = z_c * (u - intrinsics.cx) / intrinsics.fx
    y_w = z_c * (v - intrinsics.cy) / intrinsics.fy - mount.height
    return x_w, y_w, z_c + mount.forward


def bearing_distance(u: float, z_c: float, intrinsics: Intrinsics, camera_forward: float) -> tuple[float, float]:
    """Return (bearing rad, left positive; forward distance m) in the robot frame, eqs. (27), (29)-(31).

    Args:
        u: Pixel column coordinate of the target.
        z_c: Its depth along the optical axis, m.
        intrinsics: Of the picture u belongs to.
        camera_forward: Camera ahead of the axle midpoint, m.

    Raises:
        ValueError: If the depth is not positive and finite.
    """
    _check_depth(z_c)
    x_w = z_c * (u - intrinsics.cx) / intrinsics.fx
    z_w = z_c + camera_forward
    return math.atan2(-x_w, z_w), z_w


def _check_depth(z_c: float) -> None:
    if not 0.0 < z_c < math.inf:
        raise ValueError(
            f"depth before the camera is {z_c} m, expected a positive finite number; drop invalid samples."
        )
