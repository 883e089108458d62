"""`Policy`: SB3's `predict` signature; `Follower` = perception + estimator + controller, the reference policies.

`TrackingFollower` sees with paper A's tracker, which can lose the person; then it stops and looks.

The estimate of a follower is part of its state, so that eq. (35) can be evaluated: `state.estimate`.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Any, Protocol, cast

import numpy as np

from baselines.controllers import Controller
from baselines.controllers.pi import PIController
from baselines.followers.calibration import NoiseModel, Pair, noise_model
from follow_env.config import CameraConfig, RobotConfig, choose
from follow_env.geometry import CameraMount, Intrinsics
from tracker.depth import Rule, measure
from tracker.estimators.filters import (
    AdaptiveKalmanFilter,
    AugmentedKalmanFilter,
    Estimate,
    Estimator,
    KalmanFilter,
    NoFilter,
)
from tracker.person_tracker import Detector, PersonTracker, Track, TrackerSettings

Percept = tuple[Pair | None, Pair]
"""A measurement (bearing rad, distance m) or None, and the odometry twist (v m/s, omega rad/s)."""

OBSERVATION_OF = {"truth": "state", "emulated": "measurement", "mask": "rgbd_box", "detector": "rgbd"}
"""Perception -> the environment's observation mode that it reads."""
ESTIMATORS = ("none", "kf", "akf", "akf_cv")
CONTROLLERS = ("pi",)
DEFAULT_SENSOR = {"truth": "exact", "emulated": "default", "mask": "six_smallest", "detector": "six_smallest"}
"""Sensor that a follower expects unless told otherwise: that of the environments, or the rule that reads the depth."""
LOOK_RATE, LOOK_TIME = 0.5, 2.0
"""A robot that looks for the person it lost turns this fast (rad/s) to one side for this long (s), the width of the
picture, and then sweeps twice as far to either side in turn."""


class Policy(Protocol):
    """Anything that drives: the signature of Stable-Baselines3's `predict`."""

    def predict(
        self,
        observation: Any,
        state: Any = None,
        episode_start: np.ndarray | None = None,
        deterministic: bool = True,
    ) -> tuple[np.ndarray, Any]:
        """Return the action (2,) or (n, 2) in [-1, 1] and the state to hand back with the next observation."""


@dataclass
class FollowerState:
    """What a follower remembers within one episode.

    Attributes:
        estimator, controller: their memory.
        measurement: latest measurement (bearing rad, distance m), or None when the last step had none.
        estimate: latest estimate, or None while nothing was ever measured.
    """

    estimator: Estimator
    controller: Controller
    measurement: Pair | None = None
    estimate: Estimate | None = None


class Follower:
    """Perception, then estimation, then control; stands still until the person was seen once.

    Args:
        perceive: turns one observation into (measurement, odometry twist).
        make_estimator: returns a fresh estimator for an episode.
        make_controller: returns a fresh controller for an episode.
        robot: gives the scale of the twist action.
        dt: control period, s.
    """

    def __init__(
        self,
        perceive: Callable[[Any], Percept],
        make_estimator: Callable[[], Estimator],
        make_controller: Callable[[], Controller] = PIController.from_paper,
        robot: RobotConfig | None = None,
        dt: float = 1.0 / 30.0,
    ) -> None:
        self._perceive = perceive
        self._make_estimator, self._make_controller = make_estimator, make_controller
        robot = robot or RobotConfig()
        self._scale = (robot.max_speed, robot.max_yaw_rate)
        self._dt = dt

    def predict(
        self,
        observation: Any,
        state: Any = None,
        episode_start: np.ndarray | None = None,
        deterministic: bool = True,
    ) -> tuple[np.ndarray, Any]:
        """Return (action, state) for one observation, or for a batch of n with a list of n states.

        Args:
            observation: of the mode that the perception reads, single or batched along the first axis.
            state: what the last call returned; None at the start.
            episode_start: (n,) or scalar; True forgets the state.
            deterministic: followers always are.

        Returns:
            Actions float32 in [-1, 1], (2,) or (n, 2): the twist as shares of the robot's limits.
        """
        batch = _split(observation)
        if batch is None:
            starts = state is None or (episode_start is not None and bool(np.any(episode_start)))
            return self._step(observation, None if starts else state)
        flags = np.zeros(len(batch), bool) if episode_start is None else np.asarray(episode_start).reshape(-1)
        states = [None] * len(batch) if state is None else state
        results = [self._step(o, None if f else s) for o, s, f in zip(batch, states, flags, strict=True)]
        return np.stack([action for action, _ in results]), [new for _, new in results]

    def _step(self, observation: Any, state: Any) -> tuple[np.ndarray, FollowerState]:
        if state is None:
            state = FollowerState(self._make_estimator(), self._make_controller())
        measurement, twist = self._perceive(observation)
        return self._drive(state, measurement, twist), state

    def _drive(self, state: FollowerState, measurement: Pair | None, twist: Pair) -> np.ndarray:
        """Estimate, and return the controller's action."""
        state.measurement = measurement
        state.estimator.predict(twist, self._dt)
        state.estimate = state.estimator.update(measurement)
        if state.estimate is None:
            return self._action(0.0, 0.0)
        return self._action(*state.controller.command(state.estimate.bearing, state.estimate.distance, self._dt))

    def _action(self, v: float, omega: float) -> np.ndarray:
        shares = (v / self._scale[0], omega / self._scale[1])
        return np.array([min(max(share, -1.0), 1.0) for share in shares], np.float32)


@dataclass(kw_only=True)
class TrackingState(FollowerState):
    """What a `TrackingFollower` remembers within one episode.

    Attributes:
        tracker: its memory.
        track: of the latest frame.
        bearing: of the person when it was tracked last, rad; None while nobody was tracked.
        looked: for so long the robot has turned to look since then, s.
    """

    tracker: PersonTracker
    track: Track | None = None
    bearing: float | None = None
    looked: float = 0.0


class TrackingFollower(Follower):
    """Follows whom a tracker tracks in `rgbd` observations.

    A measurement is a position measured in that very frame, as bearing and forward distance; frames between the
    processed ones and coasted frames have none. Until a person is confirmed the robot stands. When the tracker stops,
    the robot halts, forgets its estimate and answers the alarm itself: it turns at `LOOK_RATE` to the side where it
    tracked the person last, sweeps back after `LOOK_TIME` (the person may be where it was, and the detector to blame),
    stands while somebody is being confirmed, and then follows whom the tracker confirmed, the largest, most central
    person. It cannot know whether that is the one it lost; `state.track.confirmations` tells that
    it was asked.

    Args:
        make_tracker: returns a fresh tracker for an episode; its rate is that of the observations.
        make_estimator, make_controller, robot, dt: as in `Follower`.
    """

    def __init__(
        self,
        make_tracker: Callable[[], PersonTracker],
        make_estimator: Callable[[], Estimator],
        make_controller: Callable[[], Controller] = PIController.from_paper,
        robot: RobotConfig | None = None,
        dt: float = 1.0 / 30.0,
    ) -> None:
        super().__init__(perceive_odometry, make_estimator, make_controller, robot, dt)
        self._make_tracker = make_tracker

    def _step(self, observation: Any, state: Any) -> tuple[np.ndarray, FollowerState]:
        if state is None:
            state = TrackingState(self._make_estimator(), self._make_controller(), tracker=self._make_tracker())
        _, twist = self._perceive(observation)
        state.track = track = state.tracker.update(observation["rgb"], observation["depth"], twist)
        if track.bearing is not None:
            state.bearing, state.looked = track.bearing, 0.0
            place = track.measurement
            measurement = None if place is None else (math.atan2(place[1], place[0]), place[0])
            return self._drive(state, measurement, twist), state
        if track.alarm:
            state.tracker.confirm()
        state.estimator.reset()
        state.controller.reset()
        state.measurement = state.estimate = None
        if state.bearing is None or track.state == "confirming":
            return self._action(0.0, 0.0), state
        back = int((state.looked + LOOK_TIME) / (2.0 * LOOK_TIME)) % 2
        state.looked += self._dt
        return self._action(0.0, math.copysign(LOOK_RATE, -state.bearing if back else state.bearing)), state


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
    """Measures from RGB-D and a box: the `mask` rung. Depth is read from the box by `rule`, eqs. (24)-(31)."""

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
    return BoxPerception(_intrinsics(camera), robot.camera_forward, rule)


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
    return functools.partial(PersonTracker, detector, _intrinsics(camera), mount, TrackerSettings.for_rate(rate))


def _intrinsics(camera: CameraConfig) -> Intrinsics:
    return Intrinsics.from_hfov(camera.width, camera.height, math.radians(camera.hfov_deg))


def _split(observation: Any) -> list[Any] | None:
    """Return the single observations of a batch, or None when the observation is a single one."""
    if isinstance(observation, Mapping):
        if observation["depth"].ndim == 2:
            return None
        return [{key: value[i] for key, value in observation.items()} for i in range(len(observation["depth"]))]
    return None if np.ndim(observation) == 1 else list(observation)
