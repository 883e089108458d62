"""The follower of paper B: one proportional-integral loop per axis, eq. (32)."""

from __future__ import annotations

import math

from baselines.controllers.base import CONTROLLERS
from follow_env.config import EnvConfig

Pair = tuple[float, float]
PAPER_KP, PAPER_KI = (math.radians(43.0), 1.0), (math.radians(0.03), 1.0)
"""Paper B's gains, read as `PIController.from_paper` says, 1/s and 1/s²."""


class PIController:
    """Turn toward the target and keep a distance: u_i = kp_i e_i + ki_i sum(e_i dt), eq. (32) read diagonally.

    omega comes from the bearing error (target to the left, turn left), v from the distance error (target farther than
    the set-point, drive on). The sum includes the current error, as printed.

    With the distance plant 1/s and the paper's gains the closed loop is s² + s + 1: wn = 1 rad/s, zeta = 0.5.

    Args:
        kp: Proportional gains (bearing, distance), 1/s.
        ki: Integral gains (bearing, distance), 1/s². What the paper calls T_i is this gain, not a time.
        set_point: (bearing rad, distance m) to keep.
        integral_limit: Bound on the magnitude of the integral's share of the command, (rad/s, m/s), against wind-up; it
            is not in the paper. The integral alone must supply the steady command, so the default is the largest one a
            person asks for: 0.8 rad/s and a fast walk of 1.6 m/s. None leaves the integrator plain.

    Raises:
        ValueError: If a gain is negative or not finite, the set-point not finite, or a limit not positive.
    """

    def __init__(
        self,
        kp: Pair,
        ki: Pair,
        set_point: Pair = (0.0, 1.5),
        integral_limit: Pair | None = (0.8, 1.6),
    ) -> None:
        for name, gains in (("kp", kp), ("ki", ki)):
            if not all(0.0 <= gain < math.inf for gain in gains):
                raise ValueError(f"{name} is {gains}, expected finite gains (bearing, distance) of zero or more.")
        if not all(math.isfinite(value) for value in set_point):
            raise ValueError(f"set_point is {set_point}, expected a finite (bearing rad, distance m).")
        if integral_limit is not None and not all(limit > 0.0 for limit in integral_limit):
            raise ValueError(
                f"integral_limit is {integral_limit}, expected positive (rad/s, m/s), or None for no limit."
            )
        self._kp_bearing, self._kp_distance = kp
        self._ki_bearing, self._ki_distance = ki
        self._set_bearing, self._set_distance = set_point
        self._limit_bearing, self._limit_distance = (math.inf, math.inf) if integral_limit is None else integral_limit
        self.reset()

    @classmethod
    def from_paper(cls) -> PIController:
        """Return paper B's controller: K_p = (43, 0.01), T_i = (0.03, 0.01), set-point (0 rad, 150 cm), no limit.

        The paper states no units. These are inferred: u1 in deg/s per rad, u2 in m/s per cm, the sum multiplied by dt;
        so kp = (0.7505, 1.0) 1/s and ki = (5.2e-4, 1.0) 1/s². Read literally (rad/s per rad, cm/s per cm, or sums
        without dt) the robot diverges, limit-cycles or never catches up.
        """
        return cls(PAPER_KP, PAPER_KI, set_point=(0.0, 1.5), integral_limit=None)

    def reset(self) -> None:
        """Empty the integrators."""
        self._integral_bearing = 0.0
        self._integral_distance = 0.0

    def command(self, bearing: float, distance: float, dt: float) -> Pair:
        """Return the twist (v m/s, omega rad/s counter-clockwise), unsaturated, for an estimated target.

        Args:
            bearing: Of the target, rad, positive to the left.
            distance: Forward distance to the target, m.
            dt: Control period, s.

        Raises:
            ValueError: If the target is not finite or dt not positive.
        """
        if not (math.isfinite(bearing) and math.isfinite(distance)):
            raise ValueError(
                f"target is ({bearing} rad, {distance} m), expected finite numbers; do not command without one."
            )
        if not 0.0 < dt < math.inf:
            raise ValueError(f"dt is {dt}, expected a positive control period in seconds.")
        error_bearing = bearing - self._set_bearing
        error_distance = distance - self._set_distance
        self._integral_bearing = _clamp(
            self._integral_bearing + self._ki_bearing * error_bearing * dt, self._limit_bearing
        )
        self._integral_distance = _clamp(
            self._integral_distance + self._ki_distance * error_distance * dt, self._limit_distance
        )
        omega = self._kp_bearing * error_bearing + self._integral_bearing
        v = self._kp_distance * error_distance + self._integral_distance
        return v, omega


def _clamp(value: float, limit: float) -> float:
    return min(max(value, -limit), limit)


@CONTROLLERS.register("pi")
def pi(config: EnvConfig, kp: Pair = PAPER_KP, ki: Pair = PAPER_KI, integral_limit: Pair | None = None) -> PIController:
    """Return paper B's controller at the task's set point, or one with other gains."""
    return PIController((kp[0], kp[1]), (ki[0], ki[1]), (0.0, config.task.set_point), integral_limit)
