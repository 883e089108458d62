"""Paper B's Kalman filter."""

from __future__ import annotations

import math

from tracker.estimators.base import ESTIMATORS, NoiseModel, Pair, checked_motion, positive_pair
from tracker.estimators.two_axis import Axis, TwoAxisFilter


class KalmanFilter(TwoAxisFilter):
    """Paper B's Kalman filter, eqs. (17)-(23) with lambda = 1.

    Eq. (22) is printed with x(k-1|k-1); the prediction x(k|k-1) is meant (the print diverges for small Q). In eq. (23)
    "P_ec" is the innovation covariance. The target's speed is not in the model: following at a constant v the distance
    settles at -(1-K)/K v dt beside the truth.

    Args:
        process_noise: Variances Q added per `predict`, (rad², m²). They belong to one dt and scale with its square.
        measurement_noise: Variances R, (rad², m²).
        initial_state: (bearing rad, distance m) at the start; by default the first measurement.
        initial_variance: P(0|0), (rad², m²); by default R, which is exact when the first measurement is the state.

    Raises:
        ValueError: If a variance is not positive and finite or the state is not finite.
    """

    __slots__ = ()

    def __init__(
        self,
        process_noise: Pair,
        measurement_noise: Pair,
        *,
        initial_state: Pair | None = None,
        initial_variance: Pair | None = None,
    ) -> None:
        q = positive_pair("process_noise", process_noise)
        r = positive_pair("measurement_noise", measurement_noise)
        p = r if initial_variance is None else positive_pair("initial_variance", initial_variance)
        super().__init__(Axis(q[0], r[0], p[0]), Axis(q[1], r[1], p[1]), initial_state)

    def predict(self, twist: Pair, dt: float) -> None:
        """Time update, eqs. (17)-(18): bearing -= omega dt, distance -= v dt, P += Q."""
        v, omega, dt = checked_motion(twist, dt)
        if self._started:
            self._bearing.predict(-omega, dt)
            self._bearing.value = math.remainder(self._bearing.value, math.tau)
            self._distance.predict(-v, dt)


@ESTIMATORS.register("kf")
def kf(noise: NoiseModel) -> KalmanFilter:
    """Return paper B's Kalman filter."""
    return KalmanFilter(noise.process, noise.measurement)
