"""Table 1 of paper B, measured: one record per cell and quantity, with the paper's value beside it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

from baselines.benchmark.cells import ESTIMATORS, PERCEPTIONS, SCENES, Cell
from baselines.benchmark.files import Value
from baselines.benchmark.metrics.episode import Row
from baselines.benchmark.statistics import Difference, PooledError

QUANTITIES = ("angle", "distance")
UNITS = {"angle": "rad", "distance": "cm"}
PAPER_RMSE = {
    ("corridor", "angle", "none"): 0.0141,
    ("corridor", "angle", "kf"): 0.0088,
    ("corridor", "angle", "akf"): 0.0081,
    ("corridor", "distance", "none"): 15.31906,
    ("corridor", "distance", "kf"): 12.73932,
    ("corridor", "distance", "akf"): 12.00340,
    ("indoor", "angle", "none"): 0.0173,
    ("indoor", "angle", "kf"): 0.0118,
    ("indoor", "angle", "akf"): 0.0112,
    ("indoor", "distance", "none"): 46.2580,
    ("indoor", "distance", "kf"): 27.2162,
    ("indoor", "distance", "akf"): 17.1864,
}
"""Table 1 of paper B by scene, quantity and estimator: rad and cm."""

COLUMNS = (
    *("perception", "scene", "estimator", "quantity", "unit", "episodes"),
    *("rmse", "ci_low", "ci_high", "bias", "spread", "ratio_to_none"),
    *("diff_to_none", "diff_none_low", "diff_none_high", "diff_to_kf", "diff_kf_low", "diff_kf_high"),
    *("paper_rmse", "paper_ratio"),
)
"""Columns of ``table1.csv``."""


def paper_ratio(scene: str, quantity: str, estimator: str) -> float | None:
    """The paper's RMSE of an estimator over that of No filter; None where the paper has no such row."""
    if estimator == "none" or (scene, quantity, estimator) not in PAPER_RMSE:
        return None
    return PAPER_RMSE[scene, quantity, estimator] / PAPER_RMSE[scene, quantity, "none"]


@dataclass(frozen=True)
class Table1:
    """The measured table.

    Attributes:
        rows: Episode rows of each cell, in the order of their seeds; the cells of a perception ran the same seeds.
    """

    rows: Mapping[Cell, Sequence[Row]]

    @property
    def perceptions(self) -> list[str]:
        """Perceptions in the table, from best to real."""
        present = {cell.perception for cell in self.rows}
        return [perception for perception in PERCEPTIONS if perception in present]

    def cell(self, perception: str, scene: str, estimator: str) -> Sequence[Row]:
        """Episode rows of one cell."""
        return self.rows[Cell(perception, scene, estimator)]

    def error(self, perception: str, scene: str, estimator: str, quantity: str) -> PooledError:
        """Pooled error of one cell and quantity."""
        return self._errors[Cell(perception, scene, estimator), quantity]

    def difference(self, perception: str, scene: str, quantity: str, estimator: str, reference: str) -> Difference:
        """Paired difference of two estimators' RMSE, estimator minus reference."""
        error = self.error(perception, scene, estimator, quantity)
        return error.minus(self.error(perception, scene, reference, quantity))

    def ratio(self, perception: str, scene: str, quantity: str, estimator: str) -> float | None:
        """RMSE over that of No filter; None when No filter makes no error."""
        ratio = self.error(perception, scene, estimator, quantity).ratio_to(
            self.error(perception, scene, "none", quantity)
        )
        return None if ratio is None else ratio.value

    @cached_property
    def _errors(self) -> dict[tuple[Cell, str], PooledError]:
        return {
            (cell, quantity): PooledError.of(rows, quantity)
            for cell, rows in self.rows.items()
            for quantity in QUANTITIES
        }

    def records(self) -> list[dict[str, Value]]:
        """Rows of ``table1.csv``, keyed by COLUMNS; angles in rad, distances in cm."""
        return [
            self._record(perception, scene, estimator, quantity)
            for perception in self.perceptions
            for scene in SCENES
            for quantity in QUANTITIES
            for estimator in ESTIMATORS
        ]

    def _record(self, perception: str, scene: str, estimator: str, quantity: str) -> dict[str, Value]:
        error = self.error(perception, scene, estimator, quantity)
        record: dict[str, Value] = {
            **dict.fromkeys(COLUMNS),
            "perception": perception,
            "scene": scene,
            "estimator": estimator,
            "quantity": quantity,
            "unit": UNITS[quantity],
            "episodes": error.episodes,
            "rmse": error.rmse,
            "bias": error.bias,
            "spread": error.spread,
            "paper_rmse": PAPER_RMSE.get((scene, quantity, estimator)),
            "paper_ratio": paper_ratio(scene, quantity, estimator),
        }
        record["ci_low"], record["ci_high"] = error.interval or (None, None)
        if estimator != "none":
            record["ratio_to_none"] = self.ratio(perception, scene, quantity, estimator)
            difference = self.difference(perception, scene, quantity, estimator, "none")
            record["diff_to_none"] = difference.value
            record["diff_none_low"], record["diff_none_high"] = difference.interval or (None, None)
        if estimator not in ("none", "kf"):
            difference = self.difference(perception, scene, quantity, estimator, "kf")
            record["diff_to_kf"] = difference.value
            record["diff_kf_low"], record["diff_kf_high"] = difference.interval or (None, None)
        return record
