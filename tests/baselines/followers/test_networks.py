"""The compiled networks act as the trained policies do in torch."""

import gymnasium as gym
import numpy as np
import pytest
import torch
from stable_baselines3.common.vec_env import DummyVecEnv

from baselines.followers.networks import Network
from baselines.learned.models import make_model, policy_arrays
from baselines.learned.recipes import PPORecipe, Recipe, RecurrentPPORecipe, SACRecipe

SMALL = {"hidden": 16, "minibatch": 32}
RECIPES = {
    "ppo": PPORecipe(**SMALL),
    "recurrent_ppo": RecurrentPPORecipe(**SMALL, memory=8),
    "sac": SACRecipe(**SMALL, buffer=100),
    "ppo_pixels": PPORecipe(observation="rgbd_uint8", **SMALL),
}


class Nowhere(gym.Env):
    """Has the spaces of the environments and nothing else."""

    action_space = gym.spaces.Box(-1.0, 1.0, (2,), np.float32)

    def __init__(self, pixels: bool) -> None:
        self.observation_space = (
            gym.spaces.Box(0, 255, (84, 84, 4), np.uint8) if pixels else gym.spaces.Box(-20.0, 20.0, (8,), np.float32)
        )


def stirred(recipe: Recipe) -> object:
    """A model whose weights are far from their initial symmetry."""
    model = make_model(recipe, DummyVecEnv([lambda: Nowhere(recipe.observation == "rgbd_uint8")]), seed=3)
    generator = torch.Generator().manual_seed(4)
    with torch.no_grad():
        for parameter in model.policy.parameters():
            parameter += 0.1 * torch.randn(parameter.shape, generator=generator)
    return model


@pytest.mark.parametrize("name", RECIPES)
def test_the_compiled_network_acts_as_the_model(name: str) -> None:
    model = stirred(RECIPES[name])
    network = Network(*policy_arrays(model))
    rng = np.random.default_rng(5)
    memory, state = network.start(), None
    starts = np.ones(1, bool)
    for _ in range(20):
        observation = model.observation_space.sample()
        if observation.dtype == np.uint8:
            observation = rng.integers(0, 256, (84, 84, 4), dtype=np.uint8)
        else:
            observation = rng.normal(0.0, 1.0, 8).astype(np.float32)
        expected, state = model.predict(observation, state, starts, deterministic=True)
        starts = np.zeros(1, bool)
        action, memory = network.act(observation, memory)
        assert action.dtype == np.float32
        np.testing.assert_allclose(action, expected, atol=2e-5)


def test_the_memory_matters() -> None:
    network = Network(*policy_arrays(stirred(RECIPES["recurrent_ppo"])))
    observation = np.full(8, 0.5, np.float32)
    first, memory = network.act(observation, network.start())
    second, _ = network.act(observation, memory)
    assert np.abs(first - second).max() > 1e-4


def test_weights_that_are_not_finite_are_refused() -> None:
    arrays, activation, squash = policy_arrays(stirred(RECIPES["ppo"]))
    arrays["dense.0.bias"][0] = np.nan
    with pytest.raises(ValueError, match=r"dense\.0\.bias are not all finite"):
        Network(arrays, activation, squash)


def test_missing_weights_are_named() -> None:
    arrays, activation, squash = policy_arrays(stirred(RECIPES["ppo"]))
    del arrays["input.scale"]
    with pytest.raises(ValueError, match=r"lack 'input\.scale'"):
        Network(arrays, activation, squash)


@pytest.mark.parametrize("name", RECIPES)
def test_weights_that_do_not_fit_each_other_are_refused(name: str) -> None:
    arrays, activation, squash = policy_arrays(stirred(RECIPES[name]))
    arrays["dense.0.weight"] = np.zeros((arrays["dense.0.weight"].shape[0] + 1, 9), np.float32)
    with pytest.raises(ValueError, match="do not fit each other"):
        Network(arrays, activation, squash)


@pytest.mark.parametrize("shape", [(64, 64, 4), (120, 160, 4)])
def test_a_picture_of_another_size_is_refused(shape: tuple[int, int, int]) -> None:
    network = Network(*policy_arrays(stirred(RECIPES["ppo_pixels"])))
    with pytest.raises(ValueError, match=f"the picture is {shape[1]}x{shape[0]}; the agent was trained on"):
        network.act(np.zeros(shape, np.uint8), network.start())
