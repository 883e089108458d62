"""`METRICS`: functions of a trace. A metric that is added later needs no replay of what was kept."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Any

from baselines.benchmark.metrics.episode import Row
from baselines.benchmark.trace import Trace
from follow_env.registry import Registry


@dataclass(frozen=True)
class Metric:
    """One number of an episode.

    Attributes:
        function: of a trace; None where the episode has no such number.
        unit: SI, empty for a share or a count.
        root_mean_square: whether it is an RMS over steps, and is pooled over episodes as one.
        doc: what it is, one sentence.
    """

    function: Callable[[Trace], float | int | str | None]
    unit: str = ""
    root_mean_square: bool = False
    doc: str = ""


METRICS: Registry[Metric] = Registry("metric", "baselines.benchmark.metrics")
"""Metrics by the name of their column."""


def metric(name: str, unit: str = "", root_mean_square: bool = False) -> Callable[[Any], Any]:
    """Return a decorator that registers a function of a trace; its docstring says what it is."""

    def add(function: Callable[[Trace], Any]) -> Callable[[Trace], Any]:
        doc = (function.__doc__ or "").strip().partition("\n")[0]
        METRICS.register(name)(Metric(function, unit, root_mean_square, doc))
        return function

    return add


def find_metric(name: str) -> Metric:
    """Return a metric by its name, or a function of a trace by `"module:object"`."""
    found: Any = METRICS.get(name)
    return found if isinstance(found, Metric) else Metric(found, doc=(found.__doc__ or "").strip().partition("\n")[0])


def measured(trace: Trace, names: Iterable[str]) -> Row:
    """Return the numbers of an episode by column, `seed` and `steps` first."""
    row: Row = {"seed": trace.seed, "steps": len(trace)}
    for name in names:
        row[name] = find_metric(name).function(trace)
    return row
