"""Behavior cloning: a picture agent first learns to act as the oracle, which knows what the picture only shows."""

from __future__ import annotations

from typing import Any

import numpy as np
import torch
from stable_baselines3 import PPO
from torch.nn.functional import mse_loss

from baselines.followers.references import Oracle
from baselines.learned.adapter import FollowVecEnv

BATCH = 256
MOST_NOISE = 0.6
"""Largest standard deviation of what is added to the driven action: the states around the ideal ones are seen too."""


def clone_oracle(model: PPO, worlds: FollowVecEnv, steps: int, seed: int, epochs: int = 6) -> float:
    """Fit the policy's mean action and return the last epoch's mean squared error.

    Half of the worlds are driven by the oracle and half by the policy as far as it has learned (Ross et al., 2011:
    DAgger), all with exploration noise of a size of their own; the oracle labels every picture.

    Args:
        model: with a policy for pictures.
        worlds: of the same observation.
        steps: pictures in all.
        seed: of the noise and the order of the pictures.
        epochs: passes over the pictures.
    """
    rng, count = np.random.default_rng(seed), worlds.num_envs
    oracle = Oracle()
    pictures = np.empty((steps // count * count, *worlds.observation_space.shape), np.uint8)  # type: ignore[misc]
    labels = np.empty((len(pictures), 2), np.float32)
    optimizer = torch.optim.Adam(model.policy.parameters(), lr=1e-3)
    noise = MOST_NOISE * rng.random((count, 1))
    observations: Any = worlds.reset()
    loss = float("nan")
    for k in range(steps // count):
        wanted = np.stack([oracle.predict(state)[0] for state in worlds.states()])
        part = slice(k * count, (k + 1) * count)
        pictures[part], labels[part] = observations, wanted
        driven = wanted.copy()
        driven[::2] = model.predict(observations[::2], deterministic=True)[0]
        observations, *_ = worlds.step(driven + noise * rng.standard_normal((count, 2)))
        if k % 4 == 3:
            _fit(model, optimizer, pictures, labels, rng.integers(0, (k + 1) * count, BATCH))
    for _ in range(epochs):
        order = rng.permutation(len(pictures))
        losses = [
            _fit(model, optimizer, pictures, labels, order[first : first + BATCH])
            for first in range(0, len(order), BATCH)
        ]
        loss = float(np.mean(losses))
    return loss


def _fit(
    model: PPO, optimizer: torch.optim.Optimizer, pictures: np.ndarray, labels: np.ndarray, chosen: np.ndarray
) -> float:
    inputs: Any = torch.from_numpy(np.ascontiguousarray(pictures[chosen].transpose(0, 3, 1, 2)))
    mean = model.policy.get_distribution(inputs).distribution.mean  # type: ignore[union-attr]
    loss = mse_loss(mean, torch.from_numpy(labels[chosen]))
    optimizer.zero_grad()
    loss.backward()  # type: ignore[no-untyped-call]
    optimizer.step()
    return float(loss.detach())
