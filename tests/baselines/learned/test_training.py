"""Training is deterministic, goes on where it stopped, and refuses what it cannot do."""

import dataclasses
from pathlib import Path

import numpy as np
import pytest

from baselines.benchmark.store import InputError
from baselines.followers.agents import load_agent
from baselines.learned import training
from baselines.learned.recipes import RECIPES, PPORecipe, Recipe, find_recipe
from follow_env.envs.follow import FollowEnv

SHORT = {
    "ppo": {"steps": 3000, "worlds": 24, "legs": 3, "rollout": 32, "minibatch": 256, "epochs": 2},
    "ppo_estimate": {"steps": 1000, "worlds": 24, "legs": 1, "rollout": 32, "minibatch": 256, "epochs": 2},
    "recurrent_ppo": {"steps": 1600, "worlds": 24, "legs": 2, "rollout": 32, "minibatch": 256, "epochs": 1},
    "ppo_pixels": {"steps": 300, "worlds": 8, "legs": 2, "rollout": 16, "minibatch": 64, "cloned_pictures": 64},
    "sac": {"steps": 1500, "worlds": 24, "legs": 2, "warm_up": 200, "buffer": 2000, "minibatch": 64},
}


@pytest.fixture(autouse=True)
def _one_seed(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(training, "HELD_SEEDS", range(1))


def short(name: str) -> Recipe:
    return dataclasses.replace(RECIPES.get(name), **SHORT[name])


def train(name: str, out: Path, **arguments: object) -> Path:
    return training.train(name, short(name), 3, out, say=lambda _: None, **arguments)


def curve(out: Path) -> list[dict[str, float]]:
    return [{key: value for key, value in leg.items() if key != "wall_s"} for leg in training.read_curve(out)]


@pytest.mark.parametrize("name", ["ppo", "sac", "recurrent_ppo", "ppo_pixels"])
def test_a_resumed_training_is_one_that_never_stopped(name: str, tmp_path: Path) -> None:
    whole = train(name, tmp_path / "whole")

    class Stop(Exception):
        pass

    def stop(_: str) -> None:
        raise Stop

    with pytest.raises(Stop):
        training.train(name, short(name), 3, tmp_path / "parts", say=stop)
    assert len(curve(tmp_path / "parts")) == 1
    parts = train(name, tmp_path / "parts", resume=True)
    assert parts.read_bytes() == whole.read_bytes()
    assert curve(tmp_path / "parts") == curve(tmp_path / "whole")


def test_a_training_killed_while_it_saves_goes_on_from_the_leg_before(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    whole = train("sac", tmp_path / "whole")
    write, written = training.write_csv, []

    def full_disk(path: Path, *rest: object) -> None:
        written.append(path)
        if len(written) == 2:
            raise OSError("no space left")
        write(path, *rest)

    monkeypatch.setattr(training, "write_csv", full_disk)
    with pytest.raises(OSError, match="no space left"):
        train("sac", tmp_path / "parts")
    monkeypatch.undo()
    monkeypatch.setattr(training, "HELD_SEEDS", range(1))
    assert train("sac", tmp_path / "parts", resume=True).read_bytes() == whole.read_bytes()


def test_the_filter_feeds_the_agent_that_wants_estimates(tmp_path: Path) -> None:
    agent, state = load_agent(train("ppo_estimate", tmp_path), scene="indoor"), None
    env = FollowEnv(scene="indoor", obs=agent.observation)
    observation, _ = env.reset(seed=1)
    actions = []
    for _ in range(10):
        action, state = agent.predict(observation, state)
        observation, *_ = env.step(action)
        actions.append(action)
    env.close()
    assert np.ptp(actions, axis=0).max() > 0.0
    assert state.estimate is not None


def test_a_folder_with_another_training_is_refused(tmp_path: Path) -> None:
    (tmp_path / "config.json").write_text("{}", encoding="utf-8")
    with pytest.raises(InputError, match="already holds a training"):
        train("ppo", tmp_path)
    with pytest.raises(InputError, match="another recipe, seed or version"):
        train("ppo", tmp_path, resume=True)


def test_a_recipe_checks_its_numbers() -> None:
    with pytest.raises(ValueError, match="worlds is 0; expected a whole number from 1"):
        dataclasses.replace(RECIPES.get("ppo"), worlds=0)
    with pytest.raises(ValueError, match="did you mean 'measurement'"):
        dataclasses.replace(RECIPES.get("ppo"), observation="measurment")


def test_the_digest_covers_the_domains(monkeypatch: pytest.MonkeyPatch) -> None:
    before = RECIPES.get("ppo").digest()
    assert before == RECIPES.get("ppo").digest()
    assert before != RECIPES.get("ppo_estimate").digest()
    monkeypatch.setattr("baselines.learned.recipes.base.DOMAINS", RECIPES.get("ppo").domains[:1])
    assert RECIPES.get("ppo").digest() != before


def test_a_recipe_is_found_by_its_name_or_its_path(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "my_recipes.py").write_text(
        "from baselines.learned.recipes import PPORecipe\nshort = PPORecipe(steps=1000)\nlong = 7\n"
    )
    monkeypatch.syspath_prepend(tmp_path)
    assert find_recipe("ppo") == ("ppo", RECIPES.get("ppo"))
    assert find_recipe("my_recipes:short") == ("short", PPORecipe(steps=1000))
    with pytest.raises(ValueError, match="'my_recipes:long' is int; expected a Recipe"):
        find_recipe("my_recipes:long")
    with pytest.raises(ValueError, match="did you mean 'sac'"):
        find_recipe("sack")
