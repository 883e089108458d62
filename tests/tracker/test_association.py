"""Gate and similarity of paper A, eqs. (15)-(19)."""

import math

import numpy as np
import pytest
from scipy.stats import chi2

from tracker.association import COVERED, Candidate, alone, associate, between, log_similarity

SIZE = (320, 240)
BOX = (100.0, 60.0, 160.0, 220.0)


def at(position, box=BOX):
    return Candidate(box, 0.9, position)


def test_the_similarity_is_equation_16_in_shares_of_the_picture():
    box = (132.0, 72.0, 180.0, 192.0)

    shift = math.hypot((156 - 130) / 320, (132 - 140) / 240)
    area = abs(48 * 120 - 60 * 160) / (320 * 240)
    aspect = abs((48 / 320) / (120 / 240) - (60 / 320) / (160 / 240))

    assert log_similarity(box, BOX, SIZE) == pytest.approx(-(shift + 1.0 * (math.sqrt(area) + 0.8 * aspect)))
    assert log_similarity(box, BOX, SIZE, (2.0, 0.0, 9.0)) == pytest.approx(-2.0 * shift)
    assert log_similarity(BOX, BOX, SIZE) == 0.0


def test_the_similarity_is_symmetric_and_does_not_depend_on_the_resolution():
    rng = np.random.default_rng(1)
    for _ in range(200):
        u0, v0 = rng.uniform(0, 200, 2)
        box = (u0, v0, u0 + rng.uniform(5, 100), v0 + rng.uniform(5, 100))
        double = tuple(2 * value for value in box)
        score = log_similarity(box, BOX, SIZE)
        assert score == pytest.approx(log_similarity(BOX, box, SIZE))
        assert score == pytest.approx(log_similarity(double, tuple(2 * value for value in BOX), (640, 480)))
        assert score <= 0.0


def test_the_edge_of_the_gate_is_inside():
    inside = associate([at((2.25, 0.0, 0.0))], (2.0, 0.0, 0.0), BOX, SIZE, gate=0.25)
    outside = associate([at((2.2500001, 0.0, 0.0))], (2.0, 0.0, 0.0), BOX, SIZE, gate=0.25)

    assert inside.chosen is not None
    assert (outside.chosen, outside.log_score) == (None, None)
    assert outside.distance == pytest.approx(0.25)


def test_inside_the_gate_similarity_decides_and_not_nearness_or_confidence():
    near = at((2.01, 0.0, 0.0), (200.0, 60.0, 260.0, 220.0))
    alike = Candidate((104.0, 60.0, 164.0, 220.0), 0.5, (2.2, 0.0, 0.0))

    found = associate([near, alike], (2.0, 0.0, 0.0), BOX, SIZE)

    assert found.chosen is alike
    assert found.distance == pytest.approx(0.2)
    assert found.log_score == pytest.approx(-4.0 / 320.0)


def test_random_candidates_against_brute_force():
    rng = np.random.default_rng(2)
    accepted = 0
    for _ in range(500):
        prediction = rng.normal(0, 1, 3)
        candidates = []
        for _ in range(int(rng.integers(0, 6))):
            u0, v0 = rng.uniform(0, 250), rng.uniform(0, 180)
            box = (u0, v0, u0 + rng.uniform(10, 60), v0 + rng.uniform(10, 60))
            candidates.append(at(tuple(prediction + rng.normal(0, 0.2, 3)), box))

        found = associate(candidates, tuple(prediction), BOX, SIZE)

        distances = [np.linalg.norm(np.subtract(c.position, prediction)) for c in candidates]
        posterior = [
            math.exp(log_similarity(c.box, BOX, SIZE)) * (d <= 0.3) for c, d in zip(candidates, distances, strict=True)
        ]
        if not any(posterior):
            assert found.chosen is None
            assert found.distance == (pytest.approx(min(distances)) if distances else None)
        else:
            accepted += 1
            assert found.chosen is candidates[int(np.argmax(posterior))]
            assert found.distance == pytest.approx(distances[int(np.argmax(posterior))])
    assert 100 < accepted < 400


def test_with_a_variance_the_place_counts_by_its_gaussian_likelihood():
    rng = np.random.default_rng(3)
    differ = implausible = 0
    for _ in range(300):
        prediction = rng.normal(0, 1, 3)
        candidates = []
        for _ in range(3):
            u0, v0 = rng.uniform(0, 250), rng.uniform(0, 180)
            box = (u0, v0, u0 + rng.uniform(10, 60), v0 + rng.uniform(10, 60))
            candidates.append(at(tuple(prediction + rng.uniform(-0.17, 0.17, 3)), box))

        found = associate(candidates, tuple(prediction), BOX, SIZE, variance=0.05**2)

        density = []
        for c in candidates:
            shift = np.subtract(c.position, prediction) / 0.05
            plausible = chi2.sf(shift @ shift, 3) >= 1e-3
            density.append(math.exp(log_similarity(c.box, BOX, SIZE) - shift @ shift / 2) if plausible else 0.0)
        if not any(density):
            assert found.chosen is None
            assert associate(candidates, tuple(prediction), BOX, SIZE).chosen is not None
            implausible += 1
            continue
        best = candidates[int(np.argmax(density))]
        assert found.chosen is best
        assert found.log_score == pytest.approx(log_similarity(best.box, BOX, SIZE))
        differ += best is not associate(candidates, tuple(prediction), BOX, SIZE).chosen
    assert differ > 50
    assert implausible > 1


def test_a_large_variance_does_not_widen_the_gate():
    for away, taken in ((0.29, True), (0.31, False)):
        found = associate([at((away, 0.0, 0.0))], (0.0, 0.0, 0.0), BOX, SIZE, variance=1.0)
        assert (found.chosen is not None) == taken


def test_a_box_between_two_others_is_the_one_that_both_cover():
    left, right = (20.0, 40.0, 80.0, 200.0), (85.0, 50.0, 150.0, 200.0)
    bridge = (50.0, 45.0, 120.0, 200.0)

    assert between(bridge, [right, left])
    assert not between(left, [bridge, right])
    assert not between(right, [left, bridge])
    assert not between(bridge, [left])
    assert not between(bridge, [left, (200.0, 40.0, 260.0, 200.0)])
    assert not between(bridge, [])
    assert not between(bridge, [left, (100.0, 60.0, 125.0, 180.0)])  # but a fifth in it: an arm, not a neighbor


def test_a_box_is_alone_between_its_neighbors():
    box, left, right = (50.0, 40.0, 110.0, 200.0), (0.0, 30.0, 62.0, 210.0), (100.0, 45.0, 160.0, 205.0)

    assert alone(box, []) == box
    assert alone(box, [left, right]) == (62.0, 40.0, 100.0, 200.0)
    assert alone(box, [(0.0, 30.0, 40.0, 210.0)]) == box  # beside it
    assert alone(box, [(20.0, 0.0, 75.0, 35.0)]) == box  # above it
    assert alone(box, [(45.0, 60.0, 65.0, 150.0)]) == box  # three quarters of it: a part of the same person
    assert alone(box, [(30.0, 60.0, 65.0, 150.0)]) == (65.0, 40.0, 110.0, 200.0)  # three sevenths
    assert alone(box, [left, (76.0, 40.0, 160.0, 70.0)]) == box  # little would be left


def test_how_much_two_boxes_cover_is_what_counting_pixels_says():
    rng = np.random.default_rng(4)
    agreed = []
    for _ in range(2000):
        edges = np.sort(rng.integers(0, 40, (3, 2, 2)), axis=2) + np.array([0, 1])
        box, *others = [tuple(map(float, (u[0], v[0], u[1], v[1]))) for u, v in edges]
        counts = np.zeros((42, 42), int)
        for u, v in edges[1:]:
            counts[v[0] : v[1], u[0] : u[1]] += 1
        u, v = edges[0]
        covered = float((counts[v[0] : v[1], u[0] : u[1]] > 0).mean())
        order = sorted(others)
        sides = order[0][0] < box[0] and order[0][2] < box[2] and order[1][0] > box[0] and order[1][2] > box[2]
        inside = np.zeros((42, 42), bool)
        inside[v[0] : v[1], u[0] : u[1]] = True
        parts = [float(inside[rows[0] : rows[1], columns[0] : columns[1]].mean()) for columns, rows in edges[1:]]
        assert between(box, others) == (sides and covered >= COVERED and max(parts) < COVERED)
        agreed.append(between(box, others))
    assert 10 < sum(agreed) < 1000


@pytest.mark.parametrize("box", [(10.0, 10.0, 10.0, 20.0), (20.0, 10.0, 10.0, 20.0), (0.0, 0.0, math.nan, 5.0)])
def test_impossible_boxes_are_refused(box):
    with pytest.raises(ValueError, match="expected finite pixels"):
        log_similarity(box, BOX, SIZE)
