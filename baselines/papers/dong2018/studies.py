"""The studies beside Table 1: how its ratios move with Q and alpha, with the assumed sensor and with the depth rule."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

from baselines.benchmark.cells import Cell
from baselines.benchmark.files import Value
from baselines.benchmark.metrics.episode import Row
from baselines.benchmark.statistics import PooledError, weighted_share
from baselines.papers.dong2018.table1 import QUANTITIES, UNITS, paper_ratio

_RESULTS = (
    *("scene", "quantity", "unit", "episodes", "rmse", "ci_low", "ci_high", "bias", "spread"),
    *("outlier_share", "ratio_to_none", "ratio_low", "ratio_high", "inflated_share", "paper_ratio"),
)
SENSITIVITY_COLUMNS = ("estimator", "q_scale", "alpha", *_RESULTS)
FAMILY_COLUMNS = ("sensor", "estimator", *_RESULTS)

Record = dict[str, Value]


def study_records(rows: Mapping[Cell, Sequence[Row]]) -> list[Record]:
    """One record per cell and quantity, compared with No filter on the same sensor, scene and seeds.

    Args:
        rows: Episode rows of each cell in the order of their seeds, the No filter cells included.

    Returns:
        Records in the order of the cells; they hold both SENSITIVITY_COLUMNS and FAMILY_COLUMNS. Alpha is None except
        for the adaptive filter.
    """
    records = []
    for cell, cell_rows in rows.items():
        reference = replace(cell, estimator="none", q_scale=1.0, alpha=0.05)
        for quantity in QUANTITIES:
            error = PooledError.of(cell_rows, quantity)
            record: Record = {
                **dict.fromkeys((*SENSITIVITY_COLUMNS, *FAMILY_COLUMNS)),
                "sensor": cell.sensor,
                "estimator": cell.estimator,
                "scene": cell.scene,
                "quantity": quantity,
                "unit": UNITS[quantity],
                "episodes": error.episodes,
                "rmse": error.rmse,
                "bias": error.bias,
                "spread": error.spread,
                "outlier_share": weighted_share(cell_rows, f"{quantity}_outlier_share"),
            }
            record["ci_low"], record["ci_high"] = error.interval or (None, None)
            if cell.estimator != "none":
                record["q_scale"] = cell.q_scale
                record["alpha"] = cell.alpha if cell.estimator == "akf" else None
                record["inflated_share"] = weighted_share(cell_rows, f"{quantity}_inflated_share")
                record["paper_ratio"] = paper_ratio(cell.scene, quantity, cell.estimator)
                ratio = error.ratio_to(PooledError.of(rows[reference], quantity))
                if ratio is not None:
                    record["ratio_to_none"] = ratio.value
                    record["ratio_low"], record["ratio_high"] = ratio.interval or (None, None)
            records.append(record)
    return records
