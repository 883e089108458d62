"""PPO on the adaptive Kalman filter's estimate."""

from baselines.learned.recipes.base import RECIPES
from baselines.learned.recipes.ppo import PPORecipe

RECIPES.register("ppo_estimate")(PPORecipe(observation="estimate"))
