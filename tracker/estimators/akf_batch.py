"""`BatchFilter`: paper B's adaptive Kalman filter over a batch of worlds, in arrays."""

from __future__ import annotations

import math

import numpy as np

from tracker.estimators import chi2_quantile
from tracker.estimators.base import NoiseModel


class BatchFilter:
    """Turns `measurement` observations (n, 8) into estimates of the same layout.

    Bearing and distance become the filter's, validity says whether there is an estimate yet; the rest stays. The
    arithmetic is that of `tracker.estimators.AdaptiveKalmanFilter` (eqs. (15)-(23)), all worlds at once.

    Args:
        worlds: how many.
        noise: Q and R.
        dt: control period, s.
        alpha: significance of the outlier test.
    """

    def __init__(self, worlds: int, noise: NoiseModel, dt: float, alpha: float = 0.05) -> None:
        self._q, self._r = np.array(noise.process), np.array(noise.measurement)
        self._dt, self._chi2 = dt, chi2_quantile(alpha)
        self._mean, self._variance = np.zeros((worlds, 2)), np.zeros((worlds, 2))
        self._started = np.zeros(worlds, bool)

    def __call__(self, observations: np.ndarray) -> np.ndarray:
        """Return the estimates (n, 8) float32 after these observations (n, 8)."""
        return self._update(observations, np.arange(len(self._started)))

    def step(
        self, observations: np.ndarray, ended: np.ndarray, last: np.ndarray | None
    ) -> tuple[np.ndarray, np.ndarray | None]:
        """Return (estimates, last estimates) of a step in which some worlds ended and began anew.

        Args:
            observations: (n, 8), of the next episode in the worlds that ended.
            ended: (k,) indices of those worlds.
            last: (k, 8) their last observations, None when k is 0.
        """
        if last is not None:
            last = self._update(last, ended)
            self._started[ended] = False
        return self(observations), last

    def forget(self) -> None:
        """Wait for the first measurement in every world."""
        self._started[:] = False

    def _update(self, observations: np.ndarray, worlds: np.ndarray) -> np.ndarray:
        values = observations.astype(np.float64)
        mean, variance, started = self._mean[worlds], self._variance[worlds], self._started[worlds]
        mean = _wrapped(np.stack((mean[:, 0] - values[:, 5] * self._dt, mean[:, 1] - values[:, 4] * self._dt), axis=1))
        variance = variance + self._q
        innovation = _wrapped(values[:, :2] - mean)
        squared = innovation * innovation
        expected = np.maximum(variance + self._r, squared / self._chi2)
        gain = variance / expected
        measured = values[:, 2] > 0.0
        corrected = (measured & started)[:, None]
        first = (measured & ~started)[:, None]
        mean = np.where(first, values[:, :2], np.where(corrected, _wrapped(mean + gain * innovation), mean))
        variance = np.where(first, self._r, np.where(corrected, (1.0 - gain) * variance, variance))
        self._mean[worlds], self._variance[worlds] = mean, variance
        self._started[worlds] = started = started | measured
        result = observations.copy()
        result[:, :2] = np.where(started[:, None], mean, 0.0)
        result[:, 2] = started
        return result


def _wrapped(pairs: np.ndarray) -> np.ndarray:
    """Return (bearing, distance) pairs (n, 2) with the bearing in [-pi, pi]."""
    pairs[:, 0] -= math.tau * np.rint(pairs[:, 0] / math.tau)
    return pairs
