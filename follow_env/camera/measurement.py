"""What a tracker would report, without rendering: the `emulated` rung of the benchmark.

Regular errors are first-order Gauss-Markov processes around a bias. Outliers of the distance come in runs: at renewals
(geometric times) the state is drawn anew, an outlier with probability `outlier_share`, its size once a run. Every step
draws the same count of random numbers, whatever happens in the world, so that two controllers with one seed meet the
same errors.
"""

import math

import numpy as np

from follow_env.config import MeasurementConfig


class GaussMarkov:
    """Stationary first-order Gauss-Markov errors with time constant tau (s) and unit variance; tau = 0 is white.

    Args:
        size: number of independent processes.
        tau: time constant, s.
        dt: step, s.
    """

    def __init__(self, size: int, tau: float, dt: float) -> None:
        self._keep = math.exp(-dt / tau) if tau > 0.0 else 0.0
        self._fresh = math.sqrt(1.0 - self._keep * self._keep)
        self._values = [0.0] * size
        self._started = False

    def step(self, rng: np.random.Generator) -> list[float]:
        """Return the next values (a list of `size` floats)."""
        draws: list[float] = rng.standard_normal(len(self._values)).tolist()
        if self._started:
            draws = [self._keep * v + self._fresh * d for v, d in zip(self._values, draws, strict=True)]
        self._values, self._started = draws, True
        return draws


class MeasurementModel:
    """Turns the true bearing (rad) and distance (m) into an emulated measurement.

    Args:
        config: the error model.
        dt: control period, s.
    """

    def __init__(self, config: MeasurementConfig, dt: float) -> None:
        self._config = config
        self._bearing_error = GaussMarkov(1, config.bearing_correlation_s, dt)
        self._distance_error = GaussMarkov(1, config.distance_correlation_s, dt)
        run = config.outlier_duration_s * (1.0 - config.outlier_share)
        self._renew = dt / run if run > dt else 1.0
        self._outlier = 0.0
        self._started = False

    def measure(
        self, bearing: float, distance: float, visible: bool, rng: np.random.Generator
    ) -> tuple[float, float] | None:
        """Return (bearing, distance) as measured, or None (person not visible, or missed)."""
        config = self._config
        (bearing_error,) = self._bearing_error.step(rng)
        (distance_error,) = self._distance_error.step(rng)
        renew, kind, size, miss = rng.random(4).tolist()
        if renew < self._renew or not self._started:
            span = config.outlier_high - config.outlier_low
            self._outlier = config.outlier_low + span * size if kind < config.outlier_share else 0.0
            self._started = True
        if not visible or miss < config.miss_share:
            return None
        measured = distance + config.distance_bias + config.distance_noise * distance_error + self._outlier
        return (
            bearing + config.bearing_bias + config.bearing_noise * bearing_error,
            max(measured, 0.0),
        )
