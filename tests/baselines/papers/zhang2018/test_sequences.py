"""The sequences of Table 2: the subject is always there, turns in every posture, and is counted as the paper counts."""

import cv2
import numpy as np
import pytest

from baselines.papers.zhang2018.sequences import TABLE_2, VIEWS, Sequence, count, play
from follow_env.world.people.bodies import SUITS
from follow_env.world.people.walker import POSTURES
from tracker.boxes import Detection

SHORT = [Sequence(suit, view, 3 * len(POSTURES)) for suit in SUITS for view in range(1, 1 + len(VIEWS))]


class Told:
    """A detector that was told the answers."""

    def __init__(self, answers: list[list[Detection]]) -> None:
        self._answers = iter(answers)

    def detect(self, rgb: np.ndarray, depth: np.ndarray) -> list[Detection]:
        return next(self._answers)


def test_the_rows_are_the_papers() -> None:
    assert sum(row.frames for row in TABLE_2) == 11452
    assert {(row.suit, row.view) for row in TABLE_2} == {(row.suit, row.view) for row in SHORT}


@pytest.mark.parametrize("row", SHORT, ids=lambda row: f"{row.suit}-{row.view}")
def test_the_subject_is_seen_whole_enough_in_every_frame(row: Sequence) -> None:
    frames = list(play(row))
    assert len(frames) == row.frames
    assert all((frame.ids == 1).sum() > 1000 for frame in frames)
    shapes = {frame.person_box() for frame in frames}
    assert len(shapes) > 0.8 * len(frames)  # it moves


def test_the_suit_is_what_differs() -> None:
    green, blue = (next(play(Sequence(suit, 1, 8))) for suit in ("green", "blue"))
    body = green.ids == 1
    np.testing.assert_array_equal(green.ids, blue.ids)
    assert green.rgb[body].mean(axis=0).argmax() == 1
    assert blue.rgb[body].mean(axis=0).argmax() == 2
    blurred = cv2.dilate(body.astype(np.uint8), np.ones((7, 7), np.uint8)) > 0  # the sensor's
    np.testing.assert_array_equal(green.rgb[~blurred], blue.rgb[~blurred])


@pytest.mark.parametrize("frames", [3, len(POSTURES), 25, 1850, 2131])
def test_the_parts_of_a_sequence_are_its_postures(frames: int) -> None:
    row = Sequence("green", 1, frames)
    parts = [row.part(number) for number in range(len(POSTURES))]
    assert [frame for part in parts for frame in part] == list(range(frames))
    assert all(row.posture(frame) == POSTURES[k] for k, part in enumerate(parts) for frame in part)


def test_a_part_shows_what_the_whole_shows() -> None:
    row = SHORT[1]
    whole, part = list(play(row)), list(play(row, row.part(2)))
    for frame, alone in zip(whole[row.part(2).start :], part, strict=False):
        np.testing.assert_array_equal(frame.rgb, alone.rgb)
        np.testing.assert_array_equal(frame.depth, alone.depth)


@pytest.mark.parametrize("view", range(1, 1 + len(VIEWS)))
def test_the_subject_is_well_in_view_of_both_cameras(view: int) -> None:
    for frame in play(Sequence("blue", view, 3 * len(POSTURES))):
        u0, v0, u1, v1 = frame.person_box() or (0.0, 0.0, 0.0, 0.0)
        height, width = frame.ids.shape
        assert 20.0 < u0 < u1 < width - 20.0  # nothing is cut off at the sides
        assert v1 - v0 > 0.4 * height
        seen = frame.depth[(frame.ids == 1) & (frame.depth > 0.0)]
        assert 2.0 < np.median(seen) < 3.0


def test_counts_of_a_perfect_a_blind_and_a_blinking_detector() -> None:
    row = SHORT[0]
    truth = [[Detection(frame.person_box() or (0.0, 0.0, 0.0, 0.0), 1.0)] for frame in play(row)]
    perfect = count(Told(truth), row)
    assert (perfect.tp, perfect.fp, perfect.fn, perfect.cfn, perfect.tda) == (row.frames, 0, 0, 0, 1.0)
    blind = count(Told([[]] * row.frames), row)
    assert (blind.tp, blind.fn, blind.cfn, blind.tda) == (0, row.frames, row.frames, 0.0)
    blinking = count(Told([found if k not in (3, 4, 9) else [] for k, found in enumerate(truth)]), row)
    assert (blinking.tp, blinking.fn, blinking.cfn) == (row.frames - 3, 3, 2)
