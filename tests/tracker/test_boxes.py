"""Overlap and suppression against brute force."""

import numpy as np
import pytest

from tracker.boxes import Detection, iou, nms, vote


def random_boxes(rng: np.random.Generator, count: int) -> np.ndarray:
    corner, size = rng.uniform(0.0, 0.8, (count, 2)), rng.uniform(0.02, 0.4, (count, 2))
    return np.hstack([corner, corner + size])


def overlap_by_counting(a: np.ndarray, b: np.ndarray) -> float:
    """Overlap of boxes with whole-numbered corners, counted cell by cell."""
    cells_a = {(u, v) for u in range(a[0], a[2]) for v in range(a[1], a[3])}
    cells_b = {(u, v) for u in range(b[0], b[2]) for v in range(b[1], b[3])}
    return len(cells_a & cells_b) / len(cells_a | cells_b)


def test_overlap_equals_counted_cells() -> None:
    rng = np.random.default_rng(0)
    corner = rng.integers(0, 12, (15, 2))
    boxes = np.hstack([corner, corner + rng.integers(1, 12, (15, 2))])
    counted = [[overlap_by_counting(a, b) for b in boxes] for a in boxes]
    np.testing.assert_allclose(iou(boxes.astype(float), boxes.astype(float)), counted, atol=1e-12)


def test_overlap_of_empty_boxes_is_zero() -> None:
    point = np.array([[0.3, 0.3, 0.3, 0.3]])
    assert iou(point, point) == 0.0
    assert iou(np.zeros((0, 4)), point).shape == (0, 1)


def suppressed_one_by_one(boxes: np.ndarray, scores: np.ndarray, overlap: float) -> list[int]:
    left, kept = sorted(range(len(boxes)), key=lambda k: (-scores[k], k)), []
    while left:
        best = left.pop(0)
        kept.append(best)
        left = [k for k in left if iou(boxes[best : best + 1], boxes[k : k + 1])[0, 0] <= overlap]
    return kept


@pytest.mark.parametrize("overlap", [0.2, 0.45, 0.8])
def test_suppression_equals_brute_force(overlap: float) -> None:
    rng = np.random.default_rng(1)
    boxes, scores = random_boxes(rng, 150), np.round(rng.random(150), 2)  # with ties
    assert nms(boxes, scores, overlap).tolist() == suppressed_one_by_one(boxes, scores, overlap)


def test_suppression_of_nothing() -> None:
    assert nms(np.zeros((0, 4)), np.zeros(0)).tolist() == []


def test_voting_equals_a_mean_by_hand() -> None:
    rng = np.random.default_rng(2)
    boxes, scores = random_boxes(rng, 120), rng.uniform(0.1, 1.0, 120)
    best = nms(boxes, scores)
    voters = 0
    for box, agreed in zip(boxes[best], vote(boxes[best], boxes, scores, 0.5), strict=True):
        total, weight = np.zeros(4), 0.0
        for other, score in zip(boxes, scores, strict=True):
            if iou(box[None], other[None])[0, 0] >= 0.5:
                total, weight, voters = total + score * other, weight + score, voters + 1
        np.testing.assert_allclose(agreed, total / weight)
    assert voters > len(best)


def test_a_box_that_nobody_shares_stays_and_nothing_votes_for_nothing() -> None:
    boxes = np.array([[0.1, 0.1, 0.3, 0.4], [0.6, 0.6, 0.9, 0.9]])
    np.testing.assert_allclose(vote(boxes, boxes, np.array([0.9, 0.2]), 0.6), boxes)
    assert vote(np.zeros((0, 4)), np.zeros((0, 4)), np.zeros(0), 0.6).shape == (0, 4)


def test_a_detection_is_a_value() -> None:
    assert Detection((0.0, 1.0, 2.0, 3.0), 0.9) == Detection((0.0, 1.0, 2.0, 3.0), 0.9)
