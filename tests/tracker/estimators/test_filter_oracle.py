"""The scalar filters against filterpy's matrix Kalman filter, an independent implementation.

The matrices are written from paper B's equations, the adaptive factor from filterpy's own innovation covariance.
"""

import math

import numpy as np
import pytest
from filterpy import kalman
from filterpy.common import Q_continuous_white_noise
from scipy import stats
from scipy.linalg import block_diag

from tracker.estimators import AdaptiveKalmanFilter, AugmentedKalmanFilter, KalmanFilter

Q = (2.0e-4, 8.0e-4)
R = (3.0e-4, 2.0e-2)
DENSITY = (0.4, 0.7)
RATE_VARIANCE = (0.5, 0.9)
SEEDS = range(5)


def scenario(seed, steps=300):
    """Yield (twist, dt, measurement or None): a wandering target, uneven steps, outliers, and misses in runs."""
    rng = np.random.default_rng(seed)
    bearing, distance, missing = 0.1, 1.8, 0
    for _ in range(steps):
        dt = float(rng.uniform(0.02, 0.05))
        twist = (float(rng.normal(0.0, 0.8)), float(rng.normal(0.0, 0.5)))
        bearing = 0.98 * bearing - twist[1] * dt + float(rng.normal(0.0, 0.01))
        distance += 0.02 * (1.8 - distance) - twist[0] * dt + float(rng.normal(0.0, 0.02))
        missing = missing - 1 if missing > 0 else int(rng.random() < 0.05) * int(rng.integers(1, 8))
        outlier = rng.random(2) < 0.1
        measurement = (
            bearing + float(rng.normal(0.0, math.sqrt(R[0])) + outlier[0] * rng.normal(0.0, 0.3)),
            distance + float(rng.normal(0.0, math.sqrt(R[1])) + outlier[1] * rng.uniform(1.0, 3.0)),
        )
        yield twist, dt, None if missing else measurement


def adaptive_noise(oracle, z, alpha):
    """Return diag(lambda_i R_ii) by eqs. (3), (4), (15), (16), (20), literally."""
    chi2 = stats.chi2.isf(alpha, df=1)
    innovation = z - oracle.H @ oracle.x
    spread = np.diag(oracle.H @ oracle.P @ oracle.H.T + oracle.R)
    noise = np.diag(oracle.R)
    factor = np.where(innovation**2 / spread > chi2, (innovation**2 / chi2 - spread + noise) / noise, 1.0)
    return factor, np.diag(factor * noise)


def compare(estimator, oracle, predict_oracle, alpha, seed):
    """Run both filters over a scenario and require equal states, variances and diagnostics."""
    updates = inflated = misses = 0
    for twist, dt, measurement in scenario(seed):
        estimator.predict(twist, dt)
        estimate = estimator.update(measurement)
        if updates:
            predict_oracle(twist, dt)
        if measurement is None:
            misses += 1
            oracle.update(None)
        else:
            z = np.array(measurement)
            if updates == 0:
                oracle.x = oracle.H.T @ z
            else:
                factor, noise = adaptive_noise(oracle, z, alpha) if alpha else (np.ones(2), oracle.R)
                spread = np.diag(oracle.H @ oracle.P @ oracle.H.T + oracle.R)
                oracle.update(z, R=noise)
                assert estimate.innovation == pytest.approx(oracle.y, abs=1e-9)
                assert estimate.nis == pytest.approx(oracle.y**2 / spread, rel=1e-6, abs=1e-9)
                assert estimate.inflation == pytest.approx(factor, rel=1e-6)
                inflated += int(np.count_nonzero(factor > 1.0))
            updates += 1
        if updates:
            assert (estimate.bearing, estimate.distance) == pytest.approx(oracle.H @ oracle.x, abs=1e-9)
            assert estimate.variance == pytest.approx(np.diag(oracle.H @ oracle.P @ oracle.H.T), abs=1e-9)
    assert updates > 150
    assert misses > 10
    assert (inflated > 20) == (alpha is not None)


def two_state_oracle():
    oracle = kalman.KalmanFilter(dim_x=2, dim_z=2, dim_u=2)
    oracle.x, oracle.P, oracle.Q = np.zeros(2), np.diag(R), np.diag(Q)
    oracle.F, oracle.H, oracle.R = np.eye(2), np.eye(2), np.diag(R)

    def predict(twist, dt):
        v, omega = twist
        oracle.predict(u=np.array([omega, v]), B=-dt * np.eye(2))

    return oracle, predict


def augmented_oracle():
    """State [bearing, its target-caused rate, distance, the target's forward speed]."""
    oracle = kalman.KalmanFilter(dim_x=4, dim_z=2, dim_u=2)
    oracle.x = np.zeros(4)
    oracle.P = np.diag([R[0], RATE_VARIANCE[0], R[1], RATE_VARIANCE[1]])
    oracle.H, oracle.R = np.array([[1.0, 0, 0, 0], [0, 0, 1.0, 0]]), np.diag(R)

    def predict(twist, dt):
        v, omega = twist
        lateral = oracle.x[2] * np.tan(oracle.x[0])
        step = np.array([[1.0, dt], [0.0, 1.0]])
        oracle.predict(
            u=np.array([-omega, -v + omega * lateral]),
            B=dt * oracle.H.T,
            F=block_diag(step, step),
            Q=block_diag(*(Q_continuous_white_noise(2, dt, spectral_density=q) for q in DENSITY)),
        )

    return oracle, predict


@pytest.mark.parametrize("seed", SEEDS)
def test_kalman_filter(seed):
    compare(KalmanFilter(Q, R), *two_state_oracle(), None, seed)


@pytest.mark.parametrize("alpha", [0.01, 0.05])
@pytest.mark.parametrize("seed", SEEDS)
def test_adaptive_kalman_filter(seed, alpha):
    compare(AdaptiveKalmanFilter(Q, R, alpha), *two_state_oracle(), alpha, seed)


@pytest.mark.parametrize("alpha", [None, 0.05])
@pytest.mark.parametrize("seed", SEEDS)
def test_augmented_kalman_filter(seed, alpha):
    ours = AugmentedKalmanFilter(DENSITY, R, alpha, initial_rate_variance=RATE_VARIANCE)
    compare(ours, *augmented_oracle(), alpha, seed)
