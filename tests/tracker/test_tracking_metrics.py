"""Counts of paper A by hand-made cases and against a brute-force count."""

import math

import numpy as np
import pytest

from tracker.metrics import count_detections, count_tracking, overlap, time_to_stop

HERE, THERE = (10.0, 10.0, 30.0, 50.0), (60.0, 10.0, 80.0, 50.0)
SHIFTED = (12.0, 10.0, 32.0, 50.0)  # overlaps HERE by 18 / 22
HALF = (20.0, 10.0, 40.0, 50.0)  # overlaps HERE by 10 / 30


def test_overlap_by_counting_pixels():
    rng = np.random.default_rng(5)
    rows, columns = np.mgrid[:40, :40] + 0.5
    for _ in range(100):
        masks, boxes = [], []
        for _ in range(2):
            u0, v0 = rng.integers(0, 30, 2)
            u1, v1 = u0 + rng.integers(1, 10), v0 + rng.integers(1, 10)
            boxes.append((float(u0), float(v0), float(u1), float(v1)))
            masks.append((u0 < columns) & (columns < u1) & (v0 < rows) & (rows < v1))
        assert overlap(*boxes) == pytest.approx((masks[0] & masks[1]).sum() / (masks[0] | masks[1]).sum())


def test_a_hand_made_sequence():
    truth = [HERE, HERE, HERE, HERE, None, HERE, HERE, None]
    detections = [[HERE], [SHIFTED, THERE], [], [HALF], [], [], [HERE, SHIFTED], [THERE]]

    counts = count_detections(truth, detections)

    assert (counts.frames, counts.tp, counts.fp, counts.fn, counts.cfn) == (8, 3, 4, 3, 2)
    assert counts.tda == 3 / 8


def test_the_paper_s_table_2_is_consistent_with_the_definitions():
    truth = [HERE] * 2131
    missed = {100, 500, 501, 900, *range(1000, 1005)}  # 9 misses, at most 5 in a row: blue, view 1

    counts = count_detections(truth, [[] if i in missed else [SHIFTED] for i in range(2131)])

    assert (counts.tp, counts.fp, counts.fn, counts.cfn) == (2122, 0, 9, 5)
    assert round(100 * counts.tda, 1) == 99.6


def test_counts_against_brute_force():
    rng = np.random.default_rng(6)
    for _ in range(50):
        n = int(rng.integers(1, 40))
        truth = [HERE if rng.random() < 0.8 else None for _ in range(n)]
        detections = [[(HERE, SHIFTED, HALF, THERE)[i] for i in rng.integers(0, 4, rng.integers(0, 3))] for _ in truth]

        counts = count_detections(truth, detections)

        missed = "".join(
            "x" if t and not {HERE, SHIFTED} & set(d) else "." for t, d in zip(truth, detections, strict=True)
        )
        assert counts.fn == missed.count("x")
        assert counts.cfn == max(map(len, missed.split(".")))
        assert counts.tp + counts.fn == sum(t is not None for t in truth)
        assert counts.tp + counts.fp == sum(map(len, detections))


def test_switches_are_counted_when_another_person_is_taken_up():
    people = [{"target": HERE, "other": THERE}] * 9
    tracked = [HERE, THERE, None, THERE, SHIFTED, HALF, THERE, HERE, None]

    counts = count_tracking(people, tracked, "target")

    assert (counts.right, counts.wrong, counts.nobody, counts.switches) == (3, 3, 1, 2)


def test_time_to_stop_counts_from_the_disappearance_that_lasts():
    visible = [True] * 5 + [False] * 3 + [True] * 2 + [False] * 12
    stopped = [False] * 20 + [True] * 2

    assert time_to_stop(visible, stopped, 10.0) == 1.0
    assert time_to_stop(visible, [False] * 22, 10.0) is None
    assert time_to_stop([True] * 3, [False, True, True], 10.0) is None


def test_sequences_of_different_length_are_refused_and_an_empty_one_has_no_accuracy():
    with pytest.raises(ValueError, match="2 and 1 frames"):
        count_detections([HERE, HERE], [[HERE]])
    assert math.isnan(count_detections([], []).tda)
