"""Followers, built from a specification for an environment: nothing is guessed."""

from __future__ import annotations

import copy
import dataclasses
import functools
import inspect
from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any, cast

from baselines.controllers import CONTROLLERS
from baselines.followers.agents import CONTROL_HZ, Agent, load_agent, shipped
from baselines.followers.calibration import noise_model
from baselines.followers.follower import Follower
from baselines.followers.noise import noise_of
from baselines.followers.perception import OBSERVATION_OF, PERCEPTIONS, Percept, intrinsics_of, make_perception
from baselines.followers.policy import Policy
from baselines.followers.recovery import RECOVERIES
from baselines.followers.references import POLICIES
from baselines.followers.spec import FollowerSpec
from baselines.followers.tracking_follower import TrackingFollower
from follow_env.config import CameraConfig, EnvConfig, RobotConfig
from follow_env.geometry import CameraMount
from follow_env.registry import Registry, choose
from tracker.depth import Rule
from tracker.estimators.base import ESTIMATORS, Estimator, NoiseModel, Pair
from tracker.person_tracker import Detector, PersonTracker, TrackerSettings

DEFAULT_SENSOR = {"truth": "exact", "emulated": "default", "mask": "six_smallest", "detector": "six_smallest"}
"""Sensor that a follower expects unless told otherwise: that of the environments, or the rule that reads the depth."""


def make_estimator(name: str, noise: NoiseModel, alpha: float = 0.05) -> Estimator:
    """Return a fresh estimator: `none`, `kf`, `akf` (paper B) or `akf_cv` (with the person's velocity)."""
    takes_alpha = "alpha" in inspect.signature(ESTIMATORS.get(name)).parameters
    made: Estimator = ESTIMATORS.build({"name": name, **({"alpha": alpha} if takes_alpha else {})}, noise)
    return made


def observation_settings(spec: Any) -> dict[str, Any]:
    """Return the settings that an environment needs so that a follower can see: its observation mode, a picture's size.

    Args:
        spec: anything that `FollowerSpec.parse` takes.
    """
    spec = FollowerSpec.parse(spec)
    if spec.observation is not None:
        return {"obs": spec.observation}
    if spec.policy is None:
        name = PERCEPTIONS.parts(spec.perception)[0] if isinstance(spec.perception, str | Mapping) else spec.perception
        seen = PERCEPTIONS.get(name) if isinstance(name, str) else name
        return {"obs": seen.observation}
    policy = _policy(spec, EnvConfig())
    if isinstance(told := getattr(policy, "observation_settings", None), Mapping):
        return dict(told)
    if isinstance(policy, Agent):
        size = {"camera": {"width": 84, "height": 84}} if policy.observation == "rgbd_uint8" else {}
        return {"obs": policy.observation, **size}
    return {"obs": _reads(policy) or "measurement"}


def build_follower(spec: Any, env: Any) -> Policy:
    """Return the follower of a specification for an environment: its robot, camera, rate, sensor and set point.

    Args:
        spec: anything that `FollowerSpec.parse` takes.
        env: an `EnvConfig`, or an environment with one as `config` (Gymnasium's wrappers may be around it).

    Raises:
        ValueError: if the follower cannot drive this environment, or the specification is wrong; one sentence.
    """
    config = config_of(env)
    spec = FollowerSpec.parse(spec)
    if spec.policy is not None:
        policy = _policy(spec, config)
    else:
        perceive = PERCEPTIONS.build(spec.perception, config)
        noise = noise_of(config, spec.perception) if spec.noise is None else _noise(spec.noise)
        recovery = RECOVERIES.build(spec.recovery, config)
        make_estimator = functools.partial(_fresh, ESTIMATORS, spec.estimator, noise)
        make_controller = functools.partial(_fresh, CONTROLLERS, spec.controller, config)
        make_estimator(), make_controller()
        if hasattr(perceive, "make_tracker"):
            policy = TrackingFollower(
                perceive.make_tracker, make_estimator, make_controller, config.robot, config.dt, config, recovery
            )
        else:
            policy = Follower(perceive, make_estimator, make_controller, config.robot, config.dt, recovery, config)
    check_match(policy, config, _mode(spec, policy))
    return policy


def config_of(env: Any) -> EnvConfig:
    """Return the settings of an environment, wrapped or not, or the settings themselves."""
    config = env if isinstance(env, EnvConfig) else getattr(getattr(env, "unwrapped", env), "config", None)
    if not isinstance(config, EnvConfig):
        raise ValueError(f"{env!r} has no EnvConfig; expected a FollowEnv, a FollowVectorEnv or an EnvConfig")
    return config


def check_match(policy: Any, config: EnvConfig, obs: str | None = None) -> None:
    """Raise a ValueError if a policy was built for another robot, camera, rate or task, or reads other observations.

    Args:
        policy: what shall drive; one without `config` says nothing of what it was built for.
        config: of the environment.
        obs: the observation mode that the policy reads, if known.
    """
    if obs is not None and obs != config.obs:
        raise ValueError(
            f"the follower reads obs={obs!r}, but the environment gives obs={config.obs!r}; make it with obs={obs!r} "
            "(`observation_settings` says what a follower needs)"
        )
    if isinstance(policy, Agent) and (config.control_hz, config.action) != (CONTROL_HZ, "twist"):
        raise ValueError(
            f"the agent {policy.name} was trained at {CONTROL_HZ} Hz with action='twist', but the environment has "
            f"control_hz={config.control_hz} and action={config.action!r}; make it with those of the training"
        )
    built = getattr(policy, "config", None)
    if not isinstance(built, EnvConfig):
        return
    for name in ("robot", "camera", "control_hz", "latency_s", "action", "task"):
        one, other = getattr(built, name), getattr(config, name)
        if one != other and not (name == "camera" and not config.obs.startswith("rgbd")):
            raise ValueError(
                f"the follower was built for another {name} ({_difference(one, other)}); build it from this "
                "environment: build_follower(spec, env)"
            )


def _mode(spec: FollowerSpec, policy: Any) -> str | None:
    """Return the observation mode that a follower reads, or None if nothing tells."""
    if spec.policy is None:
        return str(observation_settings(spec)["obs"])
    return spec.observation or _reads(policy)


def _reads(policy: Any) -> str | None:
    """Return the observation mode that a policy says it reads, or that of the environment it was built for."""
    told = getattr(policy, "observation", None)
    if told is None and isinstance(built := getattr(policy, "config", None), EnvConfig):
        told = built.obs
    return told


def _difference(one: Any, other: Any) -> str:
    if not dataclasses.is_dataclass(one):
        return f"{one!r}, here {other!r}"
    names = [f.name for f in dataclasses.fields(one) if getattr(one, f.name) != getattr(other, f.name)]
    return f"{names[0]} {getattr(one, names[0])!r}, here {getattr(other, names[0])!r}"


def _fresh(registry: Registry[Any], part: Any, given: Any) -> Any:
    """Return a new component of a specification; a class or a function is called, an object is copied and reset."""
    if callable(part) and not isinstance(part, str | Mapping):
        return part(given)
    if isinstance(part, str | Mapping):
        return registry.build(part, given)
    fresh = copy.deepcopy(part)
    fresh.reset()
    return fresh


def _noise(given: Any) -> NoiseModel:
    return given if isinstance(given, NoiseModel) else NoiseModel(**{key: tuple(pair) for key, pair in given.items()})


def _policy(spec: FollowerSpec, config: EnvConfig) -> Any:
    policy = spec.policy
    if isinstance(policy, Mapping):
        return POLICIES.build(policy, config)
    if not isinstance(policy, str | Path):
        return policy
    text = str(policy)
    if text in POLICIES:
        return POLICIES.build(text, config)
    if text in shipped():
        return load_agent(text)
    path = Path(text)
    if path.exists():
        return _load(path)
    made = POLICIES.get(text)
    if hasattr(made, "predict") and not isinstance(made, type):
        return made
    return made(config) if inspect.signature(made).parameters else made()


def _load(path: Path) -> Policy:
    """Return the agent of a file, or of the folder that `follow train` wrote."""
    if path.is_dir():
        found = [*sorted(path.glob("*.safetensors")), *sorted(path.glob("*.zip"))]
        if not found:
            raise ValueError(f"{path} holds no agent; expected a folder that `follow train` wrote, or an SB3 zip")
        path = found[0]
    return _read(path, path.stat().st_mtime_ns)


@functools.lru_cache(maxsize=8)
def _read(path: Path, written: int) -> Policy:
    """Return the agent of a file, read once for all episodes until it is `written` again."""
    if path.suffix == ".zip":
        from baselines.followers.sb3 import SB3Policy

        return SB3Policy(path)
    return load_agent(path)


def make_follower(
    estimator: str = "akf",
    perception: str = "emulated",
    scene: str = "corridor",
    controller: Any = "pi",
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
        controller: a component of `CONTROLLERS`; `pi` has the paper's gains.
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
    config = EnvConfig(robot=robot or RobotConfig(), camera=camera or CameraConfig(), control_hz=control_hz)
    CONTROLLERS.build(controller, config)
    if perception == "detector":
        make_tracker = _tracker_factory(detector, camera or CameraConfig(), robot or RobotConfig(), control_hz)
        return TrackingFollower(
            make_tracker,
            lambda: make_estimator(estimator, noise, alpha),
            lambda: CONTROLLERS.build(controller, config),
            robot=robot,
            dt=1.0 / control_hz,
        )
    rule = cast(Rule, sensor) if perception == "mask" else "six_smallest"
    perceive = make_perception(perception, camera, robot, rule)
    if any(bias):
        perceive = functools.partial(_corrected, perceive, bias)
    return Follower(
        perceive,
        lambda: make_estimator(estimator, noise, alpha),
        lambda: CONTROLLERS.build(controller, config),
        robot=robot,
        dt=1.0 / control_hz,
    )


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
