"""The observation modes of the environments, their spaces and what stands in them."""

import math
from typing import Any

import numpy as np
from gymnasium import spaces

from follow_env.camera import PinholeCamera
from follow_env.config import RobotConfig

MAX_DISTANCE = 20.0
"""Largest distance that an observation can hold, m."""


def observation_space(obs: str, camera: PinholeCamera, robot: RobotConfig) -> spaces.Space:
    """Return the space of an observation mode (see `FollowEnv`)."""
    height, width = camera.height, camera.width
    twist = largest_twist(robot)
    if obs in ("measurement", "state"):
        own = (*twist, 1.0, 1.0)
        if obs == "measurement":
            high, low = (math.pi, MAX_DISTANCE, 1.0, 600.0, *own), (-math.pi, 0.0, 0.0, 0.0)
        else:
            high, low = (math.pi, MAX_DISTANCE, 5.0, 5.0, *own), (-math.pi, -MAX_DISTANCE, -5.0, -5.0)
        return spaces.Box(
            np.array((*low, *(-value for value in own)), np.float32), np.array(high, np.float32), dtype=np.float32
        )
    if obs == "rgbd_uint8":
        return spaces.Box(0, 255, (height, width, 4), np.uint8)
    parts: dict[str, spaces.Space] = {
        "rgb": spaces.Box(0, 255, (height, width, 3), np.uint8),
        "depth": spaces.Box(0.0, camera.config.far, (height, width), np.float32),
        "twist": spaces.Box(-np.array(twist, np.float32), np.array(twist, np.float32), dtype=np.float32),
    }
    if obs == "rgbd_box":
        parts["box"] = spaces.Box(0.0, np.array((width, height, width, height), np.float32), (4,), np.float32)
    return spaces.Dict(parts)


def largest_twist(robot: RobotConfig) -> tuple[float, float]:
    """Return the largest odometry (v, omega) that an observation can hold: half as much again as the wheels can."""
    return 1.5 * robot.max_wheel_speed, 3.0 * robot.max_wheel_speed / robot.track_width


def state_values(bearing: Any, distance: Any, velocity: Any, direction: Any, own: Any) -> tuple[Any, ...]:
    """Return the eight numbers (or arrays of them) of a `state` observation.

    Args:
        bearing: truth, rad.
        distance: truth, m.
        velocity: of the person in the world frame (x, y), m/s.
        direction: cosine and sine of the robot's yaw.
        own: odometry v and omega, last action (2).
    """
    (vx, vy), (cosine, sine) = velocity, direction
    ahead, left = cosine * vx + sine * vy, cosine * vy - sine * vx
    return (bearing, distance, ahead, left, own[0], own[1], own[2], own[3])


def measurement_values(bearing: float, distance: float, age: float, own: Any) -> tuple[float, ...]:
    """Return the eight numbers of a `measurement` observation with a measurement that is `age` (s) old."""
    bearing = min(max(bearing, -math.pi), math.pi)
    return (bearing, min(distance, MAX_DISTANCE), 1.0, age, own[0], own[1], own[2], own[3])


def no_measurement_values(since: float, own: Any) -> tuple[float, ...]:
    """Return the eight numbers of a `measurement` observation without one since a time, s."""
    return (0.0, 0.0, 0.0, since, own[0], own[1], own[2], own[3])
