"""Why a cell differs from the paper, in plain words that are derived from the measured numbers alone."""

from __future__ import annotations

import math

from baselines.benchmark.cells import Cell
from baselines.benchmark.statistics import NEGLIGIBLE, Difference, PooledError, weighted_share
from baselines.papers.dong2018.table1 import PAPER_RMSE, UNITS, Table1, paper_ratio

TOLERANCE = 0.15
"""A number agrees with the paper's when it lies within this share of it."""
NAMES = {"none": "No filter", "kf": "KF", "akf": "AKF", "akf_cv": "augmented AKF"}
HYPOTHESES = (("kf", "none"), ("akf", "kf"))
"""(smaller, larger) RMSE, as the paper has them."""

_FEW_OUTLIERS = 0.2
_ONE_EPISODE_SHARE = 0.25
_SLOW_ERRORS = 0.5
_NO_DIFFERENCE = Difference(0.0, (0.0, 0.0))
_NEGLIGIBLE_SHARE = 0.01
"""Part of No filter's squared error below which a change is not worth a word."""


def number(value: float, quantity: str, more: int = 0) -> str:
    """A value in the quantity's unit, without the unit: four decimals of a rad or two of a cm, or some more."""
    decimals = (4 if quantity == "angle" else 2) + more
    return f"{round(value, decimals) + 0.0:.{decimals}f}"


def within(value: float | None, paper: float | None) -> bool | None:
    """Whether a ratio or an RMSE agrees with the paper's; None when there is nothing to compare."""
    return None if value is None or paper is None else abs(value / paper - 1.0) <= TOLERANCE


def explain(table: Table1, perception: str, scene: str, quantity: str) -> str | None:
    """What differs from the paper for one scene and quantity, and what in the numbers explains it.

    Returns:
        One paragraph, or None when both orders hold and both ratios and No filter's RMSE agree.
    """
    verdicts = _verdicts(table, perception, scene, quantity)
    if not verdicts:
        return None
    none = table.error(perception, scene, "none", quantity)
    sentences = [f"{'; '.join(verdicts)}."]
    if not none.negligible:
        sentences.append(_bias_share(none, quantity))
    else:
        sentences.append("No filter makes no error on perfect measurements, so a filter can only add its own.")
    kf, akf = (table.error(perception, scene, estimator, quantity) for estimator in ("kf", "akf"))
    sentences.append(_filter_effect(kf, none, "kf", quantity))
    if none.bias**2 < none.spread**2 and kf.spread < none.spread:
        sentences.append(_correlation(table, perception, scene, quantity))
    if akf.minus(kf) == _NO_DIFFERENCE:
        sentences.append("The AKF finds no outlier in any episode and does what the KF does.")
    else:
        sentences.append(_filter_effect(akf, none, "akf", quantity))
    if not none.negligible:
        sentences.append(_outliers(table, perception, scene, quantity))
    sentences += [_one_episode(table, perception, scene, quantity, estimator) for estimator in ("none", "kf", "akf")]
    return " ".join(sentence for sentence in sentences if sentence)


def _verdicts(table: Table1, perception: str, scene: str, quantity: str) -> list[str]:
    verdicts = []
    here, there = table.error(perception, scene, "none", quantity).rmse, PAPER_RMSE[scene, quantity, "none"]
    if not within(here, there):
        rmse = f"{number(here, quantity)} {UNITS[quantity]}"
        verdicts.append(f"No filter errs by {rmse} (paper {number(there, quantity)})")
    for smaller, larger in HYPOTHESES:
        holds = table.difference(perception, scene, quantity, smaller, larger).negative
        if not holds:
            outcome = "is undecided" if holds is None else "does not hold"
            verdicts.append(f"{NAMES[smaller]} < {NAMES[larger]} {outcome}")
    for estimator in ("kf", "akf"):
        ratio, paper = table.ratio(perception, scene, quantity, estimator), paper_ratio(scene, quantity, estimator)
        if within(ratio, paper) is False:
            verdicts.append(f"the {NAMES[estimator]} ratio is {ratio:.2f} (paper {paper:.2f})")
    return verdicts


def _bias_share(none: PooledError, quantity: str) -> str:
    share = none.bias**2 / none.rmse**2
    bias, spread, unit = number(none.bias, quantity), number(none.spread, quantity), UNITS[quantity]
    if share < _NEGLIGIBLE_SHARE:
        return f"No filter's error is all spread ({spread} {unit})."
    start = f"Bias ({bias} {unit}) makes {share:.0%} of No filter's squared error"
    if share < 0.5:
        return f"{start}, spread ({spread} {unit}) the rest."
    return (
        f"{start}: averaging leaves it, only a filter's lag or rejection shifts it; "
        f"unshifted and without any spread the ratio would be {share**0.5:.2f}."
    )


def _filter_effect(error: PooledError, none: PooledError, estimator: str, quantity: str) -> str:
    """How the filter moved the two parts of the squared error, and which of them decides."""
    unit = UNITS[quantity]
    parts = {
        "bias": (none.bias, error.bias),
        "spread": (none.spread, error.spread),
    }
    change = {name: after**2 - before**2 for name, (before, after) in parts.items()}
    told = {
        name: f"{name} from {number(before, quantity)} to {number(after, quantity)} {unit}"
        for name, (before, after) in parts.items()
        if abs(change[name]) > _NEGLIGIBLE_SHARE * none.rmse**2 and max(abs(before), abs(after)) >= NEGLIGIBLE
    }
    if not told:
        return f"The {NAMES[estimator]} changes neither bias nor spread."
    text = f"The {NAMES[estimator]} takes {' and '.join(told.values())}"
    if len(told) == 2 and change["bias"] * change["spread"] < 0.0:
        added, removed = sorted(change, key=lambda name: change[name], reverse=True)
        grows = change["bias"] + change["spread"] > 0.0
        text += (
            f": more {added} added than {removed} removed" if grows else f": more {removed} removed than {added} added"
        )
    return f"{text}."


def _correlation(table: Table1, perception: str, scene: str, quantity: str) -> str:
    """Whether the errors are ones that averaging could remove, where the KF removes less than the paper's."""
    ratio, paper = table.ratio(perception, scene, quantity, "kf"), paper_ratio(scene, quantity, "kf")
    correlation = weighted_share(table.cell(perception, scene, "none"), f"{quantity}_error_correlation")
    if ratio is None or paper is None or correlation is None or ratio <= paper * (1.0 + TOLERANCE):
        return ""
    text = f"Successive errors of No filter correlate by {correlation:.2f}"
    if correlation >= _SLOW_ERRORS:
        return f"{text}, which limits what averaging over a few steps can remove."
    return f"{text}, so averaging could remove more: the gain that the rule for Q gives leaves the rest."


def _one_episode(table: Table1, perception: str, scene: str, quantity: str, estimator: str) -> str:
    """Whether a single episode decides an estimator's error, and what happened in it."""
    squares = table.error(perception, scene, estimator, quantity).squares.tolist()
    total = math.fsum(squares)
    share = max(squares) / total if total > 0.0 else 0.0
    if share <= max(_ONE_EPISODE_SHARE, 3.0 / len(squares)):
        return ""
    row = table.cell(perception, scene, estimator)[squares.index(max(squares))]
    owner = NAMES[estimator] if estimator == "none" else f"the {NAMES[estimator]}"
    text = f"Seed {row['seed']} alone makes {share:.0%} of {owner}'s squared error"
    if row["loss_count"]:
        text += f"; there the person was out of view for up to {row['longest_out_of_view_s']:.1f} s"
    if row["ended"] != "time":
        text += f"; it ended early ({row['ended']})"
    return f"{text}."


def _outliers(table: Table1, perception: str, scene: str, quantity: str) -> str:
    none_rows = table.cell(perception, scene, "none")
    squares = table.error(perception, scene, "none", quantity).squares
    share = weighted_share(none_rows, f"{quantity}_outlier_share") or 0.0
    carried = weighted_share(none_rows, f"{quantity}_outlier_square_share", squares.tolist()) or 0.0
    inflated = weighted_share(table.cell(perception, scene, "akf"), f"{quantity}_inflated_share") or 0.0
    text = (
        f"Tails (beyond three robust standard deviations) are {share:.1%} of No filter's errors "
        f"and carry {carried:.0%} of its squared error"
    )
    if carried < _FEW_OUTLIERS:
        text += ", which leaves the AKF little to reject"
    text += f"; the AKF inflates {inflated:.1%} of the measurements"
    if inflated > share + 2.0 * Cell(perception, scene, "akf").alpha:
        text += ", good ones among them"
    return f"{text}."
