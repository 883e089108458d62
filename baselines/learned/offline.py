"""`follow export`: episodes of the reference or of an agent as a Minari dataset, for offline learning."""

from __future__ import annotations

import warnings
from collections.abc import Iterable
from typing import Any

import gymnasium as gym
import minari
import numpy as np
from minari import MinariDataset
from minari.data_collector import EpisodeBuffer
from minari.dataset.minari_dataset import parse_dataset_id

from baselines.benchmark.build import environment_kwargs, policy_of, settings_of
from baselines.benchmark.cells import ENVIRONMENT_IDS, Cell
from baselines.benchmark.store import InputError
from baselines.benchmark.trial import Trial

INFO = ("bearing", "distance", "visible", "collision", "is_success")
"""What is kept of the environment's info beside observation, action and reward."""


def export(played: Cell | Trial, seeds: Iterable[int], dataset_id: str) -> MinariDataset:
    """Play the episodes of a cell and store them in Minari's local folder (`MINARI_DATASETS_PATH` names another).

    Args:
        played: perception, scene and who drives, or a follower in a scenario.
        seeds: one for each episode; episodes of one follower and seed are the same everywhere.
        dataset_id: of Minari, for example `follow_env/corridor/akf-v0`.

    Raises:
        InputError: if the name is no id of Minari's, or is taken.
    """
    if dataset_id in minari.list_local_datasets():
        raise InputError(
            f"the dataset {dataset_id} already exists; choose another with --id, or delete it with minari."
        )
    try:
        parse_dataset_id(dataset_id)
    except ValueError as error:
        raise InputError(f"{dataset_id!r} is no name of a Minari dataset: {error}") from error
    settings = environment_kwargs(played) if isinstance(played, Cell) else settings_of(played, {})
    scene = settings.get("scene", "corridor")
    env = gym.make(ENVIRONMENT_IDS.get(scene, ENVIRONMENT_IDS["corridor"]), **{**settings, "scene": scene})
    try:
        buffers = [_play(env, policy_of(played, env), seed) for seed in seeds]
        with warnings.catch_warnings():
            warnings.filterwarnings("ignore", category=UserWarning, module="minari")  # what it recommends to add
            return minari.create_dataset_from_buffers(
                dataset_id,
                buffers,
                env=env,
                algorithm_name=_driver_name(played),
                author="follow-env authors",
                requirements=["follow-env"],
                description=f"{played.key}, {len(buffers)} episodes of follow-env's PyBullet environment",
            )
    finally:
        env.close()


def _driver_name(played: Cell | Trial) -> str:
    if isinstance(played, Trial):
        return played.follower.name
    return f"{played.estimator} + PI" if played.controller == "pi" else played.controller


def _play(env: gym.Env, policy: Any, seed: int) -> EpisodeBuffer:
    observation, info = env.reset(seed=seed)
    observations, infos = [observation], [info]
    actions, rewards, terminations, truncations = [], [], [], []
    state, done = None, False
    while not done:
        action, state = policy.predict(observation, state)
        observation, reward, terminated, truncated, info = env.step(action)
        observations.append(observation)
        infos.append(info)
        actions.append(action)
        rewards.append(reward)
        terminations.append(terminated)
        truncations.append(truncated)
        done = terminated or truncated
    stacked: Any = (
        {key: np.stack([one[key] for one in observations]) for key in observations[0]}
        if isinstance(observations[0], dict)
        else np.stack(observations)
    )
    return EpisodeBuffer(
        seed=seed,
        observations=stacked,
        actions=np.stack(actions),
        rewards=rewards,
        terminations=terminations,
        truncations=truncations,
        infos={key: np.array([one[key] for one in infos]) for key in INFO},
    )
