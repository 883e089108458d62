"""The default camera against PyBullet's TinyRenderer."""

import math

import numpy as np
import pytest

from follow_env.camera import CameraPose, PinholeCamera
from follow_env.camera.raster.renderer import RasterRenderer
from follow_env.camera.tiny import TinyRenderer
from follow_env.config import CameraConfig
from follow_env.world.people.bodies import BODIES, load_body
from follow_env.world.people.walker import Walker
from follow_env.world.scene import Box, Capsule, Cylinder, Sphere
from follow_env.world.scenes import SCENES, make_scene

from ..drawing import RED, SMALL, flat, scene


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
            walker = Walker(load_body(BODIES.names()[k // 5 % len(BODIES)]))
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


@pytest.mark.parametrize("kind", [Box, Cylinder, Sphere, Capsule])
def test_the_masks_of_primitives_agree_with_tiny_renderer(kind):
    rng, both, either = np.random.default_rng(1), 0, 0
    for _ in range(10):
        x, y, yaw = rng.uniform((1.5, -1.0, -3.0), (5.0, 1.0, 3.0)).tolist()
        size, radius = rng.uniform(0.2, 1.2, 3).tolist(), float(rng.uniform(0.15, 0.4))
        center = (x, y, 0.6)
        if kind is Box:
            solid = Box(center, size, RED, yaw)
        elif kind is Sphere:
            solid = Sphere(center, radius, RED)
        else:
            solid = kind(center, radius, 2.0 * radius + size[2], RED)
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


def test_tiny_renderer_refuses_to_supersample():
    with pytest.raises(ValueError, match="'tiny' cannot draw with supersample 2; expected 1, or use the renderer 'ras"):
        TinyRenderer(scene(), PinholeCamera(CameraConfig(supersample=2)))
