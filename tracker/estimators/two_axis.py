"""What the Kalman filters share: a scalar filter for each axis, the chi-square test, the lock-out warning."""

from __future__ import annotations

import math
import warnings
from statistics import NormalDist

from tracker.estimators.base import MEASUREMENT, Action, Estimate, Pair, finite_pair

LOCK_OUT_WINDOW = 90  # measured steps: 3 s at 30 Hz
LOCK_OUT_LIMIT = LOCK_OUT_WINDOW // 2  # see LockOutWarning
_WINDOW_MASK = (1 << LOCK_OUT_WINDOW) - 1


class LockOutWarning(RuntimeWarning):
    """An adaptive filter calls most measurements outliers, so it is probably the one that is wrong.

    The paper's model has no target speed. If Q is too small for the target's motion in a step, the prediction falls
    behind, the test of eq. (16) blames the measurements, and their correction P⁻ chi2 / e shrinks as the error e grows.
    The warning comes once per filter, when more than half of the last 90 measurements (3 s at 30 Hz) were inflated on
    one axis. With alpha = 0.05 and 20 % outliers 24 % are expected, 22 ± 4 of 90, so 46 lies six standard deviations
    off; a filter that is locked out inflates 90 % or more.
    """


class TwoAxisFilter:
    """Start, reset and measurement update shared by the filters; subclasses bring `predict` and their axes."""

    __slots__ = ("_bearing", "_distance", "_initial_state", "_started", "_warned")

    def __init__(self, bearing: Axis, distance: Axis, initial_state: Pair | None) -> None:
        self._bearing = bearing
        self._distance = distance
        self._initial_state = (
            None if initial_state is None else finite_pair("initial_state (bearing rad, distance m)", initial_state)
        )
        self._warned = False
        self.reset()

    def reset(self) -> None:
        """Return to the initial state if one was given, else wait for the first measurement."""
        self._started = False
        if self._initial_state is not None:
            self._start(*self._initial_state)

    def update(self, measurement: Pair | None) -> Estimate | None:
        """Correct the prediction, eqs. (3)-(4), (15)-(16), (19)-(23); a miss (None) leaves it as it is."""
        bearing, distance = self._bearing, self._distance
        if measurement is None:
            return self._without_innovation("miss") if self._started else None
        measured_bearing, measured_distance = finite_pair(MEASUREMENT, measurement)
        if not self._started:
            self._start(measured_bearing, measured_distance)
            return self._without_innovation("accept")

        innovation = (math.remainder(measured_bearing - bearing.value, math.tau), measured_distance - distance.value)
        nis_bearing, inflation_bearing = bearing.correct(innovation[0])
        nis_distance, inflation_distance = distance.correct(innovation[1])
        bearing.value = math.remainder(bearing.value, math.tau)
        inflated_bearing, inflated_distance = inflation_bearing > 1.0, inflation_distance > 1.0
        if (inflated_bearing or inflated_distance) and not self._warned:
            self._warn_of_lock_out()
        return Estimate(
            bearing.value,
            distance.value,
            (bearing.variance, distance.variance),
            innovation,
            (nis_bearing, nis_distance),
            (inflation_bearing, inflation_distance),
            ("inflate" if inflated_bearing else "accept", "inflate" if inflated_distance else "accept"),
        )

    def _start(self, bearing: float, distance: float) -> None:
        self._bearing.start(bearing)
        self._distance.start(distance)
        self._started = True

    def _without_innovation(self, action: Action) -> Estimate:
        variance = (self._bearing.variance, self._distance.variance)
        nothing, nominal, actions = (0.0, 0.0), (1.0, 1.0), (action, action)
        return Estimate(self._bearing.value, self._distance.value, variance, nothing, nothing, nominal, actions)

    def _warn_of_lock_out(self) -> None:
        for name, axis in (("bearing", self._bearing), ("distance", self._distance)):
            inflated = axis.history.bit_count()
            if inflated > LOCK_OUT_LIMIT:
                self._warned = True
                warnings.warn(
                    f"{type(self).__name__} called {inflated} of the last {LOCK_OUT_WINDOW} {name} measurements "
                    "outliers, so its own prediction is probably wrong; raise its "
                    f"{name} process noise, now {axis.q:g}.",
                    LockOutWarning,
                    stacklevel=3,
                )
                return


def chi2_quantile(alpha: float) -> float:
    """Return the 1 - alpha quantile of the chi-square distribution with one degree of freedom, chi2_alpha of eq. (5).

    Raises:
        ValueError: If alpha does not lie in (0, 1).
    """
    if not 0.0 < alpha < 1.0:
        raise ValueError(f"alpha is {alpha}, expected a significance level in (0, 1), such as 0.05.")
    return NormalDist().inv_cdf(alpha / 2.0) ** 2


def innovation_test(innovation: float, variance: float, r: float, chi2: float) -> tuple[float, float, float]:
    """Return (NIS, lambda, innovation variance to use) by eqs. (4), (15), (16), (20).

    Args:
        innovation: measured less predicted.
        variance: of the prediction.
        r: of the measurement.
        chi2: a NIS above it inflates R by lambda.
    """
    innovation_variance = variance + r
    squared = innovation * innovation
    nis = squared / innovation_variance
    if nis > chi2:
        innovation_variance = squared / chi2
        return nis, (innovation_variance - variance) / r, innovation_variance
    return nis, 1.0, innovation_variance


def corrected(value: float, variance: float, innovation: float, innovation_variance: float) -> tuple[float, float]:
    """Return value and variance after an innovation, eqs. (21)-(23)."""
    gain = variance / innovation_variance  # (21)
    return value + gain * innovation, variance - gain * variance  # (22), (23), where K P̄ee = P⁻


class Axis:
    """Scalar filter of one axis, a random walk with known input; q, r and p0 are its Q, R and P(0|0)."""

    __slots__ = ("chi2", "history", "p0", "q", "r", "value", "variance")

    def __init__(self, q: float, r: float, p0: float) -> None:
        self.q = q
        self.r = r
        self.p0 = p0
        self.chi2 = math.inf  # no measurement is inflated
        self.start(0.0)

    def start(self, value: float) -> None:
        """Begin at this value with the variance P(0|0)."""
        self.value = value
        self.variance = self.p0
        self.history = 0  # one bit per measurement, set when it was inflated, the newest lowest

    def predict(self, input_rate: float, dt: float) -> None:
        """Move by the known input for dt seconds; the variance grows by Q."""
        self.value += input_rate * dt
        self.variance += self.q

    def correct(self, innovation: float) -> tuple[float, float]:
        """Apply an innovation; return (NIS, lambda)."""
        nis, inflation, innovation_variance = self._test(innovation)
        self.value, self.variance = corrected(self.value, self.variance, innovation, innovation_variance)
        return nis, inflation

    def _test(self, innovation: float) -> tuple[float, float, float]:
        """Return what `innovation_test` does, and remember whether the measurement was inflated."""
        result = innovation_test(innovation, self.variance, self.r, self.chi2)
        self.history = (self.history << 1 | (result[1] > 1.0)) & _WINDOW_MASK
        return result
