"""PPO with memory, on the tracker's report."""

from dataclasses import dataclass

from baselines.learned.recipes.base import RECIPES
from baselines.learned.recipes.ppo import PPORecipe


@dataclass(frozen=True)
class RecurrentPPORecipe(PPORecipe):
    """PPO with an LSTM between observation and dense layers.

    Attributes:
        memory: units of the LSTM.
    """

    memory: int = 32


RECIPES.register("recurrent_ppo")(RecurrentPPORecipe(steps=4_000_000))
