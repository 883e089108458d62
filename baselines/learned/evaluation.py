"""Scores of an agent on held-out seeds in the PyBullet environment: what a learning curve shows."""

from __future__ import annotations

import math
from collections.abc import Iterable

from baselines.benchmark.build import PICTURE
from baselines.benchmark.cells import SCENES, Cell
from baselines.benchmark.player import play
from baselines.followers.agents import Agent
from follow_env.envs.follow import FollowEnv

HELD_SEEDS = range(20_000, 20_005)
"""Apart from the seeds of the tables and of the calibration."""
SCORES = ("success", "angle_tracking_rmse_rad", "distance_tracking_rmse_m", "collided", "lost")
CURVE_COLUMNS = ("steps", *SCORES, "wall_s")


def evaluate(agent: Agent, seeds: Iterable[int]) -> dict[str, float]:
    """Return the means of `SCORES` over the episodes of both scenes; of an RMSE the root of the mean square."""
    seeds, rows = list(seeds), []
    for scene in SCENES:
        camera = PICTURE if agent.observation == "rgbd_uint8" else None
        env = FollowEnv(scene=scene, obs=agent.observation, camera=camera)
        cell = Cell("emulated", scene, "none", controller=agent.name, sensor="default")
        rows += [play(env, agent.in_scene(scene), cell, seed).row for seed in seeds]
        env.close()

    def mean(values: Iterable[float]) -> float:
        return math.fsum(values) / len(rows)

    def values(column: str) -> list[float]:
        return [float(str(row[column])) for row in rows]

    return {
        "success": mean(values("success")),
        **{key: math.sqrt(mean(value * value for value in values(key))) for key in SCORES[1:3]},
        "collided": mean(row["ended"] == "collision" for row in rows),
        "lost": mean(row["ended"] == "lost" for row in rows),
    }
