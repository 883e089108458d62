"""What the kernels work on: one record per world, one record of settings, one record of information per world."""

import math
from typing import TYPE_CHECKING

import numpy as np

from follow_env.camera.measurement import ErrorModel
from follow_env.world.kinematic.drive import kept_speed_error
from follow_env.world.motion.routes import PAPER_SPEED, ROUTES

if TYPE_CHECKING:
    from follow_env.envs.follow import FollowEnv

MOST_TURNS = 2
"""Turns that a world's route can have."""
PERSON_STEP = 1.0 / 30.0
"""The person's path is integrated (Simpson) in steps of at most this, s."""
ROUTE_NUMBERS = {name: number for number, name in enumerate(ROUTES)}
"""Route name -> its number in a world's record."""


def _reals(*names: str) -> list[tuple[str, type]]:
    return [(name, np.float64) for name in names]


WORLD = np.dtype(
    [
        ("key", np.uint64),  # of the world's random numbers
        ("picture_seed", np.uint64),  # of the errors of this moment's picture
        *((name, np.int64) for name in ("episode", "steps", "route", "turns", "rows", "collision")),
        *((name, np.int64) for name in ("out_of_view", "longest_out_of_view", "in_band")),
        *_reals("x", "y", "yaw", "cosine", "sine"),  # robot
        *_reals("left", "right", "command_left", "command_right"),  # rim speeds, m/s
        *_reals("v", "omega", "first", "second"),  # odometry and last action
        *_reals("person_x", "person_y", "heading", "person_vx", "person_vy", "walked", "speed"),
        *_reals("route_heading", "distance_total", "duration", "ramp"),
        ("turn_start", np.float64, MOST_TURNS),
        ("turn_duration", np.float64, MOST_TURNS),
        ("turn_angle", np.float64, MOST_TURNS),
        *_reals("bearing", "distance", "surface_distance"),
        *_reals("bearing_error", "distance_error", "outlier", "last_measured"),
        *((name, np.bool_) for name in ("visible", "saturated")),
        *((name, np.bool_) for name in ("given_pose", "given_start", "by_table", "taped")),  # see `episode.begin`
    ],
    align=True,
)
"""One world: its robot, its person and route, the truth of this moment, the errors of its sensor, and its counters."""

INFO = np.dtype(
    [
        *_reals("time", "bearing", "distance", "surface_distance"),
        ("robot_pose", np.float64, 3),
        ("person_pose", np.float64, 3),
        ("person_velocity", np.float64, 2),
        ("twist", np.float64, 2),
        ("command", np.float64, 2),
        ("rewards", np.float64, 5),
        ("collision_with", np.int64),
        *((name, np.bool_) for name in ("visible", "collision", "saturated", "is_success")),
    ],
    align=True,
)
"""What `info` says of one world, `rewards` in the order of `follow_env.envs.task.reward_terms`."""

TABLE_COLUMNS = ("x", "y", "heading", "speed", "walked")
"""Of a motion's table, one row each control step: m, m, rad, m/s and m."""

SETTINGS = np.dtype(
    [
        ("observe_state", np.bool_),
        ("measure", np.bool_),
        ("pictures", np.bool_),
        ("wheel_actions", np.bool_),
        ("by_table", np.bool_),
        *((name, np.int64) for name in ("route", "substeps", "person_substeps", "delay")),
        *_reals("dt", "decay", "stretch", "start_x", "start_y", "start_yaw", "start_width"),
        *_reals("track_width", "wheel_radius", "max_speed", "max_yaw_rate", "max_wheel_speed"),
        *_reals("max_wheel_acceleration", "camera_forward", "camera_height", "hull_radius", "half_view"),
        *_reals(*ErrorModel._fields),
    ],
    align=True,
)
"""What all worlds share: the settings of a `FollowEnv` as the kernels want them."""


def pack_settings(env: "FollowEnv") -> np.ndarray:
    """Return the settings of `env`, (1,) `SETTINGS`."""
    packed = np.zeros(1, SETTINGS)
    robot, start = env.robot_config, env.scene.start
    values = {
        "observe_state": env._obs == "state",
        "measure": env._obs == "measurement",
        "pictures": env._obs.startswith("rgbd"),
        "wheel_actions": env._action == "wheels",
        "by_table": False,
        "route": ROUTE_NUMBERS[env._route_name],
        "substeps": env._substeps,
        "person_substeps": max(math.ceil(env.dt / PERSON_STEP - 1e-9), 1),
        "delay": env._delay,
        "dt": env.dt,
        "decay": kept_speed_error(env.dt, env._substeps, robot.wheel_time_constant),
        "stretch": PAPER_SPEED / env._walking_speed,
        **dict(zip(("start_x", "start_y", "start_yaw"), start, strict=True)),
        "start_width": env.scene.start_width,
        "half_view": math.tan(0.5 * env.camera.hfov),
        **ErrorModel.of(env._sensor.measurement, env.dt)._asdict(),
    }
    for name in SETTINGS.names or ():
        packed[name] = values[name] if name in values else getattr(robot, name)
    return packed
