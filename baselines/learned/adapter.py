"""`FollowVecEnv`: Stable-Baselines3's `VecEnv` over batches of worlds.

A batch has one configuration; several batches side by side are how domains are randomized. Nothing is copied world by
world: the batches write into one array, and the infos of worlds that go on are one shared empty dictionary.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from typing import Any

import gymnasium as gym
import numpy as np
from gymnasium.vector import AutoresetMode, VectorEnv
from stable_baselines3.common.vec_env import VecEnv

from follow_env.envs.observations import state_values
from follow_env.envs.task import REWARD_TERMS
from tracker.estimators.akf_batch import BatchFilter

_EPISODE_KEYS = ("is_success", "collision")


class FollowVecEnv(VecEnv):
    """Batches of worlds as one `VecEnv`, with the episode's return and length in the last info as `Monitor` gives them.

    Args:
        batches: vector environments of equal spaces that reset in the same step (`AutoresetMode.SAME_STEP`).
        filters: for each batch the filter that turns its measurements into estimates, or None.
        reward_terms: whether every info holds `rewards`, the terms of its step; it costs about a microsecond a world.
            The last info of an episode always holds `episode_rewards`, the sums of the terms.

    Raises:
        ValueError: if there is no batch, their spaces differ, or one resets in another way.
    """

    def __init__(
        self,
        batches: Sequence[VectorEnv],
        filters: Sequence[BatchFilter | None] | None = None,
        reward_terms: bool = False,
    ) -> None:
        if not batches:
            raise ValueError("there is no batch of worlds; expected at least one vector environment")
        for batch in batches:
            mode = batch.metadata.get("autoreset_mode")
            if mode != AutoresetMode.SAME_STEP:
                raise ValueError(
                    f"a batch has autoreset_mode {mode}; Stable-Baselines3 needs AutoresetMode.SAME_STEP: "
                    "make it with autoreset_mode=AutoresetMode.SAME_STEP"
                )
            if batch.single_observation_space != batches[0].single_observation_space:
                raise ValueError(
                    f"the batches observe {batches[0].single_observation_space} and "
                    f"{batch.single_observation_space}; expected one observation space"
                )
        self._batches = list(batches)
        self._filters = list(filters) if filters is not None else [None] * len(batches)
        edges = np.cumsum([0, *(batch.num_envs for batch in batches)])
        self._parts = [slice(int(a), int(b)) for a, b in itertools.pairwise(edges)]
        super().__init__(int(edges[-1]), batches[0].single_observation_space, batches[0].single_action_space)
        space = self.observation_space
        assert space.shape is not None
        self._observations = np.zeros((self.num_envs, *space.shape), space.dtype)
        self._rewards = np.zeros(self.num_envs, np.float32)
        self._dones = np.zeros(self.num_envs, bool)
        self._returns, self._lengths = np.zeros(self.num_envs), np.zeros(self.num_envs, np.int64)
        self._terms, self._sums = (
            np.zeros((self.num_envs, len(REWARD_TERMS))),
            np.zeros((self.num_envs, len(REWARD_TERMS))),
        )
        self._tells_terms = reward_terms
        self._actions: np.ndarray = np.zeros((self.num_envs, 2), np.float32)
        self._going_on: dict[str, Any] = {}
        self._infos: list[dict[str, Any]] = []

    def reset(self) -> np.ndarray:
        """Return the first observations (n, ...) of new episodes in all worlds."""
        self._infos = []
        for k, (batch, part) in enumerate(zip(self._batches, self._parts, strict=True)):
            seed = None if self._seeds[0] is None else self._seeds[0] + 1_000_003 * k
            observations, info = batch.reset(seed=seed)
            self._infos.append(info)
            estimates = self._filters[k]
            if estimates is not None:
                estimates.forget()
                observations = estimates(observations)
            self._observations[part] = observations
        self._returns[:], self._lengths[:], self._sums[:] = 0.0, 0, 0.0
        self._reset_seeds()
        self._reset_options()
        return self._observations.copy()

    def step_async(self, actions: np.ndarray) -> None:
        """Take the actions (n, 2)."""
        self._actions = np.clip(actions, -1.0, 1.0).astype(np.float32, copy=False)

    def step_wait(self) -> tuple[np.ndarray, np.ndarray, np.ndarray, list[dict[str, Any]]]:
        """Return (observations, rewards, dones, infos); a world that is done has begun its next episode."""
        infos = [self._going_on] * self.num_envs
        self._infos = []
        for batch, part, estimates in zip(self._batches, self._parts, self._filters, strict=True):
            observations, rewards, terminated, truncated, info = batch.step(self._actions[part])
            self._infos.append(info)
            done = terminated | truncated
            self._rewards[part], self._dones[part] = rewards, done
            self._returns[part] += rewards
            self._lengths[part] += 1
            ended = np.flatnonzero(done)
            self._terms[part] = _terms(info, ended)
            last = None
            if len(ended):
                last = np.stack([np.asarray(info["final_obs"][i]) for i in ended])
            if estimates is not None:
                observations, last = estimates.step(observations, ended, last)
            self._observations[part] = observations
            self._sums[part] += self._terms[part]
            for k, i in enumerate(ended):
                assert last is not None
                infos[part.start + int(i)] = self._last_info(part.start + int(i), last[k], truncated[i], info, i)
        if self._tells_terms:
            terms = [dict(zip(REWARD_TERMS, row, strict=True)) for row in self._terms.tolist()]
            infos = [{**info, "rewards": row} for info, row in zip(infos, terms, strict=True)]
        return self._observations.copy(), self._rewards.copy(), self._dones.copy(), infos

    def states(self) -> np.ndarray:
        """Return the truth of all worlds as `state` observations (n, 8) with a zero last action: what teachers see."""
        parts = []
        for info in self._infos:
            yaw = info["robot_pose"][:, 2]
            none = np.zeros(len(yaw))
            direction, own = (np.cos(yaw), np.sin(yaw)), (*info["twist"].T, none, none)
            velocity = info["person_velocity"].T
            parts.append(np.column_stack(state_values(info["bearing"], info["distance"], velocity, direction, own)))
        return np.concatenate(parts)

    def close(self) -> None:
        """Close the batches."""
        for batch in self._batches:
            batch.close()

    def get_attr(self, attr_name: str, indices: Any = None) -> list[Any]:
        """Return the attribute of the batch that each of the worlds belongs to."""
        found = [getattr(batch, attr_name) for batch in self._batches for _ in range(batch.num_envs)]
        return [found[i] for i in self._get_indices(indices)]

    def set_attr(self, attr_name: str, value: Any, indices: Any = None) -> None:
        """Refuse: worlds of a batch share their attributes."""
        raise NotImplementedError(f"{attr_name} cannot be set: the worlds of a batch share it; make another batch")

    def env_method(self, method_name: str, *method_args: Any, indices: Any = None, **method_kwargs: Any) -> list[Any]:
        """Refuse: there is no environment of one world."""
        raise NotImplementedError(f"{method_name} cannot be called world by world: the worlds are one batch")

    def env_is_wrapped(self, wrapper_class: type[gym.Wrapper], indices: Any = None) -> list[bool]:
        """Return False for each: the episode statistics come from this class, not from a wrapper."""
        from stable_baselines3.common.monitor import Monitor

        return [wrapper_class is Monitor for _ in self._get_indices(indices)]

    def _last_info(self, world: int, last: np.ndarray, truncated: bool, info: dict[str, Any], i: int) -> dict[str, Any]:
        result = {
            "episode": {"r": float(self._returns[world]), "l": int(self._lengths[world]), "t": 0.0},
            "terminal_observation": last,
            "TimeLimit.truncated": bool(truncated),
        }
        result |= {key: bool(info["final_info"][key][i]) for key in _EPISODE_KEYS}
        result["episode_rewards"] = dict(zip(REWARD_TERMS, self._sums[world].tolist(), strict=True))
        self._returns[world], self._lengths[world], self._sums[world] = 0.0, 0, 0.0
        return result


def _terms(info: dict[str, Any], ended: np.ndarray) -> np.ndarray:
    """Return the reward terms (n, 5) of a step; worlds that ended and began anew have those of the end."""
    terms = np.column_stack([info["rewards"][name] for name in REWARD_TERMS])
    if len(ended):
        last = info["final_info"]["rewards"]
        terms[ended] = np.column_stack([last[name][ended] for name in REWARD_TERMS])
    return terms
