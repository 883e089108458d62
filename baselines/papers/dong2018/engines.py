"""How far the batch's kinematic engine is from PyBullet: in open loop, in closed loop, episode by episode."""

from __future__ import annotations

import math
import warnings
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from baselines.benchmark.build import driver, environment, environment_kwargs
from baselines.benchmark.cells import SCENES, Cell
from baselines.benchmark.markdown import markdown_table
from baselines.benchmark.metrics.episode import EpisodeMetrics, Row
from baselines.benchmark.player import play
from baselines.benchmark.statistics import Difference, PooledError
from baselines.papers.dong2018.explain import NAMES
from follow_env.config import RobotConfig
from follow_env.envs.batch import FollowVectorEnv
from follow_env.envs.follow import FollowEnv
from follow_env.world.clock import PHYSICS_HZ
from follow_env.world.kinematic.drive import roll
from follow_env.world.robots.diff_drive import DiffDrive
from tracker.estimators import LockOutWarning

CONTROL_HZ = 30
"""Of the environments that are compared."""
WINDOW = 2.0
"""Open loop: the kinematic robot starts anew from PyBullet's pose this often, s."""
GROWTH = (1.0, 2.0, 4.0, 8.0, 14.0)
"""Open loop without restart: times at which the error is stated, s."""


@dataclass(frozen=True)
class Motion:
    """Open loop: the error of the kinematic robot under the commands of PyBullet's.

    Attributes:
        position, yaw: rms over all steps of all windows, m and rad.
        growth: (time s, rms position m, rms yaw rad) without restart.
    """

    position: float
    yaw: float
    growth: tuple[tuple[float, float, float], ...]


@dataclass(frozen=True)
class Following:
    """Closed loop: RMSE of a quantity with PyBullet, and the kinematic one over it, paired by episode.

    Attributes:
        quantity: what is compared.
        physics: RMSE with PyBullet, rad or cm.
        ratio: kinematic over PyBullet, with its interval.
        same_end: share of the episodes that end in the same way.
    """

    quantity: str
    physics: float
    ratio: Difference
    same_end: float


def motion(scene: str, seeds: Sequence[int]) -> Motion:
    """Replay the commands of the paper's follower in `FollowEnv` on the kinematic robot."""
    drives = list(_drives(scene, seeds))
    windows = [_replay(*drive, round(WINDOW * CONTROL_HZ)) for drive in drives]
    runs = [_replay(*drive, len(drive[1])) for drive in drives]
    growth = []
    for t in GROWTH:
        step = round(t * CONTROL_HZ)
        at = np.array([run[step - 1] for run in runs if len(run) >= step])
        growth.append((t, _rms(at[:, 0]), _rms(at[:, 1])))
    errors = np.concatenate(windows)
    return Motion(_rms(errors[:, 0]), _rms(errors[:, 1]), tuple(growth))


def following(scene: str, seeds: Sequence[int], estimator: str = "akf") -> list[Following]:
    """Let the paper's follower drive both engines through the same routes with the same measurement errors."""
    cell = Cell("emulated", scene, estimator)
    env = environment(cell)
    physics = [play(env, driver(cell), cell, seed).row for seed in seeds]
    env.close()
    kinematic = _play_batch(cell, seeds)
    same = sum(a["ended"] == b["ended"] for a, b in zip(physics, kinematic, strict=True)) / len(seeds)
    results = []
    for name, pool in _POOLS.items():
        of_physics, of_kinematic = pool(physics), pool(kinematic)
        ratio = of_kinematic.ratio_to(of_physics)
        assert ratio is not None
        results.append(Following(name, of_physics.rmse, ratio, same))
    return results


def report(episodes: int = 100, scenes: Iterable[str] = SCENES) -> str:
    """Return both comparisons over seeds 0, 1, ... as Markdown."""
    opened, closed = [], []
    for scene in scenes:
        seeds = range(episodes)
        result = motion(scene, seeds)
        grown = [f"{1000.0 * p:.1f} mm, {math.degrees(a):.3f}°" for _, p, a in result.growth]
        opened.append([scene, f"{1000.0 * result.position:.1f} mm, {math.degrees(result.yaw):.3f}°", *grown])
        for estimator in ("none", "kf", "akf"):
            for row in following(scene, seeds, estimator):
                low, high = row.ratio.interval or (math.nan, math.nan)
                both = (row.physics, row.physics * row.ratio.value)
                ratio = f"{row.ratio.value:.4f} ({low:.4f} to {high:.4f})"
                same = f"{row.same_end:.0%}"
                closed.append([scene, row.quantity, NAMES[estimator], *(f"{v:.4g}" for v in both), ratio, same])
    closed.sort(key=lambda line: (line[0], list(_POOLS).index(line[1])))
    columns = ["scene", f"windows of {WINDOW:g} s", *(f"after {t:g} s" for t in GROWTH)]
    header = ["scene", "RMSE of", "estimator", "PyBullet", "kinematic", "kinematic over PyBullet", "same end"]
    return "\n\n".join((markdown_table(columns, opened, left=1), markdown_table(header, closed, left=3)))


def _tracking(column: str, scale: float, rows: Sequence[Row]) -> PooledError:
    steps = np.array([float(row["steps"] or 0) for row in rows])
    rms = np.array([scale * float(row[column] or 0.0) for row in rows])
    return PooledError(steps, np.zeros(len(rows)), steps * rms * rms)


_POOLS: dict[str, Callable[[Sequence[Row]], PooledError]] = {
    "bearing estimate (rad)": partial(PooledError.of, quantity="angle"),
    "distance estimate (cm)": partial(PooledError.of, quantity="distance"),
    "bearing kept (rad)": partial(_tracking, "angle_tracking_rmse_rad", 1.0),
    "distance kept (cm)": partial(_tracking, "distance_tracking_rmse_m", 100.0),
}


def _drives(scene: str, seeds: Sequence[int]) -> Iterable[tuple[NDArray[np.float64], list[tuple[float, float]]]]:
    """Yield the poses (n + 1, 3) and the n rim-speed commands of closed-loop episodes with PyBullet."""
    cell = Cell("emulated", scene, "akf")
    env, policy = FollowEnv(**environment_kwargs(cell)), driver(cell)
    drive = DiffDrive(env.config.robot)
    for seed in seeds:
        observation, info = env.reset(seed=seed)
        poses, commands, state, done = [info["robot_pose"]], [], None, False
        while not done:
            action, state = policy.predict(observation, state)
            observation, _, terminated, truncated, info = env.step(action)
            poses.append(info["robot_pose"])
            commands.append(drive.wheels(*info["command"].tolist()))
            done = terminated or truncated
        yield np.array(poses), commands
    env.close()


def _replay(poses: NDArray[np.float64], commands: Sequence[tuple[float, float]], restart: int) -> NDArray[np.float64]:
    """Return the errors (n, 2) of position (m) and yaw (rad); the pose starts anew every `restart` steps."""
    robot = RobotConfig()
    decay, substeps = math.exp(-1.0 / PHYSICS_HZ / robot.wheel_time_constant), PHYSICS_HZ // CONTROL_HZ
    left = right = 0.0
    pose = (0.0, 0.0, 0.0)
    errors = []
    for k, command in enumerate(commands):
        if k % restart == 0:
            pose = tuple(poses[k].tolist())
        heading = math.cos(pose[2]), math.sin(pose[2])
        x, y, yaw, left, right, _, _ = roll(*pose, *heading, left, right, *command, decay, substeps, robot.track_width)
        pose = (x, y, yaw)
        true_x, true_y, true_yaw = poses[k + 1].tolist()
        errors.append((math.hypot(x - true_x, y - true_y), math.remainder(yaw - true_yaw, 2.0 * math.pi)))
    return np.array(errors)


def _play_batch(cell: Cell, seeds: Sequence[int]) -> list[Row]:
    """Play the episodes of `FollowEnv` in the batch and measure them as `episodes.play` does."""
    env, policy = FollowVectorEnv(len(seeds), **environment_kwargs(cell)), driver(cell)
    metrics = [EpisodeMetrics(cell, seed) for seed in seeds]
    rows: list[Row | None] = [None] * len(seeds)
    terminated = truncated = np.zeros(len(seeds), bool)
    states: Any = None
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", LockOutWarning)
        observations, info = env.reset_as_single(list(seeds))
        while True:
            actions, states = policy.predict(observations, states)
            for i, metric in enumerate(metrics):
                if rows[i] is None:
                    single = {key: info[key][i] for key in info if key[0] != "_" and key != "rewards"}
                    metric.record(single, states[i].estimate, states[i].measurement)
                    if terminated[i] or truncated[i]:
                        rows[i] = metric.row(bool(terminated[i]))
            if all(row is not None for row in rows):
                break
            observations, _, terminated, truncated, info = env.step(actions)
    env.close()
    return [row for row in rows if row is not None]


def _rms(values: NDArray[np.float64]) -> float:
    return math.sqrt(math.fsum(float(v) ** 2 for v in values) / len(values))
