# mypy: disable-error-code="no-untyped-def"
"""The robot's motion: first-order wheels and exact arcs at the physics rate, without slip."""

import math

from numba import njit

from follow_env.world.clock import PHYSICS_HZ

_jit = njit(nogil=True, error_model="numpy")


def kept_speed_error(dt: float, substeps: int, tau: float) -> float:
    """Return the share of a wheel's speed error that is left after one of `substeps` physics steps in dt (s)."""
    return math.exp(-dt / substeps / tau)


@_jit
def roll(x, y, yaw, cosine, sine, left, right, command_left, command_right, decay, substeps, track):
    """Drive for `substeps` physics steps; return pose, rim speeds and the mean twist (what encoders give).

    Each step the wheels close the share 1 - decay of their speed error, as PyBullet's velocity motors do, and the robot
    then moves on an arc with that speed. `cosine` and `sine` are those of `yaw`.
    """
    h = 1.0 / PHYSICS_HZ
    way, turned = 0.0, 0.0
    for _ in range(substeps):
        left = command_left + (left - command_left) * decay
        right = command_right + (right - command_right) * decay
        forward, half = 0.5 * (left + right) * h, 0.5 * (right - left) / track * h
        square = half * half
        # Taylor series of cos, sin and sin / x: half is below 0.1 rad.
        c, shrink = 1.0 - square * (0.5 - square / 24.0), 1.0 - square * (1.0 / 6.0 - square / 120.0)
        s = half * shrink
        cosine, sine = cosine * c - sine * s, sine * c + cosine * s
        x += forward * shrink * cosine
        y += forward * shrink * sine
        cosine, sine = cosine * c - sine * s, sine * c + cosine * s
        way += forward
        turned += 2.0 * half
    period = substeps * h
    yaw += turned
    yaw -= 2.0 * math.pi * math.floor((yaw + math.pi) / (2.0 * math.pi))
    return x, y, yaw, left, right, way / period, turned / period
