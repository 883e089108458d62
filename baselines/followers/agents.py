"""Learned followers without torch: weights in safetensors, so no code is executed to load an agent."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from importlib import resources
from pathlib import Path
from typing import Any

import numpy as np

from baselines.followers.calibration import noise_model
from baselines.followers.networks import ACTIVATIONS, Arrays, Memory, Network
from follow_env.registry import choose
from tracker.estimators import AdaptiveKalmanFilter, Estimate, Estimator
from tracker.estimators.base import Pair

SUFFIX = ".safetensors"
ENVIRONMENT = "follow_env/*-v0"
"""The environments' version that agents are trained for."""
CONTROL_HZ = 30
"""Rate at which agents learn and drive."""
OBSERVATIONS = ("measurement", "estimate", "rgbd_uint8")
"""What an agent sees: the tracker's report, the adaptive Kalman filter's estimate of it, or the picture."""


@dataclass(frozen=True)
class Card:
    """What stands in the header of a weights file.

    Attributes:
        recipe: name of the recipe.
        recipe_sha256: digest of everything in the recipe.
        seed: of the training.
        steps: environment steps of the training, with those in which a teacher was cloned.
        observation: one of `OBSERVATIONS`.
        activation: between dense layers.
        squash: whether tanh bounds the action.
        environment: ids and version that it was trained for.
    """

    recipe: str
    recipe_sha256: str
    seed: int
    steps: int
    observation: str
    activation: str
    squash: bool
    environment: str = ENVIRONMENT


@dataclass
class AgentState:
    """What an agent remembers within one episode; the estimate is None unless a filter feeds it."""

    memory: Memory
    estimator: Estimator | None = None
    measurement: Pair | None = None
    estimate: Estimate | None = None


class Agent:
    """A learned follower with SB3's `predict`.

    Args:
        card: what the weights are.
        arrays: the network, see `baselines.followers.networks`.
        scene: whose calibrated noise the filter of an `estimate` agent takes.
    """

    def __init__(self, card: Card, arrays: Arrays, scene: str = "corridor") -> None:
        self.card = card
        self._arrays = arrays
        self._network = Network(arrays, choose("activation", card.activation, ACTIVATIONS), card.squash)
        self._noise = noise_model("emulated", scene, "default")

    @property
    def name(self) -> str:
        """Recipe and seed, as in `ppo-0`."""
        return f"{self.card.recipe}-{self.card.seed}"

    @property
    def observation(self) -> str:
        """The environment's observation mode that it reads."""
        return "measurement" if self.card.observation == "estimate" else self.card.observation

    def in_scene(self, scene: str) -> Agent:
        """Return the agent with the calibrated filter noise of another scene."""
        return Agent(self.card, self._arrays, scene)

    def predict(
        self,
        observation: Any,
        state: Any = None,
        episode_start: np.ndarray | None = None,
        deterministic: bool = True,
    ) -> tuple[np.ndarray, Any]:
        """Return (action, state) for one observation, or for a batch of n with a list of n states.

        Raises:
            ValueError: if the observation has not the shape that the agent was trained on.
        """
        single = 3 if self.card.observation == "rgbd_uint8" else 1
        if isinstance(observation, Mapping) or np.ndim(observation) not in (single, single + 1):
            shape = (
                f"a mapping with {', '.join(observation)}"
                if isinstance(observation, Mapping)
                else np.shape(observation)
            )
            raise ValueError(f"the agent {self.name} got {shape}; it drives with obs={self.observation!r}")
        if np.ndim(observation) == single:
            starts = state is None or (episode_start is not None and bool(np.any(episode_start)))
            return self._step(observation, None if starts else state)
        flags = np.zeros(len(observation), bool) if episode_start is None else np.asarray(episode_start).reshape(-1)
        states = [None] * len(observation) if state is None else state
        results = [self._step(o, None if f else s) for o, s, f in zip(observation, states, flags, strict=True)]
        return np.stack([action for action, _ in results]), [new for _, new in results]

    def _step(self, observation: np.ndarray, state: AgentState | None) -> tuple[np.ndarray, AgentState]:
        if observation.shape[-1] != self._network.inputs:
            raise ValueError(
                f"the agent {self.name} got an observation of shape {observation.shape}; "
                f"its last axis must have {self._network.inputs} entries: make the environment with "
                f"obs={self.observation!r}"
            )
        if state is None:
            state = AgentState(self._network.start())
            if self.card.observation == "estimate":
                state.estimator = AdaptiveKalmanFilter(self._noise.process, self._noise.measurement)
        if self.card.observation != "rgbd_uint8":
            bearing, distance, valid, _, v, omega, _, _ = observation.tolist()
            state.measurement = (bearing, distance) if valid else None
            if state.estimator is not None:
                state.estimator.predict((v, omega), 1.0 / CONTROL_HZ)
                state.estimate = state.estimator.update(state.measurement)
                observation = observation.copy()
                observation[:3] = (state.estimate.bearing, state.estimate.distance, 1.0) if state.estimate else 0.0
        action, state.memory = self._network.act(observation, state.memory)
        return action, state


def save_agent(path: Path, card: Card, arrays: Arrays) -> None:
    """Write the weights with their card in the header."""
    from safetensors.numpy import save_file

    save_file({name: np.ascontiguousarray(a) for name, a in arrays.items()}, path, {"card": json.dumps(asdict(card))})


def load_agent(name: str | Path, scene: str = "corridor") -> Agent:
    """Return a shipped agent (`shipped()` names them) or that of a weights file.

    Raises:
        ValueError: if there is no such agent, the file is damaged or not that of the card beside it, or it was trained
            for another version.
    """
    from safetensors import SafetensorError, safe_open

    path = Path(name) if Path(name).suffix == SUFFIX else weights_file(str(name))
    if not path.is_file():
        raise ValueError(
            f"{path} is not a file; expected the {SUFFIX} file of an agent, or one of {', '.join(shipped())}"
        )
    try:
        with safe_open(path, "numpy") as file:
            header = file.metadata() or {}
            arrays = {key: file.get_tensor(key) for key in file.keys()}  # noqa: SIM118 (not a mapping)
        card = Card(**json.loads(header["card"]))
        beside = path.with_suffix(".json")
        told = json.loads(beside.read_text(encoding="utf-8"))["weights_sha256"] if beside.is_file() else None
    except (SafetensorError, KeyError, TypeError, json.JSONDecodeError) as error:
        raise ValueError(f"{path} cannot be read as an agent ({error}); get the file again") from error
    if told is not None and told != hashlib.sha256(path.read_bytes()).hexdigest():
        raise ValueError(f"{path.name} is not the file that its card {beside.name} describes; get both again")
    if card.environment != ENVIRONMENT:
        raise ValueError(
            f"{path.name} was trained for {card.environment}, this is {ENVIRONMENT}; train it again with "
            f"`follow train {card.recipe} --seed {card.seed}`"
        )
    choose("observation", card.observation, OBSERVATIONS)
    return Agent(card, arrays, scene)


def shipped() -> list[str]:
    """Names of the agents that come with the package."""
    return sorted(path.name.removesuffix(SUFFIX) for path in _folder().glob(f"*{SUFFIX}"))


def weights_file(name: str) -> Path:
    """Return the weights file of a shipped agent; a ValueError names the nearest when there is none."""
    return _folder() / f"{choose('agent', name, shipped())}{SUFFIX}"


def _folder() -> Path:
    return Path(str(resources.files("baselines.followers").joinpath("shipped")))
