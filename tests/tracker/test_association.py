"""Gate and similarity of paper A, eqs. (15)-(19)."""

import math

import numpy as np
import pytest

from tracker.association import Candidate, associate, log_similarity

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


@pytest.mark.parametrize("box", [(10.0, 10.0, 10.0, 20.0), (20.0, 10.0, 10.0, 20.0), (0.0, 0.0, math.nan, 5.0)])
def test_impossible_boxes_are_refused(box):
    with pytest.raises(ValueError, match="expected finite pixels"):
        log_similarity(box, BOX, SIZE)
