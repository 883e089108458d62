"""`follow` as a user meets it: quick help, one sentence and exit code 2 for bad input, and a clean end on Ctrl-C."""

import contextlib
import fcntl
import os
import pty
import signal
import sqlite3
import struct
import subprocess
import sys
import termios
from pathlib import Path

import pytest

import follow_env
from baselines.benchmark.cells import Cell
from baselines.benchmark.store import FILE_NAME
from baselines.cli import main as cli

ROOT = Path(__file__).resolve().parents[3]
FOLLOW = [sys.executable, "-m", "baselines.cli.main"]
TABLE1 = ["reproduce", "table1", "--perception", "truth", "--episodes", "1", "--jobs", "1"]


def follow(*arguments: str, cwd: Path) -> subprocess.CompletedProcess[str]:
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    return subprocess.run([*FOLLOW, *arguments], cwd=cwd, env=environment, capture_output=True, text=True, check=False)


@pytest.mark.parametrize(
    "arguments",
    [
        ["--help"],
        ["reproduce", "table1", "--help"],
        ["reproduce", "astronaut", "--help"],
        ["watch", "--help"],
        ["speed", "--help"],
        ["track", "--help"],
        ["train", "--help"],
    ],
)
def test_help_imports_nothing_heavy(arguments: list[str], tmp_path: Path) -> None:
    script = (
        "import sys\nfrom baselines.cli import main as cli\n"
        f"try:\n    cli.main({arguments!r})\nexcept SystemExit as end:\n    assert end.code == 0\n"
        "print(*({'numpy', 'pybullet', 'matplotlib', 'gymnasium', 'cv2', 'scipy', 'torch', 'tqdm'} & set(sys.modules)))"
    )
    run = subprocess.run([sys.executable, "-c", script], cwd=ROOT, capture_output=True, text=True, check=True)
    assert "usage: follow" in run.stdout
    assert run.stdout.splitlines()[-1] == ""


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        ([], "the following arguments are required: COMMAND"),
        (["fly"], "invalid choice: 'fly'"),
        (["reproduce"], "the following arguments are required: TABLE"),
        (["reproduce", "table2"], "invalid choice: 'table2' (choose from 'table1', 'astronaut')"),
        ([*TABLE1, "--episodes", "-3"], "--episodes: '-3' is not a whole number of at least 1"),
        ([*TABLE1, "--episodes", "0"], "--episodes: '0' is not a whole number of at least 1"),
        ([*TABLE1, "--episodes", "2.5"], "--episodes: '2.5' is not a whole number of at least 1"),
        ([*TABLE1, "--jobs", "0"], "--jobs: '0' is not a whole number of at least 1"),
        (
            [*TABLE1, "--perception", "maks"],
            "--perception: invalid choice: 'maks' (choose from 'truth', 'emulated', 'mask', 'detector')",
        ),
        ([*TABLE1, "--quick"], "unrecognized arguments: --quick"),
        (["watch", "--scene", "garden"], "--scene: invalid choice: 'garden'"),
        (["watch", "--seed", "-1"], "--seed: '-1' is not a whole number of at least 0"),
        (["watch", "--size", "1280"], "--size: '1280' is no size; expected WIDTHxHEIGHT"),
        (["watch", "--video", "nowhere/film.mp4"], "--video: 'nowhere/film.mp4' cannot be written"),
        (["calibrate", "--out", "."], "--out: '.' cannot be written"),
    ],
)
def test_bad_input_is_one_sentence_and_exit_code_2(
    arguments: list[str], sentence: str, capsys: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(SystemExit) as ended:
        cli.main(arguments)
    assert ended.value.code == 2
    error = capsys.readouterr().err
    assert sentence in error
    assert error.startswith("follow")
    assert error.count("\n") == 1


@pytest.fixture
def finished(tmp_path: Path) -> Path:
    run = follow(*TABLE1, "--out", "results", cwd=tmp_path)
    assert run.returncode == 0, run.stderr
    return tmp_path / "results"


def complaint(run: subprocess.CompletedProcess[str]) -> str:
    """The one sentence of a run that ended with exit code 2."""
    assert run.returncode == 2
    assert run.stdout == ""
    (sentence,) = [line for line in run.stderr.splitlines() if line.startswith("follow")]
    assert "Traceback" not in run.stderr
    return sentence


def test_the_version_is_one_line(tmp_path: Path) -> None:
    done = follow("--version", cwd=tmp_path)
    assert (done.returncode, done.stderr) == (0, "")
    assert done.stdout == f"follow-env {follow_env.__version__}\n"


def test_a_run_prints_its_tables_and_where_they_are(tmp_path: Path) -> None:
    run = follow(*TABLE1, cwd=tmp_path)
    assert run.returncode == 0
    assert run.stdout.startswith("# Table 1, reproduced")
    assert run.stdout.endswith("Tables, raw episodes and figures are in results/reproduced-1.\n")
    assert "8 of 8 episodes" in run.stderr
    assert (tmp_path / "results" / "reproduced-1" / "table1.csv").exists()


def test_a_folder_that_is_taken_is_kept(finished: Path) -> None:
    before = {path: path.read_bytes() for path in finished.iterdir() if path.is_file()}
    again = complaint(follow(*TABLE1, "--out", "results", cwd=finished.parent))
    assert "results already holds 8 episodes of this configuration: go on with --resume" in again
    with contextlib.closing(sqlite3.connect(finished / FILE_NAME)) as store, store:
        (ours,) = store.execute("SELECT sha256 FROM configuration").fetchone()
        store.execute("UPDATE configuration SET sha256 = ?", ("0" * 64,))
    other = complaint(follow(*TABLE1, "--out", "results", "--resume", cwd=finished.parent))
    assert "holds 8 episodes of another configuration or version of the code (000000000000" in other
    with contextlib.closing(sqlite3.connect(finished / FILE_NAME)) as store, store:
        store.execute("UPDATE configuration SET sha256 = ?", (ours,))
    before[finished / FILE_NAME] = (finished / FILE_NAME).read_bytes()
    (finished / FILE_NAME).write_bytes(before[finished / FILE_NAME][:5000])
    damaged = complaint(follow(*TABLE1, "--out", "results", "--resume", cwd=finished.parent))
    assert "results/episodes.sqlite is damaged" in damaged
    assert (finished / FILE_NAME).stat().st_size == 5000
    assert all(path.read_bytes() == content for path, content in before.items() if path.name != FILE_NAME)


def test_ctrl_c_keeps_what_was_finished_and_says_how_to_go_on(tmp_path: Path) -> None:
    """On a terminal Ctrl-C reaches the workers too: no traceback of theirs may show."""
    command = ["reproduce", "table1", "--perception", "truth", "--episodes", "40", "--out", "out"]
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    with subprocess.Popen(
        [*FOLLOW, *command, "--jobs", "2"],
        cwd=tmp_path,
        env=environment,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
    ) as run:
        assert run.stderr is not None
        for line in run.stderr:
            if line.startswith("32 of 320"):
                break
        os.killpg(run.pid, signal.SIGINT)
        rest = run.stderr.read()
    assert run.returncode == 130
    assert "Traceback" not in rest
    last = rest.splitlines()[-1]
    assert last.endswith("of 320 episodes are kept in out; the same command with --resume goes on.")
    kept = int(last.split()[1])
    assert 32 <= kept < 320
    resumed = follow(*TABLE1, "--out", "out", "--resume", cwd=tmp_path)
    assert resumed.returncode == 0
    assert len((tmp_path / "out" / "episodes.csv").read_text(encoding="utf-8").splitlines()) == 1 + 8


def test_a_terminal_shows_a_bar(tmp_path: Path) -> None:
    ours, theirs = pty.openpty()
    fcntl.ioctl(theirs, termios.TIOCSWINSZ, struct.pack("HHHH", 24, 100, 0, 0))
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    with subprocess.Popen(
        [*FOLLOW, *TABLE1], cwd=tmp_path, env=environment, stdout=subprocess.DEVNULL, stderr=theirs
    ) as run:
        os.close(theirs)
        shown = b""
        while True:
            try:
                chunk = os.read(ours, 4096)
            except OSError:
                break
            shown += chunk
    os.close(ours)
    assert run.returncode == 0
    assert b"8/8" in shown
    assert b"of 8 episodes" not in shown


def test_watch_and_calibrate_get_what_was_asked_for(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    from baselines.followers import calibration
    from baselines.papers.dong2018 import calibrate
    from baselines.viewing import watch

    asked: list[object] = []
    monkeypatch.setattr(watch, "watch", lambda *given, **also: asked.append((*given, also)) or "a summary")
    monkeypatch.setattr(calibrate, "main", lambda *arguments: asked.append(arguments) or calibration.settings())
    video, constants = tmp_path / "film.mp4", tmp_path / "constants.json"
    words = ["--estimator", "kf", "--perception", "truth", "--scene", "indoor", "--seed", "3", "--video", str(video)]
    words += ["--renderer", "opengl", "--size", "1280x720", "--shadows"]
    assert cli.main(["watch", *words]) == 0
    assert capsys.readouterr().out == "a summary\n"
    assert cli.main(["calibrate", "--out", str(constants), "--jobs", "2"]) == 0
    view = {"renderer": "opengl", "size": (1280, 720), "shadows": True}
    assert asked == [(Cell("truth", "indoor", "kf"), 3, video, view), (constants, 2)]


def test_what_watch_refuses_is_bad_input(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    from baselines.viewing import watch

    def refuse(*_: object, **__: object) -> str:
        raise ValueError("the video cannot be written; name it .mp4")

    monkeypatch.setattr(watch, "watch", refuse)
    assert cli.main(["watch"]) == 2
    assert capsys.readouterr().err == "follow: the video cannot be written; name it .mp4\n"
