"""The default camera against a ray caster and closed forms: where things are, how they are lit, whose they are."""

import math

import cv2
import numpy as np
import pytest

from follow_env.camera import CameraPose, PinholeCamera, make_renderer
from follow_env.camera.raster.renderer import RasterRenderer
from follow_env.config import CameraConfig
from follow_env.world.scene import Box, Capsule, Cylinder, Light, Sphere
from follow_env.world.scenes import make_scene

from ..drawing import GRAY, RED, SMALL, blob, flat, reference, scene

CLUTTER = scene(
    Box((3.0, 0.6, 0.5), (0.8, 0.3, 1.0), RED, 0.7),
    Box((4.0, -1.0, 0.9), (0.05, 1.5, 1.8), GRAY, -0.4),
    Box((5.0, 0.0, 1.2), (10.0, 6.0, 0.02), RED, 0.1),
    Box((8.0, 0.0, 1.0), (0.1, 30.0, 4.0), GRAY),
    Cylinder((2.0, -0.6, 0.4), 0.25, 0.8, RED),
    Cylinder((3.5, 0.2, 1.4), 0.4, 0.3, RED),
    Cylinder((6.0, 1.5, 1.5), 0.2, 3.0, GRAY),
    Sphere((3.2, -0.5, 1.0), 0.3, RED),
    Sphere((1.6, 0.7, 1.6), 0.2, GRAY),
    Capsule((2.4, 0.2, 0.7), 0.15, 1.2, RED),
    Capsule((4.5, 0.9, 1.3), 0.5, 1.4, GRAY),
)


@pytest.mark.parametrize("view", range(12))
def test_agrees_with_a_ray_caster(view):
    """Depth, ids and colors at every pixel center against the reference: off depth edges all, everywhere 99.7 %.

    Depth to 0.1 mm + 1e-5 of it, colors to one level of 255 by the stated law of light (flat-shaded people are not
    compared in color: their light is interpolated between vertices).
    """
    rng = np.random.default_rng(view)
    pose = CameraPose(*rng.uniform((-0.5, -0.8, 0.3, -0.6), (2.8, 0.8, 1.9, 0.6)).tolist())
    camera = PinholeCamera(CameraConfig(width=97, height=75, hfov_deg=75.0))
    people = [blob(2.5, 0.1, 0.8), blob(pose.x + 0.35, pose.y - 0.3, 0.9, id=7)]
    frame = RasterRenderer(CLUTTER, camera).render(pose, people)
    depth, ids, normals, albedo, points = reference(CLUTTER, camera, pose, people)
    good = np.abs(frame.depth - depth) <= 1e-4 + 1e-5 * depth
    smooth = flat(depth, 0.1)
    assert good.mean() > 0.997
    assert good[smooth].mean() > 0.9995
    assert (frame.ids == ids)[good].all()
    light = np.full(depth.shape, CLUTTER.ambient)
    for lamp in CLUTTER.lights:
        offset = np.array(lamp.position) - points
        q = 1.0 / ((offset**2).sum(axis=-1) + 1.0)
        facing = np.maximum((normals * offset).sum(axis=-1) * np.sqrt(q), 0.0)
        light += lamp.intensity * ((lamp.position[2] - 1.0) ** 2 + 1.0) * q * (0.25 + 0.75 * facing)
    colors = np.minimum(255.0 * albedo * light[..., None], 255.0)
    same = (np.abs(frame.rgb - colors) <= 1.01).all(axis=-1)
    seen = good & (ids == 0) & (depth < camera.config.far)
    assert seen.sum() > 1000
    assert same[seen].mean() > 0.999


def test_pixels_are_taken_at_their_centers():
    """A plate that faces the camera covers just the pixels whose centers lie within the projection of its corners."""
    rng, camera = np.random.default_rng(3), PinholeCamera(CameraConfig(width=320, height=240))
    v, u = np.mgrid[:240, :320] + 0.5
    for _ in range(20):
        pose = CameraPose(*rng.uniform(-3.0, 3.0, 2).tolist(), 1.0, float(rng.uniform(-3.0, 3.0)))
        ahead, left, up = rng.uniform((1.5, -0.5, -0.3), (3.0, 0.5, 0.3)).tolist()
        c, s = math.cos(pose.yaw), math.sin(pose.yaw)
        front = (pose.x + c * ahead - s * left, pose.y + s * ahead + c * left, pose.z + up)
        plate = Box((front[0] + 0.0005 * c, front[1] + 0.0005 * s, front[2]), (0.001, 0.3, 0.2), RED, pose.yaw)
        frame = RasterRenderer(scene(plate), camera).render(pose)
        u0, v0, _ = camera.project(pose, (front[0] - s * 0.15, front[1] + c * 0.15, front[2] + 0.1))
        u1, v1, _ = camera.project(pose, (front[0] + s * 0.15, front[1] - c * 0.15, front[2] - 0.1))
        covered = np.abs(frame.depth - ahead) < 1e-4
        exact = (u > u0) & (u < u1) & (v > v0) & (v < v1)
        close = (np.abs(u - u0) < 1e-3) | (np.abs(u - u1) < 1e-3) | (np.abs(v - v0) < 1e-3) | (np.abs(v - v1) < 1e-3)
        assert (covered == exact)[~close].all()


def test_the_picture_moves_with_the_camera():
    """Toward a wall the depth falls by what the camera moves; a millimeter's step changes the picture little."""
    place = make_scene("indoor")
    renderer, person = RasterRenderer(place, SMALL), blob(2.5, 0.2, 0.8)
    before = None
    for step in range(100):
        frame = renderer.render(CameraPose(0.001 * step, 0.0, 1.0, 0.0), [person])
        if before is not None:
            moved = np.abs(before.depth - frame.depth)
            assert np.median(moved) < 0.002
            assert (moved > 0.02).mean() < 0.01
            assert np.abs(before.rgb.astype(int) - frame.rgb).mean() < 2.0
        before = frame
    ahead = RasterRenderer(scene(Box((5.0, 0.0, 1.0), (0.1, 9.0, 9.0), RED)), SMALL)
    for step in range(50):
        frame = ahead.render(CameraPose(0.09 * step, 0.0, 1.0, 0.0))
        assert frame.depth[:60] == pytest.approx(4.95 - 0.09 * step, abs=1e-5)


def test_neighboring_triangles_leave_no_cracks():
    """Before a blob that fills the picture, no pixel sees the wall behind, from 300 places."""
    renderer = RasterRenderer(scene(Box((9.0, 0.0, 10.0), (0.1, 30.0, 30.0), RED)), SMALL)
    rng = np.random.default_rng(5)
    person = blob(4.0, 0.0, 10.0, radius=(2.0, 4.0, 4.0), rows=30, sides=40)
    for _ in range(300):
        x, y, z, yaw = rng.uniform((0.0, -0.5, 9.8, -0.2), (1.2, 0.5, 10.2, 0.2)).tolist()
        assert (renderer.render(CameraPose(x, y, z, yaw), [person]).ids == 1).all()


def test_people_have_their_own_ids_and_patterns():
    renderer, pose = RasterRenderer(scene(), SMALL), CameraPose(0.0, 0.0, 1.0, 0.0)
    frame = renderer.render(pose, [blob(2.0, 0.0, 0.8), blob(4.0, 0.9, 0.8, id=200)])
    assert set(np.unique(frame.ids)) == {0, 1, 200}
    assert np.median(frame.depth[frame.ids == 1]) < 2.0 < np.median(frame.depth[frame.ids == 200])
    shirts = [renderer.render(pose, [blob(2.0, 0.0, 0.8, pattern=kind)]) for kind in (0, 1, 2)]
    plain, striped, checked = (shirt.rgb[shirt.ids == 1].astype(int).sum(axis=1) for shirt in shirts)
    for patterned in (striped, checked):
        darker = patterned < 0.7 * plain
        assert 0.3 < darker.mean() < 0.7
        assert np.array_equal(patterned[~darker], plain[~darker])
    stripes = (shirts[1].rgb.sum(axis=2)[:, 80] < 0.7 * shirts[0].rgb.sum(axis=2)[:, 80])[shirts[0].ids[:, 80] == 1]
    assert np.count_nonzero(np.diff(stripes)) > 10


def test_supersampling_smooths_colors_and_nothing_else():
    pose, people = CameraPose(0.0, 0.0, 1.0, 0.0), [blob(2.0, 0.1, 0.8, pattern=2)]
    plain = RasterRenderer(make_scene("indoor"), SMALL).render(pose, people)
    doubled = PinholeCamera(CameraConfig(width=160, height=120, supersample=2))
    fine = make_renderer("raster", make_scene("indoor"), doubled).render(pose, people)
    assert np.array_equal(plain.depth, fine.depth)
    assert np.array_equal(plain.ids, fine.ids)
    large = PinholeCamera(CameraConfig(width=320, height=240))
    whole = RasterRenderer(make_scene("indoor"), large).render(pose, people).rgb.astype(int)
    mean = whole.reshape(120, 2, 160, 2, 3).sum(axis=(1, 3))
    assert np.array_equal(fine.rgb, (mean + 2) // 4)


def test_a_batch_is_its_pictures_and_old_frames_stay():
    renderer = RasterRenderer(make_scene("indoor"), SMALL)
    cameras = [CameraPose(0.5 * k, 0.2, 1.0, 0.3 * k) for k in range(4)]
    people = [[blob(2.0 + k, 0.0, 0.8)] if k % 2 else [] for k in range(4)]
    batch = renderer.render_batch(cameras, people)
    singles = [renderer.render(camera, group) for camera, group in zip(cameras, people, strict=True)]
    for k, single in enumerate(singles):
        assert np.array_equal(batch.rgb[k], single.rgb)
        assert np.array_equal(batch.depth[k], single.depth)
        assert np.array_equal(batch.ids[k], single.ids)


def test_a_capsule_has_no_seam():
    """Off its outline every pixel of a capsule has the ray caster's depth, from 24 places, eight of them inside."""
    rng, solid = np.random.default_rng(2), Capsule((2.0, 0.0, 1.0), 0.3, 1.1, RED)
    camera = PinholeCamera(CameraConfig(width=97, height=75))
    renderer = RasterRenderer(scene(solid), camera)
    for k in range(24):
        inside = k % 3 == 0
        eye, spread = ((2.0, 0.0, 1.0), 0.15) if inside else ((1.0, 0.0, 1.0), 0.25)
        pose = CameraPose(*(rng.uniform(-spread, spread, 3) + eye).tolist(), float(rng.uniform(-0.3, 0.3)))
        depth = reference(scene(solid), camera, pose)[0]
        shown = (depth < reference(scene(), camera, pose)[0]).astype(np.uint8)
        shown = cv2.erode(shown, np.ones((3, 3), np.uint8)) == 1
        assert shown.all() if inside else 500 < shown.sum() < shown.size
        assert np.abs(renderer.render(pose).depth - depth)[shown].max() < 2e-5


def test_the_inside_of_an_open_border_is_seen_and_lit():
    """A bell, open below: from below one sees its inside, from 100 places not once through it to the wall."""
    bell = blob(1.5, 0.0, 1.55, radius=(0.4, 0.4, 0.5), open_rows=4)
    wall = scene(Box((9.0, 0.0, 5.0), (0.1, 40.0, 40.0), RED), lights=(Light((0.5, 0.0, 0.3), 0.9),))
    renderer, dark = RasterRenderer(wall, SMALL), RasterRenderer(scene(lights=()), SMALL)
    rng = np.random.default_rng(6)
    for _ in range(100):
        pose = CameraPose(0.0, *rng.uniform((-0.2, 1.2), (0.2, 1.4)).tolist(), float(rng.uniform(-0.1, 0.1)))
        frame = renderer.render(pose, [bell])
        mask = (frame.ids == 1).astype(np.uint8)
        outlines, _ = cv2.findContours(mask, cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE)
        filled = cv2.drawContours(np.zeros_like(mask), outlines, -1, 1, cv2.FILLED)
        assert np.array_equal(filled, mask)
        inside = (mask == 1) & (frame.depth > 1.5)
        assert inside.sum() > 100
        gained = frame.rgb[inside, 2].astype(int) - dark.render(pose, [bell]).rgb[inside, 2]
        assert np.median(gained) > 25  # at most 14 on a surface turned away from the lamp
