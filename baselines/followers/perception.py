"""Perception: from an observation to a measurement (bearing, distance) and the odometry."""

from __future__ import annotations

import functools
import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, get_args

import numpy as np

from follow_env.config import CameraConfig, EnvConfig, RobotConfig
from follow_env.geometry import Intrinsics
from follow_env.registry import Registry, choose
from tracker.depth import Rule, measure
from tracker.estimators.base import Pair
from tracker.person_tracker import Detector, PersonTracker, TrackerSettings

Percept = tuple[Pair | None, Pair]
"""A measurement (bearing rad, distance m) or None, and the odometry twist (v m/s, omega rad/s)."""


def perceive_state(observation: np.ndarray) -> Percept:
    """Read the truth from a `state` observation."""
    bearing, distance, _, _, v, omega, _, _ = observation.tolist()
    return (bearing, distance), (v, omega)


def perceive_measurement(observation: np.ndarray) -> Percept:
    """Read the tracker's report from a `measurement` observation; no measurement when it is not valid."""
    bearing, distance, valid, _, v, omega, _, _ = observation.tolist()
    return ((bearing, distance) if valid else None), (v, omega)


def perceive_odometry(observation: Mapping[str, np.ndarray]) -> Percept:
    """Read the odometry that comes with a picture; whoever looks at the picture measures."""
    v, omega = observation["twist"].tolist()
    return None, (v, omega)


@dataclass(frozen=True)
class BoxPerception:
    """Measures from RGB-D and a box: the `mask` perception. Depth is read from the box by `rule`, eqs. (24)-(31)."""

    intrinsics: Intrinsics
    camera_forward: float
    rule: Rule = "six_smallest"

    def __call__(self, observation: Mapping[str, np.ndarray]) -> Percept:
        """Return (measurement or None, odometry twist) from an `rgbd_box` observation."""
        v, omega = observation["twist"].tolist()
        u0, v0, u1, v1 = observation["box"].tolist()
        if u1 <= u0:
            return None, (v, omega)
        box = (u0, v0, u1, v1)
        return measure(observation["depth"], box, self.intrinsics, self.camera_forward, self.rule), (v, omega)


def make_perception(
    name: str, camera: CameraConfig | None = None, robot: RobotConfig | None = None, rule: Rule = "six_smallest"
) -> Callable[[Any], Percept]:
    """Return the perception `name` for a camera on a robot: a key of `OBSERVATION_OF` that needs no memory."""
    choose("perception", name, (known for known in OBSERVATION_OF if known != "detector"))
    if name == "truth":
        return perceive_state
    if name == "emulated":
        return perceive_measurement
    camera, robot = camera or CameraConfig(), robot or RobotConfig()
    return BoxPerception(intrinsics_of(camera), robot.camera_forward, rule)


def intrinsics_of(camera: CameraConfig) -> Intrinsics:
    """Return the intrinsics of a camera's pictures."""
    return Intrinsics.from_hfov(camera.width, camera.height, math.radians(camera.hfov_deg))


PERCEPTIONS: Registry[Any] = Registry("perception")
"""Classes with the class attribute `observation` (the environment's mode that they read).

`(config, **settings)` makes a callable from an observation to a `Percept`; one with `make_tracker` tracks, with a
memory of its own in each episode.
"""


@PERCEPTIONS.register("truth")
class Truth:
    """Reads the truth from a `state` observation."""

    observation = "state"

    def __init__(self, config: EnvConfig) -> None:
        self.config = config

    def __call__(self, observation: np.ndarray) -> Percept:
        """Return (bearing and distance, odometry twist)."""
        return perceive_state(observation)


@PERCEPTIONS.register("emulated")
class Emulated:
    """Reads what a tracker would report from a `measurement` observation."""

    observation = "measurement"

    def __init__(self, config: EnvConfig) -> None:
        self.config = config

    def __call__(self, observation: np.ndarray) -> Percept:
        """Return (measurement or None, odometry twist)."""
        return perceive_measurement(observation)


@PERCEPTIONS.register("mask")
class Mask:
    """Measures from RGB-D and the person's box; `rule` says how the depth is read from it."""

    observation = "rgbd_box"

    def __init__(self, config: EnvConfig, rule: Rule = "six_smallest") -> None:
        choose("depth rule", rule, get_args(Rule))
        self._measure = BoxPerception(config.intrinsics, config.mount.forward, rule)

    def __call__(self, observation: Mapping[str, np.ndarray]) -> Percept:
        """Return (measurement or None, odometry twist)."""
        return self._measure(observation)


@PERCEPTIONS.register("detector")
class Detected:
    """Tracks the person that a detector finds in RGB-D: by default the shipped one, which needs PyTorch."""

    observation = "rgbd"

    def __init__(self, config: EnvConfig, detector: Detector | None = None) -> None:
        settings, detector = TrackerSettings.for_rate(config.control_hz), detector or _shipped_detector()
        self.make_tracker = functools.partial(PersonTracker, detector, config.intrinsics, config.mount, settings)

    def __call__(self, observation: Mapping[str, np.ndarray]) -> Percept:
        """Return the odometry; the tracker measures."""
        return perceive_odometry(observation)


@functools.cache
def _shipped_detector() -> Detector:
    """Return the shipped detector, loaded once: it has no memory."""
    from tracker.detection.detector import PersonDetector

    return PersonDetector()


OBSERVATION_OF = {name: PERCEPTIONS.get(name).observation for name in PERCEPTIONS}
"""Perception -> the environment's observation mode that it reads."""
