"""The modified Kalman filter of paper A, eqs. (5)-(14): where in space the person is, and how fast it moves.

The state [S, V] is position and velocity in the robot's present frame (x forward, y left, z up), which moves with the
robot. `predict` takes the robot's own motion: with it V is the velocity over the ground, and the model of constant
velocity holds in the odometry frame; without it V is relative to the robot, as printed, and the model fails when the
robot turns. Both noises are the same in every direction, so a rotation does not change the covariance, and all three
axes share one [position, velocity] covariance of three numbers.

The acceleration is continuous white noise: several short predictions are exactly one long one.
"""

from __future__ import annotations

import functools
import math
import operator
from collections.abc import Iterable, Sequence

Vector = tuple[float, float, float]
Motion = tuple[float, float, float]

STANDING: Motion = (0.0, 0.0, 0.0)
"""A robot that does not move: (forward m, left m, turned left rad)."""
ACCELERATION_DENSITY = 1.0
"""Spectral density of the person's acceleration, m²/s³: about 1.4 m/s² for half a second at a start, stop or turn."""
MEASUREMENT_NOISE = 0.03**2
"""Variance R of a measured position in each direction, m²: the box's jitter and the depth samples, about 3 cm."""


class PersonFilter:
    """Position and velocity of the person, started from the frames that confirmed it.

    Smoothing replaces the measurement S_k by z_s(k) = (S_k + z_s(k-1) + V̂(k-1) dt) / 2. In eq. (9) as printed dt
    cancels and nothing is smoothed; the text after eq. (14) says that the estimate is meant. The error of z_s has the
    variance R / 3 (half the new error, half the old one), which is the R used then. After a miss z_s(k-1) + V̂ dt is
    the prediction. It helps while the velocity is constant and lags when the person turns back.

    Args:
        samples: Where it was when it was confirmed: at least two of (time s, position m) at different times, the
            present one being 0, all in the present frame. The filter starts on the least-squares line through them.
        acceleration_density: Spectral density q of the white acceleration, m²/s³; over dt it adds
            q [[dt³/3, dt²/2], [dt²/2, dt]] to the covariance.
        measurement_noise: Variance R of a measured position in each direction, m².
        smoothing: Whether measurements are smoothed before the correction.

    Raises:
        ValueError: If a noise is not positive and finite, the samples' times are fewer than two different ones, or a
            position is not finite.
    """

    __slots__ = (
        "_covariance",
        "_density",
        "_noise",
        "_position",
        "_smoothed",
        "_smoothing",
        "_velocity",
    )

    def __init__(
        self,
        samples: Sequence[tuple[float, Vector]],
        acceleration_density: float = ACCELERATION_DENSITY,
        measurement_noise: float = MEASUREMENT_NOISE,
        smoothing: bool = True,
    ) -> None:
        for name, value in (("acceleration_density", acceleration_density), ("measurement_noise", measurement_noise)):
            if not 0.0 < value < math.inf:
                raise ValueError(f"{name} is {value}, expected a positive finite number.")
        self._density, self._smoothing = acceleration_density, smoothing
        self._noise = measurement_noise / 3.0 if smoothing else measurement_noise
        self._position, self._velocity, determinant, squares, total = _line(samples)
        self._smoothed = self._position
        scale = measurement_noise / determinant
        self._covariance = (scale * squares, -scale * total, scale * len(samples))

    @property
    def position(self) -> Vector:
        """Estimated position, m; after `predict` the predicted one."""
        return self._position

    @property
    def velocity(self) -> Vector:
        """Estimated velocity, m/s."""
        return self._velocity

    @property
    def covariance(self) -> tuple[float, float, float]:
        """Variance of the position (m²), covariance of both (m²/s), variance of the velocity (m²/s²), on each axis."""
        return self._covariance

    def predict(self, dt: float, motion: Motion = STANDING) -> None:
        """Move on by dt, eqs. (8), (10)-(11), into the frame in which the robot is then.

        Args:
            dt: Time step, s.
            motion: The robot's own over dt (`arc`); standing for velocities relative to the robot.

        Raises:
            ValueError: If dt is not positive and finite.
        """
        if not 0.0 < dt < math.inf:
            raise ValueError(f"dt is {dt}, expected a positive time step in seconds.")
        vx, vy, vz = self._velocity
        x, y, z = self._position
        self._position = moved((x + dt * vx, y + dt * vy, z + dt * vz), motion)
        x, y, z = self._smoothed
        self._smoothed = moved((x + dt * vx, y + dt * vy, z + dt * vz), motion)
        self._velocity = moved(self._velocity, (0.0, 0.0, motion[2]))
        spread, cross, rate = self._covariance
        q = self._density
        self._covariance = (
            spread + dt * (2.0 * cross + dt * (rate + q * dt / 3.0)),
            cross + dt * (rate + q * dt / 2.0),
            rate + q * dt,
        )

    def update(self, measurement: Vector | None) -> None:
        """Correct the prediction by a measured position (m), eqs. (9), (12)-(14); None is a miss.

        Raises:
            ValueError: If the measurement is not finite.
        """
        if measurement is None:
            self._smoothed = self._position
            return
        x, y, z = _finite(measurement)
        if self._smoothing:
            sx, sy, sz = self._smoothed
            x, y, z = (x + sx) / 2.0, (y + sy) / 2.0, (z + sz) / 2.0  # (9)
            self._smoothed = (x, y, z)
        px, py, pz = self._position
        vx, vy, vz = self._velocity
        spread, cross, rate = self._covariance
        total = spread + self._noise
        gain, rate_gain = spread / total, cross / total  # (12)
        dx, dy, dz = x - px, y - py, z - pz
        self._position = (px + gain * dx, py + gain * dy, pz + gain * dz)  # (13)
        self._velocity = (vx + rate_gain * dx, vy + rate_gain * dy, vz + rate_gain * dz)
        self._covariance = (spread - gain * spread, cross - gain * cross, rate - rate_gain * cross)  # (14)


def arc(twist: tuple[float, float], dt: float) -> Motion:
    """Return the motion of a robot that drives a constant twist (v m/s, omega rad/s) for dt s: an arc of a circle.

    Raises:
        ValueError: If the twist is not finite.
    """
    v, omega = twist
    if not (math.isfinite(v) and math.isfinite(omega)):
        raise ValueError(f"twist is ({v}, {omega}), expected finite (v m/s, omega rad/s); zeros when standing.")
    half = 0.5 * omega * dt
    chord = v * dt * (math.sin(half) / half if abs(half) > 1e-8 else 1.0)
    return chord * math.cos(half), chord * math.sin(half), omega * dt


def moved(point: Vector, motion: Motion) -> Vector:
    """Return where a point that rests on the ground is in the robot's frame after the robot's motion."""
    x, y, z = point
    forward, left, turn = motion
    if turn == 0.0:
        return x - forward, y - left, z
    cosine, sine = math.cos(turn), math.sin(turn)
    x, y = x - forward, y - left
    return cosine * x + sine * y, cosine * y - sine * x, z


def _line(samples: Sequence[tuple[float, Vector]]) -> tuple[Vector, Vector, float, float, float]:
    """Return the least-squares line at time 0 (position, velocity), the normal determinant, sum of squares and sum."""
    count = len(samples)
    total = _added(time for time, _ in samples)
    squares = _added(time * time for time, _ in samples)
    determinant = count * squares - total * total
    if not 0.0 < determinant < math.inf:
        raise ValueError(f"the filter starts from {count} samples; expected at least two, at different finite times.")
    lines = []
    for axis in range(3):
        first = _added(_finite(position)[axis] for _, position in samples)
        moment = _added(time * position[axis] for time, position in samples)
        lines.append(((squares * first - total * moment) / determinant, (count * moment - total * first) / determinant))
    (x, vx), (y, vy), (z, vz) = lines
    return (x, y, z), (vx, vy, vz), determinant, squares, total


def _added(values: Iterable[float]) -> float:
    """Return the sum, added from the left: Python's own is compensated from 3.12 on, which gives other bits."""
    return functools.reduce(operator.add, values, 0.0)


def _finite(position: Vector) -> Vector:
    if not all(map(math.isfinite, position)):
        raise ValueError(f"measured position is {position}, expected three finite numbers in meters; None for a miss.")
    return position
