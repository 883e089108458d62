"""A Minari dataset holds the very episodes that were played."""

from pathlib import Path

import minari
import numpy as np
import pytest

from baselines.benchmark.build import cell_of, driver
from baselines.cli import main as cli


@pytest.fixture(autouse=True)
def _own_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("MINARI_DATASETS_PATH", str(tmp_path))


def test_the_dataset_gives_back_environment_and_episodes(capsys: pytest.CaptureFixture[str]) -> None:
    words = ["export", "--policy", "oracle", "--scene", "indoor", "--episodes", "2", "--id", "follow_env/oracle-v0"]
    assert cli.main(words) == 0
    assert "follow_env/oracle-v0: 2 episodes, 840 steps" in capsys.readouterr().out
    dataset = minari.load_dataset("follow_env/oracle-v0")
    env, policy = dataset.recover_environment(), driver(cell_of("oracle", "indoor"))
    episode = dataset[1]
    observation, _ = env.reset(seed=1)
    for step in range(50):
        np.testing.assert_array_equal(observation, episode.observations[step])
        action, _ = policy.predict(observation)
        np.testing.assert_array_equal(action, episode.actions[step])
        observation, reward, *_, info = env.step(action)
        assert reward == episode.rewards[step]
        assert info["bearing"] == episode.infos["bearing"][step + 1]
    env.close()
    assert episode.truncations[-1]
    assert not episode.truncations[:-1].any()


@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        (["--policy", "akv"], "policy 'akv' is not known"),
        (["--policy", "parked", "--episodes", "1", "--id", "no good"], "is no name of a Minari dataset"),
    ],
)
def test_what_cannot_be_stored_is_one_sentence(
    words: list[str], sentence: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert cli.main(["export", *words]) == cli.BAD_INPUT
    complaint = capsys.readouterr().err
    assert sentence in complaint
    assert complaint.startswith("follow: ")


def test_a_dataset_is_not_overwritten(capsys: pytest.CaptureFixture[str]) -> None:
    words = ["export", "--policy", "parked", "--episodes", "1"]
    assert cli.main(words) == 0
    assert cli.main(words) == cli.BAD_INPUT
    assert "already exists" in capsys.readouterr().err
