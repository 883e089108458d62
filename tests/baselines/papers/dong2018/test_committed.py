"""The committed run of Table 1 comes back: a few of its episodes are played again, its tables are made again."""

import csv
from pathlib import Path

import pytest

from baselines.benchmark import provenance
from baselines.benchmark.cells import Cell
from baselines.benchmark.files import write_csv
from baselines.benchmark.player import Player
from baselines.benchmark.provenance import Plan
from baselines.followers import calibration
from baselines.papers.dong2018.table1 import COLUMNS, Table1

RUN = Path(__file__).parents[4] / "results" / "table1"


def rows():
    with (RUN / "episodes.csv").open(encoding="utf-8", newline="") as file:
        return list(csv.DictReader(file))


@pytest.mark.parametrize(
    ("cell", "seed"),
    [
        (Cell("emulated", "corridor", "akf"), 0),
        (Cell("emulated", "indoor", "kf"), 41),
        (Cell("emulated", "indoor", "akf_cv"), 99),
        (Cell("mask", "indoor", "akf"), 7),
    ],
)
def test_a_committed_episode_comes_back(cell, seed):
    (committed,) = (
        row
        for row in rows()
        if (row["perception"], row["scene"], row["estimator"], row["seed"])
        == (cell.perception, cell.scene, cell.estimator, str(seed))
    )
    player = Player()

    played = player(cell, seed).row

    player.close()
    for column, value in played.items():
        if isinstance(value, float):
            assert float(committed[column]) == pytest.approx(value, rel=1e-6, abs=1e-9), column
        else:
            assert committed[column] == ("" if value is None else str(value)), column


def test_the_committed_table_follows_from_the_committed_episodes(tmp_path):
    def number(text):
        try:
            return int(text)
        except ValueError:
            try:
                return float(text)
            except ValueError:
                return text or None

    cells = {}
    for row in rows():
        cell = Cell(row["perception"], row["scene"], row["estimator"])
        cells.setdefault(cell, []).append({column: number(text) for column, text in row.items()})
    write_csv(tmp_path / "table1.csv", COLUMNS, Table1(cells).records(), 6)

    assert (tmp_path / "table1.csv").read_bytes() == (RUN / "table1.csv").read_bytes()
    assert {cell.perception: len(episodes) for cell, episodes in cells.items()} == {"emulated": 100, "mask": 20}


def test_it_was_made_with_these_settings():
    import json

    config = json.loads((RUN / "config.json").read_text(encoding="utf-8"))
    plan = Plan.of(["emulated", "mask"], None, calibration.family())

    assert config["settings_sha256"] == provenance.digest(provenance.settings(calibration.settings()))
    assert config["cells"]["table1"] == [cell.key for cell in plan.table]
    assert {name: len(seeds) for name, seeds in config["seeds"]["studies"].items()} == {
        name: len(plan.study_seeds(name)) for name in plan.studies
    }
