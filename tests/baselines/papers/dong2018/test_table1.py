"""A whole reproduction: the same files however it is run or killed, and a table that says what the episodes say."""

import csv
import hashlib
import importlib
import json
import os
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest

from baselines.benchmark import provenance
from baselines.benchmark.cells import Cell
from baselines.benchmark.files import write_text
from baselines.benchmark.provenance import Plan, digest, settings
from baselines.benchmark.run import Interrupted
from baselines.benchmark.store import FILE_NAME, InputError, Store
from baselines.papers.dong2018 import reproduce as reproduction
from baselines.papers.dong2018.reproduce import reproduce
from baselines.papers.dong2018.table1 import COLUMNS, PAPER_RMSE, paper_ratio

ROOT = Path(__file__).resolve().parents[4]
HERE = Path(__file__).parents[2]
REPRODUCIBLE = {
    *("episodes.csv", "table1.csv", "table1.md", "curves.csv"),
    *("sensitivity.csv", "sensitivity_episodes.csv", "family.csv", "family_episodes.csv"),
}


@pytest.fixture(scope="module")
def synthetic() -> Iterator[ModuleType]:
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(HERE)
        yield importlib.import_module("synthetic")


def run(synthetic: ModuleType, out: Path, episodes: int = 4, resume: bool = False, jobs: int = 1, **changes) -> str:
    plan = changes.get("plan") or Plan.of(["emulated"], episodes, list(synthetic.SENSORS))
    calibration = changes.get("calibration", synthetic.CALIBRATION)
    return reproduce(plan, calibration, changes.get("episode", synthetic.episode), out, jobs, resume)


@pytest.fixture(scope="module")
def finished(synthetic: ModuleType, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """An uninterrupted run of 4 episodes in one process."""
    out = tmp_path_factory.mktemp("table1") / "finished"
    run(synthetic, out)
    return out


def files(folder: Path) -> dict[str, bytes]:
    return {path.name: path.read_bytes() for path in folder.iterdir() if path.name in REPRODUCIBLE}


def records(path: Path) -> list[dict[str, str]]:
    with path.open(encoding="utf-8", newline="") as file:
        return list(csv.DictReader(file))


def everything(folder: Path) -> dict[str, str]:
    return {
        str(path.relative_to(folder)): hashlib.sha256(path.read_bytes()).hexdigest()
        for path in folder.rglob("*")
        if path.is_file()
    }


def test_a_run_writes_all_it_promises(finished: Path) -> None:
    names = {path.name for path in finished.iterdir()}
    assert names == REPRODUCIBLE | {"config.json", "timing.csv", "timing.md", "figures", FILE_NAME}
    pictures = {path.name for path in (finished / "figures").iterdir()}
    assert pictures == {
        "figure6_corridor_angle_emulated.png",
        "figure7_corridor_distance_emulated.png",
        "figure8_indoor_angle_emulated.png",
        "figure9_indoor_distance_emulated.png",
        "sensitivity.png",
        "family.png",
    }
    text = (finished / "table1.md").read_text(encoding="utf-8")
    assert {name for name in pictures if f"(figures/{name})" in text} == pictures


def test_two_processes_write_the_same_bytes_as_one(synthetic: ModuleType, finished: Path, tmp_path: Path) -> None:
    run(synthetic, tmp_path / "two", jobs=2)
    assert files(tmp_path / "two") == files(finished)


def test_a_run_killed_again_and_again_ends_with_the_same_bytes(finished: Path, tmp_path: Path) -> None:
    """Killed while it plays, with one and two processes, and twice while it writes the results."""
    out = tmp_path / "killed"
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join([str(ROOT), str(HERE)])}
    kept = []
    for jobs, line, delay in ((1, 3, 0.03), (2, 3, 0.05), (1, 2, 0.01), (2, 99, 0.15), (1, 0, 0.6), (2, 99, None)):
        command = [sys.executable, "-m", "synthetic", str(out), "4", str(jobs), "0.0", *(["resume"] if kept else [])]
        with subprocess.Popen(command, env=environment, stderr=subprocess.PIPE, text=True) as process:
            assert process.stderr is not None
            for number, text in enumerate(process.stderr):
                done, _, tasks, _ = text.split()
                if number == line or done == tasks:
                    break
            if delay is not None:
                time.sleep(delay)
                process.send_signal(signal.SIGKILL)
        with Store(out, json.loads((out / "config.json").read_text(encoding="utf-8"))["run_sha256"]) as store:
            kept.append(len(store))
    assert process.returncode == 0
    assert 0 < kept[0] < kept[1] < kept[2] < kept[3] == kept[4] == kept[5] == int(tasks)
    assert files(out) == files(finished)


def test_resuming_takes_exactly_the_seeds_that_are_asked_for(
    synthetic: ModuleType, finished: Path, tmp_path: Path
) -> None:
    out = tmp_path / "out"
    run(synthetic, out, episodes=6)
    assert len(records(out / "episodes.csv")) == 8 * 6
    run(synthetic, out, episodes=4, resume=True)
    assert files(out) == files(finished)
    played = []

    def counted(cell: Cell, seed: int):
        played.append((cell, seed))
        return synthetic.episode(cell, seed)

    run(synthetic, out, episodes=7, resume=True, episode=counted)
    assert {seed for _, seed in played} == {6}
    assert [int(row["seed"]) for row in records(out / "episodes.csv")] == [*range(7)] * 8


def test_resuming_a_finished_run_plays_nothing(synthetic: ModuleType, finished: Path, tmp_path: Path) -> None:
    out = tmp_path / "copy"
    shutil.copytree(finished, out)
    run(synthetic, out, resume=True, episode=None)
    assert files(out) == files(finished)


def test_without_resume_what_is_there_is_kept(synthetic: ModuleType, finished: Path) -> None:
    before = everything(finished)
    with pytest.raises(InputError, match=r"already holds \d+ episodes .*--resume.*--out\.$"):
        run(synthetic, finished)
    assert everything(finished) == before


@pytest.mark.parametrize("resume", [False, True])
def test_another_configuration_is_refused_and_nothing_is_lost(
    synthetic: ModuleType, finished: Path, resume: bool
) -> None:
    before = everything(finished)
    with pytest.raises(InputError, match=r"episodes of another configuration .*--out\.$"):
        run(synthetic, finished, resume=resume, calibration={"sensor": "another"})
    assert everything(finished) == before


@pytest.mark.parametrize("resume", [False, True])
@pytest.mark.parametrize("store", ["missing", "empty", "damaged"])
def test_results_whose_store_is_gone_are_not_overwritten(
    synthetic: ModuleType, finished: Path, tmp_path: Path, store: str, resume: bool
) -> None:
    out = tmp_path / "out"
    shutil.copytree(finished, out)
    if store == "missing":
        (out / FILE_NAME).unlink()
    else:
        (out / FILE_NAME).write_bytes(b"" if store == "empty" else b"no database" * 1000)
    before = everything(out)
    with pytest.raises(InputError, match=r"--out\.$"):
        run(synthetic, out, resume=resume)
    assert everything(out) == before


def test_a_file_in_the_folders_place_is_refused(synthetic: ModuleType, tmp_path: Path) -> None:
    (tmp_path / "taken").write_text("mine", encoding="utf-8")
    for out in (tmp_path / "taken", tmp_path / "taken" / "below"):
        with pytest.raises(InputError, match=r"cannot be written .*--out\.$"):
            run(synthetic, out)
    assert (tmp_path / "taken").read_text(encoding="utf-8") == "mine"


@pytest.fixture
def read_only() -> Iterator[Path]:
    """A folder that this process may read but not write, without the rights of root if it has them."""
    root = os.geteuid() == 0
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        folder.chmod(0o555)
        if root:
            os.seteuid(65534)
        try:
            yield folder
        finally:
            if root:
                os.seteuid(0)
            folder.chmod(0o755)


@pytest.mark.parametrize("name", ["", "below"])
def test_a_read_only_folder_is_refused_before_any_work(synthetic: ModuleType, read_only: Path, name: str) -> None:
    with pytest.raises(InputError, match=r"cannot be (used|written) \(.*\): make .*--out\.$"):
        run(synthetic, read_only / name, episode=None)
    assert list(read_only.iterdir()) == []


def test_an_interrupted_run_says_what_it_kept(synthetic: ModuleType, finished: Path, tmp_path: Path) -> None:
    out = tmp_path / "out"
    calls = iter(range(10**6))

    def interrupted(cell: Cell, seed: int):
        if next(calls) == 5:
            raise KeyboardInterrupt
        return synthetic.episode(cell, seed)

    with pytest.raises(
        Interrupted, match=r"5 of \d+ episodes are kept in .*out; the same command with --resume goes on"
    ):
        run(synthetic, out, episode=interrupted)
    run(synthetic, out, resume=True)
    assert files(out) == files(finished)


def test_a_file_is_the_old_one_until_the_new_one_is_whole(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "table.csv"
    write_text(path, "old")
    write = Path.write_bytes

    def half(self: Path, content: bytes) -> None:
        write(self, content[: len(content) // 2])
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(Path, "write_bytes", half)
    with pytest.raises(OSError, match="No space"):
        write_text(path, "new content")
    assert path.read_text(encoding="utf-8") == "old"
    assert list(tmp_path.iterdir()) == [path]


def test_a_full_disk_is_one_sentence(synthetic: ModuleType, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def full(*_: object) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(reproduction, "write_csv", full)
    with pytest.raises(InputError, match=r"cannot be written \(No space left on device\)"):
        run(synthetic, tmp_path / "out")


def test_config_names_what_made_the_results(synthetic: ModuleType, finished: Path) -> None:
    config = json.loads((finished / "config.json").read_text(encoding="utf-8"))
    canonical = json.dumps(config["settings"], sort_keys=True, separators=(",", ":"))
    assert config["settings_sha256"] == hashlib.sha256(canonical.encode()).hexdigest()
    assert config["settings"]["calibration"] == synthetic.CALIBRATION
    assert len(config["cells"]["table1"]) == 8
    assert config["seeds"] == {
        "table1": {"emulated": [0, 1, 2, 3]},
        "studies": {"sensitivity": [0, 1], "family": [0, 1]},
    }
    assert config["packages"]["numpy"] == np.__version__
    assert {"platform", "python", "cpu"} <= config["machine"].keys()
    assert str(finished.parent) not in json.dumps(config)


def test_the_hash_covers_what_changes_results_and_nothing_else() -> None:
    base = settings({"r": 1.0})
    assert digest(settings({"r": 1.0})) == digest(base)
    assert digest(settings({"r": 1.1})) != digest(base)
    for group, name in (("robot", "max_speed"), ("camera", "hfov_deg"), ("packages", "pybullet")):
        assert digest({**base, group: {**base[group], name: "changed"}}) != digest(base)


def test_another_version_of_the_code_is_another_run(monkeypatch: pytest.MonkeyPatch) -> None:
    base = settings({"r": 1.0})
    before = provenance.run_digest(base)
    assert before != digest(base)
    read_bytes = Path.read_bytes
    monkeypatch.setattr(Path, "read_bytes", lambda path: read_bytes(path) + b"#" * (path.name == "akf.py"))
    assert provenance.run_digest(base) != before


def test_raw_rows_read_back_as_the_very_floats(synthetic: ModuleType, finished: Path) -> None:
    rows = records(finished / "episodes.csv")
    expected = synthetic.episode(Cell("emulated", "indoor", "akf"), 2).row
    (row,) = [row for row in rows if (row["scene"], row["estimator"], row["seed"]) == ("indoor", "akf", "2")]
    for name, value in expected.items():
        assert row[name] == ("" if value is None else repr(value) if isinstance(value, float) else str(value))


def test_table_1_is_what_the_raw_rows_say(finished: Path) -> None:
    rows = records(finished / "episodes.csv")
    table = records(finished / "table1.csv")
    assert tuple(table[0]) == COLUMNS
    assert len(table) == 2 * 4 * 2
    by_cell = {(line["scene"], line["quantity"], line["estimator"]): line for line in table}
    for (scene, quantity, estimator), line in by_cell.items():
        unit, scale = {"angle": ("rad", 1.0), "distance": ("m", 100.0)}[quantity]
        chosen = [row for row in rows if (row["scene"], row["estimator"]) == (scene, estimator)]
        steps = np.array([float(row["estimate_steps"]) for row in chosen])
        rmse = scale * np.array([float(row[f"{quantity}_rmse_{unit}"]) for row in chosen])
        bias = scale * np.array([float(row[f"{quantity}_bias_{unit}"]) for row in chosen])
        assert float(line["rmse"]) == pytest.approx(np.sqrt(np.average(rmse**2, weights=steps)), rel=1e-5)
        assert float(line["bias"]) == pytest.approx(np.average(bias, weights=steps), rel=1e-5)
        assert float(line["rmse"]) ** 2 == pytest.approx(
            float(line["bias"]) ** 2 + float(line["spread"]) ** 2, rel=1e-4
        )
        assert float(line["ci_low"]) <= float(line["rmse"]) <= float(line["ci_high"])
        assert (line["unit"], line["episodes"]) == ({"angle": "rad", "distance": "cm"}[quantity], "4")
        for reference, ratio, difference in (("none", "ratio_to_none", "diff_to_none"), ("kf", None, "diff_to_kf")):
            other = float(by_cell[scene, quantity, reference]["rmse"])
            if estimator == "none" or estimator == reference:
                assert line[difference] == ""
                continue
            assert float(line[difference]) == pytest.approx(float(line["rmse"]) - other, abs=2e-5 * other)
            if ratio:
                assert float(line[ratio]) == pytest.approx(float(line["rmse"]) / other, rel=2e-5)


def test_the_papers_values_stand_beside(finished: Path) -> None:
    table = {(line["scene"], line["quantity"], line["estimator"]): line for line in records(finished / "table1.csv")}
    assert table["corridor", "distance", "none"]["paper_rmse"] == "15.3191"
    assert table["indoor", "angle", "akf"]["paper_rmse"] == "0.0112"
    assert all(table[scene, quantity, "akf_cv"]["paper_rmse"] == "" for scene, quantity, _ in PAPER_RMSE)
    ratios = [
        round(paper_ratio(scene, quantity, estimator) or 0.0, 2)
        for quantity in ("distance", "angle")
        for scene in ("corridor", "indoor")
        for estimator in ("kf", "akf")
    ]
    assert ratios == [0.83, 0.78, 0.59, 0.37, 0.62, 0.57, 0.68, 0.65]


def test_the_studies_hold_every_combination(finished: Path) -> None:
    sensitivity = records(finished / "sensitivity.csv")
    points = {
        (line["scene"], line["quantity"], line["estimator"], line["q_scale"], line["alpha"]) for line in sensitivity
    }
    assert len(points) == len(sensitivity) == 2 * 2 * (1 + 5 + 15)
    assert {line["alpha"] for line in sensitivity if line["estimator"] == "akf"} == {"0.01", "0.05", "0.1"}
    family = records(finished / "family.csv")
    assert len(family) == 3 * 2 * 2 * 3
    assert [*dict.fromkeys(line["sensor"] for line in family)] == ["fitted", "clean", "heavy_tails"]
    for line in (*sensitivity, *family):
        assert (line["ratio_to_none"] == "") == (line["estimator"] == "none")


def test_the_depth_rules_are_compared_on_rendered_frames(synthetic: ModuleType, tmp_path: Path) -> None:
    plan = Plan.of(["mask"], 4, [])
    text = run(synthetic, tmp_path / "mask", plan=plan)
    rules = records(tmp_path / "mask" / "rules.csv")
    assert [*dict.fromkeys(line["sensor"] for line in rules)] == ["six_smallest", "grid_mean", "centroid"]
    shares = {
        line["sensor"]: float(line["outlier_share"])
        for line in rules
        if (line["scene"], line["quantity"], line["estimator"]) == ("indoor", "distance", "none")
    }
    assert shares["grid_mean"] > 0.05 > shares["six_smallest"]
    assert text.count("| grid_mean") == 2 * 2 * 3
    assert (tmp_path / "mask" / "figures" / "rules.png").exists()


def test_one_episode_decides_nothing(synthetic: ModuleType, tmp_path: Path) -> None:
    text = run(synthetic, tmp_path / "out", episodes=1)
    assert "undecided" in text
    assert "| yes |" not in text.split("### Ratios")[0]
    (line,) = [
        line
        for line in records(tmp_path / "out" / "table1.csv")
        if (line["scene"], line["estimator"], line["quantity"]) == ("indoor", "kf", "angle")
    ]
    assert (line["episodes"], line["ci_low"], line["diff_none_low"]) == ("1", "", "")
    assert float(line["ratio_to_none"]) > 0.0


def test_perfect_measurements_have_no_ratio(synthetic: ModuleType, tmp_path: Path) -> None:
    text = run(synthetic, tmp_path / "out", plan=Plan.of(["truth"], 2, []))
    assert "No filter makes no error on perfect measurements" in text
    table = records(tmp_path / "out" / "table1.csv")
    assert {line["ratio_to_none"] for line in table} == {""}
    assert not (tmp_path / "out" / "sensitivity.csv").exists()


FEATURES = ("", "AVX512F AVX512_SKX AVX2 FMA3")
"""What NumPy may not use of the processor: nothing, and what changes the last bits of its functions."""


def test_real_results_do_not_depend_on_processes_or_on_the_cpus_features(tmp_path: Path) -> None:
    follow = [sys.executable, "-m", "baselines.cli.main"]
    command = [*follow, "reproduce", "table1", "--perception", "truth", "--episodes", "2"]
    for name, jobs, features in zip(("one", "two"), ("1", "2"), FEATURES, strict=True):
        environment = {**os.environ, "PYTHONPATH": str(ROOT), "NPY_DISABLE_CPU_FEATURES": features}
        subprocess.run(
            [*command, "--jobs", jobs, "--out", str(tmp_path / name)], env=environment, check=True, capture_output=True
        )
    assert files(tmp_path / "one") == files(tmp_path / "two")
    assert len(files(tmp_path / "one")) == 4


@pytest.mark.parametrize("perception", ["emulated", "mask"])
def test_real_episodes_do_not_depend_on_the_cpus_features(perception: str) -> None:
    script = (
        "from baselines.benchmark.cells import Cell\n"
        "from baselines.benchmark.player import Player\n"
        f"episode = Player()(Cell({perception!r}, 'indoor', 'akf'), 0)\n"
        "print(episode.row, episode.curve.tobytes().hex())\n"
    )
    outputs = []
    for features in FEATURES:
        environment = {**os.environ, "PYTHONPATH": str(ROOT), "NPY_DISABLE_CPU_FEATURES": features}
        played = subprocess.run([sys.executable, "-c", script], env=environment, check=True, capture_output=True)
        outputs.append(played.stdout)
    assert b"distance_rmse_m" in outputs[0]
    assert outputs[0] == outputs[1]
