"""What a tracker would report, without rendering: the `emulated` rung of the benchmark.

Regular errors are first-order Gauss-Markov processes around a bias. Outliers of the distance come in runs: at renewals
(geometric times) the state is drawn anew, an outlier with probability `outlier_share`, its size once a run. Every step
draws the same count of random numbers, whatever happens in the world, so that two controllers with one seed meet the
same errors.
"""

import math
from typing import Any, NamedTuple

import numpy as np

from follow_env.sensors import MeasurementConfig


class ErrorModel(NamedTuple):
    """The errors of one control rate as the functions below want them.

    Attributes:
        bearing_bias, distance_bias: constant errors, rad and m.
        bearing_noise, distance_noise: standard deviations of the regular errors, rad and m.
        bearing_keep, distance_keep: share of a regular error that stays after a step.
        bearing_fresh, distance_fresh: share of the new draw in it.
        renew: probability that the outlier state is drawn anew in a step.
        outlier_share, outlier_low, outlier_high, miss_share: see `MeasurementConfig`.
    """

    bearing_bias: float
    bearing_noise: float
    bearing_keep: float
    bearing_fresh: float
    distance_bias: float
    distance_noise: float
    distance_keep: float
    distance_fresh: float
    renew: float
    outlier_share: float
    outlier_low: float
    outlier_high: float
    miss_share: float

    @classmethod
    def of(cls, config: MeasurementConfig, dt: float) -> "ErrorModel":
        """Return the errors of `config` at a control period of dt, s."""
        run = config.outlier_duration_s * (1.0 - config.outlier_share)
        return cls(
            config.bearing_bias,
            config.bearing_noise,
            *kept_and_fresh(config.bearing_correlation_s, dt),
            config.distance_bias,
            config.distance_noise,
            *kept_and_fresh(config.distance_correlation_s, dt),
            dt / run if run > dt else 1.0,
            config.outlier_share,
            config.outlier_low,
            config.outlier_high,
            config.miss_share,
        )


def kept_and_fresh(tau: float, dt: float) -> tuple[float, float]:
    """Return the weights of the last value and of a new draw of unit variance in a first-order Gauss-Markov process.

    Args:
        tau: time constant, s; 0 is white.
        dt: step, s.
    """
    keep = math.exp(-dt / tau) if tau > 0.0 else 0.0
    return keep, math.sqrt(1.0 - keep * keep)


def gauss_markov(last: float, draw: float, keep: float, fresh: float, first: bool) -> float:
    """Return the next value of a stationary first-order Gauss-Markov process of unit variance."""
    return draw if first else keep * last + fresh * draw


def next_errors(
    model: Any, last: tuple[float, float, float], draws: tuple[float, float, float, float, float], first: bool
) -> tuple[float, float, float]:
    """Return the errors of a step: bearing and distance in standard deviations, and the outlier in m.

    Args:
        model: `ErrorModel`, or a record of the same names.
        last: errors of the step before.
        draws: two standard normal numbers; three uniform in [0, 1): renewal, kind and size of the outlier.
        first: whether the episode begins.
    """
    z_bearing, z_distance, renew, kind, size = draws
    outlier = last[2]
    if renew < model.renew or first:
        span = model.outlier_high - model.outlier_low
        outlier = model.outlier_low + span * size if kind < model.outlier_share else 0.0
    return (
        gauss_markov(last[0], z_bearing, model.bearing_keep, model.bearing_fresh, first),
        gauss_markov(last[1], z_distance, model.distance_keep, model.distance_fresh, first),
        outlier,
    )


def measured(model: Any, bearing: float, distance: float, errors: tuple[float, float, float]) -> tuple[float, float]:
    """Return true bearing (rad) and distance (m) with their errors."""
    with_noise = distance + model.distance_bias + model.distance_noise * errors[1]
    return bearing + model.bearing_bias + model.bearing_noise * errors[0], max(with_noise + errors[2], 0.0)


class GaussMarkov:
    """Stationary first-order Gauss-Markov errors with time constant tau (s) and unit variance; tau = 0 is white.

    Args:
        size: number of independent processes.
        tau: time constant, s.
        dt: step, s.
    """

    def __init__(self, size: int, tau: float, dt: float) -> None:
        self._keep, self._fresh = kept_and_fresh(tau, dt)
        self._values = [0.0] * size
        self._first = True

    def step(self, rng: np.random.Generator) -> list[float]:
        """Return the next values (a list of `size` floats)."""
        draws: list[float] = rng.standard_normal(len(self._values)).tolist()
        keep, fresh, first = self._keep, self._fresh, self._first
        self._values = [gauss_markov(v, d, keep, fresh, first) for v, d in zip(self._values, draws, strict=True)]
        self._first = False
        return self._values


class MeasurementModel:
    """Turns the true bearing (rad) and distance (m) into an emulated measurement.

    Args:
        config: the error model.
        dt: control period, s.
    """

    def __init__(self, config: MeasurementConfig, dt: float) -> None:
        self._model = ErrorModel.of(config, dt)
        self._errors = (0.0, 0.0, 0.0)
        self._first = True

    def measure(
        self, bearing: float, distance: float, visible: bool, rng: np.random.Generator
    ) -> tuple[float, float] | None:
        """Return (bearing, distance) as measured, or None (person not visible, or missed)."""
        z_bearing, z_distance = rng.standard_normal(2).tolist()
        renew, kind, size, miss = rng.random(4).tolist()
        draws = z_bearing, z_distance, renew, kind, size
        self._errors = next_errors(self._model, self._errors, draws, self._first)
        self._first = False
        if not visible or miss < self._model.miss_share:
            return None
        return measured(self._model, bearing, distance, self._errors)
