"""What the kernels work on: one record per world, one of its settings, one of information."""

import numpy as np

from follow_env.camera.measurement import ErrorModel
from follow_env.config import TaskConfig
from follow_env.world.kinematic.hull import HULL
from follow_env.world.kinematic.route import MOST_TURNS


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
        *((name, np.bool_) for name in ("given_pose", "given_motion", "given_draws", "by_table", "taped")),
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

TASK = np.dtype([(name, np.float64, np.shape(value)) for name, value in vars(TaskConfig()).items()], align=True)
"""A `TaskConfig`."""

SETTINGS = np.dtype(
    [
        ("observe_state", np.bool_),
        ("measure", np.bool_),
        ("pictures", np.bool_),
        ("wheel_actions", np.bool_),
        *((name, np.int64) for name in ("route", "substeps", "person_substeps", "delay")),
        *_reals("dt", "decay", "stretch", "start_x", "start_y", "start_yaw", "start_width"),
        *_reals("track_width", "max_speed", "max_yaw_rate", "max_wheel_speed"),
        *_reals("max_wheel_acceleration", "camera_forward", "camera_height", "hull_radius", "half_view"),
        *_reals(*ErrorModel._fields),
        ("task", TASK),
        ("hull", HULL),
    ],
    align=True,
)
"""The settings of an episode as the kernels want them."""
