"""PPO on the tracker's report."""

from dataclasses import dataclass

from baselines.learned.recipes.base import RECIPES, Recipe


@dataclass(frozen=True)
class PPORecipe(Recipe):
    """Proximal policy optimization (Schulman et al., 2017).

    Attributes:
        rollout: steps of each world between updates.
        minibatch: samples of a gradient step.
        epochs: passes over a rollout.
        gae_lambda: of the generalized advantage estimate.
        clip_range: of the probability ratio.
        initial_log_std: logarithm of the action's standard deviation at the start.
        cloned_pictures: pictures from which the policy learns the oracle's actions before; 0 = none.
    """

    rollout: int = 128
    minibatch: int = 2048
    epochs: int = 8
    gae_lambda: float = 0.95
    clip_range: float = 0.2
    initial_log_std: float = -0.7
    cloned_pictures: int = 0


RECIPES.register("ppo")(PPORecipe())
