"""The default camera against TinyRenderer, a ray caster written here, and itself on other processors."""

import hashlib
import math
import os
import resource
import subprocess
import sys
from pathlib import Path

import cv2
import numpy as np
import pytest

from follow_env.camera import CameraPose, PinholeCamera
from follow_env.camera.mesh import Mesh, Placed
from follow_env.camera.raster import RasterRenderer
from follow_env.camera.tiny import TinyRenderer
from follow_env.config import CameraConfig
from follow_env.person.bodies import BODIES, load_body
from follow_env.person.walker import Walker
from follow_env.scene import Box, Cylinder, Light, Material, Scene
from follow_env.scenes import SCENES, make_scene

SMALL = PinholeCamera(CameraConfig(width=160, height=120))
GREY, RED = Material((0.5, 0.5, 0.5)), Material((0.7, 0.2, 0.1))
LAMPS = (Light((1.0, 0.5, 2.6), 0.8), Light((6.0, -1.0, 2.4), 0.5))
GOLDEN = "4285d910c656bf642c25b9c7767904532d33de1c382eb897398c1a1ccaf69502"


def scene(*primitives, lights=LAMPS):
    return Scene("test", primitives, GREY, lights, 0.3, (-20.0, 20.0, -20.0, 20.0))


def blob(x, y, z, radius=(0.25, 0.3, 0.8), id=1, pattern=0, rows=9, sides=12):
    """An ellipsoid of 2 * sides * (rows - 1) triangles around (x, y, z); only `math`, so the same everywhere."""
    directions = [(0.0, 0.0, 1.0)]
    for i in range(1, rows):
        up, out = math.cos(math.pi * i / rows), math.sin(math.pi * i / rows)
        directions += [
            (out * math.cos(2 * math.pi * k / sides), out * math.sin(2 * math.pi * k / sides), up) for k in range(sides)
        ]
    directions.append((0.0, 0.0, -1.0))
    last, faces = len(directions) - 1, []
    for k in range(sides):
        following = (k + 1) % sides
        faces += [(0, 1 + k, 1 + following), (last, last - sides + following, last - sides + k)]
        for i in range(rows - 2):
            a, b = 1 + i * sides + k, 1 + i * sides + following
            faces += [(a, a + sides, b), (b, a + sides, b + sides)]
    points = np.array([[d * r for d, r in zip(direction, radius, strict=True)] for direction in directions])
    slopes = np.array([[d / r for d, r in zip(direction, radius, strict=True)] for direction in directions])
    normals = slopes / np.sqrt((slopes * slopes).sum(axis=1, keepdims=True))
    colours = np.array([(0.2 + 0.6 * (f % 3 == 0), 0.4, 0.7) for f in range(len(faces))], np.float32)
    mesh = Mesh(np.array(faces, np.int32), colours, np.full(len(faces), pattern, np.uint8), points.astype(np.float32))
    return Placed(mesh, (points + np.array((x, y, z))).astype(np.float32), normals.astype(np.float32), id)


def reference(place, camera, pose, people=()):
    """Cast a ray through every pixel centre; return depth, ids, normals (H, W, 3), albedo and points, in float64.

    A box is met by the slab test in its own frame, a cylinder by the quadratic and its ends, a triangle by Cramer's
    rule. What lies nearer than `near` along the optical axis does not count, nor what lies beyond `far`.
    """
    near, far = camera.config.near, camera.config.far
    v, u = np.mgrid[: camera.height, : camera.width] + 0.5
    across, up = (camera.cx - u) / camera.focal, (camera.cy - v) / camera.focal
    c, s = math.cos(pose.yaw), math.sin(pose.yaw)
    rays = np.stack([c - s * across, s + c * across, up], axis=-1)
    eye = np.array((pose.x, pose.y, pose.z))
    depth, ids = np.full(u.shape, far), np.zeros(u.shape, int)
    normals, albedo = np.zeros((*u.shape, 3)), np.zeros((*u.shape, 3))

    def meet(t, hit, normal, colour, id):
        closer = hit & (t >= near) & (t < depth)
        depth[closer], ids[closer], albedo[closer] = t[closer], id, colour
        normals[closer] = np.broadcast_to(normal, normals.shape)[closer]

    x0, x1, y0, y1 = place.bounds
    floor = Box(((x0 + x1) / 2, (y0 + y1) / 2, -0.05), (x1 - x0, y1 - y0, 0.1), place.floor)
    with np.errstate(divide="ignore", invalid="ignore"):
        for p in (floor, *place.primitives):
            if isinstance(p, Box):
                frame = np.array(
                    [
                        (math.cos(p.yaw), math.sin(p.yaw), 0.0),
                        (-math.sin(p.yaw), math.cos(p.yaw), 0.0),
                        (0.0, 0.0, 1.0),
                    ]
                )
                own, own_rays = frame @ (eye - p.centre), rays @ frame.T
                half = 0.5 * np.array(p.size)
                first, second = (-half - own) / own_rays, (half - own) / own_rays
                enter, leave = np.minimum(first, second), np.maximum(first, second)
                hit = enter.max(axis=-1) <= leave.min(axis=-1)
                ends = (enter.max(axis=-1), enter.argmax(axis=-1)), (leave.min(axis=-1), leave.argmin(axis=-1))
                for t, axis in ends:
                    way = np.take_along_axis(own_rays, axis[..., None], axis=-1)
                    meet(t, hit, -np.sign(way) * frame[axis], p.material.colour, 0)
            else:
                offset, half = eye - p.centre, 0.5 * p.height
                a = rays[..., 0] ** 2 + rays[..., 1] ** 2
                b = rays[..., 0] * offset[0] + rays[..., 1] * offset[1]
                root = np.sqrt(b * b - a * (offset[0] ** 2 + offset[1] ** 2 - p.radius**2))
                for t in ((-b - root) / a, (-b + root) / a):
                    point = offset + t[..., None] * rays
                    outward = np.stack([point[..., 0], point[..., 1], np.zeros_like(t)], axis=-1) / p.radius
                    meet(t, np.abs(point[..., 2]) <= half, outward, p.material.colour, 0)
                for end in (half, -half):
                    t = (end - offset[2]) / rays[..., 2]
                    point = offset + t[..., None] * rays
                    hit = point[..., 0] ** 2 + point[..., 1] ** 2 <= p.radius**2
                    meet(t, hit, (0.0, 0.0, math.copysign(1.0, end)), p.material.colour, 0)
        for person in people:
            corners = person.vertices.astype(float)[person.mesh.faces] - eye
            for (p0, p1, p2), colour in zip(corners, person.mesh.colours, strict=True):
                normal = np.cross(p1 - p0, p2 - p0)
                t = normal @ p0 / (rays @ normal)
                q = t[..., None] * rays
                hit = (rays @ normal) < 0.0
                for start, stop in ((p0, p1), (p1, p2), (p2, p0)):
                    hit &= np.cross(stop - start, q - start) @ normal >= 0.0
                meet(t, hit, normal / np.linalg.norm(normal), colour, person.id)
    return depth, ids, normals, albedo, eye + depth[..., None] * rays


def flat(depth, slack=0.03):
    """Where the depth is smooth: no neighbour (3 x 3) differs by more than `slack` of it (at least of 1 m)."""
    depth = depth.astype(np.float32)
    window = np.ones((3, 3), np.uint8)
    return cv2.dilate(depth, window) - cv2.erode(depth, window) <= slack * np.maximum(depth, 1.0)


def random_views(name, count, seed):
    """Camera poses at least 0.15 m from everything in the scene, with somebody somewhere before the camera.

    Nearer, the near plane cuts solids open; TinyRenderer then sees through them, and ours sees them from inside. Every
    fifth view has a new body with a mesh of its own, in mid-step: TinyRenderer's people keep their posture.
    """
    rng, place = np.random.default_rng(seed), make_scene(name)
    x0, x1, y0, y1 = place.bounds
    k = 0
    while k < count:
        x, y = float(rng.uniform(x0 + 0.5, x1 - 0.5)), float(rng.uniform(0.6 * y0, 0.6 * y1))
        if place.clearance(np.array([[x, y]])) < 0.15:
            continue
        if k % 5 == 0:
            walker = Walker(load_body(BODIES[k // 5 % len(BODIES)]))
            stride = float(rng.uniform(0.0, 1.3)), float(rng.uniform(0.0, 1.6))
        k += 1
        pose = CameraPose(x, y, float(rng.uniform(0.5, 1.5)), float(rng.uniform(-math.pi, math.pi)))
        away, aside = float(rng.uniform(0.9, 5.0)), float(rng.uniform(-0.4, 0.4))
        where = x + away * math.cos(pose.yaw + aside), y + away * math.sin(pose.yaw + aside)
        yield pose, walker.place(*where, float(rng.uniform(-3.0, 3.0)), *stride)


@pytest.mark.parametrize("name", SCENES)
def test_agrees_with_tiny_renderer(name):
    """100 random views of each scene: depth within 2 cm on 99.5 % of the pixels, the person's mask with IoU > 0.97.

    All pixels where the depth is smooth count; at a depth edge (3 x 3) the two may decide differently, because
    TinyRenderer draws in fixed point and its cylinders are prisms. Over all pixels 99 % must agree.
    """
    place = make_scene(name)
    ours, theirs = RasterRenderer(place, SMALL), TinyRenderer(place, SMALL)
    smooth, everywhere, both, either = [], [], 0, 0
    for pose, person in random_views(name, 100, 0):
        a, b = ours.render(pose, [person]), theirs.render(pose, [person])
        close = np.abs(a.depth - b.depth) <= 0.02
        smooth.append(close[flat(b.depth)])
        everywhere.append(close)
        both += int(((a.ids == 1) & (b.ids == 1)).sum())
        either += int(((a.ids == 1) | (b.ids == 1)).sum())
    theirs.close()
    assert np.concatenate(smooth).mean() > 0.995
    assert np.mean(everywhere) > 0.99
    assert either > 50_000
    assert both / either > 0.97


def test_the_rigid_people_of_tiny_renderer_are_where_they_are_said_to_be():
    """People who hold their posture move, turn, leave and come back; every picture is that of a new renderer."""
    man, child = Walker(load_body("man")), Walker(load_body("child", "green"), id=9)
    kept, pose = TinyRenderer(scene(), SMALL), CameraPose(0.0, 0.0, 1.0, 0.0)
    both = [man.place(2.0, 0.3, 0.4, 0.5, 0.8), child.place(3.0, -0.4, -2.0, 0.2, 0.8)]
    moved = [man.place(3.0, -0.5, 2.5, 0.5, 0.8), child.place(2.0, 0.2, 1.0, 0.2, 0.8)]
    for people in (both, moved, moved[:1], [], both[1:], moved[::-1]):
        fresh = TinyRenderer(scene(), SMALL)
        one, two = kept.render(pose, people), fresh.render(pose, people)
        fresh.close()
        assert set(np.unique(one.ids)) == {0, *(person.id for person in people)}
        assert (one.ids == two.ids).mean() > 0.999
        assert (np.abs(one.depth - two.depth) < 0.005).mean() > 0.999
    kept.close()


def test_the_masks_of_primitives_agree_with_tiny_renderer():
    rng, both, either = np.random.default_rng(1), 0, 0
    for k in range(20):
        x, y, yaw = rng.uniform((1.5, -1.0, -3.0), (5.0, 1.0, 3.0)).tolist()
        size = rng.uniform(0.2, 1.2, 3).tolist()
        solid = Box((x, y, size[2] / 2), size, RED, yaw) if k % 2 else Cylinder((x, y, 0.6), size[0] / 2, size[2], RED)
        pose, masks = CameraPose(0.0, 0.0, 1.0, 0.0), []
        for make in (RasterRenderer, TinyRenderer):
            depths = []
            for place in (scene(solid), scene()):
                renderer = make(place, SMALL)
                depths.append(renderer.render(pose).depth)
                renderer.close()
            masks.append(depths[0] < depths[1] - 0.005)
        both, either = both + int((masks[0] & masks[1]).sum()), either + int((masks[0] | masks[1]).sum())
        assert (masks[0] & masks[1]).sum() > 0.93 * (masks[0] | masks[1]).sum()
    assert both / either > 0.97


CLUTTER = scene(
    Box((3.0, 0.6, 0.5), (0.8, 0.3, 1.0), RED, 0.7),
    Box((4.0, -1.0, 0.9), (0.05, 1.5, 1.8), GREY, -0.4),
    Box((5.0, 0.0, 1.2), (10.0, 6.0, 0.02), RED, 0.1),
    Box((8.0, 0.0, 1.0), (0.1, 30.0, 4.0), GREY),
    Cylinder((2.0, -0.6, 0.4), 0.25, 0.8, RED),
    Cylinder((3.5, 0.2, 1.4), 0.4, 0.3, RED),
    Cylinder((6.0, 1.5, 1.5), 0.2, 3.0, GREY),
)


@pytest.mark.parametrize("view", range(12))
def test_agrees_with_a_ray_caster(view):
    """Depth, ids and colours at every pixel centre against the reference: off depth edges all, everywhere 99.7 %.

    Depth to 0.1 mm + 1e-5 of it, colours to one level of 255 by the stated law of light (flat-shaded people are not
    compared in colour: their light is interpolated between vertices).
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
    colours = np.minimum(255.0 * albedo * light[..., None], 255.0)
    same = (np.abs(frame.rgb - colours) <= 1.01).all(axis=-1)
    seen = good & (ids == 0) & (depth < camera.config.far)
    assert seen.sum() > 1000
    assert same[seen].mean() > 0.999


def test_pixels_are_taken_at_their_centres():
    """A plate that faces the camera covers just the pixels whose centres lie within the projection of its corners."""
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
    """Towards a wall the depth falls by what the camera moves; a millimetre's step changes the picture little."""
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


def test_a_camera_inside_a_solid_sees_it_from_inside():
    boxed = RasterRenderer(scene(Box((0.5, 0.0, 1.0), (3.0, 2.0, 2.0), RED)), SMALL)
    assert boxed.render(CameraPose(0.0, 0.0, 1.0, 0.0)).depth[60, 80] == pytest.approx(2.0, abs=1e-5)
    place = scene(Box((0.5, 0.0, 1.0), (3.0, 2.0, 2.0), RED, 0.3), Cylinder((0.0, 0.0, 1.0), 0.8, 1.2, RED))
    for yaw in (0.0, 1.0, 2.5):
        pose = CameraPose(0.1, -0.2, 1.1, yaw)
        depth = reference(place, SMALL, pose)[0]
        frame = RasterRenderer(place, SMALL).render(pose)
        assert (np.abs(frame.depth - depth) < 1e-4).mean() > 0.998
        assert frame.depth.max() < 1.5
        assert frame.rgb.max() > 20


def test_a_person_behind_the_camera_is_not_drawn():
    renderer, pose = RasterRenderer(make_scene("corridor"), SMALL), CameraPose(3.0, 0.0, 1.0, 0.4)
    empty = renderer.render(pose)
    behind = renderer.render(pose, [blob(1.0, -1.0, 0.8), blob(3.0 - 1.0, 0.0, 0.8, id=2)])
    assert behind.ids.max() == 0
    assert frames_hash([behind]) == frames_hash([empty])


def test_a_scene_without_primitives_is_floor_and_nothing():
    frame = RasterRenderer(scene(), SMALL).render(CameraPose(0.0, 0.0, 1.0, 0.0), [blob(2.0, 0.0, 0.8)])
    assert (frame.depth[0, :40] == SMALL.config.far).all()
    expected = SMALL.focal * 1.0 / (np.arange(80, 120) + 0.5 - 60.0)
    assert frame.depth[80:, 0] == pytest.approx(expected, rel=1e-5)
    assert set(np.unique(frame.ids)) == {0, 1}


@pytest.mark.parametrize("size", [(1, 1), (1, 50), (33, 16), (17, 1)])
def test_pictures_of_any_size(size):
    camera, pose = PinholeCamera(CameraConfig(width=size[0], height=size[1])), CameraPose(0.03, 0.1, 0.9, 0.05)
    frame = RasterRenderer(make_scene("corridor"), camera).render(pose)
    assert (frame.rgb.shape, frame.depth.shape, frame.ids.shape) == ((*size[::-1], 3), size[::-1], size[::-1])
    assert (frame.rgb.dtype, frame.depth.dtype, frame.ids.dtype) == (np.uint8, np.float32, np.uint8)
    assert frame.depth == pytest.approx(reference(make_scene("corridor"), camera, pose)[0], rel=1e-4)
    assert frame.rgb.max() > 50


def test_the_largest_picture():
    """4096 x 4096: the wall ahead and the floor have their depths to the last row."""
    camera = PinholeCamera(CameraConfig(width=4096, height=4096))
    frame = RasterRenderer(make_scene("corridor"), camera).render(CameraPose(0.0, 0.0, 1.0, 0.0))
    assert frame.depth[2048, 2048] == pytest.approx(19.96, abs=1e-4)
    rows = np.arange(2400, 4096)
    assert frame.depth[rows, 2048] == pytest.approx(camera.focal / (rows + 0.5 - 2048.0), rel=1e-5)
    assert frame.rgb.max() > 50


def test_a_pose_that_is_not_a_number_is_one_clear_error():
    renderer = RasterRenderer(scene(), SMALL)
    for pose in (CameraPose(math.nan, 0.0, 1.0, 0.0), CameraPose(0.0, 0.0, 1.0, math.inf)):
        with pytest.raises(ValueError, match=r"camera's pose is .*(nan|inf).*; expected finite numbers"):
            renderer.render(pose)
    person = blob(2.0, 0.0, 0.8)
    person.vertices[5, 1] = np.nan
    with pytest.raises(ValueError, match="vertex that is not finite; expected world coordinates"):
        renderer.render(CameraPose(0.0, 0.0, 1.0, 0.0), [person])
    with pytest.raises(ValueError, match=r"1 groups of people for 2 cameras"):
        renderer.render_batch([CameraPose(0.0, 0.0, 1.0, 0.0)] * 2, [()])


def test_bad_settings_and_meshes_are_clear_errors():
    with pytest.raises(ValueError, match="supersample is 3; expected 1 or 2"):
        RasterRenderer(scene(), SMALL, supersample=3)
    with pytest.raises(ValueError, match="threads is 0; expected"):
        RasterRenderer(scene(), SMALL, threads=0)
    with pytest.raises(ValueError, match=r"texture 'bricks' is not known.*did you mean 'brick'"):
        RasterRenderer(scene(Box((1.0, 0.0, 0.0), (1.0, 1.0, 1.0), Material((0.5, 0.5, 0.5), texture="bricks"))), SMALL)
    good = blob(0.0, 0.0, 0.0)
    with pytest.raises(ValueError, match="mesh vertices are float64"):
        Placed(good.mesh, good.vertices.astype(float), good.normals, 1)
    with pytest.raises(ValueError, match="id of a placed mesh is 0"):
        Placed(good.mesh, good.vertices, good.normals, 0)
    with pytest.raises(ValueError, match="mesh faces name the vertices"):
        Mesh(good.mesh.faces + np.int32(5), good.mesh.colours, good.mesh.pattern, good.mesh.anchors)


def test_supersampling_smooths_colours_and_nothing_else():
    pose, people = CameraPose(0.0, 0.0, 1.0, 0.0), [blob(2.0, 0.1, 0.8, pattern=2)]
    plain = RasterRenderer(make_scene("indoor"), SMALL).render(pose, people)
    fine = RasterRenderer(make_scene("indoor"), SMALL, supersample=2).render(pose, people)
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


def test_neighbouring_triangles_leave_no_cracks():
    """Before a blob that fills the picture, no pixel sees the wall behind, from 300 places."""
    renderer = RasterRenderer(scene(Box((9.0, 0.0, 10.0), (0.1, 30.0, 30.0), RED)), SMALL)
    rng = np.random.default_rng(5)
    person = blob(4.0, 0.0, 10.0, radius=(2.0, 4.0, 4.0), rows=30, sides=40)
    for _ in range(300):
        x, y, z, yaw = rng.uniform((0.0, -0.5, 9.8, -0.2), (1.2, 0.5, 10.2, 0.2)).tolist()
        assert (renderer.render(CameraPose(x, y, z, yaw), [person]).ids == 1).all()


def test_memory_stays_constant_over_2000_frames():
    renderer = RasterRenderer(make_scene("indoor"), SMALL)
    groups = [[], [blob(2.0, 0.0, 0.8)], [blob(3.0, 0.5, 0.8), blob(2.0, -0.5, 0.8, id=2)]]

    def play(frames):
        for k in range(frames):
            renderer.render(CameraPose(0.001 * k, 0.0, 1.0, 0.001 * k), groups[k // 10 % 3])
        return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss

    before = play(200)
    assert play(2000) - before < 2048  # kB


def frames_hash(frames):
    digest = hashlib.sha256()
    for frame in frames:
        for array in (frame.rgb, frame.depth, frame.ids):
            digest.update(np.ascontiguousarray(array).tobytes())
    return digest.hexdigest()


def golden(threads=1):
    """Hash of 40 views: every primitive, texture and pattern, one of them from inside a box."""
    textures = ("plain", "tiles", "wood", "brick", "carpet", "spines")
    parts = [
        Box((2.0 + 0.7 * k, -1.2 + 0.5 * k, 0.5), (0.5, 0.4, 1.0), Material((0.6, 0.4, 0.3), texture=t), 0.3 * k)
        for k, t in enumerate(textures)
    ]
    parts += [Cylinder((3.0, 1.5, 0.7), 0.3, 1.4, Material((0.3, 0.6, 0.4), texture="wood"))]
    place = Scene("golden", tuple(parts), Material((0.5, 0.5, 0.5), 0.1, "tiles"), LAMPS, 0.3, (-9.0, 9.0, -9.0, 9.0))
    camera = PinholeCamera(CameraConfig(width=150, height=110))
    renderer = RasterRenderer(place, camera, threads=threads)
    people = [blob(2.2, 0.3, 0.8, pattern=1), blob(3.5, -0.8, 0.9, id=2, pattern=2)]
    frames = [
        renderer.render(CameraPose(0.06 * k, 0.3 - 0.02 * k, 0.7 + 0.02 * k, 0.05 * k - 0.5), people) for k in range(39)
    ]
    frames.append(renderer.render(CameraPose(2.0, -1.2, 0.5, 0.3), people))
    renderer.close()
    return frames_hash(frames)


@pytest.mark.parametrize("threads", [1, 2, 3])
def test_the_frames_are_the_golden_ones(threads):
    """The committed hash: a change of any bit of a picture, here or on another machine, shows."""
    assert golden(threads) == GOLDEN


def test_another_processor_gives_the_same_bits_and_compiles_once(tmp_path):
    """In a new process for a processor without vector extensions: same hash; one line about compiling, then none."""
    environment = {
        **os.environ,
        "NUMBA_CPU_NAME": "generic",
        "NUMBA_CPU_FEATURES": "",
        "NUMBA_CACHE_DIR": str(tmp_path),
        "PYTHONPATH": os.pathsep.join([str(Path(__file__).parents[2]), *sys.path]),
    }
    code = f"import runpy; print(runpy.run_path({__file__!r})['golden']())"
    for announcement in (["compiling the kernels, once"], []):
        done = subprocess.run(
            [sys.executable, "-W", "error", "-c", code], env=environment, capture_output=True, text=True, timeout=300
        )
        assert done.returncode == 0, done.stderr
        assert done.stdout.split()[-1] == GOLDEN
        assert [line for line in done.stderr.splitlines() if "pybullet build" not in line] == announcement
