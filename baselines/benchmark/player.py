"""One episode of a cell: the environment and the follower are made from the cell, played, and measured."""

from __future__ import annotations

import dataclasses
import json
import math
import time
import warnings
import zlib
from collections.abc import Callable, Hashable
from dataclasses import dataclass
from typing import Any

import gymnasium as gym
import numpy as np
from numpy.typing import NDArray

from baselines.benchmark.cells import Cell
from baselines.benchmark.metrics.episode import EpisodeMetrics, Row, quantile
from baselines.benchmark.metrics.tracking import TrackingMetrics
from baselines.followers.tracking_follower import TrackingState
from tracker.estimators import LockOutWarning


@dataclass(frozen=True, slots=True)
class Timing:
    """Wall-clock costs in one episode, s; kept apart from everything that must be reproducible.

    Attributes:
        mean, p95: Of the policy's step.
        environment: Mean of the environment's step: physics, rendering, sensor.
        metrics: Mean of the rest of a step: recording what is measured.
    """

    mean: float
    p95: float
    environment: float
    metrics: float


@dataclass(frozen=True, slots=True)
class Episode:
    """One finished episode.

    Attributes:
        row: Numbers by column name (``metrics.COLUMNS``, and ``tracking.COLUMNS`` of a follower that tracks).
        curve: Cumulative absolute errors, shape (steps, 3), float64: time s, angle rad, distance m.
        timing: Cost of the policy's step.
    """

    row: Row
    curve: NDArray[np.float64]
    timing: Timing

    def pack(self) -> tuple[str, bytes, str]:
        """Row, curve and timing as the store keeps them."""
        curve = zlib.compress(np.ascontiguousarray(self.curve, dtype="<f8").tobytes())
        row, timing = (json.dumps(part, allow_nan=False) for part in (self.row, dataclasses.astuple(self.timing)))
        return row, curve, timing

    @classmethod
    def unpack(cls, row: str, curve: bytes, timing: str) -> Episode:
        """The episode of which these are the packed parts."""
        points = np.frombuffer(zlib.decompress(curve), dtype="<f8").astype(np.float64).reshape(-1, 3)
        return cls(json.loads(row), points, Timing(*json.loads(timing)))


EpisodeFunction = Callable[[Cell, int], Episode]
"""Plays the episode of a cell and a seed; its result may depend on nothing else."""


def play(env: gym.Env, policy: Any, cell: Cell, seed: int) -> Episode:
    """Play one episode and measure it.

    Every observation is scored, the one at reset and the last one included: the belief that the policy forms from an
    observation is compared with the truth at the same instant.

    Args:
        env: The cell's environment.
        policy: Anything with SB3's ``predict``; what its state tells of ``estimate`` and ``measurement`` is scored.
        cell: Names the row.
        seed: Seed of the environment's reset.
    """
    metrics, tracking = EpisodeMetrics(cell, seed), TrackingMetrics()
    costs, stepping = [], 0.0
    state = None
    terminated = truncated = False
    with warnings.catch_warnings():
        # The sensitivity study provokes it; the row's inflated shares say the same, episode by episode.
        warnings.simplefilter("ignore", LockOutWarning)
        observation, info = env.reset(seed=seed)
        started = time.perf_counter()
        while True:
            began = time.perf_counter()
            start = np.array([state is None])
            action, state = policy.predict(observation, state, episode_start=start, deterministic=True)
            costs.append(time.perf_counter() - began)
            metrics.record(info, getattr(state, "estimate", None), getattr(state, "measurement", None))
            if isinstance(state, TrackingState) and state.track is not None:
                tracking.record(info, state.track)
            if terminated or truncated:
                break
            began = time.perf_counter()
            observation, _, terminated, truncated, info = env.step(action)
            stepping += time.perf_counter() - began
    total, deciding = time.perf_counter() - started, math.fsum(costs)
    steps = len(costs)
    timing = Timing(deciding / steps, quantile(costs, 0.95), stepping / steps, (total - deciding - stepping) / steps)
    return Episode(row=metrics.row(terminated) | tracking.columns(), curve=metrics.curve(), timing=timing)


class Player:
    """Plays episodes of any cell and keeps the last environment, because cells that share one come one after another.

    A player is sent to a worker process empty; each process makes its own environments.
    """

    def __init__(self) -> None:
        self._env: gym.Env | None = None
        self._key: Hashable = None

    def __call__(self, cell: Cell, seed: int) -> Episode:
        """Play the episode of this cell and seed; what was played before does not change it."""
        from baselines.benchmark.build import driver, environment, environment_key

        key = environment_key(cell)
        if self._env is None or key != self._key:
            self.close()
            self._env, self._key = environment(cell), key
        return play(self._env, driver(cell), cell, seed)

    def close(self) -> None:
        """Close the environment; calling it again does nothing."""
        if self._env is not None:
            self._env.close()
            self._env = None
