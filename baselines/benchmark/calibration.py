"""The benchmark's fixed parameters, read from `calibration.json`, and the environment and follower of a cell.

`follow calibrate` (`baselines.benchmark.calibrate`) made the file; nothing here is tuned by hand.
"""

from __future__ import annotations

import functools
import json
from collections.abc import Hashable, Mapping
from importlib import resources
from typing import TYPE_CHECKING, Any

from baselines.policy import OBSERVATION_OF, Follower, NoiseModel, make_follower
from follow_env.config import CameraConfig, choose

if TYPE_CHECKING:
    import gymnasium

    from baselines.benchmark.cells import Cell

CAMERA = {"width": 160, "height": 120}
"""Picture of the `mask` rung, px."""


@functools.cache
def settings() -> dict[str, Any]:
    """Return the calibration: measured errors, sensors, noise covariances and how each was found."""
    text = resources.files("baselines.benchmark").joinpath("calibration.json").read_text(encoding="utf-8")
    return dict(json.loads(text))


def family() -> list[str]:
    """Names of the emulated sensors that all match the paper's No filter row, the fitted one first."""
    return [name for name in settings()["sensors"] if name != "default"]


def sensor(name: str, scene: str) -> dict[str, float]:
    """Return the `MeasurementConfig` entries of the emulated sensor `name` in `scene`."""
    sensors = settings()["sensors"]
    return dict(sensors[choose("sensor", name, sensors)][scene])


def noise_model(perception: str, scene: str, sensor_name: str) -> NoiseModel:
    """Return R and Q by the rule of the benchmark for a perception in a scene.

    Args:
        perception: `truth`, `emulated` or `mask`.
        scene: `corridor` or `indoor`.
        sensor_name: of the emulated sensor (`default` is that of the environments) or the depth rule of `mask`.
    """
    noise = settings()["noise"]
    entry = noise[choose("noise of", f"{perception}/{sensor_name}", noise)]
    entry = entry[choose("scene", scene, entry)]
    return NoiseModel(tuple(entry["measurement"]), tuple(entry["process"]), tuple(entry["acceleration"]))


def environment_kwargs(cell: Cell, camera: Mapping[str, int] = CAMERA) -> dict[str, Any]:
    """Return what `FollowEnv` is made with for a cell; `camera` is for the `mask` rung."""
    kwargs: dict[str, Any] = {"scene": cell.scene, "obs": OBSERVATION_OF[cell.perception]}
    if cell.perception == "emulated":
        kwargs["sensor"] = {"measurement": sensor(cell.sensor, cell.scene)}
    if cell.perception == "mask":
        kwargs["camera"] = dict(camera)
    return kwargs


def environment_key(cell: Cell) -> Hashable:
    """Cells with equal keys share an environment."""
    return json.dumps(environment_kwargs(cell), sort_keys=True)


def environment(cell: Cell) -> gymnasium.Env:
    """Return the environment of a cell."""
    from follow_env.env import FollowEnv

    return FollowEnv(**environment_kwargs(cell))


def follower(cell: Cell, camera: Mapping[str, int] = CAMERA) -> Follower:
    """Return the follower of a cell; `camera` is that of its environment."""
    noise = noise_model(cell.perception, cell.scene, cell.sensor)
    q_bearing, q_distance = noise.process
    scaled = NoiseModel(noise.measurement, (cell.q_scale * q_bearing, cell.q_scale * q_distance), noise.acceleration)
    return make_follower(
        cell.estimator,
        cell.perception,
        cell.scene,
        cell.controller,
        scaled,
        cell.alpha,
        cell.sensor,
        CameraConfig(**camera),
    )
