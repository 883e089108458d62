"""The followers' table: floors and ceiling behave, scores follow from the rows."""

import dataclasses
import math
from collections.abc import Sequence

import numpy as np
import pytest
from scipy.stats import trim_mean

from baselines.benchmark.build import cell_of
from baselines.benchmark.cells import Cell
from baselines.benchmark.metrics.episode import COLUMNS as ROW_COLUMNS
from baselines.benchmark.metrics.episode import Row
from baselines.benchmark.player import Player
from baselines.benchmark.statistics import Score, interquartile_mean
from baselines.suites.followers import COLUMNS, REFERENCE, policy_name, records, report

RNG = np.random.default_rng(8)


def row(**values: object) -> Row:
    base: Row = dict.fromkeys(ROW_COLUMNS, 0.5)
    return {**base, "steps": 421, "ended": "time", "success": 1, **values}  # type: ignore[dict-item]


def drawn(count: int, scale: float) -> list[Row]:
    return [
        row(distance_tracking_rmse_m=scale * float(RNG.uniform(0.5, 1.5)), steps=int(RNG.integers(300, 422)))
        for _ in range(count)
    ]


def pooled(rows: Sequence[Row]) -> float:
    steps = np.array([float(str(r["steps"])) for r in rows])
    rms = np.array([float(str(r["distance_tracking_rmse_m"])) for r in rows])
    return math.sqrt(float(np.average(rms**2, weights=steps)))


def test_floors_fail_and_the_ceiling_does_not() -> None:
    player = Player()
    for scene in ("corridor", "indoor"):
        for name, perception, success in (("parked", "emulated", 0), ("random", "emulated", 0), ("oracle", "truth", 1)):
            cell = Cell(perception, scene, "none", name, sensor="default" if perception == "emulated" else "")
            played = player(cell, 5)
            assert played.row["success"] == success
            if name == "oracle":
                assert float(str(played.row["distance_tracking_rmse_m"])) < 0.02
            if name == "random":
                assert player(cell, 5).row == played.row
                assert player(cell, 6).row["path_ratio"] != played.row["path_ratio"]
    player.close()


def test_taking_the_bias_off_makes_the_reference_follow_closer() -> None:
    player = Player()
    plain, unbiased = (player(cell_of(name, "corridor"), 1).row for name in ("akf", "pi_unbiased"))
    player.close()
    assert float(str(plain["distance_bias_m"])) < -0.07
    assert abs(float(str(unbiased["distance_bias_m"]))) < 0.03
    assert float(str(unbiased["distance_tracking_rmse_m"])) < float(str(plain["distance_tracking_rmse_m"]))


def test_one_training_is_pooled_over_its_steps() -> None:
    rows = drawn(12, 0.2)
    score = Score.of([rows], "distance_tracking_rmse_m", True)
    assert score.value == pytest.approx(pooled(rows))
    assert score.interval is not None
    low, high = score.interval
    assert low < score.value < high


def test_one_episode_has_no_interval_and_unequal_counts_no_difference() -> None:
    one, three = (Score.of([drawn(count, 0.2)], "distance_tracking_rmse_m", True) for count in (1, 3))
    assert one.interval is None
    assert one.minus(one).interval is None
    with pytest.raises(ValueError, match="Scores of 1 and 3 episodes cannot be paired"):
        one.minus(three)
    with pytest.raises(ValueError, match="has no rms_jerk_m_s3"):
        Score.of(
            [[row(rms_jerk_m_s3=None, perception="emulated", scene="indoor", estimator="kf", seed=1)]],
            "rms_jerk_m_s3",
            True,
        )


def test_episodes_and_trainings_are_resampled_independently() -> None:
    """With trainings that each are constant, the score of a resample names its training; pairs of them must differ."""
    by_training = [[row(success=float(k)) for _ in range(5)] for k in range(3)]
    by_episode = [[row(success=float(k)) for k in range(5)] for _ in range(3)]
    trainings, episodes = (Score.of(rows, "success", False).resamples for rows in (by_training, by_episode))
    assert abs(np.corrcoef(trainings, episodes)[0, 1]) < 0.05


def test_several_trainings_give_their_interquartile_mean() -> None:
    trainings = [drawn(10, scale) for scale in (0.1, 0.11, 0.12, 0.13, 0.9)]
    score = Score.of(trainings, "distance_tracking_rmse_m", True)
    assert score.value == pytest.approx(float(np.mean(sorted(map(pooled, trainings))[1:4])))
    assert score.interval is not None
    low, high = score.interval
    assert low < score.value < high
    values = RNG.normal(size=(9, 4))
    np.testing.assert_allclose(interquartile_mean(values), trim_mean(values, 0.25, axis=0))


def test_a_policy_that_errs_twice_as_much_differs_by_the_reference() -> None:
    rows = drawn(8, 0.2)
    doubled = [{**r, "distance_tracking_rmse_m": 2.0 * float(str(r["distance_tracking_rmse_m"]))} for r in rows]
    reference = Cell("emulated", "corridor", "akf", sensor="default")
    agents = [Cell("emulated", "corridor", "none", f"ppo-{k}", sensor="default") for k in range(2)]
    found = records({reference: rows, agents[0]: doubled, agents[1]: doubled})
    assert [set(record) for record in found] == [set(COLUMNS)] * 2
    first, second = found
    assert (first["policy"], first["trainings"], first["distance_tracking_rmse_m_minus_reference"]) == (
        REFERENCE,
        None,
        None,
    )
    assert (second["policy"], second["trainings"]) == ("ppo", 2)
    for end in ("", "_low", "_high"):
        assert second[f"distance_tracking_rmse_m_minus_reference{end}"] == pytest.approx(
            first[f"distance_tracking_rmse_m{end}"], rel=1e-9
        )
    text = report(found)
    assert "nothing is claimed of the rank of: ppo." in text


def test_other_walking_speeds_have_a_table_of_their_own() -> None:
    slow = row(distance_tracking_rmse_m=0.1, success=0.5)
    usual = Cell("emulated", "corridor", "akf", sensor="default")
    played = {usual: drawn(3, 0.2), dataclasses.replace(usual, walking_speed=0.5): [slow, slow]}
    text = report(records(played))
    table, other = text.split("## Walking speeds")
    assert table.count("AKF + PI |") == 1
    assert "2 episodes each" in other
    (line,) = (line for line in other.splitlines() if line.startswith("| AKF + PI"))
    assert line.split("|")[2].strip() == "10.0 (10.0 to 10.0), 50%"
    assert "Walking speeds" not in report(records({usual: drawn(3, 0.2)}))


def test_a_cell_at_another_speed_is_played_at_it() -> None:
    player = Player()
    usual = cell_of("oracle", "corridor")
    fast = dataclasses.replace(usual, walking_speed=1.1)
    assert fast.key == usual.key + "/w1.1"
    assert float(str(player(usual, 3).row["duration_s"])) == pytest.approx(14.0)
    assert float(str(player(fast, 3).row["duration_s"])) == pytest.approx(14.0 * 12.0 / 13.0 / 1.1, abs=1.0 / 30.0)
    player.close()


def test_policies_are_named_as_people_say() -> None:
    names = {
        ("akf", "pi"): "AKF + PI",
        ("none", "pi"): "no filter + PI",
        ("none", "parked"): "parked",
        ("akf", "pi_unbiased"): "AKF + PI, bias removed",
        ("none", "recurrent_ppo-1"): "recurrent_ppo",
    }
    for (estimator, controller), name in names.items():
        assert policy_name(Cell("emulated", "indoor", estimator, controller)) == name
