"""How each follower is trained: one frozen, typed recipe per algorithm, and the domains they are trained in."""

from __future__ import annotations

import dataclasses
import hashlib
import json
from dataclasses import dataclass
from typing import Any

from follow_env.registry import choose

ENVIRONMENT = "follow_env/*-v0"
"""The environments' version that agents are trained for."""
CONTROL_HZ = 30
"""Rate at which agents learn and drive."""
OBSERVATIONS = ("measurement", "estimate", "rgbd_uint8")
"""What an agent sees: the tracker's report, the adaptive Kalman filter's estimate of it, or the picture."""


@dataclass(frozen=True)
class Domain:
    """One configuration of the world.

    Attributes:
        scene: scene name.
        share: share of the worlds.
        settings: keyword settings of the environment, as (name, value) pairs of JSON-able values.
    """

    scene: str
    share: float
    settings: tuple[tuple[str, Any], ...] = ()


_BAD_SENSOR = {"measurement": {"bearing_noise": 0.024, "distance_noise": 0.05, "miss_share": 0.1}}
_OUTLIERS = {"measurement": {"outlier_share": 0.05}}

DOMAINS = tuple(
    Domain(scene, share, settings)
    for scene in ("corridor", "indoor")
    for share, settings in (
        (0.125, ()),
        (0.05, (("walking_speed", 0.5),)),
        (0.025, (("walking_speed", 0.75),)),
        (0.05, (("walking_speed", 1.1),)),
        (0.05, (("route", "straight"),)),
        (0.05, (("route", "standing"),)),
        (0.05, (("latency_s", 2.0 / 30.0),)),
        (0.05, (("sensor", _BAD_SENSOR),)),
        (0.05, (("sensor", _OUTLIERS),)),
    )
)
"""A quarter of the worlds are the environments as they come; the others vary walking speed, route, latency, sensor."""
PLAIN_DOMAINS = (Domain("corridor", 0.5), Domain("indoor", 0.5))


@dataclass(frozen=True)
class Recipe:
    """What all recipes have.

    Attributes:
        observation: one of `OBSERVATIONS`.
        steps: environment steps in all.
        worlds: worlds that run at once; at least one for each domain.
        legs: the training is cut into this many parts of equal length; each ends with a checkpoint and an evaluation,
            and begins with new episodes and generators seeded from (seed, leg), so that a resumed training has the
            bits of one that was never interrupted.
        learning_rate: of the first leg; falls linearly to a tenth in the last.
        gamma: discount factor.
        hidden: units of the two dense layers.
    """

    observation: str = "measurement"
    steps: int = 6_000_000
    worlds: int = 240
    legs: int = 10
    learning_rate: float = 1e-3
    gamma: float = 0.98
    hidden: int = 64

    def __post_init__(self) -> None:
        choose("observation", self.observation, OBSERVATIONS)
        for name in ("steps", "worlds", "legs", "hidden"):
            if getattr(self, name) < 1:
                raise ValueError(f"{name} is {getattr(self, name)}; expected a whole number from 1")

    @property
    def domains(self) -> tuple[Domain, ...]:
        """Where it is trained: pictures are too dear for many domains."""
        return PLAIN_DOMAINS if self.observation == "rgbd_uint8" else DOMAINS

    def digest(self) -> str:
        """Return a hash of the recipe's and the domains' numbers; the code of the training is not in it."""
        content = {"recipe": type(self).__name__, **dataclasses.asdict(self), "environment": ENVIRONMENT}
        content["domains"] = [dataclasses.asdict(domain) for domain in self.domains]
        return hashlib.sha256(json.dumps(content, sort_keys=True).encode()).hexdigest()


@dataclass(frozen=True)
class PPORecipe(Recipe):
    """Proximal policy optimization (Schulman et al., 2017).

    Attributes:
        rollout: steps of each world between updates.
        minibatch: samples of a gradient step.
        epochs: passes over a rollout.
        gae_lambda: of the generalized advantage estimate.
        clip_range: of the probability ratio.
        initial_log_std: logarithm of the action's standard deviation at the start.
        cloned_pictures: pictures from which the policy learns the oracle's actions before; 0 = none.
    """

    rollout: int = 128
    minibatch: int = 2048
    epochs: int = 8
    gae_lambda: float = 0.95
    clip_range: float = 0.2
    initial_log_std: float = -0.7
    cloned_pictures: int = 0


@dataclass(frozen=True)
class RecurrentPPORecipe(PPORecipe):
    """PPO with an LSTM between observation and dense layers.

    Attributes:
        memory: units of the LSTM.
    """

    memory: int = 32


@dataclass(frozen=True)
class SACRecipe(Recipe):
    """Soft actor-critic (Haarnoja et al., 2018).

    Attributes:
        minibatch: samples of a gradient step.
        updates: gradient steps after each step of all worlds.
        buffer: transitions that are remembered.
        warm_up: steps with random actions before the first update.
        tau: share by which the target network follows.
    """

    steps: int = 1_500_000
    worlds: int = 40
    learning_rate: float = 7e-4
    minibatch: int = 512
    updates: int = 2
    buffer: int = 500_000
    warm_up: int = 10_000
    tau: float = 0.01


RECIPES: dict[str, Recipe] = {
    "ppo": PPORecipe(),
    "ppo_estimate": PPORecipe(observation="estimate"),
    "ppo_pixels": PPORecipe(
        observation="rgbd_uint8",
        steps=240_000,
        worlds=32,
        legs=4,
        learning_rate=2e-4,
        rollout=128,
        minibatch=512,
        epochs=4,
        clip_range=0.1,
        initial_log_std=-1.6,
        cloned_pictures=40_000,
    ),
    "recurrent_ppo": RecurrentPPORecipe(steps=4_000_000),
    "sac": SACRecipe(),
}
"""Recipe by the name that `follow train` takes."""
