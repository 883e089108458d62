"""`follow calibrate --detector`: the noise of the filters behind a detector, by the rule of `calibrate`.

A robot that knows the truth follows the person on seeds of the calibration while the detector and the tracker look on.
R is the covariance of the accepted measurements without outliers; Q is the smallest whole multiple of (r T)^2, T being
the time between measurements, at which clean measurements that come as rarely are inflated in fewer than 2 alpha.
"""

from __future__ import annotations

import dataclasses
import functools
import math
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path
from typing import Any

from baselines.benchmark.build import CAMERA, weights_digest
from baselines.benchmark.cells import SCENES, SENSORS
from baselines.followers import calibration
from baselines.papers.dong2018.calibrate import (
    ALPHA,
    DT,
    FIRST_SEED,
    RULE_EPISODES,
    Samples,
    error_statistics,
    noise_by_rule,
    truth_driver,
    truth_observation,
    without_outliers,
    write,
)
from follow_env.config import CameraConfig, RobotConfig
from follow_env.envs.follow import FollowEnv
from follow_env.geometry import CameraMount, Intrinsics
from tracker.person_tracker import Detector, PersonTracker, TrackerSettings

TRACKER = TrackerSettings.for_rate(1.0 / DT)


def main(weights: Path, out: Path, jobs: int = 1) -> dict[str, Any]:
    """Measure the detector with these weights, write its calibration to `out` (JSON) and return its content."""
    seeds = range(FIRST_SEED, FIRST_SEED + RULE_EPISODES)
    motion = calibration.settings()["largest_unmodeled_motion"]
    with ProcessPoolExecutor(jobs) as pool:
        play = functools.partial(_play, weights)
        errors = {scene: list(pool.map(play, [scene] * len(seeds), seeds)) for scene in SCENES}
        frames = {scene: error_statistics(errors[scene], TRACKER.every * DT) for scene in SCENES}
        sensors = [without_outliers(frames[scene]) for scene in SCENES]
        rule = functools.partial(noise_by_rule, motion=motion, every=TRACKER.every)
        noise = dict(zip(SCENES, pool.map(rule, SCENES, sensors), strict=True))
    how = {
        "weights_sha256": weights_digest(weights),
        "seeds": [seeds.start, seeds.stop],
        "camera": CAMERA,
        "alpha": ALPHA,
        "control_hz": round(1.0 / DT),
        "tracker": dataclasses.asdict(TRACKER),
    }
    name = f"detector/{SENSORS['detector']}"
    return write({"how": how, "frames": {s: {name: frames[s]} for s in SCENES}, "noise": {name: noise}}, out)


def tracked_errors(detector: Detector, scene: str, seed: int) -> Samples:
    """Play an episode by the truth; return the errors of the accepted measurements in the processed frames.

    The frames of a confirmation, in which nothing can be accepted, are left out.
    """
    env = FollowEnv(scene=scene, obs="rgbd", camera=CAMERA)
    driver, state = truth_driver(), None
    camera, robot = CameraConfig(**CAMERA), RobotConfig()
    intrinsics = Intrinsics.from_hfov(camera.width, camera.height, math.radians(camera.hfov_deg))
    tracker = PersonTracker(detector, intrinsics, CameraMount(robot.camera_forward, robot.camera_height), TRACKER)
    errors: Samples = []
    observation, info = env.reset(seed=seed)
    ended = False
    while not ended:
        track = tracker.update(observation["rgb"], observation["depth"], tuple(observation["twist"].tolist()))
        if track.processed and track.position is not None:
            errors.append(None)
            if track.measurement is not None:
                x, y, _ = track.measurement
                errors[-1] = (math.atan2(y, x) - info["bearing"], x - info["distance"], info["distance"])
        if track.alarm:
            tracker.confirm()
        action, state = driver.predict(truth_observation(info), state)
        observation, _, terminated, truncated, info = env.step(action)
        ended = terminated or truncated
    env.close()
    return errors


def _play(weights: Path, scene: str, seed: int) -> Samples:
    return tracked_errors(_detector(weights), scene, seed)


@functools.cache
def _detector(weights: Path) -> Detector:
    """Return the detector with these weights, loaded once in a process."""
    from tracker.detection.detector import PersonDetector

    return PersonDetector(weights=weights)
