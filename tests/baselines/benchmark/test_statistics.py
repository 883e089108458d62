"""Pooled errors against the raw errors they come from, and intervals against SciPy's bootstrap and theory."""

import math

import numpy as np
import pytest
import scipy.stats

from baselines.benchmark.metrics.episode import Row
from baselines.benchmark.statistics import NEGLIGIBLE, Difference, PooledError, share_interval, weighted_share


def row(errors: np.ndarray, seed: int = 0) -> Row:
    """The columns of an episode with the given distance errors, m."""
    return {
        "perception": "emulated",
        "scene": "indoor",
        "estimator": "kf",
        "seed": seed,
        "estimate_steps": len(errors),
        "distance_rmse_m": float(np.sqrt(np.mean(errors**2))),
        "distance_bias_m": float(np.mean(errors)),
        "angle_rmse_rad": float(np.sqrt(np.mean(errors**2))),
        "angle_bias_rad": float(np.mean(errors)),
    }


def cell(seed: int, episodes: int = 30, bias: float = -0.1) -> list[np.ndarray]:
    """Errors of episodes of unequal length whose level differs from episode to episode."""
    generator = np.random.default_rng(seed)
    return [generator.normal(bias, generator.uniform(0.05, 0.3), generator.integers(50, 420)) for _ in range(episodes)]


def pooled(errors: list[np.ndarray], quantity: str = "distance") -> PooledError:
    return PooledError.of([row(episode, seed) for seed, episode in enumerate(errors)], quantity)


def test_pooling_episodes_equals_pooling_their_steps() -> None:
    errors = cell(0)
    everything = np.concatenate(errors)
    for quantity, scale in (("distance", 100.0), ("angle", 1.0)):
        result = pooled(errors, quantity)
        assert result.rmse == pytest.approx(scale * np.sqrt(np.mean(everything**2)), rel=1e-12)
        assert result.bias == pytest.approx(scale * np.mean(everything), rel=1e-12)
        assert result.spread == pytest.approx(scale * np.std(everything), rel=1e-9)
        assert result.rmse**2 == pytest.approx(result.bias**2 + result.spread**2, rel=1e-12)


def test_an_error_that_is_all_bias_has_no_spread() -> None:
    assert pooled([np.full(10, 0.1), np.full(20, 0.1)]).spread == pytest.approx(0.0, abs=1e-6)


def test_the_interval_agrees_with_scipy() -> None:
    errors = cell(1)
    result = pooled(errors)
    squares, steps = np.array([np.sum(e**2) for e in errors]), np.array([len(e) for e in errors])

    def rmse(squares: np.ndarray, steps: np.ndarray, axis: int = -1) -> np.ndarray:
        return 100.0 * np.sqrt(np.sum(squares, axis=axis) / np.sum(steps, axis=axis))

    expected = scipy.stats.bootstrap(
        (squares, steps), rmse, paired=True, method="percentile", n_resamples=20_000, random_state=5
    ).confidence_interval
    width = expected.high - expected.low
    assert result.interval == pytest.approx((expected.low, expected.high), abs=0.04 * width)


def test_the_interval_of_a_difference_is_paired_and_agrees_with_scipy() -> None:
    errors = cell(2)
    better = [0.9 * episode for episode in errors]
    difference = pooled(better).minus(pooled(errors))
    sums = [np.array([np.sum(e**2) for e in group]) for group in (better, errors)]
    steps = np.array([len(e) for e in errors])

    def statistic(first: np.ndarray, second: np.ndarray, steps: np.ndarray, axis: int = -1) -> np.ndarray:
        total = np.sum(steps, axis=axis)
        return 100.0 * (np.sqrt(np.sum(first, axis=axis) / total) - np.sqrt(np.sum(second, axis=axis) / total))

    expected = scipy.stats.bootstrap(
        (*sums, steps), statistic, paired=True, method="percentile", n_resamples=20_000, random_state=6
    ).confidence_interval
    width = expected.high - expected.low
    assert difference.interval == pytest.approx((expected.low, expected.high), abs=0.04 * width)
    low, high = pooled(errors).interval or (0.0, 0.0)
    assert width < 0.2 * (high - low)
    assert (difference.value, difference.negative) == (pytest.approx(-0.1 * pooled(errors).rmse), True)


def test_the_interval_covers_the_truth_as_often_as_it_says() -> None:
    """Episodes of one step with a normal error: the RMSE's interval against its known value, over 200 experiments."""
    generator = np.random.default_rng(3)
    covered = 0
    for _ in range(200):
        low, high = pooled([np.array([error]) for error in generator.normal(0.0, 0.1, 100)]).interval or (0.0, 0.0)
        covered += low <= 10.0 <= high
    assert 0.88 <= covered / 200 <= 0.99


def test_the_interval_has_the_width_that_theory_gives() -> None:
    """Mean square of n normal errors: variance 2 sigma⁴/n, so the RMSE's is sigma²/(2 n)."""
    episodes = 400
    errors = np.random.default_rng(4).normal(0.0, 0.1, episodes)
    low, high = pooled([np.array([error]) for error in errors]).interval or (0.0, 0.0)
    assert high - low == pytest.approx(2 * 1.96 * 10.0 / math.sqrt(2 * episodes), rel=0.12)


def test_differences_and_ratios_mirror() -> None:
    first, second = pooled(cell(5)), pooled(cell(6, bias=-0.3))
    forward, backward = first.minus(second), second.minus(first)
    assert forward.value == -backward.value
    assert forward.interval == pytest.approx(tuple(-end for end in reversed(backward.interval or ())))
    ratio, inverse = first.ratio_to(second), second.ratio_to(first)
    assert ratio is not None
    assert inverse is not None
    assert ratio.value == pytest.approx(1.0 / inverse.value)
    assert ratio.interval == pytest.approx(tuple(1.0 / end for end in reversed(inverse.interval or ())), rel=1e-4)


def test_the_same_cell_differs_from_itself_by_nothing() -> None:
    assert pooled(cell(7)).minus(pooled(cell(7))) == Difference(0.0, (0.0, 0.0))


@pytest.mark.parametrize(
    ("interval", "negative"),
    [((-2.0, -1.0), True), ((-2.0, 1.0), None), ((1.0, 2.0), False), ((0.0, 0.0), False), (None, None)],
)
def test_only_an_interval_on_one_side_of_zero_decides(interval, negative: bool | None) -> None:
    assert Difference(-0.5, interval).negative is negative


def test_one_episode_gives_no_interval() -> None:
    single = pooled(cell(8, episodes=1))
    assert single.interval is None
    assert single.minus(single).interval is None
    assert single.ratio_to(single) == Difference(1.0, None)


def test_nothing_is_compared_with_an_error_that_is_only_rounding() -> None:
    rounding = pooled([np.full(10, 0.5 * NEGLIGIBLE / 100.0)] * 3)
    assert rounding.negligible
    assert pooled(cell(9, episodes=3)).ratio_to(rounding) is None


def test_unequal_numbers_of_episodes_cannot_be_paired() -> None:
    with pytest.raises(ValueError, match="30 and 29 episodes"):
        pooled(cell(0)).minus(pooled(cell(0, episodes=29)))


def test_an_episode_without_estimates_is_named() -> None:
    empty = row(np.ones(3), seed=4) | {"distance_rmse_m": None, "distance_bias_m": None}
    with pytest.raises(ValueError, match="emulated/indoor/kf with seed 4"):
        PooledError.of([row(np.ones(3)), empty], "distance")


def test_shares_are_weighted_by_steps_and_skip_what_does_not_apply() -> None:
    rows: list[Row] = [
        {"share": 0.1, "estimate_steps": 100},
        {"share": 0.4, "estimate_steps": 300},
        {"share": None, "estimate_steps": 500},
    ]
    assert weighted_share(rows, "share") == pytest.approx(0.325)
    assert weighted_share(rows, "share", [1.0, 1.0, 1.0]) == pytest.approx(0.25)
    assert weighted_share(rows[2:], "share") is None


@pytest.mark.parametrize(("count", "total"), [(0, 1), (0, 200), (1, 3), (7, 20), (200, 200)])
def test_the_interval_of_a_share_agrees_with_scipy(count: int, total: int) -> None:
    expected = scipy.stats.binomtest(count, total).proportion_ci(0.95, "wilson")
    assert share_interval(count, total) == pytest.approx(tuple(expected), abs=1e-12)
