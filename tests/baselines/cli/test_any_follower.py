"""Whatever drives, one command gives its row, one its video and one its dataset: nothing is edited or registered."""

import shutil
import sys

import minari
import numpy as np
import pytest
from stable_baselines3 import PPO

from baselines.benchmark.suite import Suite
from baselines.benchmark.trial import Scenario
from baselines.cli.main import main
from baselines.followers.agents import weights_file
from follow_env.envs.follow import FollowEnv

SUITE = Suite(
    "brief",
    (Scenario("ahead", {"route": {"name": "path", "points": [[0.8, 0.0]]}, "engine": "kinematic"}),),
    card="Less than a meter ahead.",
)


class Mine:
    """A policy of one's own."""

    def predict(self, observation, state=None, episode_start=None, deterministic=True):
        return np.clip((observation[1] - 1.5, observation[0]), -1.0, 1.0), None


@pytest.fixture(scope="module")
def files(tmp_path_factory):
    """What people have: an SB3 zip, the folder that a training wrote, and a class in a module."""
    folder = tmp_path_factory.mktemp("files")
    PPO("MlpPolicy", FollowEnv(engine="kinematic"), device="cpu").save(folder / "sb3_model.zip")
    (folder / "training").mkdir()
    for suffix in (".safetensors", ".json"):
        shutil.copy(weights_file("ppo-0").with_suffix(suffix), folder / "training")
    return {"sb3": str(folder / "sb3_model.zip"), "trained": str(folder / "training"), "own": "my_work:Mine"}


@pytest.fixture(autouse=True)
def _my_work(monkeypatch, tmp_path):
    monkeypatch.setitem(sys.modules, "my_work", sys.modules[__name__])
    monkeypatch.setenv("MINARI_DATASETS_PATH", str(tmp_path / "minari"))


def test_each_gets_its_row_and_its_paired_difference(files, tmp_path, capsys):
    words = [word for spec in ("akf", *files.values()) for word in ("--follower", spec)]
    out = tmp_path / "run"
    assert main(["bench", "my_work:SUITE", *words, "--episodes", "2", "--jobs", "1", "--out", str(out)]) == 0
    table = capsys.readouterr().out
    for name in ("akf + pi", "sb3_model", "training", "Mine"):
        assert f"| {name} " in table
    lines = [line for line in table.splitlines() if line.startswith("| ahead")]
    assert [line.count("[") for line in lines] == [0, 4, 4, 4]


@pytest.mark.parametrize("which", ["sb3", "trained", "own"])
def test_each_gets_its_video_and_its_dataset(files, which, tmp_path, capsys):
    words = ["--follower", files[which], "--suite", "my_work:SUITE", "--scenario", "ahead"]
    video = tmp_path / "seen.mp4"
    assert main(["watch", *words, "--video", str(video), "--size", "64x48"]) == 0
    assert video.stat().st_size > 1000
    assert main(["export", *words, "--episodes", "1", "--id", "follow_env/mine-v0"]) == 0
    assert minari.load_dataset("follow_env/mine-v0").total_steps > 10
    capsys.readouterr()


@pytest.mark.parametrize("command", ["watch", "export"])
def test_a_follower_that_is_none_is_one_sentence(command, capsys):
    assert main([command, "--follower", "akff"]) == 2
    assert "did you mean 'akf'" in capsys.readouterr().err
    assert main([command, "--follower", "akf", "--scenario", "coridor"]) == 2
    assert "did you mean 'corridor'" in capsys.readouterr().err
