"""`DiffDrive`: body twist <-> wheel speeds, limits and the modeled response of the wheels.

Robot frame: x forward, y left, origin at the middle of the axle (REP-103).
"""

import math

from follow_env.config import RobotConfig

SATURATED = 1e-9
"""A command that the limits moved by more than this counts as saturated, m/s."""


def wheel_speeds(v: float, omega: float, track_width: float) -> tuple[float, float]:
    """Return the rim speeds (left, right) of the twist (v, omega); m/s, rad/s and m."""
    half = 0.5 * track_width * omega
    return v - half, v + half


def twist_of(left: float, right: float, track_width: float) -> tuple[float, float]:
    """Return the twist (v, omega) of the rim speeds (left, right); m/s, rad/s and m."""
    return 0.5 * (left + right), (right - left) / track_width


def limited(
    left: float, right: float, last_left: float, last_right: float, max_speed: float, max_change: float
) -> tuple[float, float]:
    """Return the rim-speed command after the wheels' limits, m/s.

    Speeds above `max_speed` are scaled together, which keeps the curvature; then each wheel's command moves from the
    last one by at most `max_change`.
    """
    top = max(abs(left), abs(right))
    if top > max_speed:
        left, right = left * max_speed / top, right * max_speed / top
    return (
        min(max(left, last_left - max_change), last_left + max_change),
        min(max(right, last_right - max_change), last_right + max_change),
    )


def is_saturated(left: float, right: float, command_left: float, command_right: float) -> bool:
    """Whether the limits changed the rim speeds that were asked for."""
    return max(abs(command_left - left), abs(command_right - right)) > SATURATED


class DiffDrive:
    """Kinematics and limits of the differential drive (paper B, eqs. (33)-(34)).

    The print's signs are for an angle that is positive to the right; here omega is positive counter-clockwise, so
    v_l = v - omega d_r / 2 and v_r = v + omega d_r / 2.
    """

    def __init__(self, config: RobotConfig) -> None:
        self.config = config

    def wheels(self, v: float, omega: float) -> tuple[float, float]:
        """Return rim speeds (left, right) in m/s of the twist (v in m/s, omega in rad/s)."""
        return wheel_speeds(v, omega, self.config.track_width)

    def twist(self, left: float, right: float) -> tuple[float, float]:
        """Return the twist (v, omega) of the rim speeds (left, right)."""
        return twist_of(left, right, self.config.track_width)

    def limit(self, left: float, right: float, last: tuple[float, float], dt: float) -> tuple[float, float]:
        """Return the rim-speed command dt after the command `last`, within the wheels' limits: `limited`."""
        config = self.config
        return limited(left, right, *last, config.max_wheel_speed, config.max_wheel_acceleration * dt)

    def servo_gain(self, dt: float) -> float:
        """Share of the speed error that a wheel closes in one physics step dt: 1 - exp(-dt / tau)."""
        return 1.0 - math.exp(-dt / self.config.wheel_time_constant)


def advance(pose: tuple[float, float, float], v: float, omega: float, dt: float) -> tuple[float, float, float]:
    """Return the pose (x, y, yaw) after moving with a constant twist for dt: the exact arc."""
    x, y, yaw = pose
    turn = omega * dt
    chord = v * dt if abs(turn) < 1e-9 else v * dt * math.sin(0.5 * turn) / (0.5 * turn)
    return x + chord * math.cos(yaw + 0.5 * turn), y + chord * math.sin(yaw + 0.5 * turn), yaw + turn
