"""``config.json``: what a results folder was made with, and the hash of everything in it that changes results."""

from __future__ import annotations

import dataclasses
import hashlib
import importlib.metadata
import json
import os
import platform
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from datetime import datetime, timezone
from pathlib import Path
from typing import Any

from baselines.benchmark.cells import ENVIRONMENT_IDS, Cell, family_cells, rule_cells, sensitivity_cells, table1_cells
from baselines.benchmark.executors.processes import Keyed
from baselines.benchmark.metrics import episode as metrics
from follow_env.config import CameraConfig, RobotConfig
from follow_env.sensors import SensorConfig

EPISODES = {"truth": 100, "emulated": 100, "mask": 20, "detector": 20}
"""Episodes per cell of Table 1 unless told otherwise, by perception: a rendered episode costs far more."""

_STUDY_PART = {"sensitivity": 10, "family": 10, "rules": 2}
"""A study plays this part of the table's episodes, two at least."""
_COMPUTING = ("gymnasium", "numba", "numpy", "opencv-python-headless", "pybullet", "torch")
_PLAYING = ("follow_env", "tracker", "baselines/controllers", "baselines/followers")
_PACKAGES = ("follow-env", "gymnasium", "matplotlib", "numpy", "opencv-python-headless", "pybullet", "tqdm")


@dataclass(frozen=True)
class Plan:
    """Cells and seeds of a reproduction.

    Attributes:
        table: Cells of Table 1.
        episodes: Episodes per cell of the table, by perception.
        sensitivity: Cells of the sensitivity study; empty without the emulated perception.
        family: Cells of the family of sensors; empty without the emulated perception.
        rules: Cells of the comparison of depth rules; empty without the mask perception.
    """

    table: tuple[Cell, ...]
    episodes: Mapping[str, int]
    sensitivity: tuple[Cell, ...]
    family: tuple[Cell, ...]
    rules: tuple[Cell, ...]

    @classmethod
    def of(cls, perceptions: list[str], episodes: int | None, sensors: list[str]) -> Plan:
        """The plan of the paper's table at the given perceptions.

        Args:
            perceptions: Names, in any order.
            episodes: Episodes per cell; None takes EPISODES.
            sensors: Names of the family of emulated sensors.
        """
        table = tuple(table1_cells(perceptions))
        counts = {cell.perception: EPISODES[cell.perception] if episodes is None else episodes for cell in table}
        return cls(
            table=table,
            episodes=counts,
            sensitivity=tuple(sensitivity_cells()) if "emulated" in counts else (),
            family=tuple(family_cells(sensors)) if "emulated" in counts else (),
            rules=tuple(rule_cells()) if "mask" in counts else (),
        )

    def table_seeds(self, cell: Cell) -> range:
        """Seeds of a cell of the table; calibration uses others."""
        return range(self.episodes[cell.perception])

    def study_seeds(self, study: str) -> range:
        """Seeds of the cells of a study: the table's first, so that what both need is played once."""
        count = self.episodes["mask" if study == "rules" else "emulated"]
        return range(max(2, count // _STUDY_PART[study]))

    @property
    def studies(self) -> dict[str, tuple[Cell, ...]]:
        """The studies that are made, by name."""
        studies = {"sensitivity": self.sensitivity, "family": self.family, "rules": self.rules}
        return {name: cells for name, cells in studies.items() if cells}

    def tasks(self) -> list[tuple[Cell, int]]:
        """Every cell and seed that is needed, each once, cells that share an environment one after another."""
        wanted = [(cell, seed) for cell in self.table for seed in self.table_seeds(cell)]
        for study, cells in self.studies.items():
            wanted += [(cell, seed) for cell in cells for seed in self.study_seeds(study)]
        return list(dict.fromkeys(wanted))


def settings(calibration: Mapping[str, Any]) -> dict[str, Any]:
    """Everything but the code that changes an episode's result; JSON-able.

    Args:
        calibration: Content of the calibration: sensors, noise covariances and how they were found.
    """
    return {
        "benchmark": "table1",
        "environments": ENVIRONMENT_IDS,
        "robot": dataclasses.asdict(RobotConfig()),
        "camera": dataclasses.asdict(CameraConfig()),
        "sensor": dataclasses.asdict(SensorConfig()),
        "packages": {name: _version(name) for name in ("numpy", "opencv-python-headless", "pybullet")},
        "calibration": dict(calibration),
        "columns": list(metrics.COLUMNS),
    }


def digest(settings: Mapping[str, Any]) -> str:
    """SHA-256 of the settings in one canonical form, as hexadecimal text."""
    canonical = json.dumps(settings, sort_keys=True, separators=(",", ":"), allow_nan=False)
    return hashlib.sha256(canonical.encode()).hexdigest()


def run_digest(settings: Mapping[str, Any], *also: Path) -> str:
    """SHA-256 of the settings and of the code that plays and measures an episode: what runs must share to be mixed.

    Args:
        settings: JSON-able.
        also: More files of code, of this package.
    """
    return digest({**settings, "code": _code_digest(also)})


def trace_digest() -> str:
    """SHA-256 of the packages and the code that make a trace: what traces in one folder share. No metric is in it."""
    root = Path(__file__).parents[2]
    files = {path for folder in _PLAYING for path in (root / folder).rglob("*.py")}
    files |= {Path(__file__).with_name(name) for name in ("rollout.py", "trace.py", "trial.py")}
    return digest({"packages": {name: _version(name) for name in _COMPUTING}, "code": _files_digest(root, files)})


def _code_digest(also: Iterable[Path]) -> str:
    root = Path(__file__).parents[2]
    folders = (*_PLAYING, "baselines/benchmark/metrics")
    files = [path for folder in folders for path in (root / folder).rglob("*.py")]
    files += [Path(__file__).with_name(name) for name in ("build.py", "cells.py", "player.py", "rollout.py")]
    return _files_digest(root, {*files, *also})


def _files_digest(root: Path, files: Iterable[Path]) -> str:
    total = hashlib.sha256()
    for path in sorted(files):
        total.update(path.relative_to(root).as_posix().encode() + b"\0" + path.read_bytes())
    return total.hexdigest()


def document(plan: Plan, settings: Mapping[str, Any], folder: Path, jobs: int) -> str:
    """Text of ``config.json`` of a plan."""
    cells = {"table1": plan.table, **plan.studies}
    seeds = {
        "table1": {perception: list(range(count)) for perception, count in plan.episodes.items()},
        "studies": {study: list(plan.study_seeds(study)) for study in plan.studies},
    }
    return text(settings, run_digest(settings), cells, seeds, folder, jobs)


def text(
    settings: Mapping[str, Any],
    run: str,
    cells: Mapping[str, Iterable[Keyed]],
    seeds: Mapping[str, Any],
    folder: Path,
    jobs: int,
) -> str:
    """Text of ``config.json``: the settings and their hash, and beside them, unhashed, how this run was made."""
    content = {
        "settings": settings,
        "settings_sha256": digest(settings),
        "run_sha256": run,
        "cells": {name: [cell.key for cell in group] for name, group in cells.items()},
        "seeds": seeds,
        "packages": packages(),
        "machine": machine(),
        "jobs": jobs,
        "folder": folder.name,
        "started": datetime.now(timezone.utc).isoformat(timespec="seconds"),
    }
    return json.dumps(content, indent=1, allow_nan=False) + "\n"


def packages() -> dict[str, str | None]:
    """Installed versions of what results depend on."""
    return {name: _version(name) for name in _PACKAGES}


def machine() -> dict[str, str | int | None]:
    """What this machine is."""
    return {
        "platform": platform.platform(),
        "python": platform.python_version(),
        "cpu": _cpu_model(),
        "cpu_count": os.cpu_count(),
    }


def _version(package: str) -> str | None:
    try:
        return importlib.metadata.version(package)
    except importlib.metadata.PackageNotFoundError:
        return None


def _cpu_model() -> str:
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines()
    except OSError:
        return platform.processor()
    return next((line.partition(":")[2].strip() for line in lines if line.startswith("model name")), platform.machine())
