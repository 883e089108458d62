"""`follow detector`: quick help, a short run to weights that can be evaluated, and one sentence for bad input."""

import subprocess
import sys
from pathlib import Path

import pytest

from baselines.cli import main as cli

ROOT = Path(__file__).resolve().parents[3]


@pytest.mark.parametrize("action", ["train", "evaluate", "preview"])
def test_help_imports_nothing_heavy(action: str) -> None:
    script = (
        "import sys\nfrom baselines.cli import main as cli\n"
        f"try:\n    cli.main(['detector', {action!r}, '--help'])\nexcept SystemExit as end:\n    assert end.code == 0\n"
        "print(*({'numpy', 'cv2', 'torch', 'safetensors', 'matplotlib', 'numba'} & set(sys.modules)))"
    )
    run = subprocess.run([sys.executable, "-c", script], cwd=ROOT, capture_output=True, text=True, check=True)
    assert f"usage: follow detector {action}" in run.stdout
    assert run.stdout.splitlines()[-1] == ""


def test_the_nets_it_offers_are_those_there_are(capsys: pytest.CaptureFixture[str]) -> None:
    from tracker.detection.networks import NETS

    with pytest.raises(SystemExit):
        cli.main(["detector", "train", "--help"])
    assert "{" + ",".join(NETS) + "}" in capsys.readouterr().out


def test_train_and_evaluate(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    run = tmp_path / "run"
    words = ["detector", "train", "--steps", "1", "--jobs", "1", "--out", str(run)]
    assert cli.main(words) == 0
    assert "step 1/1: loss" in capsys.readouterr().out
    assert cli.main(words) == cli.BAD_INPUT
    assert "go on with it by --resume" in capsys.readouterr().err
    weights = str(run / "weights.safetensors")
    assert cli.main(["detector", "evaluate", "--weights", weights, "--pictures", "2", "--frames", "2"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert [line[:22].strip() for line in lines if line] == [
        "held-out pictures", "level camera", "as in training", "Table 2 of paper A",
        *(f"{suit}, view {view}" for suit in ("green", "blue", "indigo") for view in (1, 2)),
    ]  # fmt: skip
    assert all(len(line.split()[-6:]) == 6 for line in lines if line)


@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        (["evaluate", "--weights", "nowhere.safetensors"], "'nowhere.safetensors' do not exist"),
        (["evaluate", "--net", "paper"], "no weights are shipped for the net 'paper'"),
        (["train", "--seed", "1000000", "--out", "nowhere"], "the others are for testing"),
    ],
)
def test_bad_input_is_one_sentence(words: list[str], sentence: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert cli.main(["detector", *words]) == cli.BAD_INPUT
    error = capsys.readouterr().err
    assert sentence in error
    assert error.count("\n") == 1


def test_preview(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert cli.main(["detector", "preview", "--out", str(tmp_path / "sheet.png")]) == 0
    assert (tmp_path / "sheet.png").stat().st_size > 100_000
