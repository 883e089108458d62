"""The set-up: exact pins, and a Makefile that says what is missing."""

import importlib.metadata
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from packaging.requirements import Requirement
from packaging.specifiers import SpecifierSet
from packaging.utils import canonicalize_name
from packaging.version import Version

if sys.version_info >= (3, 11):
    import tomllib
else:
    import tomli as tomllib

ROOT = Path(__file__).resolve().parent.parent
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]


def pins() -> dict[str, str]:
    """The version text of each line of constraints.txt by canonical name; a line that is no exact pin fails."""
    lines = (line.split("#")[0].strip() for line in (ROOT / "constraints.txt").read_text(encoding="utf-8").splitlines())
    pinned: dict[str, str] = {}
    for requirement in (Requirement(line) for line in lines if line):
        (specifier,) = requirement.specifier
        assert specifier.operator == "==", requirement
        assert "*" not in specifier.version, requirement
        name = canonicalize_name(requirement.name)
        assert name not in pinned, f"{name} is pinned twice"
        pinned[name] = specifier.version
    return pinned


def requirements_of_the_project() -> set[str]:
    """Canonical names of all distributions that the project with all its extras needs here, the indirect ones too."""
    extras = PROJECT["optional-dependencies"]
    waiting = [Requirement(text) for texts in (PROJECT["dependencies"], *extras.values()) for text in texts]
    seen: set[tuple[str, str]] = set()
    while waiting:
        requirement = waiting.pop()
        name = canonicalize_name(requirement.name)
        for extra in {"", *requirement.extras}:
            if name == PROJECT["name"] or (name, extra) in seen:
                continue
            seen.add((name, extra))
            for text in importlib.metadata.requires(name) or []:
                needed = Requirement(text)
                if needed.marker is None or needed.marker.evaluate({"extra": extra}):
                    waiting.append(needed)
    return {name for name, _ in seen}


def test_every_installed_requirement_is_pinned_to_what_is_installed() -> None:
    pinned = pins()
    needed = requirements_of_the_project()
    assert len(needed) > len(PROJECT["dependencies"])
    assert sorted(needed - pinned.keys()) == []
    # A local label, as in 2.13.0+cpu, names another build of the same version.
    installed = {name: Version(importlib.metadata.version(name)).public for name in needed}
    assert installed == {name: pinned[name] for name in needed}, "installed and pinned differ: run `make setup`"
    assert pinned["torch"] == "2.13.0"


def test_every_pin_installs_on_both_supported_pythons() -> None:
    for name in (PROJECT["name"], *requirements_of_the_project()):
        supported = SpecifierSet(importlib.metadata.metadata(name)["Requires-Python"] or "")
        assert [python for python in ("3.10", "3.11") if python not in supported] == [], name


def test_the_citation_names_the_version_of_the_project() -> None:
    citation = (ROOT / "CITATION.cff").read_text(encoding="utf-8")
    assert re.findall(r"^version: (.+)$", citation, re.MULTILINE) == [PROJECT["version"]]


@pytest.fixture
def checkout(tmp_path: Path) -> Path:
    """A folder with the files that the set-up reads, and no .venv."""
    for name in ("Makefile", "pyproject.toml", "constraints.txt"):
        shutil.copy(ROOT / name, tmp_path)
    return tmp_path


def make(checkout: Path, *arguments: str) -> subprocess.CompletedProcess[str]:
    """Run make as from a plain shell: without what a make above this test run hands down."""
    settings = ("MAKEFLAGS", "MAKELEVEL", "MFLAGS", "PYTHON", "JOBS", "OUT", "EPISODES")
    environment = {key: value for key, value in os.environ.items() if key not in settings} | {"LC_ALL": "C"}
    return subprocess.run(
        ["make", *arguments], cwd=checkout, env=environment, capture_output=True, text=True, check=False
    )


def fake_python(path: Path, body: str) -> Path:
    """Write a shell script that stands for a Python interpreter."""
    path.write_text(f"#!/bin/sh\n{body}\n", encoding="utf-8")
    path.chmod(0o755)
    return path


@pytest.mark.parametrize(("body", "found"), [("echo 3.9", "is Python 3.9"), ("exit 127", "does not run")])
def test_an_unfit_python_is_one_sentence_with_the_remedy(checkout: Path, body: str, found: str) -> None:
    python = fake_python(checkout / "python", body)
    run = make(checkout, "setup", f"PYTHON={python}")
    assert run.returncode != 0
    (sentence,) = [line for line in run.stderr.splitlines() if not line.startswith("make")]
    assert f"{python} {found}" in sentence
    assert "3.10 or 3.11" in sentence
    assert "make setup PYTHON=" in sentence
    assert run.stdout == ""
    assert not (checkout / ".venv").exists()


def test_the_first_fit_python_of_several_is_taken(checkout: Path) -> None:
    broken = fake_python(checkout / "broken", "exit 1")
    fit = fake_python(checkout / "fit", "echo 3.10")
    never = fake_python(checkout / "never", "touch asked; echo 3.11")
    run = make(checkout, "setup", f"PYTHON={broken} {fit} {never}")
    assert "Python 3.10" in run.stdout
    assert not (checkout / "asked").exists()


def test_an_interrupted_setup_starts_again_from_nothing(checkout: Path) -> None:
    inner = 'case "$*" in *pip*) exit {} ;; esac'
    python = checkout / "python"
    outer = 'if [ "$1" = -c ]; then echo 3.11; else mkdir -p .venv/bin && cp inner .venv/bin/python; fi'
    fake_python(python, outer)

    fake_python(checkout / "inner", inner.format(1))
    assert make(checkout, "setup", f"PYTHON={python}").returncode != 0
    leftover = checkout / ".venv" / "leftover"
    leftover.touch()

    fake_python(checkout / "inner", inner.format(0))
    assert make(checkout, "setup", f"PYTHON={python}").returncode == 0
    assert not leftover.exists()
    assert make(checkout, "--question", "setup").returncode == 0

    (checkout / ".venv" / "bin" / "python").unlink()
    assert make(checkout, "--question", "setup").returncode != 0


def test_a_short_reproduction_never_shares_a_folder_with_the_full_one(checkout: Path) -> None:
    full, short = (
        make(checkout, "--dry-run", "reproduce", "JOBS=3", *settings).stdout.splitlines()[-1].split()
        for settings in ([], ["EPISODES=2"])
    )
    command = [".venv/bin/follow", "reproduce", "table1", "--resume", "--jobs", "3", "--out"]
    assert full == [*command, "results/reproduced"]
    assert short == [*command, "results/reproduced-2", "--episodes", "2"]
