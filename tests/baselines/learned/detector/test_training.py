"""Training: the same settings give the same weights, an interrupted run goes on to them, and a bad start is refused."""

import csv
import dataclasses
import json
from pathlib import Path

import pytest
import torch

from baselines.learned.detector import training
from baselines.learned.detector.training import TrainConfig, train
from tracker.detection.detector import PersonDetector
from tracker.detection.weights import load_network

SHORT = TrainConfig(steps=4, batch=2, evaluate_every=2, test_pictures=2)


def quiet(_: str) -> None:
    pass


@pytest.fixture(scope="module")
def finished(tmp_path_factory: pytest.TempPathFactory) -> Path:
    torch.set_num_threads(1)
    out = tmp_path_factory.mktemp("run")
    train(SHORT, out, workers=0, tell=quiet)
    return out


def test_the_folder_holds_what_is_needed_to_judge_and_to_use_the_run(finished: Path) -> None:
    assert {p.name for p in finished.iterdir()} == {
        "config.json", "log.csv", "evaluation.csv", "curves.png", "weights.safetensors", "card.json", "state.pt",
    }  # fmt: skip
    with (finished / "log.csv").open() as file:
        assert [int(row["step"]) for row in csv.DictReader(file)] == [1, 2, 3, 4]
    with (finished / "evaluation.csv").open() as file:
        rows = list(csv.DictReader(file))
    assert [int(row["step"]) for row in rows] == [2, 4]
    assert all(0.0 <= float(row["ap"]) <= 1.0 for row in rows)
    PersonDetector("light", finished / "weights.safetensors")


def test_an_interrupted_run_goes_on_to_the_same_weights(finished: Path, tmp_path: Path) -> None:
    def stop(line: str) -> None:
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        train(SHORT, tmp_path / "run", workers=0, tell=stop)
    train(SHORT, tmp_path / "run", workers=1, resume=True, tell=quiet)
    for name in ("log.csv", "weights.safetensors"):
        assert (tmp_path / "run" / name).read_bytes() == (finished / name).read_bytes()


def test_a_run_goes_on_in_the_numbers_it_began_with(
    finished: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Another machine may have other units; the card tells what the weights were trained in."""
    here = json.loads((finished / "card.json").read_text(encoding="utf-8"))["precision"]
    other = {"float32": "bfloat16", "bfloat16": "float32"}[here]
    monkeypatch.setattr(training, "choose_precision", lambda device: other)
    train(dataclasses.replace(SHORT, steps=2), tmp_path / "run", workers=0, tell=quiet)
    monkeypatch.undo()
    train(dataclasses.replace(SHORT, steps=2), tmp_path / "run", workers=0, resume=True, tell=quiet)
    assert json.loads((tmp_path / "run" / "card.json").read_text(encoding="utf-8"))["precision"] == other
    rows = [(folder / "log.csv").read_text(encoding="utf-8").splitlines()[1] for folder in (finished, tmp_path / "run")]
    assert rows[0] != rows[1]


def test_a_finished_run_has_nothing_left_to_do(finished: Path) -> None:
    before = (finished / "state.pt").read_bytes()
    train(SHORT, finished, workers=0, resume=True, tell=quiet)
    assert (finished / "state.pt").read_bytes() == before


def test_a_run_can_start_from_weights(finished: Path, tmp_path: Path) -> None:
    start = str(finished / "weights.safetensors")
    config = dataclasses.replace(SHORT, steps=1, rate=1e-12, evaluate_every=1, start=start)
    train(config, tmp_path / "run", workers=0, tell=quiet)
    before, after = (load_network("light", path) for path in (Path(start), tmp_path / "run" / "weights.safetensors"))
    torch.testing.assert_close(after.trunk.state_dict()["lower.0.0.weight"], before.trunk.lower[0][0].weight.data)


def test_a_folder_with_a_run_is_not_overwritten(finished: Path) -> None:
    with pytest.raises(ValueError, match="go on with it by --resume"):
        train(SHORT, finished, workers=0, tell=quiet)
    with pytest.raises(ValueError, match="of other settings"):
        train(dataclasses.replace(SHORT, rate=1e-3), finished, workers=0, resume=True, tell=quiet)


@pytest.mark.parametrize(
    ("settings", "sentence"),
    [
        ({"net": "lihgt"}, "did you mean 'light'"),
        ({"steps": 0}, "steps is 0; expected at least 1"),
        ({"seed": training.TEST_SEED}, "the others are for testing"),
        ({"net": "light_depth"}, "do not go together"),
    ],
)
def test_bad_settings_are_refused(settings: dict, sentence: str) -> None:
    with pytest.raises(ValueError, match=sentence):
        TrainConfig(**settings)
