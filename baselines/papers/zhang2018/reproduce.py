"""`follow reproduce astronaut`: play what is missing, keep each part, and write tables and pictures from the store."""

from __future__ import annotations

import dataclasses
import importlib.metadata
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

from baselines.benchmark import provenance
from baselines.benchmark.files import write_csv, write_text
from baselines.benchmark.run import complete
from baselines.benchmark.store import Store
from baselines.papers.zhang2018 import lookalike, rectangle, script, stage, table2
from baselines.papers.zhang2018.experiments import EPISODES, EXPERIMENTS, Detectors, Part, Player, Rows, tasks
from baselines.papers.zhang2018.table2 import OURS, SSD
from follow_env.config import CameraConfig
from follow_env.sensors import SensorConfig
from tracker.detection.detector import CONFIDENCE

FIGURES = "figures"
_DIGITS = 6
_CODE = (lookalike, rectangle, script, stage, table2)
"""Modules of this package on which the rows depend."""


def reproduce(
    experiments: Sequence[str],
    episodes: int | None,
    detectors: Detectors,
    weights: Mapping[str, str],
    speeds: Callable[[str, Path], None] | None,
    out: Path,
    jobs: int,
    resume: bool,
) -> str:
    """Play the experiments and write every result into a folder; see `running.complete` for what may be raised.

    Args:
        experiments: Names of `EXPERIMENTS`, each once, in the report's order.
        episodes: Look-alike episodes; fewer than `EPISODES` also cut Table 2's sequences. None takes all.
        detectors: The nets by name; picklable when several jobs are used.
        weights: What tells the detectors from others, by net: part of the configuration's hash.
        speeds: Measures Table 3 and writes it, given a sentence that says what playing took, and the folder; None
            leaves it out.
        out: Results folder; made when missing.
        jobs: Number of processes. The results do not depend on it.
        resume: Whether to go on with what the folder already holds.

    Returns:
        The report, `astronaut.md` without its pictures.
    """
    plan = {name: tasks(name, episodes or EPISODES) for name in experiments}
    settings = _settings(weights)
    code = [Path(str(module.__file__)) for module in _CODE]
    digest = provenance.run_digest(settings, *code)
    parts = {name: list(dict.fromkeys(part for part, _ in planned)) for name, planned in plan.items()}
    seeds = {name: sorted({seed for _, seed in planned}) for name, planned in plan.items()}
    config = provenance.text(settings, digest, parts, seeds, out, jobs)

    def write(store: Store, done: str) -> str:
        text = _write(plan, store, detectors, out)
        if speeds is not None:
            speeds(done, out)
        return text

    every = [task for planned in plan.values() for task in planned]
    return complete(every, digest, config, Player(detectors), write, out, jobs, resume)


def _settings(weights: Mapping[str, str]) -> dict[str, Any]:
    packages = ("numpy", "opencv-python-headless", "torch")
    return {
        "benchmark": "astronaut",
        "camera": dataclasses.asdict(CameraConfig()),
        "sensor": dataclasses.asdict(SensorConfig()),
        "tracker": dataclasses.asdict(stage.SETTINGS),
        "confidence": CONFIDENCE,
        "weights": dict(weights),
        "packages": {name: importlib.metadata.version(name) for name in packages},
    }


def _write(plan: Mapping[str, Sequence[tuple[Part, int]]], store: Store, detectors: Detectors, out: Path) -> str:
    """Every table and picture, from exactly the planned parts, in the plan's order."""
    (out / FIGURES).mkdir(exist_ok=True)
    printed, kept = [_HEAD], [_HEAD]
    for name, planned in plan.items():
        experiment = EXPERIMENTS[name]
        rows = [row for part, seed in planned for row in store.result(part, seed, Rows).rows]
        write_csv(out / f"{name}_rows.csv", experiment.columns, rows, _DIGITS)
        if name == "table2":
            write_csv(out / "table2.csv", table2.RECORD_COLUMNS, table2.records(rows), _DIGITS)
        section = f"## {experiment.title}\n\n{experiment.show(rows, detectors, out / FIGURES / experiment.picture)}"
        printed.append(section)
        kept.append(f"{section}\n\n![{experiment.title}]({FIGURES}/{experiment.picture})")
    write_text(out / "astronaut.md", "\n\n".join(kept) + "\n")
    return "\n\n".join(printed) + "\n"


_HEAD = f"""# Paper A's experiments, reproduced

In the cabin scene, with rendered people and the Xtion's errors in color and depth. `{OURS}` has the paper's shared
features and 2252 priors, `{SSD}` SSD's 8732 priors without them; both have the same light trunk in the place of VGG-16.
A net without weights is left out. Boxes: `mask` are the true ones, `detector` those of `{OURS}`. Speed is in
`timing.md`."""
