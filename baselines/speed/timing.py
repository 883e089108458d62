"""What a call costs: single calls of several operations in turn, so that all of them meet the same disturbances."""

from __future__ import annotations

import statistics
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass

BLOCK = 10
"""Calls of one operation in a row, after one that only warms the caches."""


@dataclass(frozen=True)
class Cost:
    """Cost of a call in s.

    Attributes:
        median, fastest, mean: By the clock on the wall.
        cpu_median, cpu_fastest: Time of the processor, all threads of this process together: other programs on the
            machine lengthen it less.
    """

    median: float
    fastest: float
    mean: float
    cpu_median: float
    cpu_fastest: float


def measure(operations: Mapping[str, Callable[[], object]], count: int) -> dict[str, Cost]:
    """Time `count` single calls of each operation after a warm-up.

    Args:
        operations: What to call, by name.
        count: Calls of each, 1 or more.

    Returns:
        The costs by the same names.
    """
    for operation in operations.values():
        for _ in range(min(count, BLOCK)):
            operation()
    samples: dict[str, list[tuple[float, float]]] = {name: [] for name in operations}
    for first in range(0, count, BLOCK):
        for name, operation in operations.items():
            operation()
            samples[name] += [_once(operation) for _ in range(min(BLOCK, count - first))]
    return {name: _cost(taken) for name, taken in samples.items()}


def _once(operation: Callable[[], object]) -> tuple[float, float]:
    wall, cpu = time.perf_counter(), time.process_time()
    operation()
    cpu = time.process_time() - cpu
    return time.perf_counter() - wall, cpu


def _cost(samples: list[tuple[float, float]]) -> Cost:
    walls, cpus = zip(*samples, strict=True)
    return Cost(statistics.median(walls), min(walls), statistics.fmean(walls), statistics.median(cpus), min(cpus))
