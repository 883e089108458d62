"""How each follower is trained: one frozen, typed recipe a file."""

from baselines.learned.recipes.base import RECIPES, Domain, Recipe, find_recipe, recipe_digest
from baselines.learned.recipes.ppo import PPORecipe
from baselines.learned.recipes.recurrent_ppo import RecurrentPPORecipe
from baselines.learned.recipes.sac import SACRecipe

__all__ = [
    "RECIPES",
    "Domain",
    "PPORecipe",
    "Recipe",
    "RecurrentPPORecipe",
    "SACRecipe",
    "find_recipe",
    "recipe_digest",
]
