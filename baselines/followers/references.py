"""References of every comparison: a parked robot, a random one, and one that knows the truth."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from baselines.followers.follower import action_of
from follow_env.config import EnvConfig
from follow_env.registry import Registry
from tracker.estimators import Estimate
from tracker.estimators.base import Pair


@dataclass
class NoState:
    """The state of a policy that estimates nothing; `generator` is that of the random one."""

    generator: np.random.Generator | None = None
    measurement: Pair | None = None
    estimate: Estimate | None = None


POLICIES: Registry[Any] = Registry("policy")
"""Classes with the class attribute `observation` (the environment's mode that they read); `(config)` makes a policy."""


@POLICIES.register("parked")
class Parked:
    """Never moves."""

    observation = "measurement"

    def __init__(self, config: EnvConfig | None = None) -> None:
        self.config = config

    def predict(
        self, observation: Any, state: Any = None, episode_start: np.ndarray | None = None, deterministic: bool = True
    ) -> tuple[np.ndarray, NoState]:
        """Return (zero action, state)."""
        return np.zeros(2, np.float32), NoState()


@POLICIES.register("random")
class Random:
    """Draws each action uniformly from the action space, from a generator seeded by the episode's first observation."""

    observation = "measurement"

    def __init__(self, config: EnvConfig | None = None) -> None:
        self.config = config

    def predict(
        self, observation: Any, state: Any = None, episode_start: np.ndarray | None = None, deterministic: bool = True
    ) -> tuple[np.ndarray, NoState]:
        """Return (action, state)."""
        if state is None or (episode_start is not None and bool(np.any(episode_start))):
            seed = int.from_bytes(np.ascontiguousarray(observation).tobytes(), "little")
            state = NoState(np.random.default_rng(seed))
        return state.generator.uniform(-1.0, 1.0, 2).astype(np.float32), state


@POLICIES.register("oracle")
class Oracle:
    """Knows bearing, distance and the person's velocity (`state` observation), and has only the robot's limits.

    Feedback linearization of the relative motion: with the person at (d, y) in the robot frame moving at (a, b),
    d' = a - v + omega y and y' = b - omega d, so v = a + omega y + k (d - set point) and omega = (b + k y) / d make
    both errors decay at the rate k.

    Args:
        config: of the environment: the robot scales the action, the task has the set point.
        gain: k, 1/s.
    """

    observation = "state"

    def __init__(self, config: EnvConfig | None = None, gain: float = 4.0) -> None:
        self.config, self._gain = config, gain
        config = config or EnvConfig()
        self._robot, self._kind, self._set_point = config.robot, config.action, config.task.set_point

    def predict(
        self, observation: Any, state: Any = None, episode_start: np.ndarray | None = None, deterministic: bool = True
    ) -> tuple[np.ndarray, NoState]:
        """Return (action, state)."""
        bearing, distance, ahead, left, *_ = observation.tolist()
        d = max(distance, 0.3)
        y = d * math.tan(min(max(bearing, -1.2), 1.2))
        omega = (left + self._gain * y) / d
        v = ahead + omega * y + self._gain * (distance - self._set_point)
        return action_of(v, omega, self._robot, self._kind), NoState()
