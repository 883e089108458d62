"""What is made of the rows: curves, verdicts and explanations, on rows whose content is known."""

import numpy as np
import pytest

from baselines.benchmark.cells import Cell
from baselines.benchmark.markdown import markdown_table
from baselines.benchmark.metrics.episode import Row
from baselines.papers.dong2018.curves import curve_records
from baselines.papers.dong2018.explain import explain
from baselines.papers.dong2018.report import report
from baselines.papers.dong2018.table1 import PAPER_RMSE, Table1


def test_curves_are_means_and_bands_over_episodes_ten_times_a_second() -> None:
    time_s = np.arange(91) / 30.0
    cell = Cell("emulated", "indoor", "kf")
    episodes = [np.column_stack([time_s, slope * time_s, 0.1 * slope * time_s]) for slope in np.linspace(1.0, 2.0, 11)]
    lines = [line for line in curve_records({cell: episodes}) if line["quantity"] == "distance"]
    assert [line["time_s"] for line in lines] == [index / 10 for index in range(31)]
    assert [line["mean"] for line in lines] == pytest.approx([15.0 * index / 10 for index in range(31)])
    assert [line["p10"] for line in lines] == pytest.approx([11.0 * index / 10 for index in range(31)])
    assert [line["p90"] for line in lines] == pytest.approx([19.0 * index / 10 for index in range(31)])


def test_an_episode_that_ended_early_keeps_its_last_sum() -> None:
    long, short = (np.column_stack([np.arange(n) / 30.0, np.arange(n), np.arange(n)]) for n in (91, 31))
    lines = curve_records({Cell("mask", "indoor", "kf"): [long, short]})
    angle = [line for line in lines if line["quantity"] == "angle"]
    assert [line["running"] for line in angle] == [2] * 11 + [1] * 20
    assert [line["mean"] for line in angle] == [(3 * k + min(3 * k, 30)) / 2 for k in range(31)]


def made(bias: dict[str, float], spread: dict[str, float], **columns: float) -> Table1:
    """A table whose distances have the given bias and spread, m, by estimator, and whose angles follow the paper."""
    generator = np.random.default_rng(0)
    factors = generator.uniform(0.995, 1.005, 40)
    factors /= np.mean(factors)
    rows: dict[Cell, list[Row]] = {}
    for scene in ("corridor", "indoor"):
        for estimator in ("none", "kf", "akf", "akf_cv"):
            paper = PAPER_RMSE.get((scene, "angle", estimator), 0.01)
            rows[Cell("emulated", scene, estimator)] = [
                {
                    "seed": seed,
                    "estimate_steps": 400,
                    "ended": "time",
                    "loss_count": 0,
                    "success": 1,
                    "angle_rmse_rad": float(paper * factor),
                    "angle_bias_rad": 0.0,
                    "distance_rmse_m": float(np.hypot(bias[estimator], spread[estimator]) * factor),
                    "distance_bias_m": float(bias[estimator] * factor),
                    **dict.fromkeys(("in_band_share", "measurement_share"), 1.0),
                    **dict.fromkeys(("angle_inflated_share", "distance_inflated_share"), 0.05),
                    **dict.fromkeys(("angle_outlier_share", "distance_outlier_share"), 0.01),
                    **dict.fromkeys(("angle_outlier_square_share", "distance_outlier_square_share"), 0.05),
                    **dict.fromkeys(("angle_error_correlation", "distance_error_correlation"), 0.9),
                    **columns,
                }
                for seed, factor in enumerate(factors)
            ]
    return Table1(rows)


def test_a_cell_as_in_the_paper_needs_no_explanation() -> None:
    table = made(
        dict.fromkeys(("none", "kf", "akf", "akf_cv"), 0.0), {"none": 0.1, "kf": 0.083, "akf": 0.078, "akf_cv": 0.07}
    )
    assert explain(table, "emulated", "corridor", "angle") is None
    assert "No filter errs by 10.00 cm (paper 15.32)." in str(explain(table, "emulated", "corridor", "distance"))
    text = report(table)
    line = next(line for line in text.splitlines() if line.startswith("| corridor | distance |"))
    assert line.split() == [*"|corridor|distance|0.83|0.83|yes|0.78|0.78|yes|".replace("|", " | ").strip().split(" ")]


def test_bias_that_dominates_is_named_with_its_share_and_the_lag() -> None:
    bias = {"none": -0.112, "kf": -0.18, "akf": -0.18, "akf_cv": -0.112}
    spread = {"none": 0.05, "kf": 0.03, "akf": 0.03, "akf_cv": 0.03}
    text = explain(made(bias, spread), "emulated", "corridor", "distance")
    assert text is not None
    assert "KF < No filter does not hold; AKF < KF does not hold; the KF ratio is 1.49 (paper 0.83)" in text
    assert "Bias (-11.20 cm) makes 83% of No filter's squared error" in text
    assert "unshifted and without any spread the ratio would be 0.91" in text
    effect = "The KF takes bias from -11.20 to -18.00 cm and spread from 5.00 to 3.00 cm"
    assert f"{effect}: more bias added than spread removed." in text
    assert "The AKF finds no outlier in any episode and does what the KF does." in text
    assert "carry 5% of its squared error, which leaves the AKF little to reject" in text


def test_slow_errors_and_a_single_bad_episode_are_named() -> None:
    names = ("none", "kf", "akf", "akf_cv")
    table = made(dict.fromkeys(names, 0.0), dict(zip(names, (0.15, 0.145, 0.145, 0.145), strict=True)))
    text = str(explain(table, "emulated", "corridor", "distance"))
    assert "Successive errors of No filter correlate by 0.90, which limits what averaging" in text
    assert "Seed" not in text
    bad = table.rows[Cell("emulated", "corridor", "kf")][7]
    bad |= {"distance_rmse_m": 2.0, "ended": "collision", "loss_count": 2, "longest_out_of_view_s": 1.44}
    text = str(explain(Table1(table.rows), "emulated", "corridor", "distance"))
    happened = "there the person was out of view for up to 1.4 s; it ended early (collision)"
    assert f"Seed 7 alone makes 83% of the KF's squared error; {happened}." in text
    assert "correlate" not in text


def test_hypotheses_are_yes_no_or_undecided_by_their_intervals() -> None:
    names = ("none", "kf", "akf", "akf_cv")
    decided = report(made(dict.fromkeys(names, 0.0), dict(zip(names, (0.2, 0.1, 0.05, 0.05), strict=True))))
    refuted = report(made(dict.fromkeys(names, 0.0), dict(zip(names, (0.1, 0.2, 0.05, 0.05), strict=True))))
    for text, verdicts in ((decided, ["yes", "yes", "yes"]), (refuted, ["no", "yes", "no"])):
        line = next(
            line
            for line in text.splitlines()
            if line.startswith("| indoor   | distance (cm) |") and "to" in line and line.count("|") == 8
        )
        assert [part.strip() for part in line.split("|")[4:8:2] + line.split("|")[7:8]] == verdicts


def test_a_markdown_table_is_aligned() -> None:
    text = markdown_table(["name", "value"], [["a", "1.00"], ["longer", "-10.00"]], left=1)
    assert text.splitlines() == [
        "| name   |  value |",
        "|--------|-------:|",
        "| a      |   1.00 |",
        "| longer | -10.00 |",
    ]
