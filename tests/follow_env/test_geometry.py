"""Pixels, depth and the robot's frame: paper B, eqs. (24)-(31)."""

import math

import numpy as np
import pytest

from follow_env.geometry import (
    DONG_2018,
    XTION_PRO,
    CameraMount,
    Intrinsics,
    back_project,
    bearing_distance,
    project,
)

LOPSIDED = Intrinsics(fx=500.0, fy=480.0, cx=310.0, cy=255.0, width=640, height=480)
MOUNT = CameraMount(forward=0.12, height=0.9)


def test_xtion_focal_length_follows_from_its_field_of_view():
    assert XTION_PRO.fx == XTION_PRO.fy == pytest.approx(583.3, abs=0.05)
    assert (XTION_PRO.cx, XTION_PRO.cy) == (320.0, 240.0)


def test_the_papers_focal_length_belongs_to_the_half_size_picture():
    assert math.degrees(DONG_2018.hfov) == pytest.approx(61.05, abs=0.005)
    assert math.degrees(Intrinsics(271.33, 271.33, 320.0, 240.0, 640, 480).hfov) == pytest.approx(99.4, abs=0.05)


@pytest.mark.parametrize("degrees", [10.0, 57.5, 120.0])
def test_field_of_view_survives_the_round_trip_and_resizing(degrees):
    intrinsics = Intrinsics.from_hfov(640, 480, math.radians(degrees))
    assert math.degrees(intrinsics.hfov) == pytest.approx(degrees)
    assert math.degrees(intrinsics.scaled(320, 240).hfov) == pytest.approx(degrees)


def test_resizing_keeps_the_ray_of_every_pixel():
    half = LOPSIDED.scaled(320, 160)
    for u, v in ((0.0, 0.0), (123.4, 77.7), (640.0, 480.0)):
        assert back_project(u / 2, v / 3, 2.0, half) == pytest.approx(back_project(u, v, 2.0, LOPSIDED))


def test_known_points():
    """Hand-computed: 0.4 m right, 0.3 m below the optical axis, 2 m ahead of a camera 0.12 m ahead, 0.9 m up."""
    assert project((0.4, -0.6, 2.12), LOPSIDED, MOUNT) == pytest.approx((410.0, 327.0))
    assert back_project(410.0, 327.0, 2.0, LOPSIDED, MOUNT) == pytest.approx((0.4, -0.6, 2.12))
    assert back_project(410.0, 327.0, 2.0, LOPSIDED) == pytest.approx((0.4, 0.3, 2.0))


def test_projection_and_back_projection_are_inverse():
    rng = np.random.default_rng(0)
    for _ in range(100):
        point = tuple(rng.uniform((-2.0, -1.5, 0.5), (2.0, 1.5, 8.0)).tolist())
        u, v = project(point, LOPSIDED, MOUNT)
        assert back_project(u, v, point[2] - MOUNT.forward, LOPSIDED, MOUNT) == pytest.approx(point)


def test_bearing_and_distance_are_the_robots_not_the_cameras():
    """Place targets by polar coordinates about the axle (left positive) and see them with a camera ahead of it."""
    for bearing in np.radians([-28.0, -5.0, 0.0, 12.0, 28.0]):
        for range_ in (1.0, 1.5, 6.0):
            forward, left = range_ * math.cos(bearing), range_ * math.sin(bearing)
            u, _ = project((-left, 0.0, forward), LOPSIDED, MOUNT)
            measured = bearing_distance(u, forward - MOUNT.forward, LOPSIDED, MOUNT.forward)
            assert measured == pytest.approx((bearing, forward))


def test_a_target_in_the_left_half_of_the_picture_has_a_positive_bearing():
    assert bearing_distance(100.0, 1.5, XTION_PRO, 0.0)[0] > 0.0
    assert bearing_distance(540.0, 1.5, XTION_PRO, 0.0)[0] < 0.0


def test_the_edge_of_the_picture_lies_at_half_the_field_of_view():
    assert bearing_distance(0.0, 1.5, XTION_PRO, 0.0)[0] == pytest.approx(math.radians(28.75))
    assert bearing_distance(640.0, 1.5, XTION_PRO, 0.0)[0] == pytest.approx(-math.radians(28.75))


@pytest.mark.parametrize("depth", [0.0, -1.0, math.nan, math.inf])
def test_depth_must_be_positive_and_finite(depth):
    with pytest.raises(ValueError, match="depth"):
        back_project(1.0, 1.0, depth, XTION_PRO)
    with pytest.raises(ValueError, match="depth"):
        bearing_distance(1.0, depth, XTION_PRO, 0.1)


def test_points_behind_the_camera_are_not_projected():
    with pytest.raises(ValueError, match="depth"):
        project((0.0, 0.0, 0.1), XTION_PRO, MOUNT)


@pytest.mark.parametrize(
    "values",
    [
        (0.0, 1.0, 1.0, 1.0, 2, 2),
        (1.0, math.nan, 1.0, 1.0, 2, 2),
        (1.0, 1.0, 1.0, 1.0, 0, 2),
        (1.0, 1.0, math.inf, 1.0, 2, 2),
    ],
)
def test_impossible_intrinsics_are_refused(values):
    with pytest.raises(ValueError, match="expected"):
        Intrinsics(*values)


@pytest.mark.parametrize("hfov", [0.0, 57.5, -1.0, math.nan])
def test_a_field_of_view_in_degrees_is_refused(hfov):
    with pytest.raises(ValueError, match="radians"):
        Intrinsics.from_hfov(640, 480, hfov)
    with pytest.raises(ValueError, match="mount"):
        CameraMount(math.nan, 0.0)
