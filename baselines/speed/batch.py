"""Steps/s of many worlds at once, beside Gymnasium's own vector environments in the same run."""

from __future__ import annotations

import statistics
import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import gymnasium as gym
import numpy as np

from follow_env import IDS

PICTURE = {"width": 84, "height": 84}
PIXEL_WORLDS = 64
PEER = "CartPole-v1, vector entry point"


@dataclass(frozen=True)
class BatchRate:
    """Steps/s of all worlds together.

    Attributes:
        what: What is stepped.
        worlds: How many at once.
        median, fastest: Of the rounds.
        peer: Median of CartPole's own vector entry point with as many worlds in the same rounds, or None.
    """

    what: str
    worlds: int
    median: float
    fastest: float
    peer: float | None


def measure_batches(counts: tuple[int, ...], rounds: int, seconds: float) -> list[BatchRate]:
    """Return the rates for each count of worlds, reset and random numbers included.

    Args:
        counts: Numbers of worlds.
        rounds: How often each is let run, in turn with its peers.
        seconds: Time of one run, s.
    """
    found: list[BatchRate] = []
    for count in counts:
        makers: dict[str, Callable[[], gym.vector.VectorEnv]] = {
            "FollowVectorEnv, one thread": lambda n=count: _batch(n, threads=1),  # type: ignore[misc]
            "FollowVectorEnv, all threads": lambda n=count: _batch(n),  # type: ignore[misc]
            PEER: lambda n=count: gym.make_vec("CartPole-v1", n, "vector_entry_point"),  # type: ignore[misc]
        }
        found += _compare(makers, count, rounds, seconds)
    pixels = {"obs": "rgbd_uint8", "camera": PICTURE}
    found += _compare(
        {
            "FollowVectorEnv, rgbd_uint8 84x84, one thread": lambda: _batch(PIXEL_WORLDS, threads=1, **pixels),
            "FollowVectorEnv, rgbd_uint8 84x84, all threads": lambda: _batch(PIXEL_WORLDS, **pixels),
        },
        PIXEL_WORLDS,
        rounds,
        seconds,
    )
    found += _compare(
        {
            "SyncVectorEnv of FollowEnv": lambda: gym.make_vec(IDS["corridor"], 2, "sync"),
            "AsyncVectorEnv of FollowEnv": lambda: gym.make_vec(IDS["corridor"], 2, "async"),
        },
        2,
        rounds,
        seconds,
    )
    return found


def _batch(count: int, **settings: Any) -> gym.vector.VectorEnv:
    return gym.make_vec(IDS["corridor"], count, "vector_entry_point", **settings)


def _compare(
    makers: dict[str, Callable[[], gym.vector.VectorEnv]], count: int, rounds: int, seconds: float
) -> list[BatchRate]:
    """Let the environments run in turn and return their rates."""
    envs = {what: make() for what, make in makers.items()}
    actions = {what: _actions(env) for what, env in envs.items()}
    rates: dict[str, list[float]] = {what: [] for what in envs}
    for what, env in envs.items():
        env.reset(seed=0)
        for _ in range(3):
            env.step(actions[what])
    for _ in range(rounds):
        for what, env in envs.items():
            rates[what].append(count * _rate(env, actions[what], seconds))
    for env in envs.values():
        env.close()
    medians = {what: statistics.median(taken) for what, taken in rates.items()}
    peer = medians.get(PEER)
    return [
        BatchRate(what, count, medians[what], max(taken), None if what == PEER else peer)
        for what, taken in rates.items()
    ]


def _actions(env: gym.vector.VectorEnv) -> np.ndarray:
    """Return actions (n, ...) that keep most of the worlds going."""
    if isinstance(env.single_action_space, gym.spaces.Box):
        return np.random.default_rng(0).uniform(-0.2, 0.8, (env.num_envs, 2)).astype(np.float32)
    return np.random.default_rng(0).integers(0, 2, env.num_envs)


def _rate(env: gym.vector.VectorEnv, actions: np.ndarray, seconds: float) -> float:
    """Return steps/s of the batch over at least `seconds`."""
    count, began = 0, time.perf_counter()
    while (spent := time.perf_counter() - began) < seconds:
        env.step(actions)
        count += 1
    return count / spent
