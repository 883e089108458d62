"""A small world with the benchmark's interface, so that what surrounds an episode is tested in milliseconds a run.

The follower and its estimators are the real ones; robot, person and sensor are a few lines of kinematics. A module of
its own, because worker processes must be able to import it: `python -m synthetic` runs a small reproduction.
"""

import dataclasses
import functools
import math
import os
import sys
import time
from pathlib import Path

import gymnasium as gym
import numpy as np

from baselines.benchmark.cells import Cell
from baselines.benchmark.player import Episode, play
from baselines.benchmark.provenance import Plan
from baselines.followers.build import make_estimator
from baselines.followers.follower import Follower
from baselines.followers.perception import perceive_measurement
from baselines.papers.dong2018.reproduce import reproduce
from tracker.estimators.base import NoiseModel

DT = 1.0 / 30.0
SENSORS = ("clean", "heavy_tails")
CALIBRATION = {"sensor": "synthetic", "sensors": list(SENSORS)}


@dataclasses.dataclass(frozen=True)
class Sensor:
    bias: float
    noise: tuple[float, float]
    outliers: float


SENSOR = {
    ("corridor", "six_smallest"): Sensor(-0.11, (0.012, 0.01), 0.0),
    ("indoor", "six_smallest"): Sensor(-0.11, (0.012, 0.01), 0.0),
    ("corridor", "centroid"): Sensor(-0.10, (0.012, 0.01), 0.0),
    ("indoor", "centroid"): Sensor(-0.10, (0.012, 0.01), 0.0),
    ("corridor", "grid_mean"): Sensor(0.03, (0.012, 0.09), 0.05),
    ("indoor", "grid_mean"): Sensor(0.03, (0.012, 0.09), 0.10),
    ("corridor", "exact"): Sensor(0.0, (0.01, 0.1), 0.0),
    ("indoor", "exact"): Sensor(0.0, (0.01, 0.1), 0.0),
    ("corridor", "fitted"): Sensor(-0.115, (0.0135, 0.09), 0.01),
    ("indoor", "fitted"): Sensor(-0.115, (0.0165, 0.101), 0.05),
    ("corridor", "clean"): Sensor(-0.12, (0.014, 0.10), 0.0),
    ("indoor", "clean"): Sensor(-0.12, (0.017, 0.45), 0.0),
    ("corridor", "heavy_tails"): Sensor(-0.04, (0.010, 0.05), 0.02),
    ("indoor", "heavy_tails"): Sensor(-0.04, (0.012, 0.05), 0.08),
}


class World(gym.Env):
    """A person who walks on a gentle curve and a robot that does what it is told."""

    def __init__(self, cell: Cell, seconds: float) -> None:
        self._sensor = None if cell.perception == "truth" else SENSOR[cell.scene, cell.sensor]
        self._steps = round(seconds / DT)

    def reset(self, *, seed=None, options=None):
        super().reset(seed=seed)
        self._k = 0
        self._robot = [0.0, 0.0, 0.0]
        self._person = [1.5, 0.0, 0.0]
        self._turn = float(self.np_random.uniform(-0.5, 0.5))
        self._twist = (0.0, 0.0)
        return self._observe()

    def step(self, action):
        v, omega = float(action[0]) * 1.2, float(action[1]) * 2.0
        self._twist = (v, omega)
        self._advance(self._robot, v, omega)
        seconds = self._k * DT
        self._advance(self._person, 0.857 * min(1.0, seconds), self._turn if 2.0 < seconds < 3.5 else 0.0)
        self._k += 1
        observation, info = self._observe()
        return observation, 0.0, False, self._k >= self._steps, info

    @staticmethod
    def _advance(pose, v, omega):
        pose[0] += v * DT * math.cos(pose[2])
        pose[1] += v * DT * math.sin(pose[2])
        pose[2] += omega * DT

    def _observe(self):
        dx, dy = self._person[0] - self._robot[0], self._person[1] - self._robot[1]
        yaw = self._robot[2]
        distance, left = math.cos(yaw) * dx + math.sin(yaw) * dy, math.cos(yaw) * dy - math.sin(yaw) * dx
        bearing = math.atan2(left, distance)
        info = {
            "time": self._k * DT,
            "bearing": bearing,
            "distance": distance,
            "visible": abs(bearing) < 0.5,
            "collision": False,
            "collision_with": "none",
            "surface_distance": math.hypot(dx, dy) - 0.4,
            "robot_pose": np.array(self._robot),
            "person_pose": np.array(self._person),
            "twist": np.array(self._twist),
            "saturated": False,
        }
        measured = (bearing, distance)
        if self._sensor is not None:
            draws = self.np_random.normal(size=2)
            outlier = self.np_random.uniform(1.0, 3.0) * (self.np_random.uniform() < self._sensor.outliers)
            measured = (
                bearing + self._sensor.noise[0] * float(draws[0]),
                distance + self._sensor.bias + self._sensor.noise[1] * float(draws[1]) + float(outlier),
            )
        return np.array([*measured, 1.0, 0.0, *self._twist, 0.0, 0.0]), info


def follower(cell: Cell) -> Follower:
    sensor = SENSOR[cell.scene, cell.sensor]
    noise = NoiseModel(
        measurement=(sensor.noise[0] ** 2, sensor.noise[1] ** 2),
        process=(2e-4 * cell.q_scale, 2e-3 * cell.q_scale),
        acceleration=(0.5, 0.5),
    )
    return Follower(perceive_measurement, lambda: make_estimator(cell.estimator, noise, cell.alpha))


def episode(cell: Cell, seed: int, seconds: float = 3.0, pause: float = 0.0) -> Episode:
    time.sleep(pause)
    return play(World(cell, seconds), follower(cell), cell, seed)


def failing(cell: Cell, seed: int) -> Episode:
    if seed == 1:
        raise ArithmeticError("this seed fails")
    return episode(cell, seed)


def dying(cell: Cell, seed: int) -> Episode:
    if seed == 1:
        os._exit(3)
    return episode(cell, seed)


def main() -> None:
    """Arguments: folder, episodes, jobs, seconds of pause in each episode, and perhaps `resume`."""
    folder, episodes, jobs, pause, *resume = sys.argv[1:]
    plan = Plan.of(["emulated"], int(episodes), list(SENSORS))
    played = functools.partial(importable().episode, pause=float(pause))
    reproduce(plan, CALIBRATION, played, Path(folder), int(jobs), bool(resume))


def importable():
    """This module under the name by which a worker process finds it."""
    import synthetic

    return synthetic


if __name__ == "__main__":
    main()
