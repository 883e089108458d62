"""The fit: it recovers the errors it is shown, meets the target it is given, and keeps its own rule for Q."""

import dataclasses
import math

import numpy as np
import pytest

from baselines.followers import calibration
from baselines.papers.dong2018 import calibrate
from baselines.papers.dong2018.calibrate import DT, _fit, _summarize
from follow_env.camera.measurement import MeasurementModel
from follow_env.sensors import MeasurementConfig
from tracker.depth import RULES

CONFIG = MeasurementConfig(
    bearing_bias=0.002,
    bearing_noise=0.012,
    bearing_correlation_s=0.15,
    distance_bias=-0.08,
    distance_noise=0.05,
    distance_correlation_s=0.1,
    outlier_share=0.12,
    outlier_duration_s=0.3,
    outlier_low=0.6,
    outlier_high=1.4,
    miss_share=0.05,
)


def play(config, episodes, steps=2000):
    """Errors of the emulated sensor as `calibrate` collects them from frames; the person stands at 1 m, then at 2 m."""
    rng = np.random.default_rng(8)
    recorded = []
    for _ in range(episodes):
        model, samples = MeasurementModel(config, DT), []
        for k in range(steps):
            truth = (0.1, 1.0 if k < steps // 2 else 2.0)
            measured = model.measure(*truth, True, rng)
            samples.append(None if measured is None else (measured[0] - truth[0], measured[1] - truth[1], truth[1]))
        recorded.append(dict.fromkeys(RULES, samples))
    return recorded


@pytest.fixture(scope="module")
def summary():
    return _summarize(play(CONFIG, 30))["grid_mean"]


def test_the_errors_that_went_in_are_found_again(summary):
    bearing, distance = summary["bearing"], summary["distance"]
    assert summary["miss_share"] == pytest.approx(0.05, abs=0.003)
    assert bearing["bias"] == pytest.approx(0.002, abs=0.001)
    assert bearing["spread"] == pytest.approx(0.012, rel=0.05)
    assert bearing["correlation_s"] == pytest.approx(0.15, rel=0.1)
    assert distance["bias"] == pytest.approx(-0.08, abs=0.005)
    assert distance["spread"] == pytest.approx(0.05, rel=0.05)
    assert distance["correlation_s"] == pytest.approx(0.1, rel=0.1)
    assert distance["outlier_share"] == pytest.approx(0.12, abs=0.01)
    assert distance["outlier_duration_s"] == pytest.approx(0.3, rel=0.15)
    assert (distance["outlier_low"], distance["outlier_high"]) == pytest.approx((0.64, 1.36), abs=0.06)


def test_outliers_that_do_not_depend_on_the_distance_are_as_many_near_as_far(summary):
    distance = summary["distance"]
    assert distance["nearer_outlier_share"] == pytest.approx(distance["farther_outlier_share"], abs=0.03)


@pytest.mark.parametrize("target", [(0.0141, 0.1531906), (0.0173, 0.46258)])
def test_the_fitted_sensor_has_the_rmse_it_was_fitted_to(target):
    fitted = dataclasses.replace(_fit(CONFIG, *target), miss_share=0.0)

    errors = np.array([error[:2] for episode in play(fitted, 40) for error in episode["centroid"]])

    assert np.sqrt((errors**2).mean(axis=0)) == pytest.approx(target, rel=0.04)
    assert fitted.outlier_share == CONFIG.outlier_share
    assert fitted.distance_noise / CONFIG.distance_noise == pytest.approx(fitted.outlier_low / CONFIG.outlier_low)


def test_the_shipped_sensors_all_have_the_papers_no_filter_rmse():
    for name in calibration.family():
        for scene, (bearing, distance) in calibrate.PAPER_NO_FILTER.items():
            config = MeasurementConfig(**calibration.sensor(name, scene))
            low, high, share = config.outlier_low, config.outlier_high, config.outlier_share
            uniform = np.linspace(low, high, 100_001)
            square = (1 - share) * config.distance_bias**2 + share * ((config.distance_bias + uniform) ** 2).mean()
            assert math.sqrt(square + config.distance_noise**2) == pytest.approx(distance, rel=1e-4), (name, scene)
            assert math.hypot(config.bearing_bias, config.bearing_noise) == pytest.approx(bearing, rel=1e-4)


def test_the_shipped_noise_keeps_the_rule_and_a_smaller_q_would_not():
    """Indoor, fitted: at the shipped multiple of the distance's Q the clean share is below 2 alpha, one less is not."""
    how, noise = calibration.settings()["how"], calibration.settings()["noise"]
    for entry in (scene for by_scene in noise.values() for scene in by_scene.values()):
        assert max(*entry["inflated_shares"], *entry["acceleration_inflated_shares"]) < 2 * how["alpha"]
    entry = noise["emulated/fitted"]["indoor"]
    multiple = entry["multiples"][1]
    assert multiple > 1
    clean = dataclasses.replace(
        MeasurementConfig(**calibration.sensor("fitted", "indoor")), outlier_share=0.0, miss_share=0.0
    )
    env = calibrate.FollowEnv(scene="indoor", sensor={"measurement": dataclasses.asdict(clean)})
    smaller = (entry["process"][0], entry["process"][1] * (multiple - 1) / multiple)
    shares = calibrate._inflated_shares(
        env, "akf", calibration.NoiseModel(tuple(entry["measurement"]), smaller, tuple(entry["acceleration"]))
    )
    env.close()
    assert shares[1] >= 2 * how["alpha"]
