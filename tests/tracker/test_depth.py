"""Reading a person's depth from a box."""

import math

import numpy as np
import pytest

from follow_env.geometry import XTION_PRO, project
from tracker.association import alone
from tracker.depth import RULES, box_depth, measure, seen_at

GRID = (2, 3, 5, 6, 8)  # rows and columns of the 5x5 grid in a box over a 10x10 picture
WHOLE = (0.0, 0.0, 10.0, 10.0)
each_rule = pytest.mark.parametrize("rule", RULES)


def picture(depth, height=10, width=10):
    return np.full((height, width), depth, dtype=np.float32)


def with_grid_samples(values):
    """Return a picture without depth but for the given values on the first pixels of the grid."""
    depth = picture(0.0)
    for value, (row, column) in zip(values, ((r, c) for r in GRID for c in GRID), strict=False):
        depth[row, column] = value
    return depth


@each_rule
def test_every_rule_reads_a_flat_surface_as_it_is(rule):
    assert box_depth(picture(2.0), WHOLE, rule) == 2.0
    assert type(box_depth(picture(2.0), WHOLE, rule)) is float


def test_the_grid_spans_the_central_sixty_percent():
    columns = picture(1.0, 100, 100) + np.arange(100, dtype=np.float32) / 100.0
    box = (20.0, 10.0, 60.0, 90.0)  # samples in columns 28, 34, 40, 46, 52
    assert box_depth(columns, box, "six_smallest") == pytest.approx((5 * 1.28 + 1.34) / 6)
    assert box_depth(columns, box, "grid_mean") == pytest.approx(1.40)
    assert box_depth(columns, box, "grid_median") == pytest.approx(1.40)
    assert box_depth(columns.T, (10.0, 20.0, 90.0, 60.0), "six_smallest") == pytest.approx((5 * 1.28 + 1.34) / 6)


@pytest.mark.parametrize(
    ("values", "six_smallest", "mean", "median"),
    [
        ([], None, None, None),
        ([3.0, 1.0], None, None, None),
        ([3.0, 1.0, 2.0], 2.0, 2.0, 2.0),
        ([3.0, 1.0, 2.0, 6.0], 3.0, 3.0, 2.5),
        ([3.0, 1.0, 2.0, 6.0, 5.0, 4.0], 3.5, 3.5, 3.5),
        ([7.5, 3.0, 1.0, 2.0, 6.0, 5.0, 4.0], 3.5, 28.5 / 7, 4.0),
    ],
)
def test_few_samples(values, six_smallest, mean, median):
    depth = with_grid_samples(values)
    assert box_depth(depth, WHOLE, "six_smallest") == six_smallest
    assert box_depth(depth, WHOLE, "grid_mean") == (None if mean is None else pytest.approx(mean))
    assert box_depth(depth, WHOLE, "grid_median") == median


@each_rule
@pytest.mark.parametrize("nothing", [0.0, math.nan, math.inf, -1.0, 0.49, 8.01])
def test_samples_without_a_usable_depth_are_dropped(rule, nothing):
    depth = picture(2.0)
    depth[:, ::2] = nothing
    assert box_depth(depth, WHOLE, rule) == 2.0
    assert box_depth(picture(nothing), WHOLE, rule) is None


@each_rule
def test_the_valid_range_includes_its_ends_and_can_be_chosen(rule):
    assert box_depth(picture(0.5), WHOLE, rule) == 0.5
    assert box_depth(picture(8.0), WHOLE, rule) == 8.0
    assert box_depth(picture(2.0), WHOLE, rule, valid_range=(2.5, 3.0)) is None
    assert box_depth(picture(9.0), WHOLE, rule, valid_range=(0.5, 10.0)) == 9.0


def test_six_smallest_of_gaussian_samples_are_biased_by_one_and_a_quarter_sigma():
    sigma, side = 0.1, 60
    rng = np.random.default_rng(5)
    depth = rng.normal(3.0, sigma, (10 * side, 10 * side)).astype(np.float32)
    boxes = [(10.0 * i, 10.0 * j, 10.0 * i + 10.0, 10.0 * j + 10.0) for i in range(side) for j in range(side)]
    bias = np.mean([box_depth(depth, box, "six_smallest") - 3.0 for box in boxes]) / sigma
    assert bias == pytest.approx(-1.25, abs=0.02)
    unbiased = np.mean([box_depth(depth, box, "grid_mean") - 3.0 for box in boxes]) / sigma
    assert unbiased == pytest.approx(0.0, abs=0.02)


def test_background_in_the_box_enters_every_rule_but_the_six_smallest():
    """A person whose middle lets the wall show through: the pixels of the box count, not those of the person."""
    depth = picture(1.5)
    depth[:, 3:7] = 4.0
    assert box_depth(depth, WHOLE, "six_smallest") == 1.5
    assert box_depth(depth, WHOLE, "grid_mean") == pytest.approx((10 * 1.5 + 15 * 4.0) / 25)
    assert box_depth(depth, WHOLE, "grid_median") == 4.0
    assert box_depth(depth, WHOLE, "centroid") == 4.0


def test_centroid_reads_only_the_pixels_around_the_middle():
    depth = picture(4.0)
    depth[4:7, 4:7] = 2.0
    assert box_depth(depth, WHOLE, "centroid") == 2.0
    depth[4:7, 4:7] = 0.0
    assert box_depth(depth, WHOLE, "centroid") is None
    depth[4, 4:6] = 3.0
    assert box_depth(depth, WHOLE, "centroid") is None
    depth[5, 5] = 2.0
    assert box_depth(depth, WHOLE, "centroid") == 3.0


@each_rule
@pytest.mark.parametrize(
    ("box", "visible"),
    [
        ((-30.0, -20.0, 25.0, 30.0), (0.0, 0.0, 25.0, 30.0)),
        ((30.5, 10.0, 90.0, 55.0), (30.5, 10.0, 64.0, 48.0)),
        ((-1e6, -1e6, 1e6, 1e6), (0.0, 0.0, 64.0, 48.0)),
    ],
)
def test_only_the_visible_part_of_a_box_counts(rule, box, visible):
    depth = np.random.default_rng(6).uniform(1.0, 5.0, (48, 64)).astype(np.float32)
    assert box_depth(depth, box, rule) == box_depth(depth, visible, rule)
    intrinsics = XTION_PRO.scaled(64, 48)
    assert measure(depth, box, intrinsics, 0.1, rule) == measure(depth, visible, intrinsics, 0.1, rule)


@each_rule
@pytest.mark.parametrize(
    "box",
    [
        (12.0, 2.0, 20.0, 8.0),  # beside the picture
        (2.0, -9.0, 8.0, -1.0),  # above it
        (10.0, 2.0, 20.0, 8.0),  # touching its edge
        (3.0, 3.0, 3.0, 8.0),  # without width
        (8.0, 2.0, 2.0, 8.0),  # inverted
    ],
)
def test_a_box_that_shows_nothing_makes_no_measurement(rule, box):
    assert box_depth(picture(2.0), box, rule) is None
    assert measure(picture(2.0), box, XTION_PRO.scaled(10, 10), 0.1, rule) is None


@each_rule
def test_any_visible_sliver_can_be_read(rule):
    """Boxes down to a fraction of a pixel at every border stay inside the picture."""
    depth = picture(2.0)
    for low, high in ((0.0, 1e-9), (9.999999999, 12.0), (-3.0, 0.4), (4.999, 5.001)):
        assert box_depth(depth, (low, low, high, high), rule) == 2.0


def show(*people):
    """Return the depth of flat people ((u0, v0, u1, v1), depth) before a wall at 5 m, and the visible parts' boxes."""
    depth, owner = picture(5.0, 120, 160), np.full((120, 160), -1)
    for index in sorted(range(len(people)), key=lambda i: -people[i][1]):
        (u0, v0, u1, v1), z = people[index]
        depth[v0:v1, u0:u1], owner[v0:v1, u0:u1] = z, index
    boxes = []
    for index in range(len(people)):
        rows, columns = np.nonzero(owner == index)
        boxes.append(tuple(map(float, (columns.min(), rows.min(), columns.max() + 1, rows.max() + 1))))
    return depth, boxes


def test_alone_a_person_is_all_of_its_box():
    depth, (box,) = show(((60, 20, 100, 110), 2.0))

    for expected in (1.75, 2.0, 2.25):
        assert seen_at(depth, box, expected, 0.3) == (box, box_depth(depth, box)) == (box, 2.0)
    assert seen_at(depth, box, 2.5, 0.3) is None
    assert seen_at(np.zeros_like(depth), box, 2.0, 0.3) is None
    assert seen_at(depth, (-20.0, 0.0, -1.0, 50.0), 2.0, 0.3) is None


@pytest.mark.parametrize("left", range(-30, 31, 5))
def test_who_steps_in_front_never_lends_the_hidden_one_a_depth(left):
    """The target at 3 m in every stage of being hidden by somebody of its width at 2 m, whose legs are farther down."""
    target, other = ((60, 20, 100, 100), 3.0), ((60 + left, 10, 100 + left, 115), 2.0)
    if left == 0:
        target = ((55, 20, 105, 100), 3.0)
    depth, boxes = show(target, other)

    of_target = seen_at(depth, boxes[0], 3.0, 0.3)
    assert seen_at(depth, boxes[1], 3.0, 0.3) is None
    assert of_target is None or of_target[1] == 3.0
    if abs(left) >= 20:
        assert of_target == (boxes[0], 3.0)
    if left == 0:
        assert box_depth(depth, boxes[0]) == 2.0
        assert of_target is None


@pytest.mark.parametrize("seed", range(20))
def test_a_box_of_two_people_is_cut_to_the_one_at_the_expected_depth(seed):
    """The target in front or beside, the other one beside it or behind it and looking out on one side."""
    rng = np.random.default_rng(seed)
    left, width, gap = (int(n) for n in rng.integers((40, 32, -15), (60, 45, 10)))
    target, other = (left, 20, left + width, 110), (left + width + gap, 25, left + width + gap + 20, 100)
    if rng.random() < 0.5:
        target, other = ((160 - box[2], box[1], 160 - box[0], box[3]) for box in (target, other))
    depth, _ = show((target, 2.0), (other, 2.6))
    both = (min(target[0], other[0]), 20.0, max(target[2], other[2]), 110.0)

    part, z = seen_at(depth, both, 2.1, 0.3)

    assert z == 2.0
    assert (part[0], part[2]) == (target[0], target[2])


@pytest.mark.parametrize("sliver", [5, 15])
def test_a_box_with_a_sliver_of_another_person_is_not_that_person(sliver):
    depth, (box, _) = show(((60, 20, 100, 110), 3.0), ((40, 10, 60 + sliver, 115), 2.0))
    box = (60.0, *box[1:])

    assert seen_at(depth, box, 2.0, 0.3) is None
    assert seen_at(depth, box, 3.0, 0.3) == ((60.0 + sliver, *box[1:]), 3.0)


@pytest.mark.parametrize("right", [False, True])
def test_an_arm_before_the_box_lends_no_depth_where_its_owner_was_detected(right):
    """The target at 2.2 m; at its edge the neighbor's arm, 0.2 m nearer, under a column of the samples."""
    target, arm, neighbor = (60, 20, 110, 110), (60, 30, 74, 100), (20.0, 10.0, 74.0, 120.0)
    if right:
        target, arm, neighbor = (tuple((160 - b[2], b[1], 160 - b[0], b[3])) for b in (target, arm, neighbor))
    depth, _ = show((target, 2.2), (arm, 2.0))
    box = tuple(map(float, target))

    _, drawn = seen_at(depth, box, 2.2, 0.3)
    part, z = seen_at(depth, box, 2.2, 0.3, alone(box, [neighbor]))

    assert drawn < 2.1
    assert (part, z) == (box, pytest.approx(2.2))


@pytest.mark.parametrize("width", [26, 20])
def test_where_the_person_shows_only_where_another_was_detected_all_of_the_box_is_read(width):
    """Without depth, or too little, in the part where nobody else was detected."""
    depth, _ = show(((60, 20, 60 + width, 110), 2.2), ((110 - width, 54, 110, 63), 2.2))
    box = (60.0, 20.0, 110.0, 110.0)

    assert seen_at(depth, box, 2.2, 0.3, (84.0, 20.0, 110.0, 110.0)) == seen_at(depth, box, 2.2, 0.3) is not None


def test_measurement_finds_a_person_where_it_stands():
    """A flat target 0.3 m left of and 2.1 m ahead of the axle, seen by a camera 0.1 m ahead of it."""
    intrinsics = XTION_PRO.scaled(320, 240)
    left, _ = project((-0.55, 0.0, 2.0), intrinsics)
    right, _ = project((-0.05, 0.0, 2.0), intrinsics)
    bearing, distance = measure(picture(2.0, 240, 320), (left, 40.0, right, 239.0), intrinsics, 0.1)
    assert bearing == pytest.approx(math.atan2(0.3, 2.1))
    assert distance == pytest.approx(2.1)


def test_no_depth_no_measurement():
    assert measure(picture(0.0), WHOLE, XTION_PRO.scaled(10, 10), 0.1) is None


def test_bad_arguments_are_named():
    with pytest.raises(ValueError, match="six_smallest, grid_mean, grid_median, centroid"):
        box_depth(picture(2.0), WHOLE, "nearest")
    with pytest.raises(ValueError, match="valid_range"):
        box_depth(picture(2.0), WHOLE, valid_range=(3.0, 1.0))
    with pytest.raises(ValueError, match="shape"):
        box_depth(np.zeros((4, 4, 3), dtype=np.float32), WHOLE)
    with pytest.raises(ValueError, match="box"):
        box_depth(picture(2.0), (0.0, 0.0, math.nan, 5.0))
    with pytest.raises(ValueError, match=r"scaled\(10, 10\)"):
        measure(picture(2.0), WHOLE, XTION_PRO, 0.1)
