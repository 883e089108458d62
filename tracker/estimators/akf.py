"""Paper B's adaptive Kalman filter: the reference."""

from __future__ import annotations

from tracker.estimators.base import ESTIMATORS, NoiseModel, Pair
from tracker.estimators.kf import KalmanFilter
from tracker.estimators.two_axis import chi2_quantile


class AdaptiveKalmanFilter(KalmanFilter):
    """Paper B's adaptive Kalman filter: a measurement that fails a chi-square test gets a larger R, eqs. (15)-(16).

    Each axis is tested on its own with one degree of freedom. When D_i = e_i²/P_ii,ee exceeds chi2, R_ii is multiplied,
    for this step, by the lambda_i that makes D_i equal to chi2; equivalently P_ii,ee becomes max(P_ii,ee, e_i²/chi2).
    The correction of an inflated axis is P⁻ chi2 / e: the larger the outlier, the smaller its effect.

    Too small a process noise locks the filter out (`LockOutWarning`). Where the first measurement may be an outlier,
    give a large `initial_variance`. The other arguments and the errors are those of `KalmanFilter`.

    Args:
        alpha: Significance level of the test, in (0, 1). The paper gives none; 0.05 means chi2 = 3.841.
    """

    __slots__ = ()

    def __init__(
        self,
        process_noise: Pair,
        measurement_noise: Pair,
        alpha: float = 0.05,
        *,
        initial_state: Pair | None = None,
        initial_variance: Pair | None = None,
    ) -> None:
        super().__init__(
            process_noise, measurement_noise, initial_state=initial_state, initial_variance=initial_variance
        )
        self._bearing.chi2 = self._distance.chi2 = chi2_quantile(alpha)


@ESTIMATORS.register("akf")
def akf(noise: NoiseModel, alpha: float = 0.05) -> AdaptiveKalmanFilter:
    """Return paper B's adaptive filter with a significance of its test."""
    return AdaptiveKalmanFilter(noise.process, noise.measurement, alpha)
