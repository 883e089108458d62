"""The robot's parts as `follow_env.world.bullet` builds them, seen from the axle's middle."""

import math

import numpy as np

from follow_env.config import RobotConfig

HULL = np.dtype(
    [
        (name, np.float64)
        for name in (
            *("half_track", "wheel_radius"),
            *("middle", "length", "width", "low", "high"),
            *("caster", "caster_radius"),
            *("mast", "mast_radius", "mast_low", "mast_high"),
            "reach",
        )
    ]
)
"""Two wheels; the chassis (place along x, half sizes, between two heights); the caster (place along x); the mast (place
along x, between two heights); all of it within `reach` of the axle's middle, m."""


def pack_hull(robot: RobotConfig) -> tuple[float, ...]:
    """Return the numbers of a robot's `HULL`."""
    half_track, wheel_radius = 0.5 * robot.track_width, robot.wheel_radius
    body = robot.body
    middle, length, width = body.chassis_middle, 0.5 * body.chassis_length, 0.5 * body.chassis_width
    low, high = body.chassis_low, body.chassis_low + body.chassis_height
    caster, caster_radius = middle + body.caster_offset, body.caster_radius
    mast, mast_radius, center = middle + body.mast_offset, body.mast_radius, body.chassis_center + body.mast_rise
    mast_low, mast_high = center - 0.5 * body.mast_height, center + 0.5 * body.mast_height
    reach = max(
        math.sqrt((abs(middle) + length) ** 2 + width * width),
        abs(caster) + caster_radius,
        abs(mast) + mast_radius,
        half_track + wheel_radius,
    )
    chassis = middle, length, width, low, high
    return (half_track, wheel_radius, *chassis, caster, caster_radius, mast, mast_radius, mast_low, mast_high, reach)
