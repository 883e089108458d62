# mypy: disable-error-code="no-untyped-def"
"""`BatchFilter`: paper B's adaptive Kalman filter over a batch of worlds, compiled."""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path

import numpy as np
from numba import njit

from follow_env.compilation import compilable, digest
from tracker.estimators.base import NoiseModel
from tracker.estimators.two_axis import chi2_quantile, corrected, innovation_test


class BatchFilter:
    """Turns `measurement` observations (n, 8) into estimates of the same layout.

    Bearing and distance become the filter's, validity says whether there is an estimate yet; the rest stays. The
    arithmetic is that of `tracker.estimators.AdaptiveKalmanFilter` (eqs. (15)-(23)), to the bit.

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
        result = observations.copy()
        noise = self._q, self._r, self._chi2
        update(result, worlds, self._mean, self._variance, self._started, self._dt, *noise)
        return result


def _compiled(sources: int) -> Callable[..., None]:
    @njit(cache=True, error_model="numpy")
    def update(observations, worlds, means, variances, started, dt, q, r, chi2):
        """Replace the measurements (n, 8) of these worlds (n,) by their filters' estimates."""
        key = sources  # noqa: F841  captured, hence part of the cache key
        for k, i in enumerate(worlds):
            seen = observations[k]
            mean, variance = means[i], variances[i]
            measured = float(seen[0]), float(seen[1])
            if started[i]:
                for axis, rate in enumerate((-float(seen[5]), -float(seen[4]))):
                    mean[axis] += rate * dt
                    variance[axis] += q[axis]
                mean[0] = wrapped(mean[0])
                if seen[2] > 0.0:
                    for axis, innovation in enumerate((wrapped(measured[0] - mean[0]), measured[1] - mean[1])):
                        _, _, expected = innovation_test(innovation, variance[axis], r[axis], chi2)
                        mean[axis], variance[axis] = corrected(mean[axis], variance[axis], innovation, expected)
                    mean[0] = wrapped(mean[0])
            elif seen[2] > 0.0:
                started[i] = True
                mean[0], mean[1] = measured
                variance[:] = r
            known = started[i]
            seen[0], seen[1] = (mean[0], mean[1]) if known else (0.0, 0.0)
            seen[2] = 1.0 if known else 0.0

    return update


@njit(error_model="numpy")
def wrapped(angle):
    """Return the angle in [-pi, pi]: `math.remainder(angle, tau)`, which within three half turns is exact as well."""
    return angle - math.tau * np.rint(angle / math.tau)


compilable(corrected, innovation_test)
update = _compiled(digest([Path(__file__).with_name("two_axis.py")]))
