# mypy: disable-error-code="no-untyped-def"
"""`KinematicWorld`: one world of the batch on its own, with the interface of `follow_env.world.bullet.World`."""

import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from numba import njit

from follow_env.compilation import announced, digest
from follow_env.config import RobotConfig
from follow_env.world.clock import PHYSICS_HZ
from follow_env.world.kinematic.drive import kept_speed_error, roll
from follow_env.world.kinematic.hull import HULL, pack_hull
from follow_env.world.kinematic.place import COLLISIONS, free_sight, pack_place, touched
from follow_env.world.people.dimensions import CHEST_HEIGHT
from follow_env.world.robots.diff_drive import DiffDrive
from follow_env.world.scene import Scene


class KinematicWorld:
    """The robot, the person and the scene without PyBullet: exact arcs, no slip, no push.

    The robot has the limits and the wheel response of the physics' robot. It passes through what it touches; that it
    touches is known. `docs/engines.md` states how far it is from PyBullet.

    Args:
        scene: the place.
        config: the robot.

    Raises:
        ValueError: if the robot has another torque limit than the default.
    """

    def __init__(self, scene: Scene, config: RobotConfig) -> None:
        check_torque(config)
        self.drive = DiffDrive(config)
        self.config = config
        self._scene = scene
        self._sight_heights = sorted((config.camera_height, CHEST_HEIGHT))
        self._place = pack_place(scene, *self._sight_heights)
        self._hull = np.array([pack_hull(config)], HULL)
        self.reset((0.0, 0.0, 0.0), (9.0, 0.0, 0.0))
        with announced("the kinematic world"):
            self.simulate(1)
            self.collision()
            self.line_of_sight((0.0, 0.0, config.camera_height), (1.0, 0.0, CHEST_HEIGHT))

    def reset(self, robot_pose: tuple[float, float, float], person_pose: tuple[float, float, float]) -> None:
        """Put the robot at rest and the person at these poses (x, y, yaw; m, rad)."""
        self._pose, self._direction = robot_pose, (math.cos(robot_pose[2]), math.sin(robot_pose[2]))
        self._rims = self._command = (0.0, 0.0)
        self.place_person(person_pose)

    def place_person(self, pose: tuple[float, float, float]) -> None:
        """Move the person's capsule to the pose (x, y, heading)."""
        self._person = pose[0], pose[1]

    def step(self, left: float, right: float, substeps: int) -> tuple[float, float]:
        """Advance by `substeps` physics steps with rim-speed commands (m/s); return the odometry twist.

        The commands pass the drive's limits first. The odometry (v, omega) is the mean over the period.
        """
        self._command = self.drive.limit(left, right, self._command, substeps / PHYSICS_HZ)
        return self.simulate(substeps)

    def simulate(self, substeps: int) -> tuple[float, float]:
        """Advance by `substeps` physics steps with the wheel commands that stand; return the odometry twist."""
        config = self.config
        decay = kept_speed_error(substeps / PHYSICS_HZ, substeps, config.wheel_time_constant)
        given = (*self._pose, *self._direction, *self._rims, *self._command)
        x, y, yaw, left, right, v, omega = _rolled(*given, decay, substeps, config.track_width)
        self._pose, self._direction, self._rims = (x, y, yaw), (math.cos(yaw), math.sin(yaw)), (left, right)
        return v, omega

    @property
    def wheel_command(self) -> tuple[float, float]:
        """The rim speeds (left, right) commanded now, after all limits, m/s."""
        return self._command

    @property
    def command(self) -> tuple[float, float]:
        """The twist (v, omega) commanded now, after all limits."""
        return self.drive.twist(*self._command)

    def robot_pose(self) -> tuple[float, float, float]:
        """Pose (x, y, yaw) of the axle's middle in the world frame, m and rad."""
        return self._pose

    def collision(self) -> str:
        """What the robot touches: "none", "wall" (anything of the scene) or "person"."""
        x, y, _ = self._pose
        return COLLISIONS[_touches(self._place, self._hull, x, y, *self._direction, *self._person)]

    def line_of_sight(self, eye: tuple[float, float, float], point: tuple[float, float, float]) -> bool:
        """Whether nothing of the scene stands between the two points (m); robot and person do not count."""
        low, high = sorted((eye[2], point[2]))
        if low < self._sight_heights[0] or high > self._sight_heights[1]:
            self._sight_heights = [min(low, self._sight_heights[0]), max(high, self._sight_heights[1])]
            self._place = pack_place(self._scene, *self._sight_heights)
        return _sees(self._place, eye, point)

    def close(self) -> None:
        """Do nothing: there is nothing to free."""


def check_torque(config: RobotConfig) -> None:
    """Raise a ValueError if the robot has a torque limit of its own, which no kinematic robot can keep."""
    if config.max_wheel_torque != RobotConfig.max_wheel_torque:
        raise ValueError(
            f"robot max_wheel_torque is {config.max_wheel_torque!r}, but the kinematic engine knows no torque; "
            "leave it out or take engine='bullet'"
        )


def _compiled(sources: int) -> tuple[Callable[..., Any], ...]:
    """Return `roll`, `touched` and `free_sight` as Python calls them; what they return is said there."""

    @njit(cache=True)
    def rolled(x, y, yaw, cosine, sine, left, right, command_left, command_right, decay, substeps, track):
        key = sources  # noqa: F841  captured, hence part of the cache key
        return roll(x, y, yaw, cosine, sine, left, right, command_left, command_right, decay, substeps, track)

    @njit(cache=True)
    def touches(place, hulls, x, y, cosine, sine, person_x, person_y):
        key = sources  # noqa: F841
        return touched(place, hulls[0], x, y, cosine, sine, person_x, person_y)

    @njit(cache=True)
    def sees(place, eye, point):
        key = sources  # noqa: F841
        return free_sight(place, eye, point)

    return rolled, touches, sees


def _sources() -> list[Path]:
    world = Path(__file__).parents[1]
    return [
        *Path(__file__).parent.glob("*.py"),
        world / "clearance.py",
        world / "clock.py",
        world / "people/dimensions.py",
    ]


_rolled, _touches, _sees = _compiled(digest(_sources()))
