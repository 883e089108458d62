"""Anything that predicts gets its row, its paired difference and its trace; metrics are asked of traces."""

import csv
import sys

import numpy as np
import pytest

from baselines.benchmark.cells import Cell
from baselines.benchmark.evaluate import compare, evaluate
from baselines.benchmark.metrics.base import METRICS, measured
from baselines.benchmark.metrics.episode import COLUMNS, EpisodeMetrics
from baselines.benchmark.player import play
from baselines.benchmark.rollout import rollout
from baselines.benchmark.suite import SUITES, Suite, find_suite
from baselines.benchmark.trace import Trace
from baselines.benchmark.trial import Scenario, Trial
from baselines.cli.main import main
from baselines.followers.build import build_follower
from baselines.followers.spec import FollowerSpec
from follow_env.envs.follow import FollowEnv

SHORT = {"name": "path", "points": [[2.0, 0.0]]}
SUITE = Suite(
    "short",
    (
        Scenario("ahead", {"route": SHORT}),
        Scenario("speeds", {"route": SHORT, "walking_speed": {"uniform": [0.5, 1.0]}}),
    ),
    metrics=("success", "distance_tracking_rmse_m", "distance_rmse_m"),
    card="Two meters ahead.",
)


class Stateless:
    """A policy as Stable-Baselines3's: no state, no belief."""

    def predict(self, observation, state=None, episode_start=None, deterministic=True):
        return np.clip((observation[1] - 1.5, observation[0]), -1.0, 1.0), None


def largest_gap(trace):
    """Largest distance to the person, m."""
    return float(trace.distance.max())


@pytest.fixture(scope="module")
def trace():
    env = FollowEnv(engine="kinematic", sensor={"measurement": {"miss_share": 0.2, "outlier_share": 0.05}})
    return rollout(env, build_follower("akf", env), seed=3)


def test_the_metrics_of_a_trace_are_those_of_the_episode_as_it_was_played(trace):
    """The same floats as the rows of Table 1 and of the followers have, for every column that both know."""
    env = FollowEnv(engine="kinematic", sensor={"measurement": {"miss_share": 0.2, "outlier_share": 0.05}})
    row = play(env, build_follower("akf", env), Cell("emulated", "corridor", "akf"), 3).row
    both = [name for name in METRICS if name in COLUMNS and not name.endswith("nis_mean")]
    assert len(both) >= 12
    mine = measured(trace, both)
    assert {name: mine[name] for name in both} == {name: row[name] for name in both}
    assert mine["steps"] == row["steps"]
    assert measured(trace, ["distance_nis_mean"])["distance_nis_mean"] == pytest.approx(
        row["distance_nis_mean"], rel=0.02
    )


def test_a_trace_gives_the_whole_episode_metrics_back(trace):
    metrics = EpisodeMetrics(Cell("emulated", "corridor", "akf"), 3)
    metrics._steps = trace.steps()
    env = FollowEnv(engine="kinematic", sensor={"measurement": {"miss_share": 0.2, "outlier_share": 0.05}})
    assert (
        metrics.row(trace.terminated)
        == play(env, build_follower("akf", env), Cell("emulated", "corridor", "akf"), 3).row
    )


def test_a_trace_is_kept_exactly_and_small(trace, tmp_path):
    trace.save(tmp_path / "one.npz")
    again = Trace.load(tmp_path / "one.npz")
    for name in vars(trace):
        assert np.array_equal(getattr(again, name), getattr(trace, name)), name
    assert (tmp_path / "one.npz").stat().st_size < 150_000
    (tmp_path / "no.npz").write_bytes(b"nothing")
    with pytest.raises(ValueError, match="is no trace of an episode"):
        Trace.load(tmp_path / "no.npz")


def test_a_stateless_policy_gets_its_row_and_its_paired_difference():
    """Defect of the past: AttributeError, for want of a state that estimates."""
    result = evaluate(["akf", Stateless()], SUITE, episodes=3, engine="kinematic")
    rows = result.rows()
    assert len(rows) == 2 * 2 * 3
    (line,) = [line for line in result.table() if line["follower"] == "Stateless" and line["scenario"] == "ahead"]
    assert line["kind"] == "own"
    assert line["distance_rmse_m"] is None
    low, high = (line[f"distance_tracking_rmse_m_minus_reference_{end}"] for end in ("low", "high"))
    assert low <= line["distance_tracking_rmse_m_minus_reference"] <= high
    assert "Stateless" in result.markdown()


class Gain:
    """A policy with a setting."""

    def __init__(self, gain):
        self.gain = gain

    def predict(self, observation, state=None, episode_start=None, deterministic=True):
        return np.clip((self.gain * (observation[1] - 1.5), observation[0]), -1.0, 1.0), None


def test_two_objects_of_one_class_are_two_followers(tmp_path):
    """Defect of the past: their traces had one key, so that the second's stood for both."""
    both = [Gain(0.2), Gain(2.0)]
    (difference,) = compare(*both, SUITE.only(["ahead"]), episodes=2, kept=tmp_path, engine="kinematic").values()
    assert difference.value > 0.01
    alone = [evaluate(one, SUITE.only(["ahead"]), episodes=2, engine="kinematic").rows() for one in both]
    assert alone == [
        evaluate(one, SUITE.only(["ahead"]), episodes=2, kept=tmp_path, engine="kinematic").rows() for one in both
    ]


def test_what_changed_since_is_played_again(monkeypatch, tmp_path):
    """An own module, a module that it uses, or the file of an agent, under the same name as before."""
    monkeypatch.syspath_prepend(tmp_path)
    (tmp_path / "gains.py").write_text("def gain():\n    return 1.0\n", encoding="utf-8")
    (tmp_path / "driver.py").write_text("from gains import gain\nclass Mine:\n    pass\n", encoding="utf-8")
    agent = tmp_path / "agent.zip"
    agent.write_bytes(b"first")

    def keys():
        specs = (FollowerSpec(policy="driver:Mine"), FollowerSpec(policy=str(agent)), FollowerSpec())
        return [Trial("short", SUITE.scenarios[0], spec).key for spec in specs]

    first = keys()
    assert keys() == first
    (tmp_path / "gains.py").write_text("def gain():\n    return 2.0\n", encoding="utf-8")
    agent.write_bytes(b"second")
    own, file, built = keys()
    assert own != first[0]
    assert file != first[1]
    assert built == first[2]


def test_the_paired_difference_of_a_follower_to_itself_is_nothing():
    for difference in compare("kf", "kf", SUITE, episodes=4, engine="kinematic").values():
        assert difference.value == 0.0
        assert difference.interval == (0.0, 0.0)


def test_the_result_does_not_depend_on_the_number_of_processes():
    one, two = (evaluate(["akf", "ppo-0"], SUITE, episodes=2, engine="kinematic", jobs=j).rows() for j in (1, 2))
    assert one == two


def test_a_metric_is_added_without_a_replay(monkeypatch, tmp_path):
    monkeypatch.setitem(sys.modules, "my_metrics", sys.modules[__name__])
    evaluate("akf", SUITE, episodes=2, kept=tmp_path, engine="kinematic")
    monkeypatch.setattr(FollowEnv, "step", None)
    result = evaluate("akf", SUITE, episodes=2, kept=tmp_path, engine="kinematic")
    gaps = [row["my_metrics:largest_gap"] for row in result.rows(["my_metrics:largest_gap"])]
    assert len(gaps) == 4
    assert min(gaps) > 1.4


def test_a_drawn_scenario_plays_other_settings_in_each_episode():
    result = evaluate("akf", SUITE.only(["speeds"]), episodes=4, engine="kinematic")
    speeds = {trace.config["walking_speed"] for trace in result.traces["speeds", 0]}
    assert len(speeds) == 4


def test_wrong_requests_are_refused_before_anything_is_played(monkeypatch):
    monkeypatch.setattr(FollowEnv, "reset", None)
    for followers, suite, words in (
        ("akff", SUITE, "did you mean 'akf'"),
        ("akf", "papre", "did you mean 'paper'"),
        ("akf", Suite("bad", (Scenario("wall", {"route": {"name": "path", "points": [[3.0, 5.0]]}}),)), "solid"),
        ("akf", Suite("bad", SUITE.scenarios, metrics=("sucess",)), "did you mean 'success'"),
        ([], SUITE, "expected at least one of each"),
    ):
        with pytest.raises(ValueError, match=words):
            evaluate(followers, suite, engine="kinematic")


def test_every_suite_and_metric_says_what_it_is():
    for name in SUITES:
        suite = find_suite(name)
        assert suite.card
        assert all(scenario.card for scenario in suite.scenarios)
    for name in METRICS:
        assert METRICS.get(name).doc, name


def test_an_own_policy_by_one_command_and_a_run_that_goes_on(monkeypatch, tmp_path, capsys):
    monkeypatch.setitem(sys.modules, "my_lab", sys.modules[__name__])
    out = tmp_path / "run"
    words = [
        "bench",
        "my_lab:SUITE",
        "--follower",
        "akf",
        "--follower",
        "my_lab:Stateless",
        "--engine",
        "kinematic",
    ]
    words += ["--jobs", "1", "--out", str(out)]
    assert main([*words, "--episodes", "2"]) == 0
    assert "Stateless" in capsys.readouterr().out
    with (out / "episodes.csv").open(encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == 8
    assert main([*words, "--episodes", "3"]) == 2
    assert "--resume" in capsys.readouterr().err
    assert main([*words, "--episodes", "3", "--resume"]) == 0
    with (out / "episodes.csv").open(encoding="utf-8") as file:
        more = list(csv.DictReader(file))
    assert [row for row in more if row["seed"] != "2"] == rows
    (tmp_path / "mine.txt").write_text("thesis")
    assert main([*words[:-1], str(tmp_path), "--episodes", "2"]) == 2
    assert "no folder of `follow bench`" in capsys.readouterr().err


def test_everything_that_has_a_name_is_listed(capsys):
    assert main(["list"]) == 0
    listed = capsys.readouterr().out
    for name in ("corridor", "commanded", "turtlebot3_burger", "akf_cv", "pi", "oracle", "paper", "success", "ppo-0"):
        assert f"  {name}" in listed
    assert main(["list", "estimators"]) == 0
    assert capsys.readouterr().out.startswith("estimators:\n")
