"""`follow train`: from a recipe and a seed to a small agent, in legs that can be resumed bit for bit."""

from __future__ import annotations

import dataclasses
import hashlib
import json
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import gymnasium as gym
import numpy as np
import torch
from gymnasium.vector import AutoresetMode
from stable_baselines3 import PPO
from stable_baselines3.common.base_class import BaseAlgorithm
from stable_baselines3.common.logger import configure

import follow_env
from baselines.benchmark.build import PICTURE
from baselines.benchmark.cells import ENVIRONMENT_IDS, SCENES
from baselines.benchmark.files import write_csv, write_text
from baselines.benchmark.provenance import machine, packages
from baselines.benchmark.store import InputError
from baselines.followers.agents import CONTROL_HZ, SUFFIX, Agent, Card, save_agent
from baselines.followers.calibration import noise_model
from baselines.learned.adapter import FollowVecEnv
from baselines.learned.cloning import clone_oracle
from baselines.learned.evaluation import CURVE_COLUMNS, HELD_SEEDS, SCORES, evaluate
from baselines.learned.models import load_model, make_model, policy_arrays
from baselines.learned.recipes import Domain, PPORecipe, Recipe, SACRecipe
from tracker.estimators.akf_batch import BatchFilter

_CURVE, _CONFIG = "curve.csv", "config.json"

assert follow_env.IDS  # importing the package registers the environments


def make_worlds(recipe: Recipe, seed: int) -> FollowVecEnv:
    """Return the recipe's worlds: one batch for each domain, in proportion to its share."""
    pixels = recipe.observation == "rgbd_uint8"
    batches, filters = [], []
    for domain, count in _counts(recipe):
        settings: dict[str, Any] = dict(domain.settings)
        settings |= {"obs": "rgbd_uint8", "camera": PICTURE} if pixels else {"obs": "measurement"}
        batches.append(
            gym.make_vec(
                ENVIRONMENT_IDS[domain.scene],
                num_envs=count,
                vectorization_mode="vector_entry_point",
                autoreset_mode=AutoresetMode.SAME_STEP,
                **settings,
            )
        )
        noise = noise_model("emulated", domain.scene, "default")
        filters.append(BatchFilter(count, noise, 1.0 / CONTROL_HZ) if recipe.observation == "estimate" else None)
    worlds = FollowVecEnv(batches, filters)
    worlds.seed(seed)
    return worlds


def train(
    name: str, recipe: Recipe, seed: int, out: Path, resume: bool = False, say: Callable[[str], None] = print
) -> Path:
    """Train one agent and return the path of its weights file in `out`.

    The folder also gets the configuration, the learning curve (`curve.csv`: scores on held seeds in the PyBullet
    environment after each leg), TensorBoard's log and the latest checkpoint.

    Raises:
        InputError: if the folder holds another training, or cannot be written.
    """
    config = {
        "name": name,
        "recipe": recipe.settings(),
        "domains": [dataclasses.asdict(domain) for domain in recipe.domains],
        "recipe_sha256": recipe.digest(),
        "seed": seed,
        "packages": packages(),
    }
    curve = _claim(out, config, resume)
    worlds, threads = make_worlds(recipe, seed), torch.get_num_threads()
    try:
        torch.set_num_threads(1)
        if curve:
            model = load_model(recipe, str(_checkpoint(out, len(curve))), worlds)
            if isinstance(recipe, SACRecipe):
                model.load_replay_buffer(_checkpoint(out, len(curve)).with_suffix(".pkl"))  # type: ignore[attr-defined]
        else:
            model = make_model(recipe, worlds, seed)
        model.set_logger(configure(str(out / "tensorboard"), ["tensorboard"]))
        for leg in range(len(curve), recipe.legs):
            began = time.perf_counter()
            _learn(model, recipe, worlds, seed, leg)
            agent = _agent(model, name, recipe, seed)
            scores = evaluate(agent, HELD_SEEDS)
            spent = (curve[-1]["wall_s"] if curve else 0.0) + time.perf_counter() - began
            curve.append({"steps": agent.card.steps, **scores, "wall_s": round(spent, 1)})
            _save(out, model, recipe, curve, agent)
            say(
                f"{name}-{seed}: {agent.card.steps:,} steps in {spent:.0f} s, held-out success "
                f"{scores['success']:.2f}, distance {100.0 * scores['distance_tracking_rmse_m']:.1f} cm, "
                f"bearing {scores['angle_tracking_rmse_rad']:.3f} rad"
            )
    finally:
        worlds.close()
        torch.set_num_threads(threads)
    weights = out / f"{name}-{seed}{SUFFIX}"
    card = {
        **dataclasses.asdict(_agent(model, name, recipe, seed).card),
        "weights_sha256": hashlib.sha256(weights.read_bytes()).hexdigest(),
        "recipe_settings": config["recipe"],
        "domains": config["domains"],
        "held_out": {"seeds": list(HELD_SEEDS), "scenes": list(SCENES), **{key: curve[-1][key] for key in SCORES}},
        "wall_s": curve[-1]["wall_s"],
        "machine": machine(),
        "packages": config["packages"],
    }
    write_text(weights.with_suffix(".json"), json.dumps(card, indent=1) + "\n")
    return weights


def _learn(model: BaseAlgorithm, recipe: Recipe, worlds: FollowVecEnv, seed: int, leg: int) -> None:
    """Run one leg; its randomness depends on the seed and the leg alone."""
    fresh = int(np.random.SeedSequence((seed, leg)).generate_state(1)[0] >> 1)
    model.set_random_seed(fresh)
    worlds.seed(fresh)
    if leg == 0 and isinstance(recipe, PPORecipe) and recipe.cloned_pictures:
        assert isinstance(model, PPO)
        clone_oracle(model, worlds, recipe.cloned_pictures, fresh)
        worlds.seed(fresh)
    model._last_obs = None  # start the leg with new episodes
    model.learning_rate = recipe.learning_rate * (1.0 - 0.9 * leg / max(recipe.legs - 1, 1))
    model._setup_lr_schedule()
    steps = recipe.steps * (leg + 1) // recipe.legs - model.num_timesteps
    model.learn(max(steps, 1), reset_num_timesteps=False)


def _agent(model: BaseAlgorithm, name: str, recipe: Recipe, seed: int) -> Agent:
    arrays, activation, squash = policy_arrays(model)
    steps = model.num_timesteps + _cloned(recipe)
    card = Card(name, recipe.digest(), seed, steps, recipe.observation, activation, squash)
    return Agent(card, arrays)


def _cloned(recipe: Recipe) -> int:
    """Return the environment steps in which the teacher was cloned."""
    pictures = recipe.cloned_pictures if isinstance(recipe, PPORecipe) else 0
    return pictures // recipe.worlds * recipe.worlds


def _save(out: Path, model: BaseAlgorithm, recipe: Recipe, curve: list[dict[str, Any]], agent: Agent) -> None:
    """Write checkpoint and weights, then the curve: it says how many legs are done; then drop the last checkpoint."""
    leg = len(curve)
    model.save(_checkpoint(out, leg))
    if isinstance(recipe, SACRecipe):
        model.save_replay_buffer(_checkpoint(out, leg).with_suffix(".pkl"))  # type: ignore[attr-defined]
    save_agent(out / f"{agent.name}{SUFFIX}", agent.card, policy_arrays(model)[0])
    write_csv(out / _CURVE, CURVE_COLUMNS, curve)
    for suffix in (".zip", ".pkl"):
        _checkpoint(out, leg - 1).with_suffix(suffix).unlink(missing_ok=True)


def _checkpoint(out: Path, leg: int) -> Path:
    return out / f"checkpoint-{leg}.zip"


def _claim(out: Path, config: dict[str, Any], resume: bool) -> list[dict[str, Any]]:
    """Make the folder and return the curve of the legs that it already holds."""
    text = json.dumps(config, indent=1) + "\n"
    try:
        out.mkdir(parents=True, exist_ok=True)
        if (out / _CONFIG).exists():
            if not resume:
                raise InputError(f"{out} already holds a training: go on with --resume, or choose another with --out.")
            if (out / _CONFIG).read_text(encoding="utf-8") != text:
                raise InputError(
                    f"{out} holds the training of another recipe, seed or version: choose another folder with --out."
                )
            return read_curve(out) if (out / _CURVE).exists() else []
        write_text(out / _CONFIG, text)
    except OSError as error:
        raise InputError(f"{out} cannot be written ({error.strerror or error}); name another with --out.") from error
    return []


def read_curve(folder: Path) -> list[dict[str, Any]]:
    """Return the learning curve of a training folder, one record a leg."""
    lines = (folder / _CURVE).read_text(encoding="utf-8").splitlines()
    records = [dict(zip(CURVE_COLUMNS, map(float, line.split(",")), strict=True)) for line in lines[1:]]
    return [{**record, "steps": int(record["steps"])} for record in records]


def _counts(recipe: Recipe) -> list[tuple[Domain, int]]:
    """Return each domain with its number of worlds, at least one; the first domains take the remainder."""
    counts = [max(1, int(domain.share * recipe.worlds)) for domain in recipe.domains]
    for k in range(recipe.worlds - sum(counts)):
        counts[k % len(counts)] += 1
    return list(zip(recipe.domains, counts, strict=True))
