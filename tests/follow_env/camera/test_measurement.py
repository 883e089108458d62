"""The emulated tracker: its errors against the statistics that its settings promise."""

import math

import gymnasium
import numpy as np
import pytest

import follow_env
from follow_env.camera.measurement import GaussMarkov, MeasurementModel
from follow_env.sensors import MeasurementConfig

DT = 1.0 / 30.0
DEFAULT = MeasurementConfig()
CLEAN = {"bearing_noise": 0.0, "distance_noise": 0.0, "distance_bias": 0.0}


def measured(config, steps, seed=0, bearing=0.1, distance=8.0):
    """Errors (steps, 2) of a model that looks at a constant truth; NaN where there is no measurement."""
    model, rng = MeasurementModel(config, DT), np.random.default_rng(seed)
    rows = [model.measure(bearing, distance, True, rng) for _ in range(steps)]
    return np.array([(math.nan, math.nan) if row is None else (row[0] - bearing, row[1] - distance) for row in rows])


def runs(flags):
    """Lengths of the runs of True that both begin and end inside the record."""
    edges = np.flatnonzero(np.diff(flags.astype(int)))
    begins, ends = edges[::2] if not flags[0] else edges[1::2], edges[1::2] if not flags[0] else edges[2::2]
    return ends - begins[: len(ends)]


@pytest.mark.parametrize("tau", [0.0, 0.1, 0.4])
def test_gauss_markov_errors_have_unit_variance_from_the_first_step_on(tau):
    """Over 4000 records: the variance must not grow from zero, which is what a wrong start looks like."""
    rng, errors = np.random.default_rng(1), GaussMarkov(4000, tau, DT)
    spread = [np.std(errors.step(rng)) for _ in range(30)]
    assert spread == pytest.approx([1.0] * 30, abs=0.05)


@pytest.mark.parametrize("tau", [0.0, 0.1, 0.4])
def test_gauss_markov_errors_forget_exponentially(tau):
    rng, errors = np.random.default_rng(2), GaussMarkov(4000, tau, DT)
    record = np.array([errors.step(rng) for _ in range(25)])
    for lag in (1, 3, 12, 24):
        wanted = math.exp(-lag * DT / tau) if tau > 0.0 else 0.0
        assert (record[0] * record[lag]).mean() == pytest.approx(wanted, abs=0.07), lag


def test_gauss_markov_processes_are_independent_of_each_other():
    rng, errors = np.random.default_rng(3), GaussMarkov(4, 0.1, DT)
    record = np.array([errors.step(rng) for _ in range(20000)])
    mixed = np.corrcoef(record.T) - np.eye(4)
    assert np.abs(mixed).max() < 0.08


def test_the_time_constant_is_in_seconds_at_every_rate():
    """After 0.2 s a process of 0.2 s has forgotten the same share at 10 and at 60 Hz."""
    for rate in (10, 60):
        rng, errors = np.random.default_rng(4), GaussMarkov(5000, 0.2, 1.0 / rate)
        record = np.array([errors.step(rng) for _ in range(rate // 5 + 1)])
        assert (record[0] * record[-1]).mean() == pytest.approx(math.exp(-1.0), abs=0.06), rate


def test_regular_errors_have_the_stated_bias_and_spread():
    config = MeasurementConfig(
        bearing_bias=0.02, bearing_noise=0.015, bearing_correlation_s=0.0, distance_correlation_s=0.0,
        distance_bias=-0.11, distance_noise=0.05,
    )  # fmt: skip
    errors = measured(config, 20000)
    assert errors.mean(axis=0) == pytest.approx((0.02, -0.11), abs=0.002)
    assert errors.std(axis=0) == pytest.approx((0.015, 0.05), rel=0.03)
    assert abs(np.corrcoef(errors.T)[0, 1]) < 0.03


@pytest.mark.parametrize(("share", "duration"), [(0.05, 0.1), (0.2, 0.5), (0.1, 0.0)])
def test_outliers_have_the_stated_share_and_mean_duration(share, duration):
    config = MeasurementConfig(**CLEAN, outlier_share=share, outlier_duration_s=duration)
    outlier = measured(config, 60000)[:, 1] > 0.5
    assert outlier.mean() == pytest.approx(share, rel=0.15)
    lengths = runs(outlier)
    # Single steps follow each other by chance only.
    wanted = duration / DT if duration > 0.0 else 1.0 / (1.0 - share)
    assert lengths.mean() == pytest.approx(wanted, rel=0.12)


def test_outlier_sizes_are_uniform_in_their_range_and_constant_within_a_run():
    config = MeasurementConfig(**CLEAN, outlier_share=0.05, outlier_duration_s=0.2, outlier_low=0.8, outlier_high=2.8)
    sizes = measured(config, 60000)[:, 1]
    drawn = np.unique(sizes[sizes > 1e-9].round(9))
    assert len(drawn) > 300
    assert drawn.min() >= 0.8
    assert drawn.max() <= 2.8
    assert drawn.mean() == pytest.approx(1.8, abs=0.08)
    assert drawn.std() == pytest.approx(2.0 / math.sqrt(12.0), rel=0.06)
    steady = np.diff(sizes)[(sizes[1:] > 0.5) & (sizes[:-1] > 0.5)]
    assert np.mean(np.abs(steady) < 1e-9) > 0.9


def test_outliers_leave_the_bearing_alone():
    config = MeasurementConfig(**CLEAN, outlier_share=0.5)
    assert np.abs(measured(config, 500)[:, 0]).max() < 1e-12


@pytest.mark.parametrize("share", [0.0, 0.1, 0.6])
def test_misses_have_the_stated_share_and_come_alone(share):
    missed = np.isnan(measured(MeasurementConfig(miss_share=share), 20000)[:, 0])
    assert missed.mean() == pytest.approx(share, abs=0.012)
    if share:
        assert np.corrcoef(missed[1:], missed[:-1])[0, 1] == pytest.approx(0.0, abs=0.03)


def test_without_outliers_and_misses_there_are_none():
    errors = measured(MeasurementConfig(), 5000)
    assert np.isfinite(errors).all()
    assert np.abs(errors[:, 1] - DEFAULT.distance_bias).max() < 5.0 * DEFAULT.distance_noise


def test_what_is_not_visible_is_not_measured():
    model, rng = MeasurementModel(MeasurementConfig(), DT), np.random.default_rng(7)
    assert [model.measure(0.0, 1.5, False, rng) for _ in range(20)] == [None] * 20


def test_the_generator_moves_on_alike_whether_the_person_is_seen_or_not():
    """So two controllers with one seed meet the same errors, whatever they let out of view."""
    config = MeasurementConfig(outlier_share=0.1, miss_share=0.1)
    always, sometimes = MeasurementModel(config, DT), MeasurementModel(config, DT)
    one, two = np.random.default_rng(8), np.random.default_rng(8)
    seen = np.random.default_rng(9).random(300) < 0.5
    for step, visible in enumerate(seen.tolist()):
        full = always.measure(0.1, 2.0, True, one)
        part = sometimes.measure(0.1, 2.0, visible, two)
        assert part == (full if visible else None), step
        assert one.bit_generator.state == two.bit_generator.state, step


def test_a_measured_distance_is_never_negative():
    config = MeasurementConfig(distance_bias=-2.0)
    model, rng = MeasurementModel(config, DT), np.random.default_rng(10)
    assert {model.measure(0.0, 1.0, True, rng)[1] for _ in range(50)} == {0.0}


@pytest.fixture(scope="module")
def parked_errors():
    """Errors of the measurement observation against the truth in `info`, over ten episodes of a parked robot."""
    env = gymnasium.make(
        follow_env.IDS["indoor"],
        route="standing",
        sensor={"measurement": {"bearing_correlation_s": 0, "distance_correlation_s": 0, "miss_share": 0.2}},
    ).unwrapped
    rows = []
    for seed in range(10):
        observation, info = env.reset(seed=seed)
        truncated = False
        while not truncated:
            rows.append((observation[2], observation[0] - info["bearing"], observation[1] - info["distance"]))
            observation, _, terminated, truncated, info = env.step(np.zeros(2, np.float32))
            assert not terminated
    env.close()
    return np.array(rows)


def test_the_environment_measures_with_the_configured_errors(parked_errors):
    valid = parked_errors[:, 0] == 1.0
    assert valid.mean() == pytest.approx(0.8, abs=0.02)
    errors = parked_errors[valid, 1:]
    assert errors.mean(axis=0) == pytest.approx((DEFAULT.bearing_bias, DEFAULT.distance_bias), abs=0.001)
    assert errors.std(axis=0) == pytest.approx((DEFAULT.bearing_noise, DEFAULT.distance_noise), rel=0.05)


def test_an_episode_of_default_errors_is_correlated_as_configured():
    """Lag-one correlation over the pooled steps of a moving robot's episodes: exp(-dt / tau)."""
    env = gymnasium.make(follow_env.IDS["corridor"], route="straight").unwrapped
    before, after = [], []
    for seed in range(8):
        observation, info = env.reset(seed=seed)
        errors, truncated = [], False
        while not truncated:
            errors.append((observation[0] - info["bearing"], observation[1] - info["distance"] - DEFAULT.distance_bias))
            lag = min(max(1.5 * (info["distance"] - 1.5), 0.0), 1.0)
            observation, _, terminated, truncated, info = env.step(np.array((lag, 0.0), np.float32))
            assert observation[2] == 1.0
            assert not terminated
        before += errors[:-1]
        after += errors[1:]
    env.close()
    before, after = np.array(before), np.array(after)
    correlation = (before * after).mean(axis=0) / (before**2).mean(axis=0)
    assert correlation[0] == pytest.approx(math.exp(-DT / DEFAULT.bearing_correlation_s), abs=0.05)
    assert correlation[1] == pytest.approx(math.exp(-DT / DEFAULT.distance_correlation_s), abs=0.05)
    assert np.sqrt((before**2).mean(axis=0)) == pytest.approx((DEFAULT.bearing_noise, DEFAULT.distance_noise), rel=0.2)


def test_two_drivers_with_one_seed_meet_the_same_errors():
    """Where both see the person, measurement minus truth is the same although the robots are elsewhere."""
    drivers = {"parked": (0.0, 0.0), "swinging": (0.1, 0.15)}
    errors = {}
    for name, action in drivers.items():
        env = gymnasium.make(
            follow_env.IDS["indoor"],
            route="standing",
            sensor={"measurement": {"outlier_share": 0.1, "miss_share": 0.1}},
        ).unwrapped
        observation, info = env.reset(seed=11)
        errors[name] = []
        for step in range(60):
            seen = (observation[0] - info["bearing"], observation[1] - info["distance"])
            errors[name].append(seen if observation[2] else (math.nan, math.nan))
            sign = 1.0 if step % 20 < 10 else -1.0
            observation, *_, info = env.step(np.array((sign * action[0], sign * action[1]), np.float32))
        assert (abs(info["distance"] - 1.5) > 0.003) == (name == "swinging")
        env.close()
    parked, swinging = np.array(errors["parked"]), np.array(errors["swinging"])
    assert np.isnan(parked).any()
    assert parked[~np.isnan(parked)].size > 60
    assert swinging == pytest.approx(parked, abs=1e-5, nan_ok=True)
