"""Estimators of the person's bearing and forward distance from measurements and odometry (paper B, section 2.1).

Model, eqs. (1)-(2) in REP-103 signs: x = [bearing (rad, left positive), distance (m, forward)], u = (v, omega) as
actually applied over the last step, x(k) = x(k-1) - dt [omega, v] + w, z = x + noise. The printed B = diag(dt, -dt)
would *increase* the angle when the robot turns towards the person; here B = -dt I. With A = H = I and diagonal Q and R
the filter is two scalar filters, written as plain floats: a step costs about three microseconds.

Predicted bearings and bearing innovations are wrapped into [-pi, pi]: nothing changes within a field of view, and a
search turn of more than half a revolution ends where it should.
"""

from __future__ import annotations

import math
import warnings
from dataclasses import dataclass
from statistics import NormalDist
from typing import Literal, Protocol

Action = Literal["accept", "inflate", "miss"]
Pair = tuple[float, float]

LOCK_OUT_WINDOW = 90  # measured steps: 3 s at 30 Hz
LOCK_OUT_LIMIT = LOCK_OUT_WINDOW // 2  # see LockOutWarning


@dataclass(frozen=True, slots=True)
class Estimate:
    """One step's result; every pair is ordered (bearing, distance).

    Attributes:
        bearing: Estimated bearing of the target, rad, positive to the left.
        distance: Estimated forward distance in the robot frame, m.
        variance: Posterior variances, rad² and m² (the predicted ones on a miss).
        innovation: Measurement minus prediction, rad and m; 0 on a miss and on the first measurement.
        nis: Normalised innovation squared D_i = e_i²/P_ii,ee of eq. (4), before inflation; 0 without an innovation.
        inflation: Adaptive factor lambda_i of eq. (16); 1 when the measurement was taken as it is.
        action: What was done with the measurement on each axis.
    """

    bearing: float
    distance: float
    variance: Pair
    innovation: Pair
    nis: Pair
    inflation: Pair
    action: tuple[Action, Action]


class Estimator(Protocol):
    """What every estimator offers: once per control period `predict`, then `update`.

    Both raise ValueError for numbers that are not finite and for a dt that is not positive.
    """

    def reset(self) -> None:
        """Forget the target; settings stay."""

    def predict(self, twist: Pair, dt: float) -> None:
        """Move the estimate by the robot's own motion, the twist (v m/s, omega rad/s ccw) driven over the last dt s."""

    def update(self, measurement: Pair | None) -> Estimate | None:
        """Take in a measurement (bearing rad, distance m), or None for a miss; return None while nothing is known."""


class LockOutWarning(RuntimeWarning):
    """An adaptive filter calls most measurements outliers, so it is probably the one that is wrong.

    The paper's model has no target speed. If Q is too small for the target's motion in a step, the prediction falls
    behind, the test of eq. (16) blames the measurements, and their correction P⁻ chi2 / e shrinks as the error e grows.
    The warning comes once per filter, when more than half of the last 90 measurements (3 s at 30 Hz) were inflated on
    one axis. With alpha = 0.05 and 20 % outliers 24 % are expected, 22 ± 4 of 90, so 46 lies six standard deviations
    off; a filter that is locked out inflates 90 % or more.
    """


class NoFilter:
    """Paper B's "No filter": the estimate is the measurement.

    On a miss the last estimate stands, with action "miss". It is this estimator that holds it: a measurement itself is
    never held. Variances are reported as 0, since nothing is modelled.
    """

    __slots__ = ("_last",)

    def __init__(self) -> None:
        self._last: Pair | None = None

    def reset(self) -> None:
        """Forget the target."""
        self._last = None

    def predict(self, twist: Pair, dt: float) -> None:
        """Check the arguments; nothing is predicted."""
        _checked_motion(twist, dt)

    def update(self, measurement: Pair | None) -> Estimate | None:
        """Return the measurement, or the last one on a miss."""
        if measurement is not None:
            self._last = _finite_pair(_MEASUREMENT, measurement)
        if self._last is None:
            return None
        action: Action = "miss" if measurement is None else "accept"
        return Estimate(*self._last, (0.0, 0.0), (0.0, 0.0), (0.0, 0.0), (1.0, 1.0), (action, action))


class _TwoAxisFilter:
    """Start, reset and measurement update shared by the filters; subclasses bring `predict` and their axes."""

    __slots__ = ("_bearing", "_distance", "_initial_state", "_started", "_warned")

    def __init__(self, bearing: _Axis, distance: _Axis, initial_state: Pair | None) -> None:
        self._bearing = bearing
        self._distance = distance
        self._initial_state = (
            None if initial_state is None else _finite_pair("initial_state (bearing rad, distance m)", initial_state)
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
        measured_bearing, measured_distance = _finite_pair(_MEASUREMENT, measurement)
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


class KalmanFilter(_TwoAxisFilter):
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
        q = _positive_pair("process_noise", process_noise)
        r = _positive_pair("measurement_noise", measurement_noise)
        p = r if initial_variance is None else _positive_pair("initial_variance", initial_variance)
        super().__init__(_Axis(q[0], r[0], p[0]), _Axis(q[1], r[1], p[1]), initial_state)

    def predict(self, twist: Pair, dt: float) -> None:
        """Time update, eqs. (17)-(18): bearing -= omega dt, distance -= v dt, P += Q."""
        v, omega, dt = _checked_motion(twist, dt)
        if self._started:
            self._bearing.predict(-omega, dt)
            self._bearing.value = math.remainder(self._bearing.value, math.tau)
            self._distance.predict(-v, dt)


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


class AugmentedKalmanFilter(_TwoAxisFilter):
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
    _bearing: _RateAxis
    _distance: _RateAxis

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
        q = _positive_pair("acceleration_density", acceleration_density)
        r = _positive_pair("measurement_noise", measurement_noise)
        p = r if initial_variance is None else _positive_pair("initial_variance", initial_variance)
        s = _positive_pair("initial_rate_variance", initial_rate_variance)
        super().__init__(_RateAxis(q[0], r[0], p[0], s[0]), _RateAxis(q[1], r[1], p[1], s[1]), initial_state)
        if alpha is not None:
            self._bearing.chi2 = self._distance.chi2 = chi2_quantile(alpha)

    def predict(self, twist: Pair, dt: float) -> None:
        """Time update by the rates, the twist and the rotation coupling over dt."""
        v, omega, dt = _checked_motion(twist, dt)
        if self._started:
            bearing, distance = self._bearing, self._distance
            coupled = abs(bearing.value) < _COUPLED_BEARING
            lateral = distance.value * math.tan(bearing.value) if coupled else 0.0
            bearing.predict(-omega, dt)
            bearing.value = math.remainder(bearing.value, math.tau)
            distance.predict(omega * lateral - v, dt)


def chi2_quantile(alpha: float) -> float:
    """Return the 1 - alpha quantile of the chi-square distribution with one degree of freedom, chi2_alpha of eq. (5).

    Raises:
        ValueError: If alpha does not lie in (0, 1).
    """
    if not 0.0 < alpha < 1.0:
        raise ValueError(f"alpha is {alpha}, expected a significance level in (0, 1), such as 0.05.")
    return NormalDist().inv_cdf(alpha / 2.0) ** 2


_MEASUREMENT = "measurement (bearing rad, distance m; None for a miss)"
_COUPLED_BEARING = math.radians(60.0)
_WINDOW_MASK = (1 << LOCK_OUT_WINDOW) - 1


class _Axis:
    """Scalar filter of one axis, a random walk with known input; q, r and p0 are its Q, R and P(0|0)."""

    __slots__ = ("chi2", "history", "p0", "q", "r", "value", "variance")

    def __init__(self, q: float, r: float, p0: float) -> None:
        self.q = q
        self.r = r
        self.p0 = p0
        self.chi2 = math.inf  # no measurement is inflated
        self.start(0.0)

    def start(self, value: float) -> None:
        self.value = value
        self.variance = self.p0
        self.history = 0  # one bit per measurement, set when it was inflated, the newest lowest

    def predict(self, input_rate: float, dt: float) -> None:
        self.value += input_rate * dt
        self.variance += self.q

    def correct(self, innovation: float) -> tuple[float, float]:
        """Apply an innovation; return (NIS, lambda)."""
        nis, inflation, innovation_variance = self._test(innovation)
        gain = self.variance / innovation_variance  # (21)
        self.value += gain * innovation  # (22)
        self.variance -= gain * self.variance  # (23), where K P̄ee = P⁻
        return nis, inflation

    def _test(self, innovation: float) -> tuple[float, float, float]:
        """Return (NIS, lambda, innovation variance to use) by eqs. (4), (15), (16), (20)."""
        innovation_variance = self.variance + self.r
        squared = innovation * innovation
        nis = squared / innovation_variance
        inflation = 1.0
        if nis > self.chi2:
            innovation_variance = squared / self.chi2
            inflation = (innovation_variance - self.variance) / self.r
        self.history = (self.history << 1 | (inflation > 1.0)) & _WINDOW_MASK
        return nis, inflation, innovation_variance


class _RateAxis(_Axis):
    """Filter of one axis with states [value, rate]; q is the spectral density of the rate's random walk."""

    __slots__ = ("covariance", "rate", "rate_p0", "rate_variance")

    def __init__(self, q: float, r: float, p0: float, rate_p0: float) -> None:
        self.rate_p0 = rate_p0
        super().__init__(q, r, p0)

    def start(self, value: float) -> None:
        super().start(value)
        self.rate = 0.0
        self.covariance = 0.0
        self.rate_variance = self.rate_p0

    def predict(self, input_rate: float, dt: float) -> None:
        self.value += (self.rate + input_rate) * dt
        self.variance += dt * (2.0 * self.covariance + dt * (self.rate_variance + self.q * dt / 3.0))
        self.covariance += dt * (self.rate_variance + self.q * dt / 2.0)
        self.rate_variance += self.q * dt

    def correct(self, innovation: float) -> tuple[float, float]:
        nis, inflation, innovation_variance = self._test(innovation)
        gain = self.variance / innovation_variance
        rate_gain = self.covariance / innovation_variance
        self.value += gain * innovation
        self.rate += rate_gain * innovation
        self.rate_variance -= rate_gain * self.covariance
        self.covariance -= gain * self.covariance
        self.variance -= gain * self.variance
        return nis, inflation


def _finite_pair(name: str, pair: Pair) -> Pair:
    first, second = pair
    first, second = float(first), float(second)
    if not (math.isfinite(first) and math.isfinite(second)):
        raise ValueError(f"{name} is ({first}, {second}), expected two finite numbers.")
    return first, second


def _positive_pair(name: str, pair: Pair) -> Pair:
    first, second = pair
    first, second = float(first), float(second)
    if not (0.0 < first < math.inf and 0.0 < second < math.inf):
        raise ValueError(f"{name} is ({first}, {second}), expected positive finite (bearing, distance) values.")
    return first, second


def _checked_motion(twist: Pair, dt: float) -> tuple[float, float, float]:
    v, omega = _finite_pair("twist (v m/s, omega rad/s; zeros when standing)", twist)
    dt = float(dt)
    if not 0.0 < dt < math.inf:
        raise ValueError(f"dt is {dt}, expected a positive time step in seconds.")
    return v, omega, dt
