"""SAC on the tracker's report."""

from dataclasses import dataclass

from baselines.learned.recipes.base import RECIPES, Recipe


@dataclass(frozen=True)
class SACRecipe(Recipe):
    """Soft actor-critic (Haarnoja et al., 2018).

    Attributes:
        minibatch: samples of a gradient step.
        updates: gradient steps after each step of all worlds.
        buffer: transitions that are remembered.
        warm_up: steps with random actions before the first update.
        tau: share by which the target network follows.
    """

    steps: int = 1_500_000
    worlds: int = 40
    learning_rate: float = 7e-4
    minibatch: int = 512
    updates: int = 2
    buffer: int = 500_000
    warm_up: int = 10_000
    tau: float = 0.01


RECIPES.register("sac")(SACRecipe())
