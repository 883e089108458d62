"""What one episode is worth: every step goes in, one row of numbers and one error curve come out.

Only plain sums and ``math`` are used, so a row has the same bits on every machine.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from itertools import groupby, pairwise
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from baselines.benchmark.cells import Cell
from follow_env.envs.task import BAND_BEARING, BAND_DISTANCE, SET_POINT, SUCCESS_BAND_SHARE, SUCCESS_OUT_OF_VIEW
from tracker.estimators import Estimate

Row = dict[str, "str | int | float | None"]
"""One episode's numbers by column name; None where a column does not apply, never NaN."""

PERSONAL_SURFACE = 0.45
"""Surface distance below which the robot stands in the intimate zone, m."""
OUTLIER_SIGMAS = 3.0
MAD_TO_SIGMA = 1.4826
NIS_BOUNDS = (0.000982069, 5.023886)
"""2.5 % and 97.5 % quantiles of chi2 with one degree of freedom."""

COLUMNS = (
    *("perception", "scene", "estimator", "controller", "sensor", "q_scale", "alpha", "seed"),
    *("steps", "duration_s", "ended", "estimate_steps", "measurement_share"),
    *("angle_rmse_rad", "angle_bias_rad", "angle_p95_rad", "angle_outlier_share", "angle_outlier_square_share"),
    *("angle_error_correlation", "distance_error_correlation"),
    *("distance_rmse_m", "distance_bias_m", "distance_p95_m"),
    *("distance_outlier_share", "distance_outlier_square_share"),
    *("angle_inflated_share", "angle_nis_mean", "angle_nis_inside_95_share"),
    *("distance_inflated_share", "distance_nis_mean", "distance_nis_inside_95_share"),
    *("angle_tracking_rmse_rad", "distance_tracking_rmse_m", "in_band_share"),
    *("longest_out_of_view_s", "loss_count", "min_surface_distance_m", "seconds_nearer_045_m", "collision_with"),
    *("success", "rms_acceleration_m_s2", "rms_jerk_m_s3", "rms_angular_jerk_rad_s3", "saturation_share", "path_ratio"),
)
"""The row's columns, in the order of the CSV files."""


class EpisodeMetrics:
    """Collects one episode and turns it into a row and a curve.

    An error is the estimate minus the truth at the same instant: bearing in rad (positive to the left), forward
    distance in m. A step before the first measurement has no estimate and no error.
    """

    def __init__(self, cell: Cell, seed: int) -> None:
        self._cell = cell
        self._seed = seed
        self._steps: list[Step] = []

    def record(
        self, info: Mapping[str, Any], estimate: Estimate | None, measurement: tuple[float, float] | None
    ) -> None:
        """Add one instant: what was true, and what the policy believed when it had seen that instant's observation."""
        self._steps.append(Step.of(info, estimate, measurement))

    def row(self, terminated: bool) -> Row:
        """The finished episode's numbers, keyed by COLUMNS.

        Args:
            terminated: Whether the environment ended the episode before its time (collision or lost).

        Raises:
            ValueError: If nothing was recorded.
        """
        steps = self._steps
        if not steps:
            raise ValueError("The episode has no step, but at least the one at reset must be recorded.")
        last = steps[-1]
        ended = "collision" if last.collision else "lost" if terminated else "time"
        estimated = [step for step in steps if step.errors is not None]
        spans = spans_out_of_view(steps)
        longest = max(spans, default=0.0)
        band = share(in_band(step) for step in steps)
        success = ended == "time" and longest <= SUCCESS_OUT_OF_VIEW + 1e-9 and band >= SUCCESS_BAND_SHARE
        row: Row = {
            "perception": self._cell.perception,
            "scene": self._cell.scene,
            "estimator": self._cell.estimator,
            "controller": self._cell.controller,
            "sensor": self._cell.sensor,
            "q_scale": float(self._cell.q_scale),
            "alpha": float(self._cell.alpha),
            "seed": self._seed,
            "steps": len(steps),
            "duration_s": last.time,
            "ended": ended,
            "estimate_steps": len(estimated),
            "measurement_share": share(step.measured for step in steps),
            "angle_tracking_rmse_rad": rms([step.bearing for step in steps]),
            "distance_tracking_rmse_m": rms([step.distance - SET_POINT for step in steps]),
            "in_band_share": band,
            "longest_out_of_view_s": longest,
            "loss_count": len(spans),
            "min_surface_distance_m": min(step.surface_distance for step in steps),
            "seconds_nearer_045_m": seconds_near(steps),
            "collision_with": last.collision_with,
            "success": int(success),
            "saturation_share": share(step.saturated for step in steps[1:]),
            "path_ratio": path_ratio(steps),
        }
        for axis, (name, unit) in enumerate((("angle", "rad"), ("distance", "m"))):
            errors = [step.errors[axis] for step in estimated if step.errors is not None]
            row |= _error_columns(errors, name, unit)
            row[f"{name}_error_correlation"] = _correlation(errors)
            # The measurement that starts a filter is compared with nothing, so it is left out; No filter tests nothing.
            tested = [] if self._cell.estimator == "none" else estimated[1:]
            row |= _consistency_columns([step for step in tested if step.actions[axis] != "miss"], axis, name)
        row |= _motion_columns(steps)
        return {column: row[column] for column in COLUMNS}

    def curve(self) -> NDArray[np.float64]:
        """Cumulative absolute errors (figures 6-9 of paper B), shape (steps, 3): time s, angle rad, distance m."""
        angle = distance = 0.0
        points = []
        for step in self._steps:
            if step.errors is not None:
                angle += abs(step.errors[0])
                distance += abs(step.errors[1])
            points.append((step.time, angle, distance))
        return np.array(points, dtype=np.float64).reshape(-1, 3)


def quantile(values: Sequence[float], share: float) -> float:
    """Quantile by linear interpolation between order statistics (NumPy's default rule)."""
    ordered = sorted(values)
    position = share * (len(ordered) - 1)
    below = math.floor(position)
    above = min(below + 1, len(ordered) - 1)
    return ordered[below] + (position - below) * (ordered[above] - ordered[below])


class Step(NamedTuple):
    """One instant of an episode, SI units."""

    time: float
    bearing: float
    distance: float
    errors: tuple[float, float] | None
    actions: tuple[str, str]
    nis: tuple[float, float]
    measured: bool
    visible: bool
    collision: bool
    collision_with: str
    surface_distance: float
    robot: tuple[float, float]
    person: tuple[float, float]
    twist: tuple[float, float]
    saturated: bool

    @staticmethod
    def errors_of(estimate: Sequence[float], bearing: float, distance: float) -> tuple[float, float]:
        """Return the errors of an estimate (bearing rad, distance m) against the truth."""
        return math.remainder(estimate[0] - bearing, 2.0 * math.pi), estimate[1] - distance

    @classmethod
    def of(cls, info: Mapping[str, Any], estimate: Estimate | None, measurement: tuple[float, float] | None) -> Step:
        """Return the moment of an environment's info and what the policy believed then."""
        bearing, distance = float(info["bearing"]), float(info["distance"])
        errors = None
        if estimate is not None:
            errors = cls.errors_of((float(estimate.bearing), float(estimate.distance)), bearing, distance)
        robot, person, twist = info["robot_pose"], info["person_pose"], info["twist"]
        return cls(
            time=float(info["time"]),
            bearing=bearing,
            distance=distance,
            errors=errors,
            actions=("miss", "miss") if estimate is None else estimate.action,
            nis=(0.0, 0.0) if estimate is None else estimate.nis,
            measured=measurement is not None,
            visible=bool(info["visible"]),
            collision=bool(info["collision"]),
            collision_with=str(info["collision_with"]),
            surface_distance=float(info["surface_distance"]),
            robot=(float(robot[0]), float(robot[1])),
            person=(float(person[0]), float(person[1])),
            twist=(float(twist[0]), float(twist[1])),
            saturated=bool(info["saturated"]),
        )


def _error_columns(errors: Sequence[float], name: str, unit: str) -> Row:
    """RMSE (35), bias, 95th percentile and tails of one axis; all None when there never was an estimate.

    An outlier lies more than three robust standard deviations (scaled median absolute deviation) from the median;
    ``outlier_square_share`` is the part of the squared error that the outliers carry.
    """
    columns = (f"{name}_rmse_{unit}", f"{name}_bias_{unit}", f"{name}_p95_{unit}")
    tails = (f"{name}_outlier_share", f"{name}_outlier_square_share")
    if not errors:
        return dict.fromkeys((*columns, *tails))
    median = quantile(errors, 0.5)
    limit = OUTLIER_SIGMAS * MAD_TO_SIGMA * quantile([abs(error - median) for error in errors], 0.5)
    outliers = [error for error in errors if abs(error - median) > limit]
    squares = math.fsum(error * error for error in errors)
    outlier_squares = math.fsum(error * error for error in outliers)
    p95 = quantile([abs(error) for error in errors], 0.95)
    return {
        **dict(zip(columns, (rms(errors), math.fsum(errors) / len(errors), p95), strict=True)),
        tails[0]: len(outliers) / len(errors),
        tails[1]: outlier_squares / squares if squares > 0.0 else 0.0,
    }


def _correlation(errors: Sequence[float]) -> float | None:
    """Correlation of an error with the one a step before: near 1, a filter cannot average it away."""
    if not errors:
        return None
    mean = math.fsum(errors) / len(errors)
    squares = math.fsum((error - mean) ** 2 for error in errors)
    products = math.fsum((a - mean) * (b - mean) for a, b in pairwise(errors))
    return products / squares if squares > 0.0 else None


def _consistency_columns(updates: Sequence[Step], axis: int, name: str) -> Row:
    """What the filter's own test said of the measurements of one axis."""
    columns = (f"{name}_inflated_share", f"{name}_nis_mean", f"{name}_nis_inside_95_share")
    if not updates:
        return dict.fromkeys(columns)
    nis = [float(step.nis[axis]) for step in updates]
    values = (
        share(step.actions[axis] == "inflate" for step in updates),
        math.fsum(nis) / len(nis),
        share(NIS_BOUNDS[0] <= value <= NIS_BOUNDS[1] for value in nis),
    )
    return dict(zip(columns, values, strict=True))


def _motion_columns(steps: Sequence[Step]) -> Row:
    """Rms acceleration and jerks by finite differences of the odometry's mean twist."""
    acceleration = differences([step.twist[0] for step in steps], steps)
    angular = differences([step.twist[1] for step in steps], steps)
    return {
        "rms_acceleration_m_s2": rms(acceleration),
        "rms_jerk_m_s3": rms(differences(acceleration, steps[1:])),
        "rms_angular_jerk_rad_s3": rms(differences(angular, steps[1:])),
    }


def differences(values: Sequence[float], steps: Sequence[Step]) -> list[float]:
    """Return the rates of change between steps, one fewer than values."""
    return [(values[k] - values[k - 1]) / (steps[k].time - steps[k - 1].time) for k in range(1, len(values))]


def spans_out_of_view(steps: Sequence[Step]) -> list[float]:
    """Durations, s, of the spans out of view: the number of instants unseen in a row times the period."""
    period = (steps[-1].time - steps[0].time) / max(len(steps) - 1, 1)
    return [period * len(list(span)) for visible, span in groupby(steps, key=lambda step: step.visible) if not visible]


def in_band(step: Step) -> bool:
    """Whether the person is at about the right distance, about ahead."""
    return BAND_DISTANCE[0] <= step.distance <= BAND_DISTANCE[1] and abs(step.bearing) <= BAND_BEARING


def seconds_near(steps: Sequence[Step]) -> float:
    """Return the time within `PERSONAL_SURFACE` of the person, s."""
    return math.fsum(
        steps[k].time - steps[k - 1].time for k in range(1, len(steps)) if steps[k].surface_distance < PERSONAL_SURFACE
    )


def path_ratio(steps: Sequence[Step]) -> float | None:
    """The robot's path length over the person's; None when the person did not move."""
    robot = math.fsum(math.dist(steps[k].robot, steps[k - 1].robot) for k in range(1, len(steps)))
    person = math.fsum(math.dist(steps[k].person, steps[k - 1].person) for k in range(1, len(steps)))
    return robot / person if person > 0.0 else None


def share(flags: Any) -> float:
    """Return how many of the flags are set; 0 of none."""
    values = [bool(flag) for flag in flags]
    return sum(values) / len(values) if values else 0.0


def rms(values: Sequence[float]) -> float | None:
    """Return the root of the mean square, or None of nothing."""
    return math.sqrt(math.fsum(value * value for value in values) / len(values)) if values else None
