"""`PinholeCamera`: intrinsics, and the camera's pose on the robot.

Picture coordinates (u, v) in px from the upper left corner; pixel (i, j) has its center at (j + 0.5, i + 0.5), the
principal point is the middle of the picture. Optical frame: x right, y down, z forward.
"""

import math
from dataclasses import dataclass

from follow_env.config import CameraConfig


@dataclass(frozen=True)
class CameraPose:
    """A level camera: position of the optical center (m) and yaw of its optical axis (rad), world frame."""

    x: float
    y: float
    z: float
    yaw: float


class PinholeCamera:
    """Intrinsics of `config`: square pixels, focal length (W / 2) / tan(HFOV / 2)."""

    def __init__(self, config: CameraConfig) -> None:
        self.config = config
        self.width, self.height = config.width, config.height
        self.hfov = math.radians(config.hfov_deg)
        self.focal = 0.5 * config.width / math.tan(0.5 * self.hfov)
        self.cx, self.cy = 0.5 * config.width, 0.5 * config.height

    def project(self, pose: CameraPose, point: tuple[float, float, float]) -> tuple[float, float, float]:
        """Return (u, v, z) of a world point: picture coordinates in px and depth along the optical axis in m."""
        dx, dy, dz = point[0] - pose.x, point[1] - pose.y, point[2] - pose.z
        cosine, sine = math.cos(pose.yaw), math.sin(pose.yaw)
        z, left = cosine * dx + sine * dy, -sine * dx + cosine * dy
        if z <= 0.0:
            raise ValueError(f"the point {point!r} lies behind the camera (depth {z:.3f} m); expected depth > 0")
        return self.cx - self.focal * left / z, self.cy - self.focal * dz / z, z

    def view_matrix(self, pose: CameraPose) -> list[float]:
        """Return the OpenGL view matrix (column-major, 16 numbers)."""
        c, s = math.cos(pose.yaw), math.sin(pose.yaw)
        rows = (
            (s, -c, 0.0, -(s * pose.x - c * pose.y)),
            (0.0, 0.0, 1.0, -pose.z),
            (-c, -s, 0.0, c * pose.x + s * pose.y),
            (0.0, 0.0, 0.0, 1.0),
        )
        return [rows[i][j] for j in range(4) for i in range(4)]

    def projection_matrix(self) -> list[float]:
        """Return the OpenGL projection matrix (column-major, 16 numbers)."""
        near, far = self.config.near, self.config.far
        return [
            2.0 * self.focal / self.width, 0.0, 0.0, 0.0,
            0.0, 2.0 * self.focal / self.height, 0.0, 0.0,
            0.0, 0.0, -(far + near) / (far - near), -1.0,
            0.0, 0.0, -2.0 * far * near / (far - near), 0.0,
        ]  # fmt: skip
