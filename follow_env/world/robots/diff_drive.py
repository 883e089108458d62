"""`DiffDrive`: body twist <-> wheel speeds, limits and the modeled response of the wheels.

Robot frame: x forward, y left, origin at the middle of the axle (REP-103).
"""

import math

from follow_env.config import RobotConfig


class DiffDrive:
    """Kinematics and limits of the differential drive (paper B, eqs. (33)-(34)).

    The print's signs are for an angle that is positive to the right; here omega is positive counter-clockwise, so
    v_l = v - omega d_r / 2 and v_r = v + omega d_r / 2.
    """

    def __init__(self, config: RobotConfig) -> None:
        self.config = config

    def wheels(self, v: float, omega: float) -> tuple[float, float]:
        """Return rim speeds (left, right) in m/s of the twist (v in m/s, omega in rad/s)."""
        half = 0.5 * self.config.track_width * omega
        return v - half, v + half

    def twist(self, left: float, right: float) -> tuple[float, float]:
        """Return the twist (v, omega) of the rim speeds (left, right)."""
        return 0.5 * (left + right), (right - left) / self.config.track_width

    def limit(self, left: float, right: float, last: tuple[float, float], dt: float) -> tuple[float, float]:
        """Return the rim-speed command after the wheels' limits.

        Speeds above the limit are scaled together, which keeps the curvature; then each wheel's command moves from
        `last` by at most max_wheel_acceleration * dt.
        """
        top = max(abs(left), abs(right))
        if top > self.config.max_wheel_speed:
            left, right = left * self.config.max_wheel_speed / top, right * self.config.max_wheel_speed / top
        step = self.config.max_wheel_acceleration * dt
        return (
            min(max(left, last[0] - step), last[0] + step),
            min(max(right, last[1] - step), last[1] + step),
        )

    def servo_gain(self, dt: float) -> float:
        """Share of the speed error that a wheel closes in one physics step dt: 1 - exp(-dt / tau)."""
        return 1.0 - math.exp(-dt / self.config.wheel_time_constant)


def advance(pose: tuple[float, float, float], v: float, omega: float, dt: float) -> tuple[float, float, float]:
    """Return the pose (x, y, yaw) after moving with a constant twist for dt: the exact arc."""
    x, y, yaw = pose
    turn = omega * dt
    chord = v * dt if abs(turn) < 1e-9 else v * dt * math.sin(0.5 * turn) / (0.5 * turn)
    return x + chord * math.cos(yaw + 0.5 * turn), y + chord * math.sin(yaw + 0.5 * turn), yaw + turn
