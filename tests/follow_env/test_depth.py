"""The depth sensor's errors against the formulas that it states."""

import math

import numpy as np
import pytest

from follow_env.camera.depth import DepthSensor
from follow_env.config import DepthConfig

EXACT = DepthConfig(axial_noise=0.0, disparity_step=0.0, min_range=0.0, max_range=math.inf, edge_band=0)
XTION_HFOV = math.radians(57.5)


@pytest.mark.parametrize("z", [0.6, 1.0, 2.0, 4.0, 7.0])
def test_axial_noise_grows_as_stated(z):
    """sigma(z) = 0.0012 + 0.0019 (z - 0.4)^2 m, without bias (quantisation off)."""
    sensor = DepthSensor(DepthConfig(disparity_step=0.0, edge_band=0), XTION_HFOV)
    read = sensor.corrupt(np.full((200, 250), z, np.float32), np.random.default_rng(5)).astype(float)
    sigma = 0.0012 + 0.0019 * (z - 0.4) ** 2
    assert (read > 0.0).all()
    assert read.std() == pytest.approx(sigma, rel=0.02)
    assert read.mean() == pytest.approx(z, abs=5.0 * sigma / math.sqrt(50000))
    assert abs(np.corrcoef(read[:, 1:].ravel(), read[:, :-1].ravel())[0, 1]) < 0.02


def test_the_noise_scale_is_a_factor():
    depth = np.full((200, 250), 2.0, np.float32)
    spread = [
        DepthSensor(DepthConfig(axial_noise=scale, disparity_step=0.0), XTION_HFOV)
        .corrupt(depth, np.random.default_rng(6))
        .std()
        for scale in (1.0, 3.0)
    ]
    assert spread[1] / spread[0] == pytest.approx(3.0, rel=1e-3)


def test_quantisation_steps_grow_with_the_square_of_the_depth():
    """Disparity f b / z in eighths of a pixel: levels z^2 / (8 f b) apart (3 mm at 1 m, 2.6 cm at 3 m)."""
    ramp = np.linspace(0.6, 7.9, 200001, dtype=np.float32)[None, :]
    sensor = DepthSensor(DepthConfig(axial_noise=0.0, edge_band=0), XTION_HFOV)
    read = sensor.corrupt(ramp, np.random.default_rng(7))[0].astype(float)
    levels = np.unique(read)
    middle = 0.5 * (levels[1:] + levels[:-1])
    focal_baseline = 320.0 / math.tan(XTION_HFOV / 2.0) * 0.075
    assert np.diff(levels) == pytest.approx(middle**2 / (8.0 * focal_baseline), rel=0.02)
    assert np.interp(1.0, middle, np.diff(levels)) == pytest.approx(0.003, abs=0.0002)
    assert np.interp(3.0, middle, np.diff(levels)) == pytest.approx(0.026, abs=0.0007)
    step = ramp[0] ** 2 / (8.0 * focal_baseline)
    assert (np.abs(read - ramp[0]) < 0.53 * step).all()
    assert focal_baseline / levels * 8.0 == pytest.approx(np.round(focal_baseline / levels * 8.0), abs=1e-3)


def test_depth_out_of_range_is_no_reading():
    depth = np.array([[0.1, 0.49, 0.51, 7.99, 8.01, 30.0]], np.float32)
    sensor = DepthSensor(DepthConfig(axial_noise=0.0, disparity_step=0.0, edge_band=0), XTION_HFOV)
    read = sensor.corrupt(depth, np.random.default_rng(8))
    assert (read > 0.0).tolist() == [[False, False, True, True, False, False]]
    assert read[0, 2:4] == pytest.approx(depth[0, 2:4])


@pytest.mark.parametrize("band", [1, 2])
def test_depth_edges_are_holes_as_wide_as_stated(band):
    depth = np.full((12, 20), 3.0, np.float32)
    depth[:, :10] = 1.0
    sensor = DepthSensor(DepthConfig(axial_noise=0.0, disparity_step=0.0, edge_band=band), XTION_HFOV)
    holes = sensor.corrupt(depth, np.random.default_rng(9)) == 0.0
    wanted = np.zeros_like(holes)
    wanted[:, 10 - band : 10 + band] = True
    assert (holes == wanted).all()


def test_smaller_jumps_than_the_limit_are_no_edges():
    holes = {}
    for jump in (0.14, 0.16):
        depth = np.full((12, 20), 1.0, np.float32)
        depth[5:, :] -= jump
        sensor = DepthSensor(DepthConfig(axial_noise=0.0, disparity_step=0.0), XTION_HFOV)
        holes[jump] = int((sensor.corrupt(depth, np.random.default_rng(10)) == 0.0).sum())
    assert holes == {0.14: 0, 0.16: 2 * 20}


def test_an_exact_sensor_changes_nothing_and_a_noisy_one_follows_its_generator():
    depth = np.random.default_rng(11).uniform(0.2, 9.0, (30, 40)).astype(np.float32)
    assert (DepthSensor(EXACT, XTION_HFOV).corrupt(depth, np.random.default_rng(0)) == depth).all()
    noisy = DepthSensor(DepthConfig(edge_band=0), XTION_HFOV)
    one, two, other = (noisy.corrupt(depth, np.random.default_rng(seed)) for seed in (1, 1, 2))
    assert (one == two).all()
    assert (one != other).any()
    assert one.dtype == np.float32
