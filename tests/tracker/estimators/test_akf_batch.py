"""The filter over a batch against the filter of one robot."""

import numpy as np

from tracker.estimators import AdaptiveKalmanFilter
from tracker.estimators.akf_batch import BatchFilter
from tracker.estimators.base import NoiseModel

NOISE = NoiseModel((0.04, 0.01), (0.05, 0.02), (0.1, 0.1))
DT = 1.0 / 30.0


def observations(rng: np.random.Generator, worlds: int) -> np.ndarray:
    """Measurements with misses and outliers, as the environments give them."""
    seen = rng.random(worlds) > 0.2
    values = np.zeros((worlds, 8), np.float32)
    values[:, 0] = rng.normal(0.0, 0.2, worlds) * seen
    values[:, 1] = (1.5 + rng.normal(0.0, 0.1, worlds) + 2.0 * (rng.random(worlds) < 0.1)) * seen
    values[:, 2] = seen
    values[:, 3:] = rng.normal(0.0, 0.5, (worlds, 5))
    return values


def test_each_world_has_the_filter_of_one_robot() -> None:
    rng = np.random.default_rng(0)
    worlds = 7
    batch = BatchFilter(worlds, NOISE, DT)
    single = [AdaptiveKalmanFilter(NOISE.process, NOISE.measurement) for _ in range(worlds)]

    def expected(i: int, observation: np.ndarray) -> np.ndarray:
        bearing, distance, valid, _, v, omega, _, _ = observation.tolist()
        single[i].predict((v, omega), DT)
        estimate = single[i].update((bearing, distance) if valid else None)
        result = observation.copy()
        result[:3] = (estimate.bearing, estimate.distance, 1.0) if estimate else 0.0
        return result

    for _ in range(200):
        ended = np.flatnonzero(rng.random(worlds) < 0.05)
        last = observations(rng, len(ended)) if len(ended) else None
        fresh = observations(rng, worlds)
        wanted_last = [expected(int(i), last[k]) for k, i in enumerate(ended)] if last is not None else []
        for i in ended:
            single[i] = AdaptiveKalmanFilter(NOISE.process, NOISE.measurement)
        wanted = np.stack([expected(i, fresh[i]) for i in range(worlds)])
        estimates, last_estimates = batch.step(fresh, ended, last)
        np.testing.assert_array_equal(estimates, wanted)
        if last is not None:
            np.testing.assert_array_equal(last_estimates, np.stack(wanted_last))
