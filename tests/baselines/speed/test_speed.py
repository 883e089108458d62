"""`follow speed`: what it compares is the same, what it prints follows from what it measured. Nothing here is timed."""

import itertools
import json
import math
from pathlib import Path

import numpy as np
import pytest

from baselines import speed
from baselines.cli import main as cli
from baselines.speed import frames, pair, timing
from baselines.speed.batch import PEER, BatchRate
from baselines.speed.frames import FrameCost
from baselines.speed.pair import Gain, Rates
from baselines.speed.solver import ITERATIONS, SolverCost
from baselines.speed.stepping import BARE, StepCost
from baselines.speed.table import document, table
from baselines.speed.timing import Cost
from follow_env import IDS
from follow_env.camera import RENDERERS
from follow_env.world.bullet import SOLVER_ITERATIONS

SIZE = (48, 36)
LEAST = speed.Effort(frames=2, steps=2, resets=2, rounds=1, seconds=0.01, sizes=(SIZE,), batches=(3,))


def cost(median: float, cpu_median: float) -> Cost:
    return Cost(median, median / 2.0, median, cpu_median, cpu_median / 2.0)


BY_HAND = speed.Report(
    unavailable={"opengl": "renderer 'opengl' needs a driver; install one"},
    frames=[FrameCost("raster", "skinned", 320, 240, cost(0.002, 0.001), cost(0.03, 0.02))],
    gains=[Gain("raster", 320, 240, Rates(500.0, 510.0, 800.0, 918.0), Rates(100.0, 100.0, 200.0, 200.0))],
    steps=[StepCost("corridor", "reset", cost(0.0005, 0.0005), cost(0.0002, 0.0001))],
    batches=[BatchRate("FollowVectorEnv", 4096, 3e6, 4e6, 1e7), BatchRate(PEER, 4096, 1e7, 2e7, None)],
    solver=[
        SolverCost(SOLVER_ITERATIONS, 0.001, 0.002, 0.003, cost(0.0002, 0.0002)),
        SolverCost(50, 0.0005, 0.001, 0.002, cost(0.0003, 0.0003)),
    ],
)


@pytest.fixture(scope="module")
def report() -> speed.Report:
    return speed.speed(LEAST)


def test_every_renderer_picture_step_and_count_of_iterations_has_a_row(report: speed.Report) -> None:
    assert {c.renderer for c in report.frames} | set(report.unavailable) == set(RENDERERS)
    persons = {name: [c.person for c in report.frames if c.renderer == name] for name in RENDERERS}
    assert persons["raster"] == ["skinned", "rigid"]
    assert persons["tiny"] == ["rigid"]
    assert {(c.width, c.height) for c in report.frames} == {SIZE}
    assert [g.renderer for g in report.gains] == list(dict.fromkeys(c.renderer for c in report.frames))
    for scene in IDS:
        names = [c.what for c in report.steps if c.scene == scene]
        assert names[0] == BARE
        assert names[-1] == "reset"
        assert len(names) == len(set(names)) == 6
    assert [c.iterations for c in report.solver] == list(ITERATIONS)


def test_batches_stand_beside_their_peers(report: speed.Report) -> None:
    assert {r.worlds for r in report.batches if r.peer is not None} == {3}
    (peer,) = [r for r in report.batches if r.what == PEER]
    assert [r.peer for r in report.batches if r.worlds == 3] == [peer.median, peer.median, None]
    assert sum("84x84" in r.what for r in report.batches) == sum("of FollowEnv" in r.what for r in report.batches) == 2
    assert all(0.0 < r.median <= r.fastest < math.inf for r in report.batches)
    assert (
        "| FollowVectorEnv                 |  4,096 |        3,000,000 |         4,000,000 |        0.30 x |"
        in table(BY_HAND)
    )


def test_all_costs_are_times(report: speed.Report) -> None:
    for row in (*report.frames, *report.steps, *report.solver):
        assert 0.0 < row.cost.fastest <= row.cost.median, row
        assert row.cost.fastest <= row.cost.mean, row
        assert 0.0 < row.cost.cpu_fastest <= row.cost.cpu_median, row
    for gain in report.gains:
        rates = (gain.frames, gain.loop)
        assert all(0.0 < rate < math.inf for r in rates for rate in (r.one, r.two, r.cpu_one, r.cpu_two)), gain


def test_ten_iterations_move_the_robot_as_well_as_fifty_and_five_do_not(report: speed.Report) -> None:
    """The motions cover up to 2.4 m and 4 rad."""
    rows = {row.iterations: row for row in report.solver}
    assert rows[SOLVER_ITERATIONS].position_error < min(0.005, 1.5 * rows[50].position_error)
    assert rows[SOLVER_ITERATIONS].heading_error < 0.01
    assert rows[5].position_error > 5.0 * rows[SOLVER_ITERATIONS].position_error


def test_the_document_holds_what_was_measured_and_where(report: speed.Report) -> None:
    content = json.loads(document(report))
    assert content["frames"][0]["cost"]["median"] == report.frames[0].cost.median
    assert content["gains"][0]["loop"]["two"] == report.gains[0].loop.two
    assert len(content["steps"]) == len(report.steps)
    assert content["machine"]["cpu_count"] >= 1
    assert {"numba", "numpy", "pybullet"} <= content["packages"].keys()
    assert table(report).count("\n## ") == 4


def test_the_table_shows_ratios_of_medians() -> None:
    lines = table(BY_HAND).splitlines()
    rows = {cells[0]: cells for line in lines if len(cells := [c.strip() for c in line.strip("|").split("|")]) > 2}
    frame, gain = ([c.strip() for c in line.strip("|").split("|")] for line in lines if line.startswith("| raster"))
    assert frame[3:] == ["2.000", "1.000", "1.000", "0.500", "500", "15.0 x", "20.0 x"]
    assert gain[2:] == ["500.0", "800.0", "1.60 x", "2.00 x", "80 %", "90 %"]
    assert rows["corridor"][-4:] == ["0.500", "2,000", "2.50 x", "5.00 x"]
    assert rows[f"{SOLVER_ITERATIONS} (default)"][1:4] == ["1.00", "2.00", "3.00"]
    assert rows["50"][-1] == "1.50 x"
    assert "- opengl: not available: renderer 'opengl' needs a driver; install one" in lines


def test_a_renderer_that_cannot_draw_here_is_said_to_be_missing(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(frames, "RENDERERS", ("tiny", "etching"))
    costs, unavailable = frames.measure_frames(*SIZE, 1)
    assert [c.renderer for c in costs] == ["tiny"]
    assert list(unavailable) == ["etching"]
    assert "renderer 'etching' is not known" in unavailable["etching"]


@pytest.mark.parametrize("person", ["skinned", "rigid"])
def test_raster_and_tiny_draw_the_same_walk(person: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """The person covers the same pixels; skinned, TinyRenderer keeps the first posture, so that only it is compared."""
    seen: dict[str, list[np.ndarray]] = {}
    for name in ("raster", "tiny"):
        renderer = frames.make(name, 80, 60)
        pictures: list[np.ndarray] = []
        seen[name] = pictures
        render = renderer.render
        monkeypatch.setattr(renderer, "render", lambda *a, r=render, p=pictures: p.append(r(*a).ids == 1))
        draw = frames.drawing(renderer, person)
        for _ in range(1 if person == "skinned" else 4):
            draw()
        renderer.close()
    for ours, theirs in zip(seen["raster"], seen["tiny"], strict=True):
        assert ours.sum() > 200
        assert (ours & theirs).sum() / (ours | theirs).sum() > 0.9
    changed = [int((a ^ b).sum()) for a, b in itertools.pairwise(seen["raster"])]
    assert all(changed), "the person stands still, so frames could be kept from one call to the next"


def test_the_loop_computes() -> None:
    state = 88172645463325252
    for _ in range(1000):
        state ^= (state << 13) % 2**64
        state ^= state >> 7
        state ^= (state << 17) % 2**64
    assert int(pair._loop(1000)) == state


def test_costs_are_median_fastest_and_mean_of_single_calls(monkeypatch: pytest.MonkeyPatch) -> None:
    """On clocks of its own: each call takes what is next in its list, and the first of a block is not counted."""
    now = {"wall": 0.0, "cpu": 0.0}
    monkeypatch.setattr(timing.time, "perf_counter", lambda: now["wall"])
    monkeypatch.setattr(timing.time, "process_time", lambda: now["cpu"])
    slow = iter([100.0] * 4 + [4.0, 1.0, 7.0])

    def fast() -> None:
        now["wall"] += 1.0
        now["cpu"] += 0.25

    def uneven() -> None:
        now["wall"] += (taken := next(slow))
        now["cpu"] += 0.5 * taken

    costs = timing.measure({"fast": fast, "uneven": uneven}, 3)
    assert costs["fast"] == Cost(1.0, 1.0, 1.0, 0.25, 0.25)
    assert costs["uneven"] == Cost(4.0, 1.0, 4.0, 2.0, 0.5)


@pytest.mark.parametrize(("words", "effort"), [([], speed.FULL), (["--quick"], speed.QUICK)])
def test_the_command_prints_the_table_and_writes_it_beside_the_figures(
    words: list[str],
    effort: speed.Effort,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    asked = []
    monkeypatch.setattr(speed, "speed", lambda effort, tell: asked.append(effort) or BY_HAND)
    assert cli.main(["speed", *words, "--out", str(tmp_path / "new")]) == 0
    assert asked == [effort]
    assert capsys.readouterr().out == table(BY_HAND) + "\n"
    assert (tmp_path / "new" / "speed.md").read_text(encoding="utf-8") == table(BY_HAND) + "\n"
    written = json.loads((tmp_path / "new" / "speed.json").read_text(encoding="utf-8"))
    assert written["frames"][0]["peer_cost"]["median"] == 0.03


def test_a_folder_that_cannot_be_made_is_bad_input(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    taken = tmp_path / "taken"
    taken.write_text("a file", encoding="utf-8")
    assert cli.main(["speed", "--out", str(taken)]) == 2
    assert capsys.readouterr().err == f"follow: {taken} cannot be made (File exists); name another --out\n"
