"""The report's sections on the `detector` rung: what the tracker did, how well it measured, what the detector costs."""

from __future__ import annotations

import math
from collections.abc import Sequence

from baselines.benchmark.cells import ESTIMATORS, SCENES, Cell
from baselines.benchmark.files import Value
from baselines.benchmark.markdown import markdown_table
from baselines.benchmark.metrics.episode import Row
from baselines.benchmark.metrics.tracking import AT_THE_PERSON
from baselines.benchmark.statistics import PooledError
from baselines.papers.dong2018.explain import NAMES, number
from baselines.papers.dong2018.report import difference_text
from baselines.papers.dong2018.table1 import QUANTITIES, UNITS, Table1

COST_COLUMNS = (
    *("scene", "estimator", "quantity", "unit", "episodes", "mask_rmse", "detector_rmse"),
    *("difference", "difference_low", "difference_high", "ratio"),
)
"""Columns of ``detector_cost.csv``."""

HOW_SCORED = (
    "The detector looks at every third frame (10 Hz), control runs at 30 Hz. As on every rung, a step is scored when "
    "the follower has an estimate:\nbetween measurements No filter holds the last one and the filters predict, so each "
    "pays for the age of what it has. Steps without an estimate\n(before the first confirmation, and from a stop of "
    "the tracker to the next one) have no error; *no estimate* is their share.\nR and Q follow the rule of the other "
    "rungs, measured on the detector's own errors on seeds that are not played here."
)
"""What an error means where measurements are rarer than steps."""


def detector_report(table: Table1) -> str:
    """The sections as Markdown; empty for a table without `detector` cells."""
    if "detector" not in table.perceptions:
        return ""
    return "\n\n".join([*_tracking_sections(table), *_cost_sections(table)]) + "\n"


def _tracking_sections(table: Table1) -> list[str]:
    return [
        f"## The tracker behind `detector`\n\n{HOW_SCORED}",
        "### Tracking\n\n"
        "Per episode, means: share of the processed frames with an accepted measurement (those of the confirmation "
        "have none), confirmations and stops of\nthe tracker, time without a track after the first confirmation and on "
        f"something farther than {AT_THE_PERSON:g} m from the person. *False* counts the\nconfirmations of such a "
        "thing, *lost* the episodes at whose end the person is not tracked.",
        _tracking(table),
        "### The measurements alone\n\nIn the frames that have one, with No filter driving; its row in the table "
        "above adds what holding them for three steps costs.",
        _measurements(table),
    ]


def _cost_sections(table: Table1) -> list[str]:
    """The comparison with `mask`; none if the table lacks it."""
    records = cost_records(table)
    if not records:
        return []
    rows = []
    for scene in SCENES:
        for quantity in QUANTITIES:
            for estimator in ESTIMATORS:
                mask, detector = _pair(table, scene, estimator, quantity)
                ratio = detector.ratio_to(mask)
                rows.append(
                    [
                        scene,
                        f"{quantity} ({UNITS[quantity]})",
                        NAMES[estimator],
                        number(mask.rmse, quantity),
                        number(detector.rmse, quantity),
                        difference_text(detector.minus(mask), quantity),
                        "–" if ratio is None else f"{ratio.value:.2f}",
                    ]
                )
    header = ["scene", "quantity", "estimator", "mask RMSE", "detector RMSE", "detector - mask", "ratio"]
    return [
        "## What the detector costs in error",
        "The same route and person on each seed with the true box (`mask`, a measurement at each of 30 frames a "
        "second) and with the detector and the tracker\n(10 a second): paired differences of the RMSE over "
        f"{records[0]['episodes']} episodes. Each rung is scored on the steps at which it has an estimate.",
        markdown_table(header, rows, left=3),
    ]


def cost_records(table: Table1) -> list[dict[str, Value]]:
    """Rows of ``detector_cost.csv``, keyed by COST_COLUMNS; none unless the table has `mask` and `detector`."""
    if not {"mask", "detector"} <= set(table.perceptions):
        return []
    records = []
    for scene in SCENES:
        for quantity in QUANTITIES:
            for estimator in ESTIMATORS:
                mask, detector = _pair(table, scene, estimator, quantity)
                difference, ratio = detector.minus(mask), detector.ratio_to(mask)
                low, high = difference.interval or (None, None)
                values = (scene, estimator, quantity, UNITS[quantity], mask.episodes, mask.rmse, detector.rmse)
                costs = (difference.value, low, high, None if ratio is None else ratio.value)
                records.append(dict(zip(COST_COLUMNS, (*values, *costs), strict=True)))
    return records


def _pair(table: Table1, scene: str, estimator: str, quantity: str) -> tuple[PooledError, PooledError]:
    """Errors of `mask` and `detector` over the seeds that both ran, which begin at 0."""
    groups = [table.cell(perception, scene, estimator) for perception in ("mask", "detector")]
    common = min(map(len, groups))
    mask, detector = (PooledError.of(group[:common], quantity) for group in groups)
    return mask, detector


def _tracking(table: Table1) -> str:
    header = ["scene", "estimator", "no estimate", "accepted", "confirmations", "false", "stops", "untracked (s)"]
    header += ["wrong target (s)", "lost"]
    rows = []
    for scene in SCENES:
        for estimator in ESTIMATORS:
            episodes = table.rows[Cell("detector", scene, estimator)]
            rows.append(
                [
                    scene,
                    NAMES[estimator],
                    f"{1.0 - _total(episodes, 'estimate_steps') / _total(episodes, 'steps'):.1%}",
                    f"{_mean(episodes, 'accepted_share'):.1%}",
                    *(f"{_mean(episodes, name):.2f}" for name in ("confirmations", "false_confirmations", "stops")),
                    *(f"{_mean(episodes, name):.2f}" for name in ("untracked_s", "wrong_target_s")),
                    f"{1.0 - _mean(episodes, 'tracked_at_end'):.0%}",
                ]
            )
    return markdown_table(header, rows, left=2)


def _measurements(table: Table1) -> str:
    rows = []
    for scene in SCENES:
        for quantity in QUANTITIES:
            error = _measured(table.rows[Cell("detector", scene, "none")], quantity)
            interval = "–" if error.interval is None else " to ".join(number(end, quantity) for end in error.interval)
            rows.append(
                [
                    scene,
                    f"{quantity} ({UNITS[quantity]})",
                    number(error.rmse, quantity),
                    interval,
                    *(number(value, quantity) for value in (error.bias, error.spread)),
                ]
            )
    return markdown_table(["scene", "quantity", "RMSE", "95 % interval", "bias", "spread"], rows, left=2)


def _measured(episodes: Sequence[Row], quantity: str) -> PooledError:
    """Error of the measurements alone, from the columns that begin with ``measured_``."""
    renamed = [
        row
        | {"estimate_steps": row["measured_steps"]}
        | {name.removeprefix("measured_"): value for name, value in row.items() if name.startswith("measured_")}
        for row in episodes
    ]
    return PooledError.of(renamed, quantity)


def _total(episodes: Sequence[Row], column: str) -> float:
    return math.fsum(float(str(row[column])) for row in episodes)


def _mean(episodes: Sequence[Row], column: str) -> float:
    return _total(episodes, column) / len(episodes)
