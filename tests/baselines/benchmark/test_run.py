"""Cells, plans, and playing them: what is asked for is played once, by any number of processes; failures are named."""

import dataclasses
import importlib
import os
import pickle
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest

from baselines.benchmark.cells import Cell, family_cells, rule_cells, sensitivity_cells, table1_cells
from baselines.benchmark.executors import processes as pool
from baselines.benchmark.executors.processes import EpisodeError, play_all
from baselines.benchmark.progress import progress
from baselines.benchmark.provenance import Plan

ROOT = Path(__file__).resolve().parents[3]
CELL = Cell("emulated", "corridor", "kf")


@pytest.fixture
def synthetic(monkeypatch: pytest.MonkeyPatch) -> ModuleType:
    monkeypatch.syspath_prepend(Path(__file__).parents[1])
    return importlib.import_module("synthetic")


def test_table_1_has_every_scene_and_estimator_in_one_order() -> None:
    cells = table1_cells(["mask", "emulated", "mask"])
    assert [(cell.perception, cell.scene, cell.estimator) for cell in cells] == [
        (perception, scene, estimator)
        for perception in ("emulated", "mask")
        for scene in ("corridor", "indoor")
        for estimator in ("none", "kf", "akf", "akf_cv")
    ]


def test_keys_are_distinct_and_never_change() -> None:
    cells = {*table1_cells(["truth", "emulated", "mask"]), *sensitivity_cells(), *family_cells(["white", "bursts"])}
    cells.update(rule_cells())
    assert len({cell.key for cell in cells}) == len(cells)
    assert Cell("mask", "indoor", "akf", q_scale=3, alpha=0.1).key == "mask/indoor/akf/pi/q3.0/a0.1/six_smallest"


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"perception": "maks"}, "perception is 'maks', but it must be one of truth, emulated, mask"),
        ({"scene": "garden"}, "scene is 'garden'"),
        ({"estimator": "ukf"}, "estimator is 'ukf'"),
        ({"q_scale": 0.0}, "q_scale is 0.0"),
        ({"q_scale": float("nan")}, "q_scale is nan"),
        ({"alpha": 1.0}, "alpha is 1.0"),
    ],
)
def test_an_impossible_cell_is_refused(change: dict, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        dataclasses.replace(CELL, **change)


def test_a_plan_plays_each_episode_once_and_covers_every_study() -> None:
    plan = Plan.of(["mask", "emulated"], None, ["fitted", "white"])
    tasks = plan.tasks()
    assert len(tasks) == len(set(tasks))
    assert plan.episodes == {"emulated": 100, "mask": 20}
    assert {name: len(plan.study_seeds(name)) for name in plan.studies} == {
        "sensitivity": 10,
        "family": 10,
        "rules": 10,
    }
    assert {(cell, seed) for cell in plan.table for seed in plan.table_seeds(cell)} <= set(tasks)
    assert {(cell, seed) for cell in sensitivity_cells() for seed in range(10)} <= set(tasks)
    assert {(cell, seed) for cell in family_cells(["white"]) for seed in range(10)} <= set(tasks)
    assert {(cell, seed) for cell in rule_cells() for seed in range(10)} <= set(tasks)
    assert len(tasks) == 8 * 100 + 8 * 20 + 2 * (5 + 15 - 2) * 10 + 2 * 3 * 10 + 2 * 2 * 3 * 10


@pytest.mark.parametrize(("episodes", "studies"), [(1, 2), (9, 2), (50, 5)])
def test_studies_take_a_tenth_of_the_episodes_but_two_at_least(episodes: int, studies: int) -> None:
    plan = Plan.of(["emulated"], episodes, [])
    assert plan.study_seeds("sensitivity") == range(studies)


def test_a_study_is_made_only_where_its_perception_is() -> None:
    truth, mask = Plan.of(["truth"], 3, ["white"]), Plan.of(["mask"], 3, ["white"])
    assert (truth.sensitivity, truth.family, truth.rules, len(truth.tasks())) == ((), (), (), 2 * 4 * 3)
    assert (mask.sensitivity, mask.family, len(mask.rules)) == ((), (), 3 * 2 * 3)


def test_every_observation_of_an_episode_is_scored(synthetic: ModuleType) -> None:
    episode = synthetic.episode(CELL, 0, seconds=2.0)
    assert (episode.row["steps"], episode.row["estimate_steps"], len(episode.curve)) == (61, 61, 61)
    assert episode.row["duration_s"] == pytest.approx(2.0)
    assert 0.0 < episode.timing.mean <= episode.timing.p95 * 2.0


def test_an_estimate_is_compared_with_the_truth_of_its_own_instant(synthetic: ModuleType) -> None:
    """With perfect measurements No filter is right at every step; one step's shift would cost v dt = 3 cm."""
    row = synthetic.episode(Cell("truth", "corridor", "none"), 0).row
    assert row["distance_rmse_m"] < 1e-6
    assert row["angle_rmse_rad"] < 1e-6


def test_worker_processes_give_what_one_process_gives(synthetic: ModuleType) -> None:
    tasks = [(Cell("emulated", scene, "akf"), seed) for scene in ("corridor", "indoor") for seed in range(4)]
    alone = dict(play_all(synthetic.episode, tasks, jobs=1))
    together = dict(play_all(synthetic.episode, tasks, jobs=3))
    assert alone.keys() == together.keys() == set(tasks)
    for task in tasks:
        assert alone[task].row == together[task].row
        assert np.array_equal(alone[task].curve, together[task].curve)


@pytest.mark.parametrize("jobs", [1, 2])
def test_a_failing_episode_is_named_with_its_traceback(synthetic: ModuleType, jobs: int) -> None:
    tasks = [(CELL, seed) for seed in range(4)]
    with pytest.raises(EpisodeError, match=r"emulated/corridor/kf/.* with seed 1 failed:\n(.*\n)*.*this seed fails"):
        list(play_all(synthetic.failing, tasks, jobs))


def test_a_worker_that_dies_is_noticed_and_named(synthetic: ModuleType) -> None:
    with pytest.raises(EpisodeError, match=r"the worker process that played .* with seed 1 died with code 3"):
        list(play_all(synthetic.dying, [(CELL, seed) for seed in range(4)], jobs=2))


def test_no_worker_outlives_an_abandoned_run(synthetic: ModuleType, monkeypatch: pytest.MonkeyPatch) -> None:
    started = []
    start = pool._start

    def remember(episode: object) -> object:
        started.append(start(episode))  # type: ignore[arg-type]
        return started[-1]

    monkeypatch.setattr(pool, "_start", remember)
    playing = play_all(synthetic.episode, [(CELL, seed) for seed in range(50)], jobs=2)
    next(playing)
    assert [process.is_alive() for _, process in started] == [True, True]
    playing.close()
    assert [process.is_alive() for _, process in started] == [False, False]


def children(pid: int) -> set[int]:
    """Processes whose parent is the given one."""
    found = set()
    for stat in Path("/proc").glob("[0-9]*/stat"):
        try:
            fields = stat.read_text().rpartition(")")[2].split()
        except (FileNotFoundError, ProcessLookupError):
            continue
        if int(fields[1]) == pid and fields[0] != "Z":
            found.add(int(stat.parent.name))
    return found


def test_workers_die_with_a_parent_that_is_killed(tmp_path: Path) -> None:
    command = [sys.executable, "-m", "synthetic", str(tmp_path), "4", "2", "0.5"]
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join([str(ROOT), str(Path(__file__).parents[1])])}
    with subprocess.Popen(command, env=environment, stderr=subprocess.PIPE) as parent:
        deadline = time.monotonic() + 60
        while len(children(parent.pid)) < 3:  # two workers and multiprocessing's resource tracker
            assert time.monotonic() < deadline
            time.sleep(0.05)
        workers = children(parent.pid)
        time.sleep(1.0)
        parent.send_signal(signal.SIGKILL)
    while any(Path(f"/proc/{worker}").exists() for worker in workers):
        assert time.monotonic() < deadline
        time.sleep(0.05)


def test_progress_without_a_terminal_is_a_line_for_every_tenth(capsys: pytest.CaptureFixture[str]) -> None:
    assert list(progress(iter(range(40)), total=50, done=10)) == list(range(40))
    lines = capsys.readouterr().err.splitlines()
    assert lines == [f"{count} of 50 episodes" for count in range(10, 51, 5)]


def test_progress_on_a_terminal_is_a_bar(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    monkeypatch.setattr(sys.stderr, "isatty", lambda: True)
    assert list(progress(iter(range(3)), total=3)) == [0, 1, 2]
    assert "3/3" in capsys.readouterr().err


@pytest.fixture
def player() -> Iterator[object]:
    from baselines.benchmark.player import Player

    player = Player()
    yield player
    player.close()


def test_what_a_player_played_before_does_not_change_an_episode(player) -> None:
    tasks = [
        (Cell("emulated", "corridor", "kf"), 1),
        (Cell("emulated", "indoor", "akf"), 0),
        (Cell("truth", "indoor", "none"), 2),
    ]
    first = [player(*task) for task in tasks]
    again = [player(*task) for task in reversed(tasks)][::-1]
    for before, after in zip(first, again, strict=True):
        assert before.row == after.row
        assert np.array_equal(before.curve, after.curve)


def test_a_player_travels_to_a_worker_and_plays_the_same(player) -> None:
    task = (Cell("emulated", "indoor", "akf_cv"), 5)
    assert pickle.loads(pickle.dumps(type(player)()))(*task).row == player(*task).row


def test_real_episodes_are_scored_by_the_measured_following(player) -> None:
    row = player(Cell("truth", "corridor", "none"), 0).row
    assert row["distance_rmse_m"] < 1e-5
    assert (row["ended"], row["duration_s"]) == ("time", pytest.approx(14.0))
    assert row["steps"] == 421
