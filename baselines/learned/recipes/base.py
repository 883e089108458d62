"""`Recipe`: how a follower is trained, as data; the domains it is trained in; and the registry of recipes."""

from __future__ import annotations

import dataclasses
import hashlib
import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from baselines.followers.agents import ENVIRONMENT, OBSERVATIONS
from follow_env.registry import Registry, choose


@dataclass(frozen=True)
class Domain:
    """One configuration of the world.

    Attributes:
        scene: scene name.
        share: share of the worlds.
        settings: keyword settings of the environment, as (name, value) pairs of JSON-able values.
    """

    scene: str
    share: float
    settings: tuple[tuple[str, Any], ...] = ()


_BAD_SENSOR = {"measurement": {"bearing_noise": 0.024, "distance_noise": 0.05, "miss_share": 0.1}}
_OUTLIERS = {"measurement": {"outlier_share": 0.05}}

DOMAINS = tuple(
    Domain(scene, share, settings)
    for scene in ("corridor", "indoor")
    for share, settings in (
        (0.125, ()),
        (0.05, (("walking_speed", 0.5),)),
        (0.025, (("walking_speed", 0.75),)),
        (0.05, (("walking_speed", 1.1),)),
        (0.05, (("route", "straight"),)),
        (0.05, (("route", "standing"),)),
        (0.05, (("latency_s", 2.0 / 30.0),)),
        (0.05, (("sensor", _BAD_SENSOR),)),
        (0.05, (("sensor", _OUTLIERS),)),
    )
)
"""A quarter of the worlds are the environments as they come; the others vary walking speed, route, latency, sensor."""
PLAIN_DOMAINS = (Domain("corridor", 0.5), Domain("indoor", 0.5))


@dataclass(frozen=True)
class Recipe:
    """What all recipes have.

    Attributes:
        observation: one of `OBSERVATIONS`.
        steps: environment steps in all.
        worlds: worlds that run at once; at least one for each domain.
        legs: the training is cut into this many parts of equal length; each ends with a checkpoint and an evaluation,
            and begins with new episodes and generators seeded from (seed, leg), so that a resumed training has the
            bits of one that was never interrupted.
        learning_rate: of the first leg; falls linearly to a tenth in the last.
        gamma: discount factor.
        hidden: units of the two dense layers.
    """

    observation: str = "measurement"
    steps: int = 6_000_000
    worlds: int = 240
    legs: int = 10
    learning_rate: float = 1e-3
    gamma: float = 0.98
    hidden: int = 64

    def __post_init__(self) -> None:
        choose("observation", self.observation, OBSERVATIONS)
        for name in ("steps", "worlds", "legs", "hidden"):
            if getattr(self, name) < 1:
                raise ValueError(f"{name} is {getattr(self, name)}; expected a whole number from 1")

    @property
    def domains(self) -> tuple[Domain, ...]:
        """Where it is trained: pictures are too dear for many domains."""
        return PLAIN_DOMAINS if self.observation == "rgbd_uint8" else DOMAINS

    def settings(self) -> dict[str, Any]:
        """Return every number of the recipe, and its class; JSON-able, as cards carry it."""
        return {"class": type(self).__name__, **dataclasses.asdict(self)}

    def digest(self) -> str:
        """Return a hash of the recipe's and the domains' numbers; the code of the training is not in it."""
        return recipe_digest(self.settings(), [dataclasses.asdict(domain) for domain in self.domains], ENVIRONMENT)


def recipe_digest(settings: Mapping[str, Any], domains: Sequence[Mapping[str, Any]], environment: str) -> str:
    """Return the hash of a recipe as a card carries it, whatever the recipe of that name says today.

    Args:
        settings: what `Recipe.settings` returned.
        domains: records of the `Domain`s.
        environment: ids and version that were trained in.
    """
    content = {**settings, "recipe": settings["class"], "environment": environment, "domains": list(domains)}
    del content["class"]
    return hashlib.sha256(json.dumps(content, sort_keys=True).encode()).hexdigest()


RECIPES: Registry[Recipe] = Registry("recipe", "baselines.learned.recipes")
"""Recipes by the name that `follow train` takes; each is registered in its own file."""


def find_recipe(recipe: str) -> tuple[str, Recipe]:
    """Return what the agents of a recipe are called, and the recipe.

    Args:
        recipe: a registered name, or `"module:object"`.

    Raises:
        ValueError: for an unknown name (the nearest is named), or what is no recipe.
    """
    found = RECIPES.get(recipe)
    if not isinstance(found, Recipe):
        raise ValueError(f"recipe {recipe!r} is {type(found).__name__}; expected a Recipe")
    return recipe.rpartition(":")[2], found
