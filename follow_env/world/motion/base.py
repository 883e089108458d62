"""`Motion`: how a person moves, whoever decided it; and how a setting becomes one."""

import math
from collections.abc import Callable, Mapping
from typing import Any, Protocol

import numpy as np

from follow_env.registry import Registry
from follow_env.world.motion.profile import PAPER_SPEED
from follow_env.world.people.dimensions import RADIUS
from follow_env.world.scene import Scene

Pose = tuple[float, float, float]
TABLE_COLUMNS = ("x", "y", "heading", "speed", "walked")
"""Of a motion's table, one row each step: m, m, rad, m/s and m."""


class Motion(Protocol):
    """A person's motion in the world frame, from the episode's start on.

    Attributes:
        duration: the episode ends then, s.
    """

    duration: float

    def pose(self, t: float) -> Pose:
        """Return (x, y, heading) at time t (s), m and rad."""

    def velocity(self, t: float) -> tuple[float, float]:
        """Return the velocity at time t, m/s."""

    def speed(self, t: float) -> float:
        """Return the walking speed at time t, m/s."""

    def walked(self, t: float) -> float:
        """Return the way walked until time t, m: it drives the gait."""


MakeMotion = Callable[..., Motion]
"""(scene, start pose, random generator, walking speed in m/s, **settings) -> `Motion`."""
MOTIONS: Registry[MakeMotion] = Registry("route", "follow_env.world.motion")
"""Motions by the name of the `route` setting."""


def make_motion(route: Any, scene: Scene, start: Pose, rng: np.random.Generator, speed: float = PAPER_SPEED) -> Motion:
    """Return the motion of an episode.

    Args:
        route: a registered name, `"module:object"`, a mapping `{"name": ..., **settings}`, a function as `MakeMotion`
            says, or a `Motion` (which starts where it starts).
        scene: where it walks.
        start: (x, y, heading) of the person at t = 0, m and rad.
        rng: what is drawn comes from here.
        speed: between starting and stopping, m/s.

    Raises:
        ValueError: for an unknown name or impossible settings.
    """
    if hasattr(route, "pose"):
        return route
    if callable(route):
        return route(scene, start, rng, speed)
    if not isinstance(route, str | Mapping):
        raise ValueError(
            f"route is {route!r}; expected a name, a mapping with a name, a Motion, or a function that makes one"
        )
    return MOTIONS.build(route, scene, start, rng, speed)


def check_motion(route: Any, scene: Scene, set_point: float, speed: float) -> None:
    """Raise a ValueError for a route that nobody can walk in this scene, tried from the middle of its start."""
    x, y, yaw = scene.start
    ahead = (x + set_point * math.cos(yaw), y + set_point * math.sin(yaw), yaw)
    motion = make_motion(route, scene, ahead, np.random.default_rng(0), speed)
    if not 0.0 < motion.duration < math.inf:
        raise ValueError(f"route {route!r} lasts {motion.duration!r} s; expected a finite time > 0")
    way = motion_table(motion, 0.1)
    if not np.isfinite(way).all():
        raise ValueError(f"route {route!r} has poses that are not finite; expected numbers in meters and radians")
    gap = scene.clearance(way[:, :2])
    if gap < RADIUS:
        raise ValueError(
            f"route {route!r} passes {gap:.2f} m from something solid in the scene {scene.name!r}; expected at least "
            f"{RADIUS} m: take route='standing', another route or another scene"
        )


def motion_table(motion: Motion, dt: float) -> np.ndarray:
    """Return `TABLE_COLUMNS` of a motion at times 0, dt, ... until its end, (rows, 5)."""
    times = [k * dt for k in range(math.ceil(motion.duration / dt) + 1)]
    return np.array([(*motion.pose(t), motion.speed(t), motion.walked(t)) for t in times])
