"""Scores of an agent on held-out seeds in the PyBullet environment: what a learning curve shows."""

from __future__ import annotations

import math
from collections.abc import Iterable

from baselines.benchmark.cells import SCENES, Cell
from baselines.benchmark.episodes import play
from baselines.learned.agents import Agent
from baselines.learned.recipes import PICTURE
from follow_env.env import FollowEnv

HELD_SEEDS = range(20_000, 20_005)
"""Apart from the seeds of the tables and of the calibration."""
SCORES = ("success", "angle_tracking_rmse_rad", "distance_tracking_rmse_m", "collisions", "losses")
CURVE_COLUMNS = ("steps", *SCORES, "wall_s")


def evaluate(agent: Agent, seeds: Iterable[int]) -> dict[str, float]:
    """Return the means of `SCORES` over the seeds in both scenes (RMSE pooled over the episodes)."""
    seeds, rows = list(seeds), []
    for scene in SCENES:
        camera = PICTURE if agent.observation == "rgbd_uint8" else None
        env = FollowEnv(scene, obs=agent.observation, camera=camera)
        cell = Cell("emulated", scene, "none", controller=agent.name, sensor="default")
        rows += [play(env, agent.in_scene(scene), cell, seed).row for seed in seeds]
        env.close()

    def mean(values: Iterable[float]) -> float:
        return math.fsum(values) / len(rows)

    return {
        "success": mean(float(row["success"]) for row in rows),
        **{key: math.sqrt(mean(float(row[key]) ** 2 for row in rows)) for key in SCORES[1:3]},
        "collisions": mean(row["ended"] == "collision" for row in rows),
        "losses": mean(row["ended"] == "lost" for row in rows),
    }
