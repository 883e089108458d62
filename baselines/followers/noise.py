"""The noise that a filter is told, from the sensor's settings: whatever the room, one sensor has one noise."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from baselines.followers.calibration import detector_settings, settings
from follow_env.config import EnvConfig
from follow_env.registry import choose
from tracker.estimators.base import NoiseModel, Pair
from tracker.person_tracker import TrackerSettings

CALIBRATED_HZ = 30.0
LEAST_VARIANCE = 1e-8
"""A sensor without noise still has this variance, rad^2 and m^2: a filter cannot divide by zero."""


def noise_of(config: EnvConfig, perception: Any) -> NoiseModel:
    """Return R and Q for a perception under an environment's settings.

    R: of `emulated` the squares of the sensor's stated standard deviations (`MeasurementConfig`); of `mask` and
    `detector` the variances that rendered frames gave for the rule that reads the depth (`follow calibrate`). Q: the
    largest motion of a person on paper B's routes that the filters' model lacks, in one control period; it grows with
    the square of the period, and n steps between two measurements share n^2 Q.

    Args:
        config: of the environment.
        perception: a name or a mapping; one of one's own has the noise of `emulated`.

    Raises:
        ValueError: for a depth rule whose noise was not calibrated; give the follower's `noise`.
    """
    name = perception["name"] if isinstance(perception, Mapping) else perception
    rule = perception.get("rule", "six_smallest") if isinstance(perception, Mapping) else "six_smallest"
    motion = settings()["noise"]["emulated/default"]["corridor"]
    slower = (CALIBRATED_HZ / config.control_hz) ** 2
    if name == "detector":
        variances = detector_settings()["noise"]["detector/six_smallest"]["corridor"]["measurement"]
        slower *= TrackerSettings.for_rate(config.control_hz).every
    elif name == "mask":
        noise = settings()["noise"]
        variances = noise[choose("calibrated noise of", f"mask/{rule}", noise)]["corridor"]["measurement"]
    elif name == "truth":
        variances = settings()["noise"]["truth/exact"]["corridor"]["measurement"]
    else:
        sensor = config.sensor.measurement
        variances = [sensor.bearing_noise**2, sensor.distance_noise**2]
    measurement = max(variances[0], LEAST_VARIANCE), max(variances[1], LEAST_VARIANCE)
    process: Pair = (slower * motion["process"][0], slower * motion["process"][1])
    return NoiseModel(measurement, process, (motion["acceleration"][0], motion["acceleration"][1]))
