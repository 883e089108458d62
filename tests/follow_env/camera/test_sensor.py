"""The sensor's errors against the formulas that it states."""

import dataclasses
import hashlib
import math
import os
import subprocess
import sys
from pathlib import Path
from statistics import NormalDist

import numpy as np
import pytest

from follow_env.camera import PinholeCamera, RGBDFrame
from follow_env.camera.sensor.errors import RGBDSensor
from follow_env.config import CameraConfig
from follow_env.sensors import HARSH_SENSOR, IDEAL_SENSOR, ColorConfig, DepthConfig, SensorConfig

WIDTH, HEIGHT = 250, 200
GRAY = np.full((HEIGHT, WIDTH, 3), 128, np.uint8)
NORMAL = NormalDist()


def camera(width=WIDTH, height=HEIGHT):
    return PinholeCamera(CameraConfig(width=width, height=height))


def read(depth, rgb=None, seed=1, **dials):
    """What a sensor with only these errors of the depth reports."""
    depth = np.asarray(depth, np.float32)
    rgb = np.full((*depth.shape, 3), 128, np.uint8) if rgb is None else rgb
    sensor = RGBDSensor(
        dataclasses.replace(IDEAL_SENSOR.depth, **dials), IDEAL_SENSOR.color, camera(*depth.shape[::-1])
    )
    return sensor.corrupt(RGBDFrame(rgb, depth, np.zeros(depth.shape, np.uint8)), seed).depth


def look(rgb, seed=1, **dials):
    """The colors that a sensor with only these errors of the color reports."""
    shape = rgb.shape[:2]
    sensor = RGBDSensor(
        IDEAL_SENSOR.depth, dataclasses.replace(IDEAL_SENSOR.color, **dials), camera(shape[1], shape[0])
    )
    return sensor.corrupt(RGBDFrame(rgb, np.ones(shape, np.float32), np.zeros(shape, np.uint8)), seed).rgb


def wall(z):
    return np.full((HEIGHT, WIDTH), z, np.float32)


def share(seen):
    """A share and its standard error, for approx."""
    p = seen.mean()
    return p, math.sqrt(max(p * (1.0 - p), 1e-4) / seen.size)


def frame_hash(width=90, height=70):
    """Hash of frames of both noisy sensors: every error at work, on a picture made of whole numbers and divisions."""
    v, u = np.mgrid[:height, :width].astype(np.float32)
    depth = np.float32(0.3) + (v * np.float32(7) + u) / np.float32(64.0)
    depth[20:50, 30:60] = 1.5
    depth[:5, :5] = (0.0, np.nan, np.inf, -1.0, 30.0)
    rgb = np.stack([(v * 3) % 256, (u * 5) % 256, (u + v) % 256], axis=-1).astype(np.uint8)
    digest = hashlib.sha256()
    for config in (SensorConfig(), HARSH_SENSOR):
        sensor = RGBDSensor(config.depth, config.color, camera(width, height))
        for seed in (0, 1, 2**64 - 1):
            frame = sensor.corrupt(RGBDFrame(rgb, depth, np.zeros(depth.shape, np.uint8)), seed)
            digest.update(frame.depth.tobytes() + frame.rgb.tobytes())
    return digest.hexdigest()


@pytest.mark.parametrize("z", [0.6, 1.0, 2.0, 4.0, 7.0])
def test_axial_noise_grows_as_stated(z):
    """sigma(z) = 0.0012 + 0.0019 (z - 0.4)^2 m, without bias, normal, independent of the neighbors."""
    noisy = read(wall(z), axial_noise=1.0).astype(float)
    sigma = 0.0012 + 0.0019 * (z - 0.4) ** 2
    assert noisy.std() == pytest.approx(sigma, rel=0.02)
    assert noisy.mean() == pytest.approx(z, abs=5.0 * sigma / math.sqrt(noisy.size))
    deviates = (noisy - z) / sigma
    for level in (-2.0, -1.0, 0.5, 1.5, 2.5):
        assert (deviates < level).mean() == pytest.approx(NORMAL.cdf(level), abs=0.01)
    for one, two in (
        (deviates[:, 1:], deviates[:, :-1]),
        (deviates[1:], deviates[:-1]),
        (deviates[1:, 1:], deviates[:-1, :-1]),
    ):
        assert abs(np.corrcoef(one.ravel(), two.ravel())[0, 1]) < 0.02


def test_frames_are_independent_and_the_noise_scale_is_a_factor():
    frames = [read(wall(2.0), seed=seed, axial_noise=1.0).ravel() - 2.0 for seed in (1, 2, 3, 2**63)]
    assert np.abs(np.corrcoef(frames) - np.eye(4)).max() < 0.02
    tripled = read(wall(2.0), axial_noise=3.0).ravel() - 2.0
    assert tripled == pytest.approx(3.0 * frames[0], abs=1e-6)


def test_readings_lie_on_the_grid_of_disparities():
    """Disparity f b / z in eighths of a pixel at 640 px: levels z^2 / (8 f b) apart (3 mm at 1 m, 2.6 cm at 3 m)."""
    z = np.linspace(0.6, 7.9, 4000 * 6, dtype=np.float32).reshape(6, 4000)
    levels = read(z, disparity_step=0.125).astype(float)
    focal_baseline = 320.0 / math.tan(math.radians(57.5) / 2.0) * 0.075
    eighths = 8.0 * focal_baseline / levels
    assert np.abs(eighths - np.round(eighths)).max() < 2e-4
    assert np.abs(np.round(eighths) - 8.0 * focal_baseline / z).max() < 0.5 + 1e-3
    values = np.unique(levels)
    middle = 0.5 * (values[1:] + values[:-1])
    assert np.interp(1.0, middle, np.diff(values)) == pytest.approx(0.003, abs=0.0002)
    assert np.interp(3.0, middle, np.diff(values)) == pytest.approx(0.026, abs=0.0007)


def test_depth_out_of_range_is_no_reading():
    seen = read([[0.1, 0.49, 0.51, 7.99, 8.01, 30.0]], min_range=0.5, max_range=8.0)
    assert seen[0] == pytest.approx([0.0, 0.0, 0.51, 7.99, 0.0, 0.0])


def test_what_lies_beyond_the_renderers_far_is_nothing_seen():
    """Also when the sensor reaches farther; noise never lifts a reading above the observation's bound."""
    near_sighted = PinholeCamera(CameraConfig(width=40, height=30, far=5.0))
    sensor = RGBDSensor(DepthConfig(axial_noise=9.0), IDEAL_SENSOR.color, near_sighted)
    for z, wanted in ((5.0, 0.0), (4.99, 5.0)):
        frame = RGBDFrame(GRAY[:30, :40], np.full((30, 40), z, np.float32), np.zeros((30, 40), np.uint8))
        assert sensor.corrupt(frame, 1).depth.max() == wanted


@pytest.mark.parametrize(("width", "native"), [(640, 0.8), (320, 2.0), (640, 1.6)])
def test_lateral_jitter_displaces_as_stated(width, native):
    """A ramp tells from where each reading was taken; a Gaussian of `native` px at 640 px, rounded."""
    for axis in (0, 1):
        depth = np.float32(2.0) + np.indices((120, width))[axis].astype(np.float32) / np.float32(1024.0)
        moved = ((read(depth, lateral_noise=native) - depth) * 1024.0)[8:-8, 8:-8]
        sigma = native * width / 640.0
        steps = np.arange(-8, 9)
        chances = [NORMAL.cdf((k + 0.5) / sigma) - NORMAL.cdf((k - 0.5) / sigma) for k in steps]
        assert moved.mean() == pytest.approx(0.0, abs=0.03)
        assert moved.var() == pytest.approx(sum(c * k * k for c, k in zip(chances, steps, strict=True)), rel=0.03)
        for k in (0, 1, -1):
            assert (moved == k).mean() == pytest.approx(chances[k + 8], abs=0.01)


@pytest.mark.parametrize("band", [1, 2])
@pytest.mark.parametrize(("holes", "flying"), [(1.0, 0.0), (0.5, 0.2), (0.0, 0.7)])
def test_at_a_step_readings_are_lost_or_fly_in_the_stated_shares(band, holes, flying):
    """Within the band of a step from 1 m to 3 m; those that fly lie between, uniform in disparity."""
    depth = np.full((4000, 12), 3.0, np.float32)
    depth[:, :6] = 1.0
    seen = read(depth, edge_band=band, edge_holes=holes, edge_flying=flying)
    edge = np.zeros(12, bool)
    edge[6 - band : 6 + band] = True
    assert (seen[:, ~edge] == depth[:, ~edge]).all()
    inside = seen[:, edge]
    between = (inside > 1.0) & (inside < 3.0)
    assert (inside == 0.0).mean() == pytest.approx(holes, abs=0.02)
    assert between.mean() == pytest.approx(flying, abs=0.02)
    assert ((inside == depth[:, edge]) | (inside == 0.0) | between).all()
    if flying:
        place = (1.0 / inside[between] - 1.0 / 3.0) / (1.0 - 1.0 / 3.0)
        assert np.quantile(place, (0.1, 0.5, 0.9)) == pytest.approx((0.1, 0.5, 0.9), abs=0.03)


def test_smaller_jumps_than_the_limit_are_no_edges():
    """The limit is a share of the pixel's own depth: of 1.0 and 1.16 m only the nearer is at an edge."""
    holes = {}
    for near, jump in ((1.0, 0.14), (1.0, 0.16), (0.5, 0.14), (4.0, 0.5), (4.0, 0.9)):
        depth = np.full((12, 20), near, np.float32)
        depth[5:, :] += jump
        holes[near, jump] = int(
            (read(depth, edge_band=1, edge_jump=0.15, edge_holes=1.0, edge_flying=0.0) == 0.0).sum()
        )
    assert holes == {(1.0, 0.14): 0, (1.0, 0.16): 20, (0.5, 0.14): 0, (4.0, 0.5): 0, (4.0, 0.9): 40}


def test_the_projectors_shadow_lies_left_and_is_as_wide_as_the_disparities_differ():
    """f b (1 / 1.5 - 1 / 4) px of the wall at 4 m; nothing on the right or on the person."""
    depth = np.full((50, 320), 4.0, np.float32)
    depth[:, 150:200] = 1.5
    lost = read(depth, shadow=1.0) == 0.0
    wide = camera(320, 50).focal * 0.075 * (1.0 / 1.5 - 1.0 / 4.0)
    assert wide > 8.0
    assert lost[:, : 150 - math.ceil(wide)].sum() == lost[:, 150:].sum() == 0
    assert lost[:, 150 - math.floor(wide) : 150].all()
    assert (read(depth, shadow=0.3) == 0.0).sum() == pytest.approx(0.3 * lost.sum(), rel=0.15)
    assert (read(wall(2.0), shadow=1.0) > 0.0).all()


@pytest.mark.parametrize("color", [(0, 0, 0), (10, 20, 30), (60, 10, 200), (0, 100, 0), (255, 255, 255)])
def test_dark_surfaces_are_lost_as_stated(color):
    """dark_dropout max(0, 1 - L / dark_level), L the luminance of Rec. 601."""
    rgb = np.full_like(GRAY, color)
    p, error = share(read(wall(2.0), rgb, dark_level=70.0, dark_dropout=0.8) == 0.0)
    luminance = 0.299 * color[0] + 0.587 * color[1] + 0.114 * color[2]
    assert p == pytest.approx(0.8 * max(1.0 - luminance / 70.0, 0.0), abs=4.0 * error)


@pytest.mark.parametrize("tilt", [30.0, 60.0, 70.0, 80.0])
@pytest.mark.parametrize("turned", [False, True])
def test_grazing_surfaces_are_lost_as_stated(tilt, turned):
    """A plane tilted about the vertical or the horizontal; the angle at each pixel from its normal, not from depth."""
    eye = camera()
    v, u = np.mgrid[:HEIGHT, :WIDTH] + 0.5
    x, y = (u - eye.cx) / eye.focal, (v - eye.cy) / eye.focal
    c, s = math.cos(math.radians(tilt)), math.sin(math.radians(tilt))
    facing = c + s * (y if turned else x)
    depth = np.where(facing > 0.02, 2.0 * c / facing, 30.0)
    cosine = facing / np.sqrt(1.0 + x * x + y * y)
    wanted = 0.9 * np.maximum(1.0 - cosine / math.cos(math.radians(50.0)), 0.0)
    lost = read(depth, grazing_deg=50.0, grazing_dropout=0.9, max_range=29.0, min_range=0.01) == 0.0
    inside = (facing > 0.05) & (depth < 20.0)
    for low, high in ((0.0, 0.15), (0.15, 0.4), (0.4, 0.9)):
        where = inside & (wanted >= low) & (wanted <= high)
        if where.sum() > 500:
            spread = math.sqrt(0.25 / where.sum())
            assert lost[where].mean() == pytest.approx(wanted[where].mean(), abs=4.0 * spread)
    assert inside.sum() > 10000


def test_a_depth_edge_is_not_a_grazing_surface():
    depth = wall(4.0)
    depth[50:150, 80:160] = 1.0
    assert (read(depth, grazing_deg=45.0, grazing_dropout=1.0) > 0.0).all()


def test_what_is_no_depth_is_no_reading_and_spoils_no_neighbor():
    depth = wall(2.0)
    holes = ((10, 10, np.nan), (20, 30, np.inf), (30, 50, 0.0), (40, 70, -1.0), (0, 0, np.nan), (199, 249, np.inf))
    for i, j, value in holes:
        depth[i, j] = value
    for config in (IDEAL_SENSOR.depth, DepthConfig(lateral_noise=0.0, edge_band=0), HARSH_SENSOR.depth):
        sensor = RGBDSensor(config, ColorConfig(), camera())
        seen = sensor.corrupt(RGBDFrame(GRAY, depth, np.zeros(depth.shape, np.uint8)), 1).depth
        assert np.isfinite(seen).all()
        assert (seen >= 0.0).all()
        if config.edge_band == 0:
            assert (seen == 0.0).sum() == len(holes)
            assert all(seen[i, j] == 0.0 for i, j, _ in holes)


@pytest.mark.parametrize(("level", "shot", "gain"), [(128, 0.0, 1.0), (128, 0.3, 1.0), (60, 0.3, 1.5), (200, 0.5, 0.5)])
def test_color_noise_is_as_stated(level, shot, gain):
    """sigma^2 = read^2 + shot^2 I at the exposed level I, and 1/12 of the rounding; channels independent."""
    seen = look(np.full_like(GRAY, level), read_noise=2.0, shot_noise=shot, gain=gain).astype(float)
    assert seen.mean() == pytest.approx(level * gain, abs=0.1)
    assert seen.var() == pytest.approx(4.0 + shot * shot * level * gain + 1.0 / 12.0, rel=0.03)
    pixels = seen.reshape(-1, 3)
    assert np.abs(np.corrcoef(pixels.T) - np.eye(3)).max() < 0.02
    assert abs(np.corrcoef(seen[1:, :, 0].ravel(), seen[:-1, :, 0].ravel())[0, 1]) < 0.02
    assert abs(np.corrcoef(seen[:, 1:, 0].ravel(), seen[:, :-1, 2].ravel())[0, 1]) < 0.02


@pytest.mark.parametrize("sigma", [0.4, 0.8, 2.0, 3.0])
@pytest.mark.parametrize("upright", [False, True])
def test_blur_has_the_stated_width(sigma, upright):
    """A step's slope is the blur's kernel: its variance is sigma^2. A gray picture stays, up to its borders."""
    step = np.zeros((90, 640, 3), np.uint8)
    along = 640 if not upright else 90
    step[(slice(None), slice(320, None)) if not upright else slice(45, None)] = 240
    row = look(step, blur=sigma)[45, :, 1] if not upright else look(step, blur=sigma)[:, 320, 1]
    slope = np.diff(row.astype(float))
    place = np.arange(along - 1)
    mean = (slope * place).sum() / slope.sum()
    assert slope.sum() == 240.0
    assert math.sqrt((slope * (place - mean) ** 2).sum() / slope.sum()) == pytest.approx(sigma, rel=0.04)
    assert (look(np.full((90, 640, 3), 77, np.uint8), blur=sigma) == 77).all()


def test_gain_exposes_and_cuts():
    levels = np.arange(256, dtype=np.uint8).repeat(3).reshape(1, 256, 3)
    assert (look(levels, gain=1.5) == np.minimum(np.floor(levels * 1.5 + 0.5), 255)).all()


def test_an_ideal_sensor_changes_nothing():
    rng = np.random.default_rng(11)
    depth = rng.uniform(0.05, 30.0, (HEIGHT, WIDTH)).astype(np.float32)
    depth[:10] = 30.0
    rgb = rng.integers(0, 256, (HEIGHT, WIDTH, 3), np.uint8)
    sensor = RGBDSensor(IDEAL_SENSOR.depth, IDEAL_SENSOR.color, camera())
    seen = sensor.corrupt(RGBDFrame(rgb, depth, np.ones(depth.shape, np.uint8)), 5)
    assert (seen.depth == depth).all()
    assert (seen.rgb == rgb).all()
    assert (seen.ids == 1).all()


@pytest.mark.parametrize(("width", "height"), [(1, 1), (1, 9), (9, 1), (2, 2), (3, 5)])
def test_small_pictures_are_read_too(width, height):
    frame = RGBDFrame(
        GRAY[:height, :width].copy(), wall(2.0)[:height, :width].copy(), np.zeros((height, width), np.uint8)
    )
    for config in (SensorConfig(), HARSH_SENSOR):
        seen = RGBDSensor(config.depth, config.color, camera(width, height)).corrupt(frame, 3)
        assert seen.depth.shape == (height, width)
        assert ((seen.depth == 0.0) | (np.abs(seen.depth - 2.0) < 0.2)).all()


def test_one_seed_gives_one_frame_whatever_came_before():
    config = SensorConfig()
    frame = RGBDFrame(GRAY, wall(2.0), np.zeros((HEIGHT, WIDTH), np.uint8))
    sensor = RGBDSensor(config.depth, config.color, camera())
    first, other, again = (sensor.corrupt(frame, seed) for seed in (7, 8, 7))
    assert (first.depth == again.depth).all()
    assert (first.rgb == again.rgb).all()
    assert (first.depth != other.depth).mean() > 0.5
    assert (first.rgb != other.rgb).mean() > 0.5


def test_another_processor_gives_the_same_bits(tmp_path):
    """In a new process, compiled for a processor without vector extensions."""
    environment = {
        **os.environ,
        "NUMBA_CPU_NAME": "generic",
        "NUMBA_CPU_FEATURES": "",
        "NUMBA_CACHE_DIR": str(tmp_path),
        "PYTHONPATH": os.pathsep.join([str(Path(__file__).parents[3]), *sys.path]),
    }
    code = f"import runpy; print(runpy.run_path({__file__!r})['frame_hash']())"
    done = subprocess.run([sys.executable, "-c", code], env=environment, capture_output=True, text=True, timeout=300)
    assert done.returncode == 0, done.stderr
    assert done.stdout.split()[-1] == frame_hash()
