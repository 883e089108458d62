"""From a cell of the benchmark to its environment and its follower."""

from __future__ import annotations

import functools
import hashlib
import importlib.metadata
import json
from collections.abc import Hashable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from baselines.benchmark.cells import ESTIMATORS, PIXELS, Cell
from baselines.benchmark.trial import Trial
from baselines.followers.build import build_follower, make_follower, observation_settings
from baselines.followers.calibration import detector_settings, noise_model, sensor
from baselines.followers.perception import OBSERVATION_OF
from baselines.followers.policy import Policy
from baselines.followers.references import POLICIES
from follow_env.config import CameraConfig
from follow_env.registry import choose
from tracker.estimators.base import NoiseModel, Pair
from tracker.person_tracker import Detector

if TYPE_CHECKING:
    import gymnasium

CAMERA = {"width": 320, "height": 240}
"""Picture of the `mask` and `detector` rungs, px."""
PICTURE = {"width": 84, "height": 84}
"""Picture of the agents that drive from pixels, px."""


UNBIASED = "pi_unbiased"
"""The reference when somebody has taken the sensor's constant bias off each measurement."""


def cell_of(policy: str, scene: str) -> Cell:
    """Return the cell in which a policy drives with the environments' own sensor.

    Args:
        policy: an estimator (with the paper's PI), a floor or ceiling, or an agent.
        scene: scene name.

    Raises:
        ValueError: for an unknown policy; names the nearest.
    """
    if policy in ESTIMATORS:
        return Cell("emulated", scene, policy, sensor="default")
    if policy == UNBIASED:
        return Cell("emulated", scene, "akf", policy, sensor="default")
    if policy == "oracle":
        return Cell("truth", scene, "none", policy)
    if policy in POLICIES:
        return Cell("emulated", scene, "none", policy, sensor="default")
    from baselines.followers.agents import load_agent, shipped

    name = choose("policy", policy, (*ESTIMATORS, UNBIASED, *POLICIES, *shipped()))
    if load_agent(name).observation == "rgbd_uint8":
        return Cell(PIXELS, scene, "none", name)
    return Cell("emulated", scene, "none", name, sensor="default")


def environment_kwargs(cell: Cell, camera: Mapping[str, int] = CAMERA) -> dict[str, Any]:
    """Return what `FollowEnv` is made with for a cell; `camera` is for the `mask` and `detector` rungs."""
    kwargs: dict[str, Any] = {"scene": cell.scene}
    if cell.walking_speed is not None:
        kwargs["walking_speed"] = cell.walking_speed
    if cell.perception == PIXELS:
        return {**kwargs, "obs": "rgbd_uint8", "camera": dict(PICTURE)}
    kwargs["obs"] = OBSERVATION_OF[cell.perception]
    if cell.perception == "emulated":
        kwargs["sensor"] = {"measurement": sensor(cell.sensor, cell.scene)}
    if cell.perception in ("mask", "detector"):
        kwargs["camera"] = dict(camera)
    return kwargs


def environment_key(cell: Cell) -> Hashable:
    """Cells with equal keys share an environment."""
    return json.dumps(environment_kwargs(cell), sort_keys=True)


def environment(cell: Cell) -> gymnasium.Env:
    """Return the environment of a cell."""
    from follow_env.envs.follow import FollowEnv

    return FollowEnv(**environment_kwargs(cell))


def driver(cell: Cell, camera: Mapping[str, int] = CAMERA) -> Policy:
    """Return what drives in a cell: the paper's follower, a floor or ceiling, or a learned agent.

    Args:
        cell: the factors.
        camera: that of its environment.
    """
    if cell.controller in POLICIES:
        return POLICIES.get(cell.controller)()
    if cell.controller not in ("pi", UNBIASED):
        from baselines.followers.agents import load_agent

        return load_agent(cell.controller, cell.scene)
    noise = noise_model(cell.perception, cell.scene, cell.sensor)
    q_bearing, q_distance = noise.process
    scaled = NoiseModel(noise.measurement, (cell.q_scale * q_bearing, cell.q_scale * q_distance), noise.acceleration)
    return make_follower(
        cell.estimator,
        cell.perception,
        cell.scene,
        "pi",
        scaled,
        cell.alpha,
        cell.sensor,
        CameraConfig(**camera),
        detector=shipped_detector() if cell.perception == "detector" else None,
        bias=_bias(cell) if cell.controller == UNBIASED else (0.0, 0.0),
    )


def settings_of(played: Cell | Trial, camera: Mapping[str, int] = CAMERA) -> dict[str, Any]:
    """Return what `FollowEnv` is made with for a cell or a trial; `camera` is the size unless another is asked for."""
    if isinstance(played, Cell):
        return {**environment_kwargs(played), "camera": dict(camera)}
    return {
        "camera": dict(camera),
        **played.scenario.settings,
        **observation_settings(played.follower),
        **played.changes,
    }


def policy_of(played: Cell | Trial, env: Any, camera: Mapping[str, int] = CAMERA) -> Policy:
    """Return what drives in a cell or a trial."""
    return driver(played, camera) if isinstance(played, Cell) else build_follower(played.follower, env)


def title_of(played: Cell | Trial) -> str:
    """Return how a picture or a dataset names a cell or a trial."""
    if isinstance(played, Cell):
        return f"{played.scene}, {played.perception}, {played.estimator} + PI"
    return f"{played.suite} {played.scenario.name}, {played.follower.name}"


@functools.cache
def shipped_detector() -> Detector:
    """Return the detector of the `detector` rung: loaded once in a process, and computing in one thread of it."""
    from tracker.detection.detector import PersonDetector

    return PersonDetector()


def detector_identity() -> dict[str, Any]:
    """Return what of the shipped detector changes an episode's result; JSON-able.

    Raises:
        FileNotFoundError: if its weights or its calibration are missing.
        ValueError: if the calibration is that of other weights.
    """
    from tracker.detection.detector import shipped_weights

    weights, calibration = weights_digest(shipped_weights()), detector_settings()
    if calibration["how"]["weights_sha256"] != weights:
        raise ValueError(
            "the calibration of the detector is that of other weights; measure the shipped ones with "
            "`follow calibrate --detector`"
        )
    return {"weights_sha256": weights, "torch": importlib.metadata.version("torch"), "calibration": calibration}


def weights_digest(weights: Path) -> str:
    """Return the SHA-256 of a file of weights, as hexadecimal text."""
    return hashlib.sha256(weights.read_bytes()).hexdigest()


def _bias(cell: Cell) -> Pair:
    errors = sensor(cell.sensor, cell.scene)
    return errors["bearing_bias"], errors["distance_bias"]
