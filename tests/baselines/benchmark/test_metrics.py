"""The numbers of one episode against plain NumPy on the same errors, and against cases worked out by hand."""

import json
import math
from typing import Any

import numpy as np
import pytest

from baselines.benchmark.cells import Cell
from baselines.benchmark.metrics.episode import COLUMNS, EpisodeMetrics, Row, quantile
from tracker.estimators import Estimate

CELL = Cell("emulated", "indoor", "akf")
DT = 1.0 / 30.0


def info(k: int, **changes: Any) -> dict[str, Any]:
    """A step of a perfect pursuit: person 1.5 m ahead, both at 0.9 m/s."""
    return {
        "time": k * DT,
        "bearing": 0.0,
        "distance": 1.5,
        "visible": True,
        "collision": False,
        "collision_with": "none",
        "surface_distance": 1.1,
        "robot_pose": np.array([0.9 * k * DT, 0.0, 0.0]),
        "person_pose": np.array([1.5 + 0.9 * k * DT, 0.0, 0.0]),
        "twist": np.array([0.9, 0.0]),
        "saturated": False,
    } | changes


def estimate(bearing: float = 0.0, distance: float = 1.5, nis=(1.0, 1.0), action=("accept", "accept")) -> Estimate:
    return Estimate(bearing, distance, (1e-4, 1e-2), (0.0, 0.0), nis, (1.0, 1.0), action)


def finish(steps: list[tuple[dict[str, Any], Estimate | None]], cell: Cell = CELL, terminated: bool = False) -> Row:
    metrics = EpisodeMetrics(cell, 7)
    for truth, belief in steps:
        metrics.record(truth, belief, None if belief is None else (belief.bearing, belief.distance))
    return metrics.row(terminated)


def test_a_row_has_every_column_in_order_and_no_nan() -> None:
    row = finish([(info(k), estimate()) for k in range(90)])
    assert tuple(row) == COLUMNS
    assert json.loads(json.dumps(row, allow_nan=False)) == row
    assert (row["perception"], row["scene"], row["estimator"], row["seed"]) == ("emulated", "indoor", "akf", 7)


def test_estimation_errors_agree_with_numpy() -> None:
    generator = np.random.default_rng(1)
    truth, errors = generator.uniform(-0.4, 0.4, 500), generator.normal((0.01, -0.1), (0.02, 0.1), (500, 2))
    errors[::20, 1] += 2.0
    row = finish(
        [(info(k, bearing=truth[k]), estimate(truth[k] + errors[k, 0], 1.5 + errors[k, 1])) for k in range(500)]
    )
    for axis, name, unit in ((0, "angle", "rad"), (1, "distance", "m")):
        assert row[f"{name}_rmse_{unit}"] == pytest.approx(np.sqrt(np.mean(errors[:, axis] ** 2)), rel=1e-9)
        assert row[f"{name}_bias_{unit}"] == pytest.approx(np.mean(errors[:, axis]), rel=1e-9)
        assert row[f"{name}_p95_{unit}"] == pytest.approx(np.quantile(np.abs(errors[:, axis]), 0.95), rel=1e-9)
    assert row["distance_outlier_share"] == pytest.approx(0.05, abs=0.004)
    carried = np.sum(errors[::20, 1] ** 2) / np.sum(errors[:, 1] ** 2)
    assert row["distance_outlier_square_share"] == pytest.approx(carried, abs=0.02)
    assert row["angle_outlier_share"] < 0.01


@pytest.mark.parametrize("correlation", [0.0, 0.6, 0.95])
def test_the_correlation_of_successive_errors(correlation: float) -> None:
    draws = np.random.default_rng(3).normal(size=(20_000, 2))
    errors = np.zeros((20_000, 2))
    for k in range(1, 20_000):
        errors[k] = correlation * errors[k - 1] + 0.01 * draws[k]
    row = finish([(info(k), estimate(0.1 + error[0], 1.4 + error[1])) for k, error in enumerate(errors)])
    for name in ("angle", "distance"):
        assert row[f"{name}_error_correlation"] == pytest.approx(correlation, abs=0.02)


@pytest.mark.parametrize("share", [0.0, 0.05, 0.5, 0.95, 1.0])
@pytest.mark.parametrize("size", [1, 2, 7, 100])
def test_quantiles_agree_with_numpy(share: float, size: int) -> None:
    values = np.random.default_rng(size).normal(size=size)
    assert quantile(values.tolist(), share) == pytest.approx(np.quantile(values, share), rel=1e-12)


def test_an_angle_error_goes_the_short_way_round() -> None:
    row = finish([(info(k, bearing=-math.pi + 0.01), estimate(bearing=math.pi - 0.01)) for k in range(3)])
    assert row["angle_bias_rad"] == pytest.approx(-0.02)


def test_steps_before_the_first_measurement_are_not_scored() -> None:
    steps = [(info(k), None if k < 10 else estimate(distance=1.4)) for k in range(40)]
    row = finish(steps)
    assert (row["steps"], row["estimate_steps"], row["measurement_share"]) == (40, 30, 0.75)
    assert row["distance_bias_m"] == pytest.approx(-0.1)


def test_an_episode_without_any_estimate_leaves_its_columns_empty() -> None:
    row = finish([(info(k), None) for k in range(5)])
    empty = {name for name, value in row.items() if value is None}
    assert empty == {name for name in COLUMNS if name.startswith(("angle_", "distance_")) and "tracking" not in name}


def test_the_curve_is_the_running_sum_of_absolute_errors() -> None:
    metrics = EpisodeMetrics(CELL, 0)
    for k in range(30):
        metrics.record(info(k), None if k == 0 else estimate(0.01 * (-1) ** k, 1.5 - 0.1), None)
    curve = metrics.curve()
    assert (curve.shape, curve.dtype) == ((30, 3), np.float64)
    np.testing.assert_allclose(curve[:, 0], np.arange(30) * DT)
    np.testing.assert_allclose(curve[:, 1], 0.01 * np.arange(30), atol=1e-12)
    np.testing.assert_allclose(curve[:, 2], 0.1 * np.arange(30), atol=1e-12)


def test_the_filter_is_judged_on_measurements_that_it_could_test() -> None:
    beliefs = [estimate(nis=(0.0, 0.0))]
    beliefs += [estimate(nis=(1.0, 9.0), action=("accept", "inflate"))] * 6
    beliefs += [estimate(nis=(1.0, 1.0))] * 2
    beliefs += [estimate(nis=(0.0, 0.0), action=("miss", "miss"))] * 5
    row = finish([(info(k), belief) for k, belief in enumerate(beliefs)])
    assert (row["angle_inflated_share"], row["distance_inflated_share"]) == (0.0, 0.75)
    assert (row["angle_nis_mean"], row["distance_nis_mean"]) == (1.0, 7.0)
    assert (row["angle_nis_inside_95_share"], row["distance_nis_inside_95_share"]) == (1.0, 0.25)


def test_nis_of_a_consistent_filter_lies_inside_its_bounds_95_percent_of_the_time() -> None:
    nis = np.random.default_rng(2).chisquare(1, 20_000).tolist()
    row = finish([(info(k), estimate(nis=(value, value))) for k, value in enumerate(nis)])
    assert row["angle_nis_inside_95_share"] == pytest.approx(0.95, abs=0.005)
    assert row["angle_nis_mean"] == pytest.approx(1.0, abs=0.03)


def test_no_filter_tests_nothing() -> None:
    row = finish([(info(k), estimate()) for k in range(5)], Cell("emulated", "indoor", "none"))
    assert row["angle_inflated_share"] is None
    assert row["distance_nis_mean"] is None


def test_following_errors_are_those_of_the_truth_to_the_set_point() -> None:
    row = finish([(info(k, bearing=0.1, distance=1.7), estimate(0.5, 3.0)) for k in range(10)])
    assert row["angle_tracking_rmse_rad"] == pytest.approx(0.1)
    assert row["distance_tracking_rmse_m"] == pytest.approx(0.2)


def test_time_out_of_view_is_the_number_of_instants_unseen_times_the_period() -> None:
    unseen = {*range(10, 25), *range(50, 53), *range(90, 100)}
    row = finish([(info(k, visible=k not in unseen), estimate()) for k in range(100)])
    assert row["loss_count"] == 3
    assert row["longest_out_of_view_s"] == pytest.approx(15 * DT)
    row = finish([(info(k, visible=k < 60), estimate()) for k in range(100)])
    assert row["longest_out_of_view_s"] == pytest.approx(40 * DT)


def test_seconds_in_the_intimate_zone() -> None:
    row = finish([(info(k, surface_distance=0.3 if 20 <= k < 50 else 0.5), estimate()) for k in range(100)])
    assert row["seconds_nearer_045_m"] == pytest.approx(1.0)
    assert row["min_surface_distance_m"] == 0.3


@pytest.mark.parametrize(
    ("changes", "terminated", "ended", "success"),
    [
        ({}, False, "time", 1),
        ({"visible": lambda k: not 100 <= k < 130}, False, "time", 1),
        ({"visible": lambda k: not 100 <= k < 132}, False, "time", 0),
        ({"distance": lambda k: 1.5 if k < 320 else 2.2}, False, "time", 1),
        ({"distance": lambda k: 1.5 if k < 315 else 2.2}, False, "time", 0),
        ({"bearing": lambda k: 0.0 if k < 315 else -0.55}, False, "time", 0),
        ({"collision": lambda k: k == 399}, True, "collision", 0),
        ({}, True, "lost", 0),
    ],
    ids=["perfect", "1 s unseen", "longer unseen", "80 % in band", "79 % near", "79 % ahead", "collision", "lost"],
)
def test_success_needs_a_whole_episode_in_view_and_in_band(changes, terminated, ended, success) -> None:
    steps = [(info(k, **{name: value(k) for name, value in changes.items()}), estimate()) for k in range(400)]
    row = finish(steps, terminated=terminated)
    assert (row["ended"], row["success"]) == (ended, success)


def test_a_parked_robot_does_not_succeed() -> None:
    steps = [
        (info(k, distance=1.5 + 0.9 * k * DT, robot_pose=np.zeros(3), twist=np.zeros(2)), estimate())
        for k in range(400)
    ]
    row = finish(steps)
    assert (row["success"], row["path_ratio"]) == (0, 0.0)


def test_motion_of_a_sinusoidal_drive() -> None:
    """v = V sin(wt): rms acceleration V w/sqrt 2, rms jerk V w²/sqrt 2."""
    speed, rate, steps = 0.3, 2.0 * math.pi / 2.0, 600
    twists = [np.array([speed * math.sin(rate * k * DT), speed * math.cos(rate * k * DT)]) for k in range(steps)]
    row = finish([(info(k, twist=twists[k], saturated=k % 4 == 1), estimate()) for k in range(steps)])
    assert row["rms_acceleration_m_s2"] == pytest.approx(speed * rate / math.sqrt(2), rel=0.01)
    assert row["rms_jerk_m_s3"] == pytest.approx(speed * rate**2 / math.sqrt(2), rel=0.01)
    assert row["rms_angular_jerk_rad_s3"] == pytest.approx(speed * rate**2 / math.sqrt(2), rel=0.01)
    assert row["saturation_share"] == pytest.approx(0.25, abs=0.002)
    assert row["path_ratio"] == pytest.approx(1.0)


def test_a_person_who_stands_still_leaves_no_path_ratio() -> None:
    assert finish([(info(k, person_pose=np.zeros(3)), estimate()) for k in range(5)])["path_ratio"] is None


def test_an_episode_without_steps_is_refused() -> None:
    with pytest.raises(ValueError, match="no step"):
        EpisodeMetrics(CELL, 0).row(terminated=False)
