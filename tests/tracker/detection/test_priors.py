"""Priors against the closed form of paper A's Table 1, coding as a round trip, matching against a plain search."""

import math

import numpy as np
import pytest

from tracker.boxes import iou
from tracker.detection.priors import (
    IGNORED,
    MATCH_OVERLAP,
    NEAR_OVERLAP,
    NEAR_SHARE,
    NEGATIVE,
    OWN_OVERLAP,
    OWN_PRIORS,
    PAPER_LAYERS,
    POSITIVE,
    SSD300_LAYERS,
    decode,
    encode,
    match,
    prior_boxes,
    to_centers,
    to_corners,
)

PRIORS = prior_boxes(PAPER_LAYERS)


def test_there_are_as_many_as_the_papers_say() -> None:
    counts = [layer.cells**2 * layer.per_cell for layer in PAPER_LAYERS]
    assert counts == [1444, 600, 150, 54, 4]
    assert len(PRIORS) == sum(counts) == 2252
    assert len(prior_boxes(SSD300_LAYERS)) == 8732


@pytest.mark.parametrize(("layer", "row", "column"), [(0, 9, 9), (0, 0, 0), (1, 4, 6), (2, 2, 2), (3, 1, 0), (4, 0, 0)])
def test_shapes_and_places_are_those_of_table_1(layer: int, row: int, column: int) -> None:
    cells, smallest, largest, step = [
        (19, 60, 115, 16),
        (10, 115, 170, 30),
        (5, 170, 225, 60),
        (3, 225, 280, 100),
        (1, 280, 320, 300),
    ][layer]
    ratios = (0.5, 2, 1 / 3, 3) if layer in (1, 2, 3) else (0.5, 2)
    side = math.sqrt(smallest * largest)
    shapes = [(smallest, smallest), (side, side)]
    shapes += [(smallest * math.sqrt(r), smallest / math.sqrt(r)) for r in ratios]
    u, v = (column + 0.5) * step, (row + 0.5) * step
    expected = [[max(u - w / 2, 0), max(v - h / 2, 0), min(u + w / 2, 300), min(v + h / 2, 300)] for w, h in shapes]
    first = sum((1444, 600, 150, 54)[:layer]) + (row * cells + column) * len(shapes)
    np.testing.assert_allclose(300 * to_corners(PRIORS[first : first + len(shapes)]), expected, atol=1e-3)


def test_all_lie_in_the_picture_and_none_is_empty() -> None:
    for layers in (PAPER_LAYERS, SSD300_LAYERS):
        priors = prior_boxes(layers)
        corners = to_corners(priors)
        assert corners.min() >= -1e-6
        assert corners.max() <= 1.0 + 1e-6
        assert priors[:, 2:].min() > 0.02


def test_coding_there_and_back() -> None:
    rng = np.random.default_rng(2)
    corner, size = rng.uniform(0.0, 0.7, (len(PRIORS), 2)), rng.uniform(0.01, 0.3, (len(PRIORS), 2))
    boxes = np.hstack([corner, corner + size])
    np.testing.assert_allclose(decode(encode(boxes, PRIORS), PRIORS), boxes, atol=1e-6)


def test_a_code_is_the_shift_over_the_variances() -> None:
    prior = np.array([[0.5, 0.5, 0.2, 0.4]])
    box = to_corners(np.array([[0.52, 0.46, 0.2 * math.e**0.2, 0.4]]))
    np.testing.assert_allclose(encode(box, prior), [[1.0, -1.0, 1.0, 0.0]], atol=1e-12)
    np.testing.assert_allclose(to_centers(to_corners(prior)), prior)


NOBODY, NEARLY = -1, -2


def matched_by_search(boxes: np.ndarray, difficult: np.ndarray) -> np.ndarray:
    """The person of each prior, pair by pair, or that it has none or nearly one."""
    overlaps = {
        (n, p): float(iou(boxes[n : n + 1], to_corners(PRIORS[p : p + 1]))[0, 0])
        for n in range(len(boxes))
        for p in range(len(PRIORS))
    }
    owner = np.full(len(PRIORS), NOBODY)
    for p in range(len(PRIORS)):
        best = max(range(len(boxes)), key=lambda n: (overlaps[n, p], -n))
        if overlaps[best, p] >= MATCH_OVERLAP:
            owner[p] = best
        elif overlaps[best, p] >= min(NEAR_OVERLAP, NEAR_SHARE * max(overlaps[best, q] for q in range(len(PRIORS)))):
            owner[p] = NEARLY
    left_people, left_priors = [n for n in range(len(boxes)) if not difficult[n]], set(range(len(PRIORS)))
    while left_people:
        n, p = max(((n, p) for n in left_people for p in left_priors), key=lambda pair: overlaps[pair])
        owner[p] = n
        left_people.remove(n)
        left_priors.remove(p)
    own = dict(enumerate(owner.tolist()))
    for p in range(len(PRIORS)):
        if owner[p] < 0:
            own[p] = max(range(len(boxes)), key=lambda n: (overlaps[n, p], -n))
    for n in (n for n in range(len(boxes)) if not difficult[n]):
        mine = sorted((p for p in own if own[p] == n), key=lambda p: (-overlaps[n, p], p))
        owner[[p for p in mine[:OWN_PRIORS] if overlaps[n, p] >= OWN_OVERLAP]] = n
    return owner


def test_matching_equals_a_search_over_all_pairs() -> None:
    boxes = np.array([[0.1, 0.1, 0.4, 0.95], [0.45, 0.3, 0.52, 0.6], [0.15, 0.1, 0.42, 0.9], [0.6, 0.2, 0.9, 1.0]])
    difficult = np.array([False, False, False, True])
    labels, offsets, weights = match(boxes, difficult, PRIORS)
    owner = matched_by_search(boxes, difficult)
    expected = np.where(difficult[owner], IGNORED, POSITIVE)
    expected[owner == NOBODY], expected[owner == NEARLY] = NEGATIVE, IGNORED
    assert (owner == NEARLY).any()
    np.testing.assert_array_equal(labels, expected)
    assert {IGNORED, NEGATIVE, POSITIVE} == set(labels.tolist())
    found = labels == POSITIVE
    np.testing.assert_allclose(decode(offsets[found], PRIORS[found]), boxes[owner[found]], atol=1e-5)
    assert not offsets[~found].any()
    for person in set(owner[found].tolist()):
        shared = weights[found & (owner == person)]
        np.testing.assert_allclose(shared, 1.0 / math.sqrt(len(shared)), rtol=1e-6)
    assert not weights[~found].any()


def test_a_distant_person_has_priors_although_none_overlaps_enough() -> None:
    distant, tiny = np.array([[0.48, 0.40, 0.54, 0.70]]), np.array([[0.48, 0.40, 0.49, 0.44]])  # 4 m away; a hand
    assert iou(distant, to_corners(PRIORS)).max() < MATCH_OVERLAP
    assert iou(tiny, to_corners(PRIORS)).max() < OWN_OVERLAP
    for box, found in ((distant, OWN_PRIORS), (tiny, 1)):
        labels = match(box, np.array([False]), PRIORS).labels
        assert (labels == POSITIVE).sum() == found


def test_priors_as_good_as_those_that_have_to_find_a_person_may() -> None:
    distant = np.array([[0.46, 0.16, 0.54, 0.78]])  # 4 m away, in profile, arms raised
    overlaps = iou(distant, to_corners(PRIORS))[0]
    labels = match(distant, np.array([False]), PRIORS).labels
    good = overlaps >= NEAR_SHARE * overlaps.max()
    np.testing.assert_array_equal(labels == IGNORED, good & (labels != POSITIVE))
    assert overlaps.max() < NEAR_OVERLAP / NEAR_SHARE
    assert (labels == IGNORED).any()
    assert (match(distant, np.array([True]), PRIORS).labels != POSITIVE).all()


def test_a_picture_without_people_is_all_background() -> None:
    labels, offsets, weights = match(np.zeros((0, 4)), np.zeros(0, bool), PRIORS)
    assert (labels == NEGATIVE).all()
    assert not offsets.any()
    assert not weights.any()


@pytest.mark.parametrize("box", [(0.5, 0.1, 0.5, 0.9), (0.6, 0.1, 0.5, 0.9), (0.1, 0.1, float("nan"), 0.9)])
def test_boxes_that_would_make_the_loss_infinite_are_refused(box: tuple[float, ...]) -> None:
    with pytest.raises(ValueError, match="u0 < u1"):
        match(np.array([box]), np.array([False]), PRIORS)
