"""How good the estimate was, of policies that tell one: eq. (35) of paper B and the filter's consistency."""

from __future__ import annotations

import math

from baselines.benchmark.metrics.base import metric
from baselines.benchmark.metrics.episode import rms
from baselines.benchmark.trace import Trace


def _errors(trace: Trace, axis: int) -> list[float]:
    return [step.errors[axis] for step in trace.steps() if step.errors is not None]


def _bias(errors: list[float]) -> float | None:
    return math.fsum(errors) / len(errors) if errors else None


@metric("angle_rmse_rad", "rad", root_mean_square=True)
def angle_rmse(trace: Trace) -> float | None:
    """RMS of the estimated bearing less the true one, eq. (35) of paper B."""
    return rms(_errors(trace, 0))


@metric("angle_bias_rad", "rad")
def angle_bias(trace: Trace) -> float | None:
    """Mean of the estimated bearing less the true one."""
    return _bias(_errors(trace, 0))


@metric("distance_rmse_m", "m", root_mean_square=True)
def distance_rmse(trace: Trace) -> float | None:
    """RMS of the estimated forward distance less the true one, eq. (35) of paper B."""
    return rms(_errors(trace, 1))


@metric("distance_bias_m", "m")
def distance_bias(trace: Trace) -> float | None:
    """Mean of the estimated forward distance less the true one."""
    return _bias(_errors(trace, 1))


def _nis_mean(trace: Trace, axis: int) -> float | None:
    """Mean of the innovations squared over their variance, where a filter compared a measurement with a prediction."""
    compared = trace.estimated & (trace.judged[:, axis] != "miss") & (trace.innovation[:, axis] != 0.0)
    values = trace.nis[compared, axis].tolist()
    return math.fsum(values) / len(values) if values and any(values) else None


@metric("angle_nis_mean")
def angle_nis_mean(trace: Trace) -> float | None:
    """Mean normalized innovation squared of the bearing; 1 for a consistent filter."""
    return _nis_mean(trace, 0)


@metric("distance_nis_mean")
def distance_nis_mean(trace: Trace) -> float | None:
    """Mean normalized innovation squared of the distance; 1 for a consistent filter."""
    return _nis_mean(trace, 1)
