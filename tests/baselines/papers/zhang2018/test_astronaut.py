"""Paper A's experiments: counted as in the paper, the same by any number of processes, kept when interrupted."""

import csv
import importlib
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest
import torch

from baselines.benchmark.run import Interrupted
from baselines.benchmark.store import InputError
from baselines.cli import main as cli
from baselines.papers.zhang2018 import table2, table3
from baselines.papers.zhang2018.experiments import EXPERIMENTS, tasks
from baselines.papers.zhang2018.nets import Nets
from baselines.papers.zhang2018.reproduce import reproduce
from baselines.papers.zhang2018.sequences import TABLE_2, Sequence, count, play
from baselines.papers.zhang2018.table2 import NETS
from follow_env.world.people.walker import POSTURES
from tracker.boxes import Detection
from tracker.detection import detector as detecting

FILM = Sequence("green", 1, 2 * len(POSTURES))
WEIGHTS = {net: "0" * 64 for net in NETS}


def cut_short(patch: pytest.MonkeyPatch) -> ModuleType:
    """Leave one short film of Table 2, and return what stands for the nets."""
    patch.syspath_prepend(Path(__file__).parents[2])
    patch.setattr(table2, "films", lambda share: [FILM])
    return importlib.import_module("suits")


@pytest.fixture
def suits(monkeypatch: pytest.MonkeyPatch) -> ModuleType:
    return cut_short(monkeypatch)


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, str]:
    """Folder and report of a run in one go in this process."""
    out = tmp_path_factory.mktemp("whole")
    with pytest.MonkeyPatch.context() as patch:
        return out, run(cut_short(patch), out)


def run(suits: ModuleType, out: Path, jobs: int = 1, resume: bool = False, patience: int = 1_000_000) -> str:
    return reproduce(["table2"], 1, suits.detectors(patience), WEIGHTS, None, out, jobs, resume)


def results(out: Path) -> dict[str, bytes]:
    return {
        path.relative_to(out).as_posix(): path.read_bytes()
        for path in out.rglob("*")
        if path.is_file() and path.name not in ("config.json", "episodes.sqlite")
    }


def test_the_papers_rows_are_those_of_its_text() -> None:
    for film in TABLE_2:
        for paper in table2.PAPER[film.suit, film.view].values():
            assert paper.frames == film.frames == paper.tp + paper.fn
            assert paper.cfn <= paper.fn
    totals = {net: sum(one[net].tp for one in table2.PAPER.values()) for net in NETS}
    assert totals == {"light_ssd": 11357, "light": 11431}  # 99.17 % and 99.82 % of 11452


class Told:
    """A detector that was told the answers."""

    def __init__(self, answers: list[list[Detection]]) -> None:
        self._answers = iter(answers)

    def detect(self, rgb: np.ndarray, depth: np.ndarray) -> list[Detection]:
        return next(self._answers)


def test_a_perfect_and_a_blind_net_are_counted_over_the_parts() -> None:
    truth = [[Detection(frame.person_box() or (0.0, 0.0, 0.0, 0.0), 1.0)] for frame in play(FILM)]
    told = {"light": Told(truth), "light_ssd": Told([[]] * FILM.frames)}
    rows = [row for part in range(len(POSTURES)) for row in table2.detect(FILM, part, told)]
    assert [row["frame"] for row in rows] == list(range(FILM.frames))
    assert all(set(row) == set(table2.COLUMNS) for row in rows)
    blind, perfect, *totals = table2.records(rows)
    wanted = ("net", "frames", "tp", "fp", "fn", "cfn", "tda")
    assert [blind[name] for name in wanted] == ["light_ssd", 16, 0, 0, 16, 16, 0.0]
    assert [perfect[name] for name in wanted] == ["light", 16, 16, 0, 0, 0, 1.0]
    assert [record["suit"] for record in totals] == ["all", "all"]
    for line in table2.by_posture(rows).splitlines()[2:]:
        assert line.replace(" ", "").endswith("|2|0.00%|100.00%|")


def test_detector_evaluate_and_table_2_count_alike(suits: ModuleType) -> None:
    nets = suits.detectors()
    rows = [row for part in range(len(POSTURES)) for row in table2.detect(FILM, part, nets)]
    for record, net in zip(table2.records(rows), NETS, strict=False):
        counts = count(nets[net], FILM)
        assert record["net"] == net
        assert [record[name] for name in ("tp", "fp", "fn", "cfn")] == [counts.tp, counts.fp, counts.fn, counts.cfn]
    assert 0 < counts.tp < FILM.frames  # neither perfect nor blind: the comparison says something


def test_one_and_two_processes_write_the_same(suits: ModuleType, whole: tuple[Path, str], tmp_path: Path) -> None:
    one, report = whole
    assert run(suits, tmp_path, jobs=2) == report
    assert results(tmp_path) == results(one)
    assert set(results(one)) == {"astronaut.md", "table2.csv", "table2_rows.csv", "figures/figure11.png"}


def test_an_interrupted_run_keeps_its_parts_and_goes_on(
    suits: ModuleType, whole: tuple[Path, str], tmp_path: Path
) -> None:
    with pytest.raises(Interrupted, match="3 of 8 episodes are kept"):
        run(suits, tmp_path / "broken", patience=7)
    with pytest.raises(InputError, match="already holds 3 episodes"):
        run(suits, tmp_path / "broken")
    with pytest.raises(Interrupted):  # two frames a part: what was kept is not played again
        run(suits, tmp_path / "broken", resume=True, patience=9)
    run(suits, tmp_path / "broken", resume=True)
    assert results(tmp_path / "broken") == results(whole[0])


def test_the_table_follows_from_the_written_rows(whole: tuple[Path, str]) -> None:
    out, text = whole
    with (out / "table2_rows.csv").open(encoding="utf-8", newline="") as file:
        rows = list(csv.DictReader(file))
    assert table2.table(table2.records(rows)) in text


def test_every_part_of_every_experiment_has_its_own_key() -> None:
    for episodes in (1, 20, 200):
        planned = [task for name in EXPERIMENTS for task in tasks(name, episodes)]
        assert len({(part.key, seed) for part, seed in planned}) == len(planned)
    assert sum(film.frames for film in table2.films()) == 11452
    assert {film.frames for film in table2.films(1e-9)} == {len(POSTURES)}
    assert len(tasks("lookalike", 200)) == 2 * 200


def test_speeds_are_beside_each_other_and_beside_the_ssds(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    from tracker.detection.networks import make_network
    from tracker.detection.weights import save_weights

    for net in NETS:
        network = make_network(net)
        for head in network.heads:  # an untrained net takes every second prior for a person
            torch.nn.init.constant_(head.bias.data.view(-1, 6)[:, 4], 5.0)
        save_weights(network, tmp_path / f"{net}.safetensors")
    monkeypatch.setattr(table3, "FULL", {"light_ssd": "light_ssd", "light": "light"})  # half a second a frame less
    monkeypatch.setattr(table3, "_PICTURES", 1)
    nets = Nets({net: tmp_path / f"{net}.safetensors" for net in NETS})
    assert set(nets.digests()) == set(NETS)
    speeds = table3.measure_speeds(nets, 1)
    assert [(one.net, one.stage) for one in speeds[:3]] == [("light_ssd", stage) for stage in table3.STAGES]
    table3.write(speeds, "Played.", tmp_path)
    with (tmp_path / "timing.csv").open(encoding="utf-8", newline="") as file:
        rows = list(csv.DictReader(file))
    assert all(float(row["of_ssd"]) == 1.0 for row in rows if row["net"] == "light_ssd")
    assert all(float(row["frames_per_s"]) == pytest.approx(1.0 / float(row["median_s"]), rel=1e-4) for row in rows)
    assert (tmp_path / "timing.md").read_text(encoding="utf-8").startswith("Played.\n\n# Table 3")


@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        ([], "no weights are shipped for the net 'light'"),
        (["--weights", "light_ssd=nowhere", "--weights", "light=nowhere"], "the weights 'nowhere' do not exist"),
        (["--weights", "paper=some.safetensors"], "net 'paper' is not known"),
        (["--weights", "light"], "'light' names no file; expected NET=FILE"),
        (["--experiment", "table4"], "invalid choice: 'table4'"),
        (["--episodes", "0"], "'0' is not a whole number of at least 1"),
    ],
)
def test_bad_input_is_one_sentence(
    words: list[str],
    sentence: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.setattr(detecting, "SHIPPED", tmp_path)
    try:
        code = cli.main(["reproduce", "astronaut", "--out", str(tmp_path / "out"), *words])
    except SystemExit as ended:
        code = ended.code  # type: ignore[assignment]
    error = capsys.readouterr().err
    assert code == cli.BAD_INPUT
    assert sentence in error
    assert error.count("\n") == 1
    assert not (tmp_path / "out").exists()
