"""Paper A's first experiment with perfect boxes: what is tracked is the subject, all the way round, and over gaps."""

import math
from itertools import pairwise

import pytest

from baselines.papers.zhang2018 import rectangle
from baselines.papers.zhang2018.experiments import Part, Player, Rows
from baselines.papers.zhang2018.rectangle import COLUMNS, CORNERS, GAP_FRAMES, GAPS, RUNS, play, table


@pytest.fixture(scope="module")
def played():
    return Player({})(Part("rectangle", "mask/walk"), 0)


@pytest.fixture(scope="module")
def walk(played):
    return played.rows


def places(rows, name):
    return [tuple(row[f"{name}_{axis}"] for axis in "xyz") for row in rows if row[f"{name}_x"] is not None]


def test_the_truth_goes_round_the_papers_rectangle(walk):
    truth = places([row for row in walk if row["run"] == "all"], "truth")

    across, along = [y for _, y, _ in truth], [x for x, _, _ in truth]
    assert max(across) - min(across) == pytest.approx(1.4, abs=0.001)
    assert max(along) - min(along) == pytest.approx(2.0, abs=0.001)
    assert all(min(abs(x - CORNERS[0][0]), abs(x - CORNERS[1][0]), abs(abs(y) - 0.7)) < 1e-9 for x, y, _ in truth)
    assert math.dist(truth[0], truth[-1]) < 0.1
    assert max(math.dist(a, b) for a, b in pairwise(truth)) < 0.06


def test_every_frame_is_tracked_from_the_confirmation_on(walk):
    states = [row["state"] for row in walk if row["run"] == "all"]

    assert states == ["confirming"] * 4 + ["tracking"] * (len(states) - 4)


def test_the_front_surface_is_measured_within_the_papers_bound_of_the_middle_less_its_offset(walk):
    rows = [row for row in walk if row["run"] == "all" and row["measured_x"] is not None]
    errors = [m[0] - t[0] for m, t in zip(places(rows, "measured"), places(rows, "truth"), strict=True)]
    offset = sum(errors) / len(errors)

    assert -0.30 < offset < -0.05
    assert max(abs(error - offset) for error in errors) < rectangle.BOUND
    sideways = [m[1] - t[1] for m, t in zip(places(rows, "measured"), places(rows, "truth"), strict=True)]
    assert max(map(abs, sideways)) < rectangle.BOUND


def test_gaps_of_five_frames_are_coasted_over_and_the_track_holds(walk):
    rows = [row for row in walk if row["run"] == "gaps"]

    for name in GAPS:
        during = [k for k, row in enumerate(rows) if row["gap"] == name]
        assert during == list(range(during[0], during[0] + GAP_FRAMES))
        assert {(rows[k]["state"], rows[k]["detections"], rows[k]["measured_x"]) for k in during} == {
            ("coasting", 0, None)
        }
        assert rows[during[-1] + 1]["state"] == "tracking"
    assert rows[-1]["state"] == "tracking"


def test_the_table_has_a_row_for_each_position_and_gap(walk):
    lines = table(walk).splitlines()

    assert {tuple(row) for row in walk} == {COLUMNS}
    assert {row["run"] for row in walk} == set(RUNS)
    assert sum(line.startswith("| mask | walk | measured | 19") for line in lines) == 1
    assert sum(line.startswith("| mask | walk | estimated | 19") for line in lines) == 1
    for name in GAPS:
        (line,) = [line for line in lines if line.startswith(f"| mask | walk | {name} | {GAP_FRAMES} |")]
        assert line.endswith("| yes |")


def test_the_store_can_hold_the_rows(played):
    assert Rows.unpack(*played.pack()) == played


def test_a_detector_that_sees_nobody_is_reported_as_such(monkeypatch):
    monkeypatch.setattr(rectangle, "SPEED", 1.6)  # a quarter of the frames

    class Blind:
        def detect(self, rgb, depth):
            return []

    rows = play("crouch", Blind()).rows

    assert {row["state"] for row in rows} == {"searching"}
    assert "| detector | crouch | measured | 0 | 0.0 % |" in table(rows)
    assert table(rows).count("| 0 | | no |") == len(GAPS)


def test_an_unknown_posture_is_named_with_the_nearest():
    with pytest.raises(ValueError, match=r"posture 'crouching' is not known.*did you mean 'crouch'"):
        play("crouching")
