"""The error curves of figures 6-9: cumulative absolute errors over time, their mean and spread over seeds."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from baselines.benchmark.cells import Cell
from baselines.benchmark.files import Value
from baselines.papers.dong2018.table1 import QUANTITIES, UNITS

CURVE_COLUMNS = (
    *("perception", "scene", "quantity", "unit", "estimator", "time_s", "running"),
    *("mean", "p10", "p90"),
)
RATE = 10
"""Points per second of the curves written and drawn, Hz."""

_SCALE = {"angle": 1.0, "distance": 100.0}


def curve_records(curves: Mapping[Cell, Sequence[NDArray[np.float64]]]) -> list[dict[str, Value]]:
    """Mean and 10-90 % band over episodes of the cumulative absolute errors, rad and cm.

    An episode that ended early keeps its last sum, so that a curve never falls; the column ``running`` counts those
    that have not ended.

    Args:
        curves: Curves of each cell's episodes, each of shape (steps, 3): time s, angle rad, distance m.
    """
    records: list[dict[str, Value]] = []
    for cell, episodes in curves.items():
        sampled = [_sample(curve) for curve in episodes]
        for column, quantity in enumerate(QUANTITIES):
            for index in range(max(len(points) for points in sampled)):
                values = [float(points[min(index, len(points) - 1), column]) * _SCALE[quantity] for points in sampled]
                low, high = np.quantile(values, [0.1, 0.9])
                records.append(
                    {
                        "perception": cell.perception,
                        "scene": cell.scene,
                        "quantity": quantity,
                        "unit": UNITS[quantity],
                        "estimator": cell.estimator,
                        "time_s": index / RATE,
                        "running": sum(index < len(points) for points in sampled),
                        "mean": math.fsum(values) / len(values),
                        "p10": float(low),
                        "p90": float(high),
                    }
                )
    return records


def _sample(curve: NDArray[np.float64]) -> NDArray[np.float64]:
    """The two errors at 0, 1/RATE, 2/RATE ... s as far as the curve goes, shape (points, 2)."""
    step_tolerance = 1e-6
    times = curve[:, 0]
    points = int((times[-1] + step_tolerance) * RATE) + 1
    indices = np.searchsorted(times, np.arange(points) / RATE + step_tolerance, side="right") - 1
    return curve[indices, 1:]
