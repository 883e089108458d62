"""The README keeps its word: its Python runs as printed, its tables are those of the committed run."""

import re
import subprocess
import sys
from pathlib import Path

import pytest

from baselines.cli.main import _parser
from baselines.followers import calibration
from baselines.papers.dong2018 import calibration_report

ROOT = Path(__file__).parents[1]
README = (ROOT / "README.md").read_text(encoding="utf-8")


def test_the_python_runs_as_printed():
    (code,) = re.findall(r"```python\n(.*?)```", README, re.S)

    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=120)

    assert done.returncode == 0, done.stderr
    assert re.search(r"^14\.0 s, distance [12]\.\d\d m, success: True$", done.stdout, re.M)


def test_its_make_targets_exist():
    makefile = (ROOT / "Makefile").read_text(encoding="utf-8")

    targets = set(re.findall(r"\bmake (\w+)", README))

    assert {"reproduce", "test"} <= targets
    for target in targets:
        assert re.search(rf"^{target}:", makefile, re.M), target


@pytest.mark.parametrize("words", re.findall(r"`follow (.+?)`", README))
def test_its_follow_commands_parse(words):
    _parser().parse_args(words.split())


@pytest.mark.parametrize(
    ("report", "title"),
    [
        ("table1/table1.md", "## Perception `emulated`"),
        ("table1/table1.md", "## Perception `mask`"),
        ("followers/followers.md", ""),
    ],
)
def test_the_rows_of_its_tables_are_those_of_the_committed_run(report, title):
    text = (ROOT / "results" / report).read_text(encoding="utf-8")
    table = re.search(r"(^\|.*?)\n\n", text.split(title)[1] if title else text, re.S | re.M)
    assert table is not None
    head, rule, *rows = table.group(1).splitlines()
    shown = re.findall(rf"{re.escape(head)}\n{re.escape(rule)}\n((?:\|.*\n)+)", README)
    assert shown
    assert any(set(part.splitlines()) < set(rows) and len(part.splitlines()) == 4 for part in shown)


def test_it_is_short():
    assert len(README.splitlines()) <= 260


@pytest.mark.parametrize("target", re.findall(r"\]\((?!http)([^)#]+)\)", README))
def test_its_links_lead_somewhere(target):
    assert (ROOT / target).exists()


def test_the_calibration_page_shows_the_shipped_calibration():
    page = (ROOT / "docs" / "calibration.md").read_text(encoding="utf-8")

    assert calibration_report.summary(calibration.settings()) in page
