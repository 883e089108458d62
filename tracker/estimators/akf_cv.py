"""The adaptive filter with the target's motion in its state: what the paper's model lacks."""

from __future__ import annotations

import math

from tracker.estimators.base import ESTIMATORS, NoiseModel, Pair, checked_motion, positive_pair
from tracker.estimators.two_axis import Axis, TwoAxisFilter, chi2_quantile

_COUPLED_BEARING = math.radians(60.0)


class AugmentedKalmanFilter(TwoAxisFilter):
    """The adaptive filter with the target's motion in the state: [value, rate] per axis (not in the paper).

    The rate is what the robot's own twist does not explain: for the distance the target's forward speed, for the
    bearing what the target's motion and the robot's translation cause together. It is a random walk (white-noise
    acceleration), so a steady walk leaves no bias. The forward distance also changes because the robot turns,
    d' = v_target - v + omega y: the lateral offset y = d tan(bearing) of the last estimate enters as a known input.
    Beyond 60 deg, outside any field of view used here, that term is left out: it grows without bound towards 90 deg,
    and leaving it out on both sides gives the distance back after a full turn. The other arguments and the errors are
    those of `KalmanFilter`.

    Args:
        acceleration_density: Spectral densities q of the white acceleration, (rad²/s³, m²/s³); over dt it adds
            q [[dt³/3, dt²/2], [dt²/2, dt]]. Rate changes of rms a lasting tau each amount to about q = a² tau.
        alpha: As in `AdaptiveKalmanFilter`; None switches the test off.
        initial_rate_variance: Variances of the rates at the start, where the rates are 0, (rad²/s², m²/s²); the default
            is about the square of the largest rates on paper B's routes, 0.77 rad/s and 0.86 m/s.
    """

    __slots__ = ()
    _bearing: RateAxis
    _distance: RateAxis

    def __init__(
        self,
        acceleration_density: Pair,
        measurement_noise: Pair,
        alpha: float | None = 0.05,
        *,
        initial_state: Pair | None = None,
        initial_variance: Pair | None = None,
        initial_rate_variance: Pair = (0.6, 0.75),
    ) -> None:
        q = positive_pair("acceleration_density", acceleration_density)
        r = positive_pair("measurement_noise", measurement_noise)
        p = r if initial_variance is None else positive_pair("initial_variance", initial_variance)
        s = positive_pair("initial_rate_variance", initial_rate_variance)
        super().__init__(RateAxis(q[0], r[0], p[0], s[0]), RateAxis(q[1], r[1], p[1], s[1]), initial_state)
        if alpha is not None:
            self._bearing.chi2 = self._distance.chi2 = chi2_quantile(alpha)

    def predict(self, twist: Pair, dt: float) -> None:
        """Time update by the rates, the twist and the rotation coupling over dt."""
        v, omega, dt = checked_motion(twist, dt)
        if self._started:
            bearing, distance = self._bearing, self._distance
            coupled = abs(bearing.value) < _COUPLED_BEARING
            lateral = distance.value * math.tan(bearing.value) if coupled else 0.0
            bearing.predict(-omega, dt)
            bearing.value = math.remainder(bearing.value, math.tau)
            distance.predict(omega * lateral - v, dt)


class RateAxis(Axis):
    """Filter of one axis with states [value, rate]; q is the spectral density of the rate's random walk."""

    __slots__ = ("covariance", "rate", "rate_p0", "rate_variance")

    def __init__(self, q: float, r: float, p0: float, rate_p0: float) -> None:
        self.rate_p0 = rate_p0
        super().__init__(q, r, p0)

    def start(self, value: float) -> None:
        """Begin at this value with a rate of 0."""
        super().start(value)
        self.rate = 0.0
        self.covariance = 0.0
        self.rate_variance = self.rate_p0

    def predict(self, input_rate: float, dt: float) -> None:
        """Move by the rate and the known input for dt seconds."""
        self.value += (self.rate + input_rate) * dt
        self.variance += dt * (2.0 * self.covariance + dt * (self.rate_variance + self.q * dt / 3.0))
        self.covariance += dt * (self.rate_variance + self.q * dt / 2.0)
        self.rate_variance += self.q * dt

    def correct(self, innovation: float) -> tuple[float, float]:
        """Apply an innovation to value and rate; return (NIS, lambda)."""
        nis, inflation, innovation_variance = self._test(innovation)
        gain = self.variance / innovation_variance
        rate_gain = self.covariance / innovation_variance
        self.value += gain * innovation
        self.rate += rate_gain * innovation
        self.rate_variance -= rate_gain * self.covariance
        self.covariance -= gain * self.covariance
        self.variance -= gain * self.variance
        return nis, inflation


@ESTIMATORS.register("akf_cv")
def akf_cv(noise: NoiseModel, alpha: float | None = 0.05) -> AugmentedKalmanFilter:
    """Return the augmented filter with a significance of its test."""
    return AugmentedKalmanFilter(noise.acceleration, noise.measurement, alpha)
