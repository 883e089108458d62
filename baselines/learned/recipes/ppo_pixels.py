"""PPO on the picture, after the oracle's actions were cloned."""

from baselines.learned.recipes.base import RECIPES
from baselines.learned.recipes.ppo import PPORecipe

RECIPES.register("ppo_pixels")(
    PPORecipe(
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
    )
)
