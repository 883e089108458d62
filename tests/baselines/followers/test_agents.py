"""The shipped agents are what their cards say and drive as they did; what is no agent is refused."""

import csv
import dataclasses
import hashlib
import json
from pathlib import Path

import numpy as np
import pytest
from safetensors.numpy import load_file, save_file

from baselines.benchmark.cells import Cell
from baselines.benchmark.player import Player
from baselines.followers.agents import SUFFIX, load_agent, save_agent, shipped, weights_file
from baselines.learned.recipes import recipe_digest
from baselines.suites.followers import cells, speed_cells
from follow_env.envs.follow import FollowEnv
from follow_env.world.motion.profile import PAPER_SPEED

RUN = Path(__file__).parents[3] / "results" / "followers"
AGENTS = shipped()


def rows() -> list[dict[str, str]]:
    with (RUN / "episodes.csv").open(encoding="utf-8", newline="") as file:
        return list(csv.DictReader(file))


@pytest.mark.parametrize("name", AGENTS)
def test_the_card_tells_what_the_weights_are(name: str) -> None:
    weights, agent = weights_file(name), load_agent(name)
    card = json.loads(weights.with_suffix(".json").read_text(encoding="utf-8"))
    assert weights.stat().st_size < 1_000_000
    assert card["weights_sha256"] == hashlib.sha256(weights.read_bytes()).hexdigest()
    assert {key: card[key] for key in dataclasses.asdict(agent.card)} == dataclasses.asdict(agent.card)
    assert agent.name == name
    recipe = card["recipe_settings"]
    assert agent.card.recipe_sha256 == recipe_digest(recipe, card["domains"], card["environment"])
    assert agent.card.steps >= recipe["steps"]
    assert card["held_out"]["success"] > 0.0


@pytest.mark.parametrize("name", [name for name in AGENTS if "pixels" not in name or name.endswith("-0")])
def test_a_shipped_agent_drives_as_it_did(name: str) -> None:
    committed = rows()
    player = Player()
    mine = [cell for cell in [*cells([name]), *speed_cells([name])] if cell.controller == name]
    for cell in mine[:1] if "pixels" in name else [*mine[:2], mine[-1]]:  # both scenes, and the fastest person
        wanted = (name, cell.scene, str(cell.walking_speed or PAPER_SPEED), "3")
        (line,) = (r for r in committed if (r["controller"], r["scene"], r["walking_speed"], r["seed"]) == wanted)
        for column, value in player(cell, 3).row.items():
            if isinstance(value, float):
                assert float(line[column]) == pytest.approx(value, rel=1e-9, abs=1e-12), column
            else:
                assert line[column] == ("" if value is None else str(value)), column
    player.close()


def test_the_committed_followers_include_every_agent() -> None:
    assert {line["controller"] for line in rows()} == {cell.controller for cell in cells(AGENTS)}


@pytest.fixture
def weights(tmp_path: Path) -> Path:
    path = tmp_path / f"copy{SUFFIX}"
    path.write_bytes(weights_file("ppo-0").read_bytes())
    return path


def test_an_unknown_agent_names_the_nearest() -> None:
    with pytest.raises(ValueError, match="did you mean 'ppo-0'"):
        load_agent("ppo_0")


def test_damaged_weights_are_refused(weights: Path) -> None:
    weights.write_bytes(weights.read_bytes()[:2000])
    with pytest.raises(ValueError, match=r"copy\.safetensors cannot be read as an agent"):
        load_agent(weights)


def test_weights_that_are_not_those_of_their_card_are_refused(weights: Path) -> None:
    weights.with_suffix(".json").write_bytes(weights_file("ppo-0").with_suffix(".json").read_bytes())
    load_agent(weights)
    changed = bytearray(weights.read_bytes())
    changed[-1] ^= 1
    weights.write_bytes(changed)
    with pytest.raises(ValueError, match=r"copy\.safetensors is not the file that its card copy\.json describes"):
        load_agent(weights)


def test_weights_of_something_else_are_refused(weights: Path) -> None:
    save_file({"layer": np.zeros(3, np.float32)}, weights)
    with pytest.raises(ValueError, match=r"copy\.safetensors cannot be read as an agent"):
        load_agent(weights)


def test_a_missing_file_is_named(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match=r"none\.safetensors is not a file"):
        load_agent(tmp_path / f"none{SUFFIX}")


def test_an_agent_of_another_version_is_refused(weights: Path) -> None:
    card = dataclasses.replace(load_agent("ppo-0").card, environment="follow_env/*-v7")
    save_agent(weights, card, load_file(weights))
    with pytest.raises(
        ValueError, match=r"was trained for follow_env/.*-v7, this is .*-v0; train it again with `follow"
    ):
        load_agent(weights)


@pytest.mark.parametrize(
    ("name", "obs", "wanted"),
    [
        ("ppo-0", "rgbd", "measurement"),
        ("recurrent_ppo-0", "rgbd_uint8", "measurement"),
        ("ppo_pixels-0", "rgbd_box", "rgbd_uint8"),
        ("ppo_pixels-0", "measurement", "rgbd_uint8"),
    ],
)
def test_another_observation_is_refused(name: str, obs: str, wanted: str) -> None:
    env = FollowEnv(scene="corridor", obs=obs, camera={"width": 32, "height": 24})
    observation, _ = env.reset(seed=0)
    with pytest.raises(ValueError, match=rf"agent {name} got .*; it drives with obs='{wanted}'"):
        load_agent(name).predict(observation)
    env.close()


def test_a_batch_is_driven_world_by_world() -> None:
    agent, rng = load_agent("recurrent_ppo-0"), np.random.default_rng(0)
    both: object = None
    alone: list[object] = [None, None]
    for step in range(5):
        observations = rng.normal(0.0, 0.3, (2, 8)).astype(np.float32)
        starts = np.array([step == 0, step in (0, 3)])
        actions, both = agent.predict(observations, both, starts)
        for i in range(2):
            action, alone[i] = agent.predict(observations[i], alone[i], starts[i : i + 1])
            np.testing.assert_array_equal(action, actions[i])


def test_cells_of_agents_are_cells_of_the_benchmark() -> None:
    assert Cell("pixels", "corridor", "none", "ppo_pixels-0") in cells(["ppo_pixels-0"])
    with pytest.raises(ValueError, match="policy 'ppo-99' is not known"):
        cells(["ppo-99"])
