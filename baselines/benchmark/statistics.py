"""Pooled errors of a cell, and what is known about them: percentile bootstrap intervals over whole episodes.

All cells of the same number of episodes are resampled with the same draws, so a difference between two cells that ran
the same seeds is a paired one. No result depends on the machine: sums are plain and in a fixed order.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache
from statistics import NormalDist

import numpy as np
from numpy.typing import NDArray

from baselines.benchmark.metrics.episode import Row

RESAMPLES = 10_000
CONFIDENCE = 0.95
NEGLIGIBLE = 1e-4
"""RMSE, rad or cm, below which an error is the rounding of a single-precision observation and nothing else."""
_GENERATOR_SEED = 20_180_901

Interval = tuple[float, float]


@dataclass(frozen=True, slots=True)
class Difference:
    """A paired quantity between two cells with its 95 % interval; None where one episode gives no interval."""

    value: float
    interval: Interval | None

    @property
    def negative(self) -> bool | None:
        """True when the whole interval lies below zero, False when none of it does, None when it does not decide."""
        if self.interval is None:
            return None
        low, high = self.interval
        return True if high < 0.0 else False if low >= 0.0 else None


@dataclass(frozen=True)
class PooledError:
    """The error of one quantity over all steps of all episodes of a cell.

    Attributes:
        steps: Scored steps of each episode, shape (episodes,).
        sums: Sum of the error over the steps of each episode, shape (episodes,).
        squares: Sum of the squared error over the steps of each episode, shape (episodes,).
    """

    steps: NDArray[np.float64]
    sums: NDArray[np.float64]
    squares: NDArray[np.float64]

    @classmethod
    def of(cls, rows: Sequence[Row], quantity: str) -> PooledError:
        """Collect the rows of a cell in the order of their seeds.

        Args:
            rows: The cell's episodes.
            quantity: ``angle`` (result in rad) or ``distance`` (result in cm).

        Raises:
            ValueError: If an episode never had an estimate.
        """
        unit, scale = {"angle": ("rad", 1.0), "distance": ("m", 100.0)}[quantity]
        steps, sums, squares = [], [], []
        for row in rows:
            rmse, bias, count = row[f"{quantity}_rmse_{unit}"], row[f"{quantity}_bias_{unit}"], row["estimate_steps"]
            if not (isinstance(rmse, float) and isinstance(bias, float) and isinstance(count, int)):
                raise ValueError(
                    f"The episode {_name(row)} never had an estimate, but a pooled error needs one in each episode."
                )
            steps.append(float(count))
            sums.append(count * (scale * bias))
            squares.append(count * (scale * rmse) * (scale * rmse))
        return cls(np.array(steps), np.array(sums), np.array(squares))

    @property
    def episodes(self) -> int:
        """Number of episodes."""
        return len(self.steps)

    @property
    def rmse(self) -> float:
        """Root mean square error, eq. (35) of paper B."""
        return math.sqrt(math.fsum(self.squares) / math.fsum(self.steps))

    @property
    def bias(self) -> float:
        """Mean error, estimate minus truth."""
        return math.fsum(self.sums) / math.fsum(self.steps)

    @property
    def spread(self) -> float:
        """Standard deviation about the bias: rmse² = bias² + spread²."""
        return math.sqrt(max(0.0, self.rmse**2 - self.bias**2))

    @property
    def negligible(self) -> bool:
        """Whether there is no error but rounding: nothing can be compared with it."""
        return self.rmse < NEGLIGIBLE

    @property
    def interval(self) -> Interval | None:
        """95 % interval of the RMSE."""
        return None if self.episodes < 2 else _interval(self._resampled_rmse)

    def minus(self, other: PooledError) -> Difference:
        """Paired difference of the RMSEs, this minus the other, over the same seeds."""
        self._require_pairs(other)
        paired = self.episodes >= 2
        return Difference(
            self.rmse - other.rmse,
            _interval(self._resampled_rmse - other._resampled_rmse) if paired else None,
        )

    def ratio_to(self, other: PooledError) -> Difference | None:
        """Paired ratio of the RMSEs, this over the other; None when the other's error is negligible."""
        self._require_pairs(other)
        if other.negligible:
            return None
        paired = self.episodes >= 2
        return Difference(
            self.rmse / other.rmse,
            _interval(self._resampled_rmse / other._resampled_rmse) if paired else None,
        )

    @cached_property
    def _resampled_rmse(self) -> NDArray[np.float64]:
        """RMSE of each resample, shape (RESAMPLES,)."""
        steps = np.zeros(RESAMPLES)
        squares = np.zeros(RESAMPLES)
        for picks in _draws(self.episodes):
            steps += self.steps[picks]
            squares += self.squares[picks]
        return np.sqrt(squares / steps)

    def _require_pairs(self, other: PooledError) -> None:
        if self.episodes != other.episodes:
            raise ValueError(
                f"Cells of {self.episodes} and {other.episodes} episodes cannot be paired: compare the same seeds."
            )


@dataclass(frozen=True)
class Score:
    """A score of one policy or of an algorithm trained from several seeds.

    Attributes:
        value: Of one training the plain score, of several the interquartile mean over them.
        resamples: The same of each resample, shape (RESAMPLES,): episodes are resampled, and so are the trainings.
        episodes: Number of episodes of each training.
    """

    value: float
    resamples: NDArray[np.float64]
    episodes: int

    @classmethod
    def of(cls, trainings: Sequence[Sequence[Row]], column: str, root_mean_square: bool) -> Score:
        """Collect a column: its mean over episodes, or its RMS over their steps.

        Args:
            trainings: Rows of each training in the order of their seeds, the same seeds in each.
            column: Of ``metrics.COLUMNS``, with a number in each row.
            root_mean_square: Whether the column is an RMS over steps, pooled as one; otherwise the mean is taken.

        Raises:
            ValueError: If an episode has no such number.
        """
        missing = [_name(row) for rows in trainings for row in rows if not isinstance(row[column], (int, float))]
        if missing:
            raise ValueError(f"The episode {missing[0]} has no {column}, but the table needs it of each episode.")
        values = np.array([[float(str(row[column])) for row in rows] for rows in trainings])
        weights = np.array([[float(str(row["steps"])) for row in rows] for rows in trainings])
        if not root_mean_square:
            weights = np.ones_like(weights)
        sums = weights * (values * values if root_mean_square else values)
        count = len(trainings)
        totals, steps = np.zeros((count, RESAMPLES)), np.zeros((count, RESAMPLES))
        for picks in _draws(values.shape[1]):
            totals += sums[:, picks]
            steps += weights[:, picks]
        means, resampled = sums.sum(axis=1) / weights.sum(axis=1), totals / steps
        if root_mean_square:
            means, resampled = np.sqrt(means), np.sqrt(resampled)
        chosen = np.random.default_rng((_GENERATOR_SEED, 1)).integers(0, count, size=(count, RESAMPLES))
        return cls(
            float(interquartile_mean(means[:, None])[0]),
            interquartile_mean(np.take_along_axis(resampled, chosen, axis=0)),
            values.shape[1],
        )

    @property
    def interval(self) -> Interval | None:
        """95 % interval; None where one episode gives none."""
        return _interval(self.resamples) if self.episodes >= 2 else None

    def minus(self, other: Score) -> Difference:
        """Paired difference over the same episodes."""
        if self.episodes != other.episodes:
            raise ValueError(
                f"Scores of {self.episodes} and {other.episodes} episodes cannot be paired: compare the same seeds."
            )
        paired = self.interval is not None
        return Difference(self.value - other.value, _interval(self.resamples - other.resamples) if paired else None)


def interquartile_mean(values: NDArray[np.float64]) -> NDArray[np.float64]:
    """Mean along the first axis without the lowest and the highest quarter (rounded down) of its entries."""
    cut = len(values) // 4
    kept = np.sort(values, axis=0)[cut : len(values) - cut]
    total: NDArray[np.float64] = kept.sum(axis=0)
    return total / len(kept)


def weighted_share(rows: Sequence[Row], column: str, weights: Sequence[float] | None = None) -> float | None:
    """Mean of a share over episodes, weighted by their scored steps or by one weight per row.

    Returns:
        The mean, or None when the column applies to no episode.
    """
    pairs = []
    for position, row in enumerate(rows):
        value = row[column]
        weight = row["estimate_steps"] if weights is None else weights[position]
        if isinstance(value, (int, float)) and isinstance(weight, (int, float)):
            pairs.append((float(value), float(weight)))
    total = math.fsum(weight for _, weight in pairs)
    return math.fsum(value * weight for value, weight in pairs) / total if total > 0.0 else None


def share_interval(count: int, total: int) -> Interval:
    """95 % interval of the share of `count` in `total` episodes (Wilson 1927), within [0, 1]."""
    z = NormalDist().inv_cdf(0.5 + 0.5 * CONFIDENCE)
    share, shrunk = count / total, 1.0 + z * z / total
    middle = (share + 0.5 * z * z / total) / shrunk
    half = z * math.sqrt(share * (1.0 - share) / total + (0.5 * z / total) ** 2) / shrunk
    return max(middle - half, 0.0), min(middle + half, 1.0)


@lru_cache(maxsize=4)
def _draws(episodes: int) -> NDArray[np.int64]:
    """Positions of the episodes in each resample, shape (episodes, RESAMPLES); always the same for the same number."""
    generator = np.random.default_rng(_GENERATOR_SEED)
    draws = generator.integers(0, episodes, size=(episodes, RESAMPLES))
    draws.flags.writeable = False
    return draws


def _interval(values: NDArray[np.float64]) -> Interval:
    tail = (1.0 - CONFIDENCE) / 2.0
    low, high = np.quantile(values, [tail, 1.0 - tail])
    return float(low), float(high)


def _name(row: Row) -> str:
    return f"{row['perception']}/{row['scene']}/{row['estimator']} with seed {row['seed']}"
