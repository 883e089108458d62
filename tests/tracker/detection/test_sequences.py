"""The sequences of Table 2: the subject is always there, turns in every posture, and is counted as the paper counts."""

import numpy as np
import pytest

from follow_env.person.walker import POSTURES
from tracker.detection.boxes import Detection
from tracker.detection.sequences import SUITS, TABLE_2, VIEWS, Sequence, count, play

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
    np.testing.assert_array_equal(green.rgb[~body], blue.rgb[~body])


def test_counts_of_a_perfect_a_blind_and_a_blinking_detector() -> None:
    row = SHORT[0]
    truth = [[Detection(frame.person_box() or (0.0, 0.0, 0.0, 0.0), 1.0)] for frame in play(row)]
    perfect = count(Told(truth), row)
    assert (perfect.tp, perfect.fp, perfect.fn, perfect.cfn, perfect.tda) == (row.frames, 0, 0, 0, 1.0)
    blind = count(Told([[]] * row.frames), row)
    assert (blind.tp, blind.fn, blind.cfn, blind.tda) == (0, row.frames, row.frames, 0.0)
    blinking = count(Told([found if k not in (3, 4, 9) else [] for k, found in enumerate(truth)]), row)
    assert (blinking.tp, blinking.fn, blinking.cfn) == (row.frames - 3, 3, 2)
