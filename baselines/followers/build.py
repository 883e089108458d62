"""Followers of the benchmark, built from names."""

from __future__ import annotations

import functools
from collections.abc import Callable
from dataclasses import replace
from typing import Any, cast

from baselines.followers.calibration import noise_model
from baselines.followers.follower import Follower
from baselines.followers.perception import OBSERVATION_OF, Percept, intrinsics_of, make_perception
from baselines.followers.tracking_follower import TrackingFollower
from follow_env.config import CameraConfig, RobotConfig
from follow_env.geometry import CameraMount
from follow_env.registry import choose
from tracker.depth import Rule
from tracker.estimators import AdaptiveKalmanFilter, AugmentedKalmanFilter, Estimator, KalmanFilter, NoFilter
from tracker.estimators.base import NoiseModel, Pair
from tracker.person_tracker import Detector, PersonTracker, TrackerSettings

ESTIMATORS = ("none", "kf", "akf", "akf_cv")
CONTROLLERS = ("pi",)
DEFAULT_SENSOR = {"truth": "exact", "emulated": "default", "mask": "six_smallest", "detector": "six_smallest"}
"""Sensor that a follower expects unless told otherwise: that of the environments, or the rule that reads the depth."""


def make_estimator(name: str, noise: NoiseModel, alpha: float = 0.05) -> Estimator:
    """Return a fresh estimator: `none`, `kf`, `akf` (paper B) or `akf_cv` (with the person's velocity)."""
    choose("estimator", name, ESTIMATORS)
    if name == "none":
        return NoFilter()
    if name == "kf":
        return KalmanFilter(noise.process, noise.measurement)
    if name == "akf":
        return AdaptiveKalmanFilter(noise.process, noise.measurement, alpha)
    return AugmentedKalmanFilter(noise.acceleration, noise.measurement, alpha)


def make_follower(
    estimator: str = "akf",
    perception: str = "emulated",
    scene: str = "corridor",
    controller: str = "pi",
    noise: NoiseModel | None = None,
    alpha: float = 0.05,
    sensor: str | None = None,
    camera: CameraConfig | None = None,
    robot: RobotConfig | None = None,
    control_hz: int = 30,
    detector: Detector | None = None,
    bias: Pair = (0.0, 0.0),
) -> Follower:
    """Return paper B's follower, or a variant of it.

    Args:
        estimator: `none`, `kf`, `akf` or `akf_cv`.
        perception: `truth`, `emulated`, `mask` or `detector`; `OBSERVATION_OF` says which observation it reads.
        scene: whose calibrated noise is taken when `noise` is None.
        controller: `pi`, the paper's gains.
        noise: R and Q; by default those of the calibration for this perception and scene. A `detector` of your own
            takes those of `mask`, whose depths are read by the same rule; as Q covers (rate * time between
            measurements)^2 and only every n-th frame is measured, n steps share n^2 Q, and each takes n Q.
        alpha: significance of the adaptive test.
        sensor: whose calibrated noise is taken; for `mask` also the rule by which depth is read from the box.
        camera: of the pictures that `mask` and `detector` read; by default the environment's default camera.
        robot: of the environment; scales the action.
        control_hz: of the environment. Q per step is calibrated at 30 Hz and scales with the square of the period.
        detector: finds people for `detector`; by default the shipped one, which needs PyTorch. It has no memory, so
            episodes share it.
        bias: known constant errors (rad, m) of a memoryless perception, taken off each measurement; the paper has none.
    """
    choose("controller", controller, CONTROLLERS)
    choose("perception", perception, OBSERVATION_OF)
    sensor = sensor or DEFAULT_SENSOR[perception]
    if noise is None:
        borrowed = perception == "detector" and detector is not None
        noise = noise_model("mask" if borrowed else perception, scene, sensor)
        slower = (30.0 / control_hz) ** 2
        if perception == "detector":
            slower *= TrackerSettings.for_rate(control_hz).every / (1 if borrowed else TrackerSettings().every)
        noise = replace(noise, process=(slower * noise.process[0], slower * noise.process[1]))
    make_estimator(estimator, noise, alpha)
    if perception == "detector":
        make_tracker = _tracker_factory(detector, camera or CameraConfig(), robot or RobotConfig(), control_hz)
        return TrackingFollower(
            make_tracker, lambda: make_estimator(estimator, noise, alpha), robot=robot, dt=1.0 / control_hz
        )
    rule = cast(Rule, sensor) if perception == "mask" else "six_smallest"
    perceive = make_perception(perception, camera, robot, rule)
    if any(bias):
        perceive = functools.partial(_corrected, perceive, bias)
    return Follower(perceive, lambda: make_estimator(estimator, noise, alpha), robot=robot, dt=1.0 / control_hz)


def _corrected(perceive: Callable[[Any], Percept], bias: Pair, observation: Any) -> Percept:
    measured, twist = perceive(observation)
    return (None if measured is None else (measured[0] - bias[0], measured[1] - bias[1])), twist


def _tracker_factory(
    detector: Detector | None, camera: CameraConfig, robot: RobotConfig, rate: int
) -> Callable[[], PersonTracker]:
    if detector is None:
        from tracker.detection.detector import PersonDetector

        detector = PersonDetector()
    mount = CameraMount(robot.camera_forward, robot.camera_height)
    return functools.partial(PersonTracker, detector, intrinsics_of(camera), mount, TrackerSettings.for_rate(rate))
