"""Properties of the estimators that follow from paper B's equations and from estimation theory."""

import math
import warnings

import numpy as np
import pytest
from scipy import stats

from tracker.estimators import (
    AdaptiveKalmanFilter,
    AugmentedKalmanFilter,
    KalmanFilter,
    LockOutWarning,
    NoFilter,
    chi2_quantile,
)

DT = 1.0 / 30.0
SPEED = 0.86  # m/s, paper B's walk
STANDING = (0.0, 0.0)
Q = (1.7e-4, (2.0 * SPEED * DT) ** 2)
R = (2.0e-4, 1.0e-2)
DENSITY = (0.5, 0.5)

FILTERS = {
    "kf": lambda: KalmanFilter(Q, R),
    "akf": lambda: AdaptiveKalmanFilter(Q, R),
    "akf_cv": lambda: AugmentedKalmanFilter(DENSITY, R),
}
ESTIMATORS = {"none": NoFilter, **FILTERS}
each_estimator = pytest.mark.parametrize("make", ESTIMATORS.values(), ids=ESTIMATORS)
each_filter = pytest.mark.parametrize("make", FILTERS.values(), ids=FILTERS)


def drive(estimator, measurements, twist=STANDING):
    """Return the estimate after each measurement of a run at constant twist."""
    estimates = []
    for measurement in measurements:
        estimator.predict(twist, DT)
        estimates.append(estimator.update(measurement))
    return estimates


def noisy_walk(rng, steps, outlier_share=0.0):
    """Measurements of a person kept at 1.5 m straight ahead, some of them 1-3 m too far."""
    bearings = rng.normal(0.0, math.sqrt(R[0]), steps)
    distances = 1.5 + rng.normal(0.0, math.sqrt(R[1]), steps)
    distances += (rng.random(steps) < outlier_share) * rng.uniform(1.0, 3.0, steps)
    return list(zip(bearings.tolist(), distances.tolist(), strict=True))


@each_estimator
def test_nothing_is_estimated_before_the_first_measurement(make):
    assert drive(make(), [None, None], (0.5, 0.5)) == [None, None]


@each_estimator
def test_the_first_measurement_is_the_first_estimate(make):
    estimator = make()
    estimator.predict((0.5, 0.5), DT)
    estimate = estimator.update((0.1, 1.7))
    assert (estimate.bearing, estimate.distance) == (0.1, 1.7)
    assert (estimate.action, estimate.innovation, estimate.nis, estimate.inflation) == (
        ("accept", "accept"),
        (0.0, 0.0),
        (0.0, 0.0),
        (1.0, 1.0),
    )


@each_filter
def test_first_variance_is_the_measurement_noise(make):
    assert make().update((0.1, 1.7)).variance == R


@each_estimator
def test_reset_makes_the_estimator_new(make):
    rng = np.random.default_rng(4)
    run = [*noisy_walk(rng, 20, 0.3), None, None, *noisy_walk(rng, 5)]
    used = make()
    drive(used, noisy_walk(rng, 30), (0.3, -0.2))
    used.reset()
    assert drive(used, run, (0.4, 0.1)) == drive(make(), run, (0.4, 0.1))


@each_filter
def test_an_estimate_moves_by_the_robots_own_motion(make):
    estimator = make()
    estimator.update((0.0, 1.5))
    estimate = drive(estimator, [None] * 15, (0.6, 0.4))[-1]
    assert estimate.action == ("miss", "miss")
    assert estimate.bearing == pytest.approx(-0.4 * 15 * DT)  # turning left leaves the target to the right
    # Driving takes 0.3 m; turning by 0.2 rad takes less than 1.5 m * (1 - cos 0.2), and nothing in the 2-state filters.
    assert 1.5 - 0.3 - 0.04 < estimate.distance <= 1.5 - 0.3 + 1e-12


def test_without_a_filter_a_miss_leaves_the_last_estimate():
    first, missed = drive(NoFilter(), [(0.2, 1.4), None], (1.0, 1.0))
    assert (missed.bearing, missed.distance) == (first.bearing, first.distance)
    assert missed.action == ("miss", "miss")


@each_filter
def test_uncertainty_grows_over_misses_and_shrinks_with_a_measurement(make):
    estimator = make()
    estimates = drive(estimator, [(0.0, 1.5), None, None, None, (0.0, 1.5)])
    for axis in (0, 1):
        variances = [estimate.variance[axis] for estimate in estimates]
        assert variances[0] < variances[1] < variances[2] < variances[3]
        assert variances[4] < variances[3]


@each_filter
def test_results_are_plain_floats_whatever_comes_in(make):
    estimator = make()
    estimator.update(np.array([0.1, 1.5], dtype=np.float32))
    estimator.predict(np.array([0.5, 0.1], dtype=np.float32), np.float32(DT))
    estimate = estimator.update(np.array([0.1, 1.5], dtype=np.float32))
    numbers = (estimate.bearing, estimate.distance, *estimate.variance, *estimate.innovation, *estimate.nis)
    assert {type(number) for number in numbers} == {float}


@pytest.mark.parametrize("kind", [KalmanFilter, AdaptiveKalmanFilter, AugmentedKalmanFilter])
def test_initial_state_and_variance_stand_before_any_measurement(kind):
    estimator = kind(DENSITY, R, initial_state=(0.2, 1.2), initial_variance=(0.3, 0.4))
    for _ in range(2):
        start = estimator.update(None)
        assert (start.bearing, start.distance, start.variance) == (0.2, 1.2, (0.3, 0.4))
        drive(estimator, [(0.0, 2.0)] * 3, (0.4, 0.4))
        estimator.reset()


@pytest.mark.parametrize("alpha", [1e-12, 0.001, 0.01, 0.05, 0.5, 0.999])
def test_chi2_quantile_agrees_with_scipy(alpha):
    assert chi2_quantile(alpha) == pytest.approx(stats.chi2.isf(alpha, df=1), rel=1e-9)


@pytest.mark.parametrize("alpha", [0.01, 0.05, 0.3])
def test_inflation_is_the_factor_that_meets_the_chi_square_bound(alpha):
    """Eqs. (15)-(16): lambda > 1 if and only if D > chi2, and with lambda R the statistic is exactly chi2."""
    rng = np.random.default_rng(1)
    chi2 = stats.chi2.isf(alpha, df=1)
    inflated = 0
    for _ in range(500):
        prior_variance = tuple(rng.uniform(0.001, 0.1, 2).tolist())
        innovation = rng.normal(0.0, 0.3, 2)
        estimator = AdaptiveKalmanFilter(Q, R, alpha, initial_state=(0.1, 1.5), initial_variance=prior_variance)
        estimate = estimator.update((0.1 + innovation[0], 1.5 + innovation[1]))
        for axis in (0, 1):
            nominal = prior_variance[axis] + R[axis]
            statistic = innovation[axis] ** 2 / nominal
            used = prior_variance[axis] + estimate.inflation[axis] * R[axis]
            assert estimate.nis[axis] == pytest.approx(statistic)
            assert (estimate.inflation[axis] > 1.0) == (statistic > chi2) == (estimate.action[axis] == "inflate")
            assert used == pytest.approx(max(nominal, innovation[axis] ** 2 / chi2))
            if statistic > chi2:
                assert innovation[axis] ** 2 / used == pytest.approx(chi2)
                inflated += 1
    assert 100 < inflated < 900  # both branches were seen


def test_corrections_of_outliers_redescend():
    chi2 = stats.chi2.isf(0.05, df=1)
    corrections = []
    for error in (0.5, 1.0, 2.0, 4.0, 1e3):
        estimator = AdaptiveKalmanFilter(Q, R, initial_state=(0.0, 1.5))
        estimate = estimator.update((0.0, 1.5 + error))
        corrections.append(estimate.distance - 1.5)
        assert corrections[-1] == pytest.approx(R[1] * chi2 / error)
        assert estimate.variance[1] <= R[1]
    assert corrections == sorted(corrections, reverse=True)


def test_inflation_starts_from_the_nominal_noise_every_step():
    estimator = AdaptiveKalmanFilter(Q, R)
    after_outlier = drive(estimator, [(0.0, 1.5)] * 50 + [(0.0, 4.0), (0.0, 1.5)])[-1]
    assert after_outlier.inflation == (1.0, 1.0)
    assert after_outlier.nis[1] == pytest.approx(after_outlier.innovation[1] ** 2 / innovation_variance(after_outlier))


def innovation_variance(estimate):
    """Return P⁻ + R of the distance from an accepted estimate: P = P⁻ R / (P⁻ + R)."""
    prior = estimate.variance[1] * R[1] / (R[1] - estimate.variance[1])
    return prior + R[1]


def test_outliers_hurt_the_adaptive_filter_less():
    rng = np.random.default_rng(7)
    run = noisy_walk(rng, 2000, outlier_share=0.1)
    errors = {
        kind: math.sqrt(np.mean([(e.distance - 1.5) ** 2 for e in drive(kind(Q, R), run)]))
        for kind in (KalmanFilter, AdaptiveKalmanFilter)
    }
    assert errors[AdaptiveKalmanFilter] < 0.5 * errors[KalmanFilter]


def test_following_at_constant_speed_biases_the_two_state_filter_as_riccati_says():
    """Steady distance error -(1-K)/K v dt, with K from P⁻² - Q P⁻ - Q R = 0."""
    prior = (Q[1] + math.sqrt(Q[1] ** 2 + 4.0 * Q[1] * R[1])) / 2.0
    gain = prior / (prior + R[1])
    estimate = drive(KalmanFilter(Q, R), [(0.0, 1.5)] * 500, (SPEED, 0.0))[-1]
    assert estimate.distance - 1.5 == pytest.approx(-(1.0 - gain) / gain * SPEED * DT, rel=1e-9)
    assert estimate.variance[1] == pytest.approx((1.0 - gain) * prior, rel=1e-9)


def test_target_velocity_in_the_state_removes_the_bias():
    estimate = drive(AugmentedKalmanFilter(DENSITY, R, alpha=None), [(0.0, 1.5)] * 1000, (SPEED, 0.0))[-1]
    assert estimate.distance == pytest.approx(1.5, abs=1e-9)


def test_predicted_distance_turns_with_the_robot_only_in_the_augmented_filter():
    """A standing target at 25 deg, robot turning on the spot: compare with the rigid rotation of its position."""
    bearing, distance, omega = math.radians(25.0), 1.5, 0.33
    lateral, turn = distance * math.tan(bearing), omega * DT
    exact = distance * math.cos(turn) + lateral * math.sin(turn)
    predictions = []
    for estimator in (AugmentedKalmanFilter(DENSITY, R), KalmanFilter(Q, R)):
        estimator.update((bearing, distance))
        predictions.append(drive(estimator, [None], (0.0, omega))[0].distance)
    assert predictions[0] == pytest.approx(exact, abs=turn**2)
    assert predictions[1] == distance
    assert exact - distance > 10.0 * turn**2  # what the two-state model leaves to Q is far above the tolerance


@each_filter
def test_a_blind_full_turn_ends_where_it_began(make):
    estimator = make()
    estimator.update((0.1, 1.5))
    steps = 400
    omega = -2.0 * math.pi / (steps * DT)
    turned = drive(estimator, [None] * steps, (0.0, omega))
    assert turned[-1].bearing == pytest.approx(0.1)
    assert turned[-1].distance == pytest.approx(1.5, rel=0.05)
    assert max(abs(estimate.bearing) for estimate in turned) <= math.pi
    estimator.predict(STANDING, DT)
    assert estimator.update((0.1, 1.5)).innovation[0] == pytest.approx(0.0, abs=1e-9)


@each_filter
def test_bearing_innovations_take_the_short_way_round(make):
    estimator = make()
    estimator.update((3.14, 1.5))
    estimator.predict(STANDING, DT)
    estimate = estimator.update((-3.1, 1.5))
    assert estimate.innovation[0] == pytest.approx(2.0 * math.pi - 6.24)
    assert -math.pi <= estimate.bearing < -3.1


def two_sided_95(statistics):
    """Return whether the sum of chi-square(1) statistics lies inside its 95 % interval."""
    low, high = stats.chi2.interval(0.95, df=len(statistics))
    return low < sum(statistics) < high


def test_nis_of_the_kalman_filter_is_chi_square_on_matched_data():
    rng = np.random.default_rng(11)
    truth, nis = np.array([0.0, 3.0]), []
    estimator = KalmanFilter(Q, R)
    estimator.update(tuple(truth + rng.normal(0.0, np.sqrt(R))))
    for _ in range(2000):
        twist = rng.normal(0.0, 0.3, 2)
        truth = truth - DT * twist[::-1] + rng.normal(0.0, np.sqrt(Q))
        estimator.predict(twist, DT)
        nis.append(estimator.update(truth + rng.normal(0.0, np.sqrt(R))).nis)
    assert two_sided_95([bearing for bearing, _ in nis])
    assert two_sided_95([distance for _, distance in nis])


def test_nis_of_the_augmented_filter_is_chi_square_on_matched_data():
    rng = np.random.default_rng(12)
    value, rate, nis = np.zeros(2), rng.normal(0.0, np.sqrt((0.6, 0.75))), []  # the filter's own prior
    noise = np.linalg.cholesky([[DT**3 / 3.0, DT**2 / 2.0], [DT**2 / 2.0, DT]])
    estimator = AugmentedKalmanFilter(DENSITY, R, alpha=None)
    estimator.update(value + rng.normal(0.0, np.sqrt(R)))
    for _ in range(2000):
        step = noise @ rng.normal(size=(2, 2)) * np.sqrt(DENSITY)
        value, rate = value + DT * rate + step[0], rate + step[1]
        estimator.predict(STANDING, DT)
        nis.append(estimator.update(value + rng.normal(0.0, np.sqrt(R))).nis)
    assert two_sided_95([bearing for bearing, _ in nis])
    assert two_sided_95([distance for _, distance in nis])


def lock_out_warnings(estimator, run, twist):
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        estimates = drive(estimator, run, twist)
    return [w for w in caught if issubclass(w.category, LockOutWarning)], estimates


def test_too_small_process_noise_locks_the_filter_out_and_is_reported_once():
    q_distance = 0.01 * (SPEED * DT) ** 2 / chi2_quantile(0.05)
    estimator = AdaptiveKalmanFilter((Q[0], q_distance), R)
    run = noisy_walk(np.random.default_rng(2), 420)
    warned, estimates = lock_out_warnings(estimator, run, (SPEED, 0.0))
    assert sum(e.action[1] == "inflate" for e in estimates) > 0.8 * len(run)
    assert abs(estimates[-1].distance - 1.5) > 1.0  # meters wrong, as the warning is about
    assert len(warned) == 1
    assert "distance" in str(warned[0].message)
    assert warned[0].filename == __file__
    estimator.reset()
    assert lock_out_warnings(estimator, run, (SPEED, 0.0))[0] == []


def test_more_than_half_of_the_last_ninety_measurements_make_a_lock_out():
    good, outlier = (0.0, 1.5), (0.0, 9.0)
    for before, inflated, reported in ((0, 45, 0), (0, 46, 1), (200, 45, 0), (200, 46, 1)):
        estimator = AdaptiveKalmanFilter((1e-9, 1e-9), R)
        run = [good] * (before + 1) + [outlier] * inflated + [good] * 200
        assert len(lock_out_warnings(estimator, run, STANDING)[0]) == reported
    spread_out = [good] + ([good] * 60 + [outlier] * 40) * 10
    assert lock_out_warnings(AdaptiveKalmanFilter((1e-9, 1e-9), R), spread_out, STANDING)[0] == []


def test_a_new_target_starts_with_a_clean_record():
    estimator = AdaptiveKalmanFilter((1e-9, 1e-9), R)
    for _ in range(3):
        assert lock_out_warnings(estimator, [(0.0, 1.5)] + [(0.0, 9.0)] * 40, STANDING)[0] == []
        estimator.reset()


@pytest.mark.parametrize("outlier_share", [0.0, 0.1, 0.2])
def test_outliers_alone_are_not_taken_for_a_lock_out(outlier_share):
    run = noisy_walk(np.random.default_rng(3), 20_000, outlier_share)
    warned, estimates = lock_out_warnings(AdaptiveKalmanFilter(Q, R), run, (SPEED, 0.0))
    assert warned == []
    assert sum(e.action[1] == "inflate" for e in estimates) >= 0.9 * outlier_share * len(run)


@pytest.mark.parametrize("bad", [0.0, -1e-3, math.nan, math.inf])
@pytest.mark.parametrize("kind", [KalmanFilter, AdaptiveKalmanFilter, AugmentedKalmanFilter])
def test_variances_must_be_positive_and_finite(kind, bad):
    with pytest.raises(ValueError, match="positive finite"):
        kind((bad, 1e-3), R)
    with pytest.raises(ValueError, match="measurement_noise"):
        kind(Q, (1e-3, bad))
    with pytest.raises(ValueError, match="initial_variance"):
        kind(Q, R, initial_variance=(bad, 1e-3))


@pytest.mark.parametrize("alpha", [0.0, 1.0, -0.1, math.nan])
@pytest.mark.parametrize("kind", [AdaptiveKalmanFilter, AugmentedKalmanFilter])
def test_alpha_must_be_a_probability(kind, alpha):
    with pytest.raises(ValueError, match="alpha"):
        kind(Q, R, alpha)


@pytest.mark.parametrize("bad", [math.nan, math.inf, -math.inf])
@each_estimator
def test_numbers_that_are_not_finite_are_refused_and_leave_no_trace(make, bad):
    estimator = make()
    estimator.update((0.0, 1.5))
    with pytest.raises(ValueError, match="measurement"):
        estimator.update((0.0, bad))
    with pytest.raises(ValueError, match="twist"):
        estimator.predict((bad, 0.0), DT)
    after = estimator.update(None)
    assert (after.bearing, after.distance) == (0.0, 1.5)


@pytest.mark.parametrize("dt", [0.0, -DT, math.nan, math.inf])
@each_estimator
def test_time_must_advance(make, dt):
    with pytest.raises(ValueError, match="dt"):
        make().predict(STANDING, dt)
