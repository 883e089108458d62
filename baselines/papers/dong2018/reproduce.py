"""`follow reproduce table1`: play what is missing, keep each episode, and write tables and figures from the store."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from baselines.benchmark import provenance
from baselines.benchmark.files import write_csv, write_text
from baselines.benchmark.metrics import episode as metrics
from baselines.benchmark.metrics import tracking
from baselines.benchmark.player import EpisodeFunction
from baselines.benchmark.provenance import Plan
from baselines.benchmark.run import Played, rows, run
from baselines.benchmark.store import Store
from baselines.papers.dong2018 import figures
from baselines.papers.dong2018.curves import CURVE_COLUMNS, curve_records
from baselines.papers.dong2018.detector_report import COST_COLUMNS, cost_records, detector_report
from baselines.papers.dong2018.report import report
from baselines.papers.dong2018.studies import FAMILY_COLUMNS, SENSITIVITY_COLUMNS, Record, study_records
from baselines.papers.dong2018.table1 import COLUMNS, Table1

FIGURES = "figures"
_DIGITS = 6


def reproduce(
    plan: Plan, calibration: Mapping[str, Any], episode: EpisodeFunction, out: Path, jobs: int, resume: bool
) -> str:
    """Play the plan's episodes and write every result into a folder; see `running.run` for what may be raised.

    Args:
        plan: Cells and seeds.
        calibration: Content of the calibration, and what identifies the detector if one is used, part of the
            configuration's hash.
        episode: Plays one cell and seed; picklable when several jobs are used.
        out: Results folder; made when missing.
        jobs: Number of processes. The results do not depend on it.
        resume: Whether to go on with the episodes that the folder already holds.

    Returns:
        The report, ``table1.md`` without its figures.
    """
    settings = provenance.settings(calibration)
    config = provenance.document(plan, settings, out, jobs)
    digest = provenance.run_digest(settings)
    return run(plan.tasks(), digest, config, episode, lambda store: _write(plan, store, out), out, jobs, resume)


def _write(plan: Plan, episodes: Store, out: Path) -> tuple[str, Played]:
    """Every table and figure, from exactly the planned seeds, in the plan's order."""
    (out / FIGURES).mkdir(exist_ok=True)
    table = {cell: [episodes.episode(cell, seed) for seed in plan.table_seeds(cell)] for cell in plan.table}
    write_csv(out / "episodes.csv", metrics.COLUMNS, rows(table))
    curves = curve_records({cell: [played.curve for played in group] for cell, group in table.items()})
    write_csv(out / "curves.csv", CURVE_COLUMNS, curves, _DIGITS)
    drawn = figures.draw_curves(curves, out / FIGURES)
    rules: list[Record] = []
    for name, cells in plan.studies.items():
        study = {cell: [episodes.episode(cell, seed) for seed in plan.study_seeds(name)] for cell in cells}
        write_csv(out / f"{name}_episodes.csv", metrics.COLUMNS, rows(study))
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
    tracked = [row for cell, group in measured.rows.items() if cell.perception == "detector" for row in group]
    if tracked:
        write_csv(out / "tracking_episodes.csv", tracking.COLUMNS, tracked)
    costs = cost_records(measured)
    if costs:
        write_csv(out / "detector_cost.csv", COST_COLUMNS, costs, _DIGITS)
    text = "\n".join(filter(None, (report(measured, rules), detector_report(measured))))
    pictures = "\n\n".join(f"![{path.stem.replace('_', ' ')}]({FIGURES}/{path.name})" for path in drawn)
    write_text(out / "table1.md", f"{text}\n## Figures\n\n{pictures}\n")
    return text, table
