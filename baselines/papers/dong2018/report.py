"""``table1.md``: the measured table beside the paper's, hypotheses and ratios, and what explains the differences."""

from __future__ import annotations

from collections.abc import Sequence

from baselines.benchmark.cells import ESTIMATORS, SCENES
from baselines.benchmark.markdown import markdown_table
from baselines.benchmark.statistics import Difference, weighted_share
from baselines.papers.dong2018.explain import HYPOTHESES, NAMES, TOLERANCE, explain, number, within
from baselines.papers.dong2018.studies import Record
from baselines.papers.dong2018.table1 import PAPER_RMSE, QUANTITIES, UNITS, Table1, paper_ratio

_PERCEPTIONS = {
    "truth": "the measurement is the truth",
    "emulated": "truth through a measurement model, whose scale alone is fitted to the paper's No filter row",
    "mask": "rendered RGB-D, box of the visible pixels with stated jitter, real depth path; nothing is fitted",
    "detector": "rendered RGB-D, boxes of the shipped detector, the tracker at 10 Hz; nothing is fitted",
}
NOTEWORTHY = 0.01
"""A difference below this share of No filter's RMSE is marked as slight, whatever its interval says."""
_VERDICT = {True: "yes", None: "undecided", False: "no"}


def report(table: Table1, rules: Sequence[Record] = ()) -> str:
    """The whole report as Markdown that also reads well on a terminal.

    Args:
        table: Measured cells.
        rules: Records of the comparison of depth rules, if it was made.
    """
    parts = [
        "# Table 1, reproduced",
        "RMSE over all steps of all episodes, with 95 % bootstrap intervals over whole episodes; "
        "rmse² = bias² + spread².\n"
        "Errors are estimate minus truth: angle positive to the left, distance forward. "
        "Differences are paired by seed.",
    ]
    for perception in table.perceptions:
        episodes = len(table.cell(perception, SCENES[0], "none"))
        parts += [
            f"## Perception `{perception}`: {_PERCEPTIONS[perception]}",
            f"{episodes} episode{'s' if episodes != 1 else ''} per cell.",
            _errors(table, perception),
            "### Hypotheses\n\nThe paper has AKF < KF < No filter everywhere. A verdict is *slight* when it "
            f"is a difference below {NOTEWORTHY:.0%} of No filter's RMSE.",
            _hypotheses(table, perception),
            f"### Ratios to No filter\n\nBeside the paper's, within {TOLERANCE:.0%} of them or not.",
            _ratios(table, perception),
            "### What differs, and why",
            _explanations(table, perception),
            "### Following",
            _following(table, perception),
        ]
    if rules:
        parts += [
            "## Depth rules on rendered frames",
            f"The `mask` perception with other rules that read a depth from the same box, "
            f"{rules[0]['episodes']} episodes per cell. Tails lie beyond three robust standard deviations.",
            _rules(rules),
        ]
    return "\n\n".join(parts) + "\n"


def difference_text(difference: Difference, quantity: str) -> str:
    """A difference with its interval, if it has one, in the quantity's unit."""
    text = number(difference.value, quantity, more=2)
    if difference.interval is None:
        return text
    low, high = difference.interval
    return f"{text} ({number(low, quantity, more=2)} to {number(high, quantity, more=2)})"


def _errors(table: Table1, perception: str) -> str:
    header = ["scene", "quantity", "estimator", "RMSE", "95 % interval", "bias", "spread", "ratio"]
    header += ["paper", "paper ratio"]
    rows = []
    for scene in SCENES:
        for quantity in QUANTITIES:
            for estimator in ESTIMATORS:
                error = table.error(perception, scene, estimator, quantity)
                paper = PAPER_RMSE.get((scene, quantity, estimator))
                ratio = None if estimator == "none" else table.ratio(perception, scene, quantity, estimator)
                interval = error.interval
                rows.append(
                    [
                        scene,
                        f"{quantity} ({UNITS[quantity]})",
                        NAMES[estimator],
                        number(error.rmse, quantity),
                        "–" if interval is None else " to ".join(number(end, quantity) for end in interval),
                        number(error.bias, quantity),
                        number(error.spread, quantity),
                        _ratio(ratio),
                        "–" if paper is None else number(paper, quantity),
                        _ratio(paper_ratio(scene, quantity, estimator)),
                    ]
                )
    return markdown_table(header, rows, left=3)


def _hypotheses(table: Table1, perception: str) -> str:
    header = ["scene", "quantity", "KF - No filter", "KF < No filter", "AKF - KF", "AKF < KF", "AKF < KF < No filter"]
    rows = []
    for scene in SCENES:
        for quantity in QUANTITIES:
            row = [scene, f"{quantity} ({UNITS[quantity]})"]
            differences = [table.difference(perception, scene, quantity, *pair) for pair in HYPOTHESES]
            for difference in differences:
                none = table.error(perception, scene, "none", quantity)
                slight = abs(difference.value) < NOTEWORTHY * none.rmse
                row += [
                    difference_text(difference, quantity),
                    _VERDICT[difference.negative] + (" (slight)" if slight else ""),
                ]
            outcomes = [difference.negative for difference in differences]
            row.append(_VERDICT[False if False in outcomes else None if None in outcomes else True])
            rows.append(row)
    return markdown_table(header, rows, left=2)


def _ratios(table: Table1, perception: str) -> str:
    header = ["scene", "quantity"]
    for name in ("KF", "AKF"):
        header += [f"{name} ratio", "paper", f"within {TOLERANCE:.0%}"]
    rows = []
    for scene in SCENES:
        for quantity in QUANTITIES:
            row = [scene, quantity]
            for estimator in ("kf", "akf"):
                ratio = table.ratio(perception, scene, quantity, estimator)
                paper = paper_ratio(scene, quantity, estimator)
                row += [_ratio(ratio), _ratio(paper), {None: "–", True: "yes", False: "no"}[within(ratio, paper)]]
            rows.append(row)
    return markdown_table(header, rows, left=2)


def _rules(records: Sequence[Record]) -> str:
    header = [
        "scene",
        "quantity",
        "depth rule",
        "estimator",
        "RMSE",
        "bias",
        "spread",
        "tails",
        "ratio",
        "paper ratio",
    ]
    rows = []
    for scene in SCENES:
        for quantity in QUANTITIES:
            for record in records:
                if (record["scene"], record["quantity"]) != (scene, quantity):
                    continue
                share, ratio, paper = record["outlier_share"], record["ratio_to_none"], record["paper_ratio"]
                rows.append(
                    [
                        scene,
                        f"{quantity} ({UNITS[quantity]})",
                        str(record["sensor"]),
                        NAMES[str(record["estimator"])],
                        *(number(float(str(record[column])), quantity) for column in ("rmse", "bias", "spread")),
                        "–" if share is None else f"{float(str(share)):.1%}",
                        *("–" if value is None else f"{float(str(value)):.2f}" for value in (ratio, paper)),
                    ]
                )
    return markdown_table(header, rows, left=4)


def _explanations(table: Table1, perception: str) -> str:
    lines = []
    for scene in SCENES:
        for quantity in QUANTITIES:
            text = explain(table, perception, scene, quantity)
            lines.append(f"- {scene}, {quantity}: {text or 'as in the paper.'}")
    return "\n".join(lines)


def _following(table: Table1, perception: str) -> str:
    header = ["scene", "estimator", "success", "ended early", "collision", "lost", "in band", "measured"]
    header += ["inflated angle", "inflated distance"]
    rows = []
    for scene in SCENES:
        for estimator in ESTIMATORS:
            episodes = table.cell(perception, scene, estimator)
            ends = [row["ended"] for row in episodes]
            counts = (sum(row["success"] == 1 for row in episodes), len(ends) - ends.count("time"))
            shares = [count / len(ends) for count in (*counts, ends.count("collision"), ends.count("lost"))]
            columns = ("in_band_share", "measurement_share", "angle_inflated_share", "distance_inflated_share")
            row = [scene, NAMES[estimator], *(f"{share:.0%}" for share in shares)]
            for column in columns:
                value = weighted_share(episodes, column)
                row.append("–" if value is None else f"{value:.1%}")
            rows.append(row)
    return markdown_table(header, rows, left=2)


def _ratio(value: float | None) -> str:
    return "–" if value is None else f"{value:.2f}"
