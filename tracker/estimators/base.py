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
from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal, Protocol

from follow_env.registry import Registry

Action = Literal["accept", "inflate", "miss"]
Pair = tuple[float, float]

MEASUREMENT = "measurement (bearing rad, distance m; None for a miss)"
"""How error messages name a measurement."""


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


@dataclass(frozen=True)
class NoiseModel:
    """Noise settings of the Kalman filters at one control rate; pairs are (bearing, distance).

    Attributes:
        measurement: R, variances in (rad^2, m^2).
        process: Q per control step, variances in (rad^2, m^2).
        acceleration: spectral densities of the augmented filter, (rad^2/s^3, m^2/s^3).
    """

    measurement: Pair
    process: Pair
    acceleration: Pair


ESTIMATORS: Registry[Callable[..., Estimator]] = Registry("estimator", "tracker.estimators")
"""Functions (`NoiseModel`, **settings) that return a fresh estimator; each is registered in its own file."""


def finite_pair(name: str, pair: Pair) -> Pair:
    """Return the pair as floats; a ValueError says that `name` is not finite."""
    first, second = pair
    first, second = float(first), float(second)
    if not (math.isfinite(first) and math.isfinite(second)):
        raise ValueError(f"{name} is ({first}, {second}), expected two finite numbers.")
    return first, second


def positive_pair(name: str, pair: Pair) -> Pair:
    """Return the pair as floats; a ValueError says that `name` is not positive and finite."""
    first, second = pair
    first, second = float(first), float(second)
    if not (0.0 < first < math.inf and 0.0 < second < math.inf):
        raise ValueError(f"{name} is ({first}, {second}), expected positive finite (bearing, distance) values.")
    return first, second


def checked_motion(twist: Pair, dt: float) -> tuple[float, float, float]:
    """Return (v, omega, dt); a ValueError says what is not finite or not positive."""
    v, omega = finite_pair("twist (v m/s, omega rad/s; zeros when standing)", twist)
    dt = float(dt)
    if not 0.0 < dt < math.inf:
        raise ValueError(f"dt is {dt}, expected a positive time step in seconds.")
    return v, omega, dt
