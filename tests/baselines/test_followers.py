"""The followers' table: floors and ceiling behave, scores follow from the rows."""

import math
from collections.abc import Sequence

import numpy as np
import pytest
from scipy.stats import trim_mean

from baselines.benchmark.cells import Cell
from baselines.benchmark.episodes import Player
from baselines.benchmark.followers import COLUMNS, REFERENCE, policy_name, records, report
from baselines.benchmark.metrics import COLUMNS as ROW_COLUMNS
from baselines.benchmark.metrics import Row
from baselines.benchmark.statistics import Score, interquartile_mean

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


def test_one_training_is_pooled_over_its_steps() -> None:
    rows = drawn(12, 0.2)
    score = Score.of([rows], "distance_tracking_rmse_m", True)
    assert score.value == pytest.approx(pooled(rows))
    low, high = score.interval
    assert low < score.value < high


def test_several_trainings_give_their_interquartile_mean() -> None:
    trainings = [drawn(10, scale) for scale in (0.1, 0.11, 0.12, 0.13, 0.9)]
    score = Score.of(trainings, "distance_tracking_rmse_m", True)
    assert score.value == pytest.approx(float(np.mean(sorted(map(pooled, trainings))[1:4])))
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


def test_policies_are_named_as_people_say() -> None:
    names = {
        ("akf", "pi"): "AKF + PI",
        ("none", "pi"): "no filter + PI",
        ("none", "parked"): "parked",
        ("none", "recurrent_ppo-1"): "recurrent_ppo",
    }
    for (estimator, controller), name in names.items():
        assert policy_name(Cell("emulated", "indoor", estimator, controller)) == name
