"""`follow train`: train a follower in the batch of worlds."""

from __future__ import annotations

import argparse
import dataclasses
from pathlib import Path

from baselines.cli.arguments import Commands, add_seed, positive
from baselines.cli.exits import bad_input, need


def add(commands: Commands) -> None:
    """Add the command to ``follow``."""
    train = commands.add_parser("train", help="train a follower in the batch of worlds")
    train.add_argument(
        "recipe",
        metavar="ALGO",
        help="`follow list recipes`, or module:object",
    )
    train.add_argument("--steps", type=positive, metavar="N", help="environment steps (default: the recipe's)")
    add_seed(train)
    train.add_argument("--out", type=Path, metavar="DIR", help="default: results/learned/ALGO-S")
    train.add_argument("--resume", action="store_true", help="go on after the last finished leg")
    train.set_defaults(run=_run)


def _run(parsed: argparse.Namespace) -> None:
    from baselines.learned.recipes import find_recipe

    with bad_input(ValueError):
        name, recipe = find_recipe(parsed.recipe)
    need("stable_baselines3", "learn", "trainings")
    from baselines.learned.training import train

    out = parsed.out or Path("results", "learned", f"{name}-{parsed.seed}")
    try:
        with bad_input(ValueError):
            if parsed.steps is not None:
                recipe = dataclasses.replace(recipe, steps=parsed.steps)
            weights = train(name, recipe, parsed.seed, out, parsed.resume)
    except KeyboardInterrupt:
        raise KeyboardInterrupt(
            f"interrupted: the finished legs are kept in {out}; the same command with --resume goes on."
        ) from None
    print(f"The agent is {weights}.")
