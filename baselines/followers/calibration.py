"""The calibrated parameters, read from `calibration.json`: measured errors, emulated sensors, noise of the filters.

`follow calibrate` made the file (`papers.dong2018.calibrate`); nothing in it is tuned by hand. What belongs to the
shipped detector stands beside it in `calibration_detector.json` (`follow calibrate --detector`), as it changes with the
weights.
"""

from __future__ import annotations

import functools
import json
from importlib import resources
from typing import Any

from follow_env.registry import choose
from tracker.estimators.base import NoiseModel


@functools.cache
def settings() -> dict[str, Any]:
    """Return the calibration: measured errors, sensors, noise covariances and how each was found."""
    text = resources.files("baselines.followers").joinpath("calibration.json").read_text(encoding="utf-8")
    return dict(json.loads(text))


@functools.cache
def detector_settings() -> dict[str, Any]:
    """Return the calibration of the shipped detector; raise FileNotFoundError if there is none."""
    file = resources.files("baselines.followers").joinpath("calibration_detector.json")
    if not file.is_file():
        raise FileNotFoundError("the shipped detector is not calibrated; measure it with `follow calibrate --detector`")
    return dict(json.loads(file.read_text(encoding="utf-8")))


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
        perception: `truth`, `emulated`, `mask` or `detector`.
        scene: `corridor` or `indoor`.
        sensor_name: of the emulated sensor (`default` is that of the environments) or the depth rule of `mask` and
            `detector`.
    """
    noise = (detector_settings() if perception == "detector" else settings())["noise"]
    entry = noise[choose("noise of", f"{perception}/{sensor_name}", noise)]
    entry = entry[choose("scene", scene, entry)]
    return NoiseModel(tuple(entry["measurement"]), tuple(entry["process"]), tuple(entry["acceleration"]))
