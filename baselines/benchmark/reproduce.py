"""`follow reproduce table1`: play what is missing, keep each episode, and write tables and figures from the store."""

from __future__ import annotations

import contextlib
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from baselines.benchmark import configuration, figures, metrics, store
from baselines.benchmark.cells import Cell
from baselines.benchmark.configuration import Plan
from baselines.benchmark.curves import CURVE_COLUMNS, curve_records
from baselines.benchmark.episodes import Episode, EpisodeFunction
from baselines.benchmark.files import Value, write_csv, write_text
from baselines.benchmark.pool import Task, play_all
from baselines.benchmark.progress import progress
from baselines.benchmark.report import report
from baselines.benchmark.store import InputError, Store
from baselines.benchmark.studies import FAMILY_COLUMNS, SENSITIVITY_COLUMNS, Record, study_records
from baselines.benchmark.table1 import COLUMNS, Table1

FIGURES = "figures"
_RESULTS = (configuration.FILE_NAME, "table1.csv", "table1.md", "episodes.csv")
_TIMING_COLUMNS = ("cell", "seed", "policy_step_mean_s", "policy_step_p95_s")
_DIGITS = 6


class Interrupted(KeyboardInterrupt):
    """The user stopped the run; the message says what was kept and how to go on."""


def reproduce(
    plan: Plan, calibration: Mapping[str, Any], episode: EpisodeFunction, out: Path, jobs: int, resume: bool
) -> str:
    """Play the plan's episodes and write every result into a folder.

    Args:
        plan: Cells and seeds.
        calibration: Content of the calibration, part of the configuration's hash.
        episode: Plays one cell and seed; picklable when several jobs are used.
        out: Results folder; made when missing.
        jobs: Number of processes. The results do not depend on it.
        resume: Whether to go on with the episodes that the folder already holds.

    Returns:
        The report, ``table1.md`` without its figures.

    Raises:
        InputError: If the folder cannot be used; nothing in it has changed.
        EpisodeError: If an episode fails; the finished ones are kept.
        Interrupted: On Ctrl-C; the finished episodes are kept.
    """
    settings = configuration.settings(calibration)
    digest = configuration.run_digest(settings)
    _claim(out)
    with Store(out, digest) as episodes:
        if len(episodes) and not resume:
            raise InputError(
                f"{out} already holds {len(episodes)} episodes of this configuration: "
                "go on with --resume, or choose another folder with --out."
            )
        try:
            with _writable(out):
                write_text(out / configuration.FILE_NAME, configuration.document(plan, settings, out, jobs))
                (out / FIGURES).mkdir(exist_ok=True)
            _play_missing(plan, episode, episodes, jobs)
            with _writable(out):
                return _write_results(plan, episodes, out)
        except KeyboardInterrupt:
            tasks = plan.tasks()
            kept = len(tasks) - len(_missing(tasks, episodes))
            raise Interrupted(
                f"interrupted: {kept} of {len(tasks)} episodes are kept in {out}; "
                "the same command with --resume goes on."
            ) from None


def _claim(out: Path) -> None:
    """Make the folder, and refuse one whose results would be lost."""
    with _writable(out):
        out.mkdir(parents=True, exist_ok=True)
        results = [name for name in _RESULTS if (out / name).exists()]
        path = out / store.FILE_NAME
        stored = path.exists() and path.stat().st_size > 0
    if results and not stored:
        raise InputError(
            f"{out} holds {results[0]} but not the episodes it was made from ({store.FILE_NAME}), so it would be lost: "
            "choose another folder with --out."
        )


@contextlib.contextmanager
def _writable(out: Path) -> Iterator[None]:
    """Turn the system's refusals into sentences with a remedy."""
    try:
        yield
    except OSError as error:
        raise InputError(
            f"{out} cannot be written ({error.strerror or error}): make it a writable folder on a disk with space, "
            "or choose another with --out."
        ) from error


def _play_missing(plan: Plan, episode: EpisodeFunction, episodes: Store, jobs: int) -> None:
    tasks = plan.tasks()
    missing = _missing(tasks, episodes)
    if missing:
        with contextlib.closing(play_all(episode, missing, jobs)) as playing:
            for (cell, seed), result in progress(playing, total=len(tasks), done=len(tasks) - len(missing)):
                episodes.add(cell, seed, result)


def _missing(tasks: Sequence[Task], episodes: Store) -> list[Task]:
    finished = episodes.finished()
    return [(cell, seed) for cell, seed in tasks if (cell.key, seed) not in finished]


def _write_results(plan: Plan, episodes: Store, out: Path) -> str:
    """Every table and figure, from exactly the planned seeds, in the plan's order."""
    table = {cell: [episodes.episode(cell, seed) for seed in plan.table_seeds(cell)] for cell in plan.table}
    write_csv(out / "episodes.csv", metrics.COLUMNS, _rows(table))
    write_csv(out / "timing.csv", _TIMING_COLUMNS, _timings(table))
    curves = curve_records({cell: [played.curve for played in group] for cell, group in table.items()})
    write_csv(out / "curves.csv", CURVE_COLUMNS, curves, _DIGITS)
    drawn = figures.draw_curves(curves, out / FIGURES)
    rules: list[Record] = []
    for name, cells in plan.studies.items():
        study = {cell: [episodes.episode(cell, seed) for seed in plan.study_seeds(name)] for cell in cells}
        write_csv(out / f"{name}_episodes.csv", metrics.COLUMNS, _rows(study))
        records = study_records({cell: [played.row for played in group] for cell, group in study.items()})
        columns = SENSITIVITY_COLUMNS if name == "sensitivity" else FAMILY_COLUMNS
        write_csv(out / f"{name}.csv", columns, records, _DIGITS)
        drawn.append(out / FIGURES / f"{name}.png")
        draw = figures.draw_sensitivity if name == "sensitivity" else figures.draw_sensors
        draw(records, drawn[-1])
        if name == "rules":
            rules = records
    measured = Table1({cell: [played.row for played in group] for cell, group in table.items()})
    write_csv(out / "table1.csv", COLUMNS, measured.records(), _DIGITS)
    text = report(measured, rules)
    pictures = "\n\n".join(f"![{path.stem.replace('_', ' ')}]({FIGURES}/{path.name})" for path in drawn)
    write_text(out / "table1.md", f"{text}\n## Figures\n\n{pictures}\n")
    return text


def _rows(played: Mapping[Cell, Sequence[Episode]]) -> list[metrics.Row]:
    return [episode.row for group in played.values() for episode in group]


def _timings(played: Mapping[Cell, Sequence[Episode]]) -> list[dict[str, Value]]:
    return [
        dict(zip(_TIMING_COLUMNS, (cell.key, seed, episode.timing.mean, episode.timing.p95), strict=True))
        for cell, group in played.items()
        for seed, episode in enumerate(group)
    ]
