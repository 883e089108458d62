"""Stable-Baselines3 models of the recipes, and their policies as plain arrays."""

from __future__ import annotations

from typing import Any

import gymnasium as gym
import numpy as np
import torch
from sb3_contrib import RecurrentPPO
from stable_baselines3 import PPO, SAC
from stable_baselines3.common.base_class import BaseAlgorithm
from stable_baselines3.common.torch_layers import BaseFeaturesExtractor
from stable_baselines3.common.vec_env import VecEnv
from torch import nn

from baselines.followers.networks import CLIP
from baselines.learned.recipes import PPORecipe, Recipe, RecurrentPPORecipe, SACRecipe
from follow_env.envs.task import SET_POINT

OFFSET = (0.0, SET_POINT, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
SCALE = (1.0 / 0.2, 1.0 / 0.3, 1.0, 1.0 / 0.2, 1.0, 1.0, 1.0, 1.0)
"""Features of a `measurement` observation: (bearing, distance, validity, age, v, omega, last action) scaled to about
one; fixed, so that nothing has to be remembered but the weights."""
CONVOLUTIONS = ((16, 8, 4), (32, 4, 2), (32, 3, 2))
"""(channels, kernel, stride) of the picture's layers."""


def make_model(recipe: Recipe, worlds: VecEnv, seed: int, log_dir: str | None = None) -> BaseAlgorithm:
    """Return an untrained model of the recipe's algorithm."""
    pixels = recipe.observation == "rgbd_uint8"
    common: dict[str, Any] = {
        "learning_rate": recipe.learning_rate,
        "gamma": recipe.gamma,
        "seed": seed,
        "device": "cpu",
        "tensorboard_log": log_dir,
    }
    policy: dict[str, Any] = {"features_extractor_class": Picture if pixels else Scaled}
    if isinstance(recipe, SACRecipe):
        policy |= {"net_arch": [recipe.hidden] * 2}
        return SAC(
            "MlpPolicy",
            worlds,
            buffer_size=recipe.buffer,
            learning_starts=recipe.warm_up,
            batch_size=recipe.minibatch,
            tau=recipe.tau,
            train_freq=1,
            gradient_steps=recipe.updates,
            policy_kwargs=policy,
            **common,
        )
    assert isinstance(recipe, PPORecipe)
    layers = [recipe.hidden] * (1 if pixels else 2)
    policy |= {"net_arch": {"pi": layers, "vf": layers}, "log_std_init": recipe.initial_log_std}
    policy |= {"activation_fn": nn.ReLU if pixels else nn.Tanh}  # a thousand unscaled features would saturate tanh
    if isinstance(recipe, RecurrentPPORecipe):
        policy |= {"lstm_hidden_size": recipe.memory}
    algorithm, name = (RecurrentPPO, "MlpLstmPolicy") if isinstance(recipe, RecurrentPPORecipe) else (PPO, "MlpPolicy")
    return algorithm(
        "CnnPolicy" if pixels else name,
        worlds,
        n_steps=recipe.rollout,
        batch_size=recipe.minibatch,
        n_epochs=recipe.epochs,
        gae_lambda=recipe.gae_lambda,
        clip_range=recipe.clip_range,
        policy_kwargs=policy,
        **common,
    )


def load_model(recipe: Recipe, path: str, worlds: VecEnv) -> BaseAlgorithm:
    """Return the model of a checkpoint that `train` wrote on this machine."""
    algorithm = (
        SAC if isinstance(recipe, SACRecipe) else RecurrentPPO if isinstance(recipe, RecurrentPPORecipe) else PPO
    )
    return algorithm.load(path, worlds, device="cpu")


def policy_arrays(model: BaseAlgorithm) -> tuple[dict[str, np.ndarray], str, bool]:
    """Return (arrays, activation, squash): what `Network` needs to act as the model's deterministic policy does."""
    policy: Any = model.policy
    squash = isinstance(model, SAC)
    actor = policy.actor if squash else policy
    extractor = actor.features_extractor
    arrays: dict[str, torch.Tensor] = {}
    if isinstance(extractor, Picture):
        for i, layer in enumerate(module for module in extractor.layers if isinstance(module, nn.Conv2d)):
            assert layer.bias is not None
            arrays |= {f"conv.{i}.weight": layer.weight, f"conv.{i}.bias": layer.bias}
            arrays[f"conv.{i}.stride"] = torch.tensor([float(layer.stride[0])])
    else:
        arrays |= {"input.offset": extractor.offset, "input.scale": extractor.scale}
    if isinstance(model, RecurrentPPO):
        lstm = policy.lstm_actor
        arrays |= {"lstm.weight_ih": lstm.weight_ih_l0, "lstm.weight_hh": lstm.weight_hh_l0}
        arrays["lstm.bias"] = lstm.bias_ih_l0 + lstm.bias_hh_l0
    hidden, last = (actor.latent_pi, actor.mu) if squash else (policy.mlp_extractor.policy_net, policy.action_net)
    dense = [*(module for module in hidden if isinstance(module, nn.Linear)), last]
    for i, layer in enumerate(dense):
        arrays |= {f"dense.{i}.weight": layer.weight, f"dense.{i}.bias": layer.bias}
    plain = {name: tensor.detach().cpu().numpy().astype(np.float32) for name, tensor in arrays.items()}
    return plain, "relu" if squash or isinstance(extractor, Picture) else "tanh", squash


class Scaled(BaseFeaturesExtractor):
    """A `measurement` observation (8,) as features of about unit size."""

    offset: torch.Tensor
    scale: torch.Tensor

    def __init__(self, observation_space: gym.Space) -> None:
        super().__init__(observation_space, len(OFFSET))
        self.register_buffer("offset", torch.tensor(OFFSET))
        self.register_buffer("scale", torch.tensor(SCALE))

    def forward(self, observations: torch.Tensor) -> torch.Tensor:
        """Return the features (n, 8)."""
        return ((observations - self.offset) * self.scale).clamp(-CLIP, CLIP)


class Picture(BaseFeaturesExtractor):
    """A small convolutional net over the picture (channels first, in [0, 1])."""

    def __init__(self, observation_space: gym.Space) -> None:
        assert observation_space.shape is not None
        channels, height, width = observation_space.shape
        layers: list[nn.Module] = []
        for out, kernel, stride in CONVOLUTIONS:
            layers += [nn.Conv2d(channels, out, kernel, stride), nn.ReLU()]
            channels, height, width = out, (height - kernel) // stride + 1, (width - kernel) // stride + 1
        super().__init__(observation_space, channels * height * width)
        self.layers = nn.Sequential(*layers, nn.Flatten())

    def forward(self, observations: torch.Tensor) -> torch.Tensor:
        """Return the features (n, features_dim)."""
        return self.layers(observations)
