"""The OpenGL camera against the default one, and what it promises where there is no driver.

Skipped where no OpenGL context can be made, save for the sentences that say so.
"""

import dataclasses
import math
import os
import re
import sys

import cv2
import numpy as np
import pytest

from follow_env.camera import CameraPose, PinholeCamera, make_renderer
from follow_env.camera.opengl.renderer import OpenGLRenderer
from follow_env.camera.raster.renderer import RasterRenderer
from follow_env.camera.raster.textures import TEXTURES
from follow_env.config import CameraConfig
from follow_env.envs.follow import FollowEnv
from follow_env.world.people.bodies import BODIES, load_body
from follow_env.world.people.walker import Walker
from follow_env.world.scene import Box, Capsule, Cylinder, Light, Material, Scene, Sphere
from follow_env.world.scenes import SCENES, make_scene

SMALL = PinholeCamera(CameraConfig(width=160, height=120))
GRAY = Material((0.5, 0.5, 0.5))
LAMPS = (Light((1.0, 0.5, 2.6), 0.8), Light((6.0, -1.0, 2.4), 0.5))
EYE = CameraPose(0.0, 0.0, 1.0, 0.0)


@pytest.fixture
def draw():
    """Make OpenGL renderers, closed when the test ends; skip where there is no OpenGL."""
    made = []

    def one(place, camera=SMALL, shadows=False):
        try:
            made.append(OpenGLRenderer(place, camera, shadows))
        except ValueError as error:
            if not re.search("found no OpenGL|needs moderngl", str(error)):
                raise
            pytest.skip(str(error))
        return made[-1]

    yield one
    for renderer in made:
        renderer.close()


def scene(*primitives, floor=GRAY, lights=LAMPS):
    return Scene("test", primitives, floor, lights, 0.3, (-20.0, 20.0, -20.0, 20.0))


def somebody(x=2.2, y=0.2, heading=0.3, id=1, pattern=0):
    person = Walker(load_body("man"), id=id).place(x, y, heading, 0.4, 0.9)
    mesh = dataclasses.replace(person.mesh, pattern=np.full(len(person.mesh.faces), pattern, np.uint8))
    return dataclasses.replace(person, mesh=mesh)


def views(place, count):
    """Random poses away from solids, with somebody before the camera."""
    rng = np.random.default_rng(5)
    x0, x1, y0, y1 = place.bounds
    while count:
        x, y = float(rng.uniform(x0 + 0.5, x1 - 0.5)), float(rng.uniform(0.6 * y0, 0.6 * y1))
        if place.clearance(np.array([[x, y]])) < 0.15:
            continue
        if count % 5 == 0:
            walker = Walker(load_body(BODIES.names()[count // 5 % len(BODIES)]))
        count -= 1
        pose = CameraPose(x, y, float(rng.uniform(0.5, 1.5)), float(rng.uniform(-math.pi, math.pi)))
        away, aside = float(rng.uniform(0.9, 5.0)), float(rng.uniform(-0.4, 0.4))
        where = x + away * math.cos(pose.yaw + aside), y + away * math.sin(pose.yaw + aside)
        yield pose, walker.place(*where, *rng.uniform((-3.0, 0.0, 0.0), (3.0, 1.3, 1.6)).tolist())


def inside(frame):
    """Pixels with no silhouette in their 3 x 3 neighborhood."""
    window = np.ones((3, 3), np.uint8)
    jump = cv2.dilate(frame.depth, window) - cv2.erode(frame.depth, window)
    same = cv2.dilate(frame.ids, window) == cv2.erode(frame.ids, window)
    return same & (jump <= 0.03 * np.maximum(frame.depth, 1.0))


def compare(frames):
    """Return the shares of depths within 1 cm and ids that agree, and the mean difference in gray levels."""
    close, colors, both, either = [], [], 0, 0
    for a, b in frames:
        assert b.rgb.dtype == np.uint8
        assert b.depth.dtype == np.float32
        assert b.ids.dtype == np.uint8
        where = inside(a)
        close.append((np.abs(a.depth - b.depth) <= 0.01)[where])
        colors.append(np.abs(a.rgb.astype(int) - b.rgb)[where].ravel())
        both, either = both + int(((a.ids == b.ids) & (a.ids > 0)).sum()), either + int(((a.ids | b.ids) > 0).sum())
    assert either > 5000
    return np.concatenate(close).mean(), both / either, np.concatenate(colors).mean()


@pytest.mark.parametrize("name", SCENES)
def test_agrees_with_the_default_camera(name, draw):
    """50 random views of each scene: depth, ids and colors, textures and a person in mid-step included."""
    place = make_scene(name)
    theirs, ours = RasterRenderer(place, SMALL), draw(place)
    close, iou, gray = compare([(theirs.render(p, [who]), ours.render(p, [who])) for p, who in views(place, 50)])
    assert close > 0.995
    assert iou > 0.99
    assert gray < 0.5


def test_every_solid_texture_and_pattern_agrees(draw):
    """Textures that were shifted by half a cell or mirrored would differ by more than ten levels."""
    solids = []
    for k, texture in enumerate(TEXTURES):
        look, y = Material((0.7, 0.5, 0.3), texture=texture), 2.2 - 0.9 * k
        solids += [Box((4.0, y, 0.4), (0.6, 0.5, 0.8), look, 0.3 * k), Cylinder((3.0, y, 0.2), 0.3, 0.4, look)]
        solids += [Sphere((4.0, y, 1.3), 0.35, look), Capsule((4.5, y, 2.0), 0.25, 0.9, look)]
    place, people = scene(*solids), [somebody(pattern=1), somebody(y=-0.6, heading=2.3, id=2, pattern=2)]
    camera = PinholeCamera(CameraConfig(width=320, height=240, hfov_deg=70.0))
    theirs, ours = RasterRenderer(place, camera), draw(place, camera)
    poses = [EYE, CameraPose(8.0, 0.5, 1.6, 3.0), CameraPose(4.5, -4.0, 0.7, 1.5)]
    close, iou, gray = compare([(theirs.render(p, people), ours.render(p, people)) for p in poses])
    assert close > 0.995
    assert iou > 0.99
    assert gray < 0.6


def test_a_camera_inside_a_solid_sees_it_from_inside(draw):
    for solid in (Box((0, 0, 1), (1.5, 2.5, 1.2), GRAY, 0.4), Cylinder((0, 0, 1), 0.8, 1.2, GRAY)):
        place = scene(solid)
        theirs, ours = RasterRenderer(place, SMALL).render(EYE), draw(place).render(EYE)
        assert np.abs(theirs.depth - ours.depth).max() < 0.005
        assert np.abs(theirs.rgb.astype(int) - ours.rgb).mean() < 1.0


def test_supersampling_averages_colors_and_nothing_else(draw):
    place, person = make_scene("indoor"), somebody()
    sizes = [(160, 120, 1), (160, 120, 2), (320, 240, 1)]
    plain, smooth, double = (
        draw(place, PinholeCamera(CameraConfig(width=w, height=h, supersample=s))).render(EYE, [person])
        for w, h, s in sizes
    )
    assert (plain.depth == smooth.depth).all()
    assert (plain.ids == smooth.ids).all()
    mean = double.rgb.reshape(120, 2, 160, 2, 3).mean(axis=(1, 3))
    assert np.abs(smooth.rgb - mean).max() <= 1.0
    assert np.abs(plain.rgb - mean).max() > 20.0


def test_shadows_lie_where_the_lamp_cannot_see(draw):
    """A plate in the air darkens the floor behind it, seen from the lamp, to its bounced light; and nothing else."""
    lamp, plate = (3.0, 0.4, 2.5), Box((3.2, 0.0, 1.2), (0.8, 0.6, 0.02), GRAY)
    place = scene(plate, lights=(Light(lamp, 0.6),))
    camera = PinholeCamera(CameraConfig(width=320, height=240))
    bright, dark = (draw(place, camera, shadows).render(EYE) for shadows in (False, True))
    assert (bright.depth == dark.depth).all()
    v, u = np.mgrid[:240, :320] + 0.5
    z = bright.depth.astype(float)
    x, y, up = z, z * (camera.cx - u) / camera.focal, 1.0 + z * (camera.cy - v) / camera.focal
    share = (lamp[2] - 1.2) / (lamp[2] - up)  # the way from the lamp to the floor meets the plate's plane here
    gap = np.maximum(np.abs(lamp[0] + share * (x - lamp[0]) - 3.2) - 0.4, np.abs(lamp[1] + share * (y - lamp[1])) - 0.3)
    floor, edge = (np.abs(up) < 1e-3) & (z < 8.0), 0.05
    ratio = dark.rgb.mean(axis=-1) / bright.rgb.mean(axis=-1)
    assert (floor & (gap < -edge)).sum() > 500
    assert ratio[floor & (gap < -edge)].max() < 0.85
    assert ratio[floor & (gap > edge)].min() > 0.98


def test_several_cameras_in_turn_draw_their_own_pictures(draw):
    corridor, indoor, people = make_scene("corridor"), make_scene("indoor"), [somebody(), somebody(3.0, -0.4, 2.0, 9)]
    one, two = draw(corridor), draw(indoor)
    alone, full = one.render(EYE), one.render(EYE, people)
    for group, frame in ((people, full), ((), alone), (people[::-1], full), (people[:1], None)):
        two.render(EYE, people[1:])
        again = one.render(EYE, group)
        assert set(np.unique(again.ids)) == {0, *(person.id for person in group)}
        assert frame is None or (again.rgb == frame.rgb).all()


def test_renderers_come_and_go_without_leaving_much(draw):
    """A picture's buffers are 7 MB; ModernGL itself keeps some 50 kB of each context."""

    def pages():
        with open("/proc/self/statm", encoding="ascii") as file:
            return int(file.read().split()[1]) * os.sysconf("SC_PAGE_SIZE")

    camera, person, before = PinholeCamera(CameraConfig(width=640, height=480)), somebody(), 0
    for k in range(20):
        if k == 5:
            before = pages()
        renderer = draw(scene(), camera)
        renderer.render(EYE, [person])
        renderer.close()
        renderer.close()
    assert pages() - before < 8e6


def test_a_forked_process_is_told_so_instead_of_waiting_forever(draw):
    renderer = draw(scene())
    renderer.render(EYE)
    read, write = os.pipe()
    child = os.fork()
    if child == 0:
        said = []
        for use in (lambda: renderer.render(EYE), lambda: OpenGLRenderer(scene(), SMALL), renderer.close):
            try:
                use()
            except ValueError as error:
                said.append(str(error))
        os.write(write, "\n".join(said).encode())
        os._exit(0)
    os.close(write)
    with os.fdopen(read) as pipe:
        said = pipe.read().splitlines()
    assert os.waitpid(child, 0)[1] == 0
    assert len(said) == 2
    assert all("'spawn'" in sentence for sentence in said)


def test_the_environment_draws_with_it(draw):
    draw(scene())
    pictures = []
    for renderer in ("raster", "opengl"):
        env = FollowEnv(obs="rgbd", sensor="ideal", renderer=renderer, camera={"width": 80, "height": 60})
        env.reset(seed=3)
        pictures.append(env.frame())
        env.close()
    close, iou, _ = compare([pictures] * 10)
    assert close > 0.995
    assert iou > 0.99


@pytest.mark.parametrize("bad", [math.nan, math.inf])
def test_what_is_not_a_number_is_one_clear_error(bad, draw):
    renderer, person = draw(scene()), somebody()
    with pytest.raises(ValueError, match=r"pose is .* expected finite"):
        renderer.render(CameraPose(0.0, bad, 1.0, 0.0))
    vertices = person.vertices.copy()
    vertices[7, 1] = bad
    with pytest.raises(ValueError, match="vertex that is not finite"):
        renderer.render(EYE, [dataclasses.replace(person, vertices=vertices)])
    assert (renderer.render(EYE, [person]).ids == 1).any()


def test_without_moderngl_the_remedy_is_named(monkeypatch):
    monkeypatch.setitem(sys.modules, "moderngl", None)
    with pytest.raises(ValueError, match=r"pip install 'follow-env\[gl\]'"):
        make_renderer("opengl", scene(), SMALL)


def test_without_a_driver_the_remedy_is_named(monkeypatch):
    pytest.importorskip("moderngl")
    monkeypatch.setenv("GLCONTEXT_LINUX_LIBEGL", "libnothing.so")
    with pytest.raises(ValueError, match="apt install libegl1 libgl1 libgl1-mesa-dri"):
        make_renderer("opengl", scene(), SMALL)
