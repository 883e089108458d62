"""Average precision and counts on cases that can be done by hand."""

import numpy as np
import pytest

from baselines.learned.detector.evaluation import Truth, assign, average_precision, score
from tracker.boxes import Detection

LEFT, RIGHT = (0.1, 0.1, 0.3, 0.9), (0.6, 0.1, 0.8, 0.9)
NEAR_LEFT = (0.11, 0.1, 0.31, 0.9)


def truth(*boxes: tuple[float, ...], difficult: tuple[int, ...] = ()) -> Truth:
    return Truth(np.array(boxes).reshape(-1, 4), np.isin(np.arange(len(boxes)), difficult))


def test_a_person_is_found_once() -> None:
    assert assign(np.array([LEFT, NEAR_LEFT, RIGHT]), truth(LEFT)).tolist() == [1, 0, 0]


def test_difficult_people_count_for_nothing() -> None:
    assert assign(np.array([LEFT, RIGHT]), truth(LEFT, RIGHT, difficult=(1,))).tolist() == [1, -1]
    found = [[Detection(RIGHT, 0.9), Detection(LEFT, 0.8)]]
    result = score(found, [truth(LEFT, RIGHT, difficult=(1,))])
    assert (result.ap, result.tp, result.fp, result.fn) == (1.0, 1, 0, 0)


def test_precision_and_recall_by_hand() -> None:
    # true, false, true of 3 people: precision 1, 1/2, 2/3, made monotonous 1, 2/3, 2/3
    ap = average_precision(np.array([0.9, 0.8, 0.7]), np.array([1, 0, 1]), 3)
    assert ap == pytest.approx((1.0 + 2.0 / 3.0) / 3.0)
    assert average_precision(np.array([0.7, 0.9, 0.8]), np.array([1, 1, 0]), 3) == pytest.approx(ap)


def test_average_precision_equals_the_integral_of_the_curve() -> None:
    rng = np.random.default_rng(0)
    confidence, hits, people = rng.random(200), rng.integers(0, 2, 200), 140
    order = np.argsort(-confidence)
    recall = np.cumsum(hits[order]) / people
    precision = np.cumsum(hits[order]) / np.arange(1, 201)
    grid = (np.arange(1, people + 1) - 0.5) / people
    integral = np.mean([max(precision[recall >= level], default=0.0) for level in grid])
    assert average_precision(confidence, hits, people) == pytest.approx(integral)


def test_counts_are_at_the_papers_confidence() -> None:
    found = [[Detection(LEFT, 0.9), Detection(RIGHT, 0.6)], [Detection(RIGHT, 0.4)], []]
    result = score(found, [truth(LEFT), truth(RIGHT), truth(LEFT)])
    assert (result.pictures, result.tp, result.fp, result.fn) == (3, 1, 1, 2)


def test_nothing_to_find() -> None:
    assert score([[]], [truth()]).ap == 1.0
    assert score([[Detection(LEFT, 0.9)]], [truth()]).ap == 0.0
