"""`follow calibrate`: measures and fits everything that Table 1 needs fixed before any filter is compared.

1. Rendered frames of each scene (truth-driven robot, seeds of their own) give the errors of each depth rule: bias,
   spread, correlation, outliers (`OUTLIER` away from the median), misses.
2. The emulated sensor keeps the shape that the rule `SHAPE_RULE` has; one scale per scene and quantity makes its RMSE
   the paper's No filter row. The family has other shapes, scaled in the same way.
3. R is the covariance without outliers. Q is the smallest whole multiple of (r dt)^2 at which clean measurements are
   inflated in fewer than 2 alpha of the steps on that axis (`papers`: the largest unmodeled rates r). The augmented
   filter's density follows the same rule, in multiples of a^2 dt, a the largest unmodeled acceleration.
"""

from __future__ import annotations

import dataclasses
import itertools
import json
import math
import statistics
import warnings
from collections.abc import Callable, Sequence
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path
from typing import Any, cast

import numpy as np

from baselines.benchmark.build import CAMERA
from baselines.benchmark.cells import DEPTH_RULES, SCENES
from baselines.followers.build import make_estimator
from baselines.followers.follower import Follower
from baselines.followers.perception import make_perception, perceive_measurement, perceive_state
from baselines.papers.dong2018.table1 import PAPER_RMSE
from follow_env.config import CameraConfig
from follow_env.envs.follow import FollowEnv
from follow_env.sensors import MeasurementConfig
from tracker.depth import RULES, Rule
from tracker.estimators import LockOutWarning, NoFilter
from tracker.estimators.base import NoiseModel

DT = 1.0 / 30.0
ALPHA = 0.05
FIRST_SEED = 10_000
FRAME_EPISODES, RULE_EPISODES = 20, 8
OUTLIER = (0.1, 0.3)
"""Errors farther than this from the median (of the distance: beyond it) are outliers, rad and m."""
WALKING_SPEED = 12.0 / 14.0
SHAPE_RULE = "grid_mean"
"""Mean over the box: the reading of "z_c is measured by the camera" that lets the background in (paper B, (25))."""
PAPER_NO_FILTER = {
    scene: (PAPER_RMSE[scene, "angle", "none"], PAPER_RMSE[scene, "distance", "none"] / 100.0) for scene in SCENES
}
"""Table 1's No filter row, rad and m."""
TRUTH_NOISE = MeasurementConfig(bearing_noise=1e-3, distance_noise=1e-2)

FAR_FROM = 1.7
"""Outlier shares are also told apart by the true distance, nearer and farther than this, m."""
Samples = list[tuple[float, float, float] | None]
"""Errors of bearing (rad) and distance (m), and the true distance (m); None = miss."""


def main(out: Path, jobs: int = 1) -> dict[str, Any]:
    """Measure and fit, write the calibration to `out` (JSON) and return its content."""
    seeds = range(FIRST_SEED, FIRST_SEED + FRAME_EPISODES)
    with ProcessPoolExecutor(jobs) as pool:
        frames = {scene: _summarize(list(pool.map(_frame_errors, [scene] * len(seeds), seeds))) for scene in SCENES}
        motion = _largest(list(pool.map(_unmodeled_motion, [s for s in SCENES for _ in seeds], [*seeds] * 2)))
        sensors = {"default": dict.fromkeys(SCENES, dataclasses.asdict(MeasurementConfig()))}
        for name, shape in _shapes(frames).items():
            sensors[name] = {scene: dataclasses.asdict(_fit(shape(scene), *PAPER_NO_FILTER[scene])) for scene in SCENES}
        wanted = {f"emulated/{name}": by_scene for name, by_scene in sensors.items()}
        for rule in DEPTH_RULES:
            wanted[f"mask/{rule}"] = {
                scene: dataclasses.asdict(without_outliers(frames[scene][rule])) for scene in SCENES
            }
        wanted["truth/exact"] = dict.fromkeys(SCENES, dataclasses.asdict(TRUTH_NOISE))
        tasks = [
            (scene, MeasurementConfig(**by_scene[scene]), motion) for by_scene in wanted.values() for scene in SCENES
        ]
        noise = iter(list(pool.map(noise_by_rule, *zip(*tasks, strict=True))))
    content: dict[str, Any] = {
        "how": {
            "seeds": [seeds.start, seeds.stop],
            "camera": CAMERA,
            "shape_rule": SHAPE_RULE,
            "alpha": ALPHA,
            "control_hz": round(1.0 / DT),
            "outlier_thresholds_rad_m": OUTLIER,
            "far_from_m": FAR_FROM,
            "paper_no_filter_rad_m": PAPER_NO_FILTER,
        },
        "frames": frames,
        "largest_unmodeled_motion": motion,
        "sensors": sensors,
        "noise": {name: {scene: next(noise) for scene in SCENES} for name in wanted},
    }
    return write(content, out)


def write(content: dict[str, Any], out: Path) -> dict[str, Any]:
    """Write a calibration as JSON with six significant digits and return what was written."""
    text = json.dumps(_rounded(content), indent=1) + "\n"
    out.write_text(text, encoding="utf-8")
    return dict(json.loads(text))


def truth_driver() -> Follower:
    """Return who follows by the truth, so that no filter's error enters a calibration."""
    return Follower(perceive_state, NoFilter)


def truth_observation(info: dict[str, Any]) -> np.ndarray:
    """Return what that driver reads, from the info of an environment."""
    return np.array((info["bearing"], info["distance"], 0.0, 0.0, *info["twist"], 0.0, 0.0))


def _frame_errors(scene: str, seed: int) -> dict[str, Samples]:
    """Play an episode by the truth; return the errors of each depth rule on its frames."""
    env, driver, state = FollowEnv(scene=scene, obs="rgbd_box", camera=CAMERA), truth_driver(), None
    rules = {rule: make_perception("mask", CameraConfig(**CAMERA), rule=cast(Rule, rule)) for rule in RULES}
    errors: dict[str, Samples] = {rule: [] for rule in rules}
    observation, info = env.reset(seed=seed)
    ended = False
    while not ended:
        for rule, perceive in rules.items():
            measurement, _ = perceive(observation)
            errors[rule].append(
                None
                if measurement is None
                else (measurement[0] - info["bearing"], measurement[1] - info["distance"], info["distance"])
            )
        action, state = driver.predict(truth_observation(info), state)
        observation, _, terminated, truncated, info = env.step(action)
        ended = terminated or truncated
    env.close()
    return errors


def _summarize(episodes: Sequence[dict[str, Samples]]) -> dict[str, dict[str, Any]]:
    """Return, for each rule, the statistics of its errors over the episodes."""
    return {rule: error_statistics([episode[rule] for episode in episodes], DT) for rule in RULES}


def error_statistics(samples: Sequence[Samples], dt: float) -> dict[str, Any]:
    """Return misses, bias, spread, correlation and outliers of the errors of some episodes, sampled every `dt` s."""
    found = [[error for error in episode if error is not None] for episode in samples]
    count = sum(len(episode) for episode in samples)
    entry: dict[str, Any] = {"miss_share": 1.0 - sum(map(len, found)) / count}
    for axis, name in enumerate(("bearing", "distance")):
        series = [[error[axis] for error in episode] for episode in found]
        values = [value for episode in series for value in episode]
        middle = statistics.median(values)
        far = [[_is_outlier(value - middle, axis) for value in episode] for episode in series]
        core = [
            v for episode, flags in zip(series, far, strict=True) for v, f in zip(episode, flags, strict=True) if not f
        ]
        beyond = sorted(v - middle for v in values if _is_outlier(v - middle, axis))
        runs = sum(flags[i] and not (i and flags[i - 1]) for flags in far for i in range(len(flags)))
        entry[name] = {
            "rmse": math.sqrt(math.fsum(v * v for v in values) / len(values)),
            "bias": statistics.fmean(core),
            "spread": statistics.pstdev(core),
            "correlation_s": _correlation_time(series, far, statistics.fmean(core), dt),
            "outlier_share": len(beyond) / len(values),
            "outlier_duration_s": dt * len(beyond) / runs if runs else 0.0,
            "outlier_low": beyond[len(beyond) // 20] if beyond else 0.0,
            "outlier_high": beyond[-1 - len(beyond) // 20] if beyond else 0.0,
        }
        for side, farther in (("nearer", False), ("farther", True)):
            flags = [
                _is_outlier(error[axis] - middle, axis)
                for episode in found
                for error in episode
                if (error[2] > FAR_FROM) == farther
            ]
            entry[name][f"{side}_outlier_share"] = sum(flags) / len(flags)
    return entry


def _is_outlier(offset: float, axis: int) -> bool:
    """Whether an error so far from the median is an outlier: of the distance, only background counts."""
    return (offset if axis else abs(offset)) > OUTLIER[axis]


def _correlation_time(series: list[list[float]], far: list[list[bool]], mean: float, dt: float) -> float:
    """Time constant of the regular errors from their correlation over one step, s."""
    products = squares = 0.0
    for values, flags in zip(series, far, strict=True):
        for i in range(1, len(values)):
            if not (flags[i] or flags[i - 1]):
                products += (values[i] - mean) * (values[i - 1] - mean)
                squares += (values[i] - mean) ** 2
    return -dt / math.log(products / squares) if 0.0 < products < squares else 0.0


def without_outliers(rule: dict[str, Any]) -> MeasurementConfig:
    """Return the statistics of measured errors as an emulated sensor without outliers."""
    bearing, distance = rule["bearing"], rule["distance"]
    return MeasurementConfig(
        bearing_bias=bearing["bias"],
        bearing_noise=bearing["spread"],
        bearing_correlation_s=bearing["correlation_s"],
        distance_bias=distance["bias"],
        distance_noise=distance["spread"],
        distance_correlation_s=distance["correlation_s"],
        miss_share=rule["miss_share"],
    )


def _shapes(frames: dict[str, Any]) -> dict[str, Callable[[str], MeasurementConfig]]:
    """Return the shapes of the fitted sensor and of the family, before scaling, by scene."""

    def measured(rule: str) -> Callable[[str], MeasurementConfig]:
        def shape(scene: str) -> MeasurementConfig:
            distance = frames[scene][rule]["distance"]
            return dataclasses.replace(
                without_outliers(frames[scene][rule]),
                **{key: distance[key] for key in distance if key.startswith("outlier_")},
            )

        return shape

    fitted = measured(SHAPE_RULE)
    stated = MeasurementConfig(
        bearing_correlation_s=0.0, distance_bias=-0.115, distance_noise=0.101, distance_correlation_s=0.0,
        outlier_share=0.05, outlier_duration_s=0.0, outlier_low=1.0, outlier_high=3.0,
    )  # fmt: skip
    return {
        "fitted": fitted,
        "surface": measured("six_smallest"),
        "white": lambda scene: dataclasses.replace(
            fitted(scene), bearing_correlation_s=0.0, distance_correlation_s=0.0, outlier_duration_s=0.0
        ),
        "bursts": lambda scene: dataclasses.replace(fitted(scene), outlier_duration_s=0.5),
        "unbiased": lambda scene: dataclasses.replace(fitted(scene), bearing_bias=0.0, distance_bias=0.0),
        "rare_far": lambda scene: stated,
    }


def _fit(shape: MeasurementConfig, bearing_rmse: float, distance_rmse: float) -> MeasurementConfig:
    """Scale the errors of each quantity by one factor so that their root mean square is the given one, rad and m."""
    bearing = bearing_rmse / math.hypot(shape.bearing_bias, shape.bearing_noise)
    low, high, share = shape.outlier_low, shape.outlier_high, shape.outlier_share
    mean, square = 0.5 * (low + high), (low * low + low * high + high * high) / 3.0
    outliers = share * (square + 2.0 * shape.distance_bias * mean)
    distance = distance_rmse / math.sqrt(shape.distance_bias**2 + shape.distance_noise**2 + outliers)
    return dataclasses.replace(
        shape,
        bearing_bias=bearing * shape.bearing_bias,
        bearing_noise=bearing * shape.bearing_noise,
        distance_bias=distance * shape.distance_bias,
        distance_noise=distance * shape.distance_noise,
        outlier_low=distance * low,
        outlier_high=distance * high,
    )


def _unmodeled_motion(scene: str, seed: int) -> tuple[float, float, float, float]:
    """Return the largest |rate| and |acceleration| per axis that the robot's twist does not explain in an episode."""
    env, driver, state = FollowEnv(scene=scene, obs="state"), truth_driver(), None
    observation, info = env.reset(seed=seed)
    rates: list[tuple[float, float]] = []
    ended = False
    while not ended:
        before = info
        action, state = driver.predict(observation, state)
        observation, _, terminated, truncated, info = env.step(action)
        v, omega = info["twist"]
        rates.append(
            (
                (info["bearing"] - before["bearing"]) / DT + float(omega),
                (info["distance"] - before["distance"]) / DT + float(v),
            )
        )
        ended = terminated or truncated
    env.close()
    steps = list(itertools.pairwise(rates))
    largest_rates = [max(abs(rate[axis]) for rate in rates) for axis in (0, 1)]
    largest_accelerations = [max(abs(b[axis] - a[axis]) / DT for a, b in steps) for axis in (0, 1)]
    return largest_rates[0], largest_rates[1], largest_accelerations[0], largest_accelerations[1]


def _largest(rows: Sequence[tuple[float, float, float, float]]) -> dict[str, float]:
    names = ("bearing_rad_s", "distance_m_s", "bearing_rad_s2", "distance_m_s2")
    return {name: max(row[i] for row in rows) for i, name in enumerate(names)}


def noise_by_rule(scene: str, sensor: MeasurementConfig, motion: dict[str, float], every: int = 1) -> dict[str, Any]:
    """Return R, Q and the augmented filter's density for a sensor, with the multiples and inflated shares found.

    Args:
        scene: in which the clean measurements are simulated.
        sensor: its errors.
        motion: the largest unmodeled rates and accelerations.
        every: only every so many-th step is measured. Q must cover (r T)^2 over the time T between measurements, so
            each of the n steps takes n (r dt)^2; the density's unit is a^2 T.
    """
    clean = dataclasses.replace(sensor, outlier_share=0.0, miss_share=0.0)
    measurement = (clean.bearing_noise**2, clean.distance_noise**2)
    unit = (every * (motion["bearing_rad_s"] * DT) ** 2, every * (WALKING_SPEED * DT) ** 2)
    process, multiples, shares = _smallest_multiples("akf", scene, clean, measurement, unit, (1e-4, 1e-4), every)
    unit_cv = (motion["bearing_rad_s2"] ** 2 * DT * every, motion["distance_m_s2"] ** 2 * DT * every)
    density, multiples_cv, shares_cv = _smallest_multiples("akf_cv", scene, clean, measurement, process, unit_cv, every)
    return {
        "measurement": measurement,
        "process": process,
        "multiples": multiples,
        "inflated_shares": shares,
        "acceleration": density,
        "acceleration_multiples": multiples_cv,
        "acceleration_inflated_shares": shares_cv,
    }


def _smallest_multiples(
    estimator: str,
    scene: str,
    clean: MeasurementConfig,
    measurement: tuple[float, float],
    process: tuple[float, float],
    acceleration: tuple[float, float],
    every: int,
) -> tuple[tuple[float, float], list[int], list[float]]:
    """Raise the multiple of the estimator's own noise per axis until it inflates fewer than 2 alpha of the steps."""
    env = FollowEnv(scene=scene, sensor={"measurement": dataclasses.asdict(clean)})
    multiples = [1, 1]
    unit = process if estimator == "akf" else acceleration
    while True:
        scaled = (multiples[0] * unit[0], multiples[1] * unit[1])
        noise = NoiseModel(measurement, *((scaled, acceleration) if estimator == "akf" else (process, scaled)))
        shares = _inflated_shares(env, estimator, noise, every)
        if max(shares) < 2.0 * ALPHA:
            env.close()
            return scaled, multiples, shares
        multiples = [m + (share >= 2.0 * ALPHA) for m, share in zip(multiples, shares, strict=True)]


def _inflated_shares(env: FollowEnv, estimator: str, noise: NoiseModel, every: int = 1) -> list[float]:
    """Share of the measured steps in which the filter inflates, per axis, over the calibration episodes."""
    policy = Follower(perceive_measurement, lambda: make_estimator(estimator, noise, ALPHA))
    inflated, measured = [0, 0], 0
    for seed in range(FIRST_SEED, FIRST_SEED + RULE_EPISODES):
        observation, _ = env.reset(seed=seed)
        state, ended, step = None, False, 0
        while not ended:
            if step % every:
                observation[:3] = 0.0  # bearing, distance, validity
            with warnings.catch_warnings():
                warnings.simplefilter("ignore", LockOutWarning)  # what is looked for here
                action, state = policy.predict(observation, state)
            measured += step % every == 0
            step += 1
            for axis in (0, 1):
                inflated[axis] += state.estimate is not None and state.estimate.action[axis] == "inflate"
            observation, _, terminated, truncated, _ = env.step(action)
            ended = terminated or truncated
    return [count / measured for count in inflated]


def _rounded(value: Any) -> Any:
    """Round every float to six significant digits, so that the file reads well and is the same on any machine."""
    if isinstance(value, float):
        return float(f"{value:.6g}")
    if isinstance(value, dict):
        return {key: _rounded(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [_rounded(item) for item in value]
    return value
