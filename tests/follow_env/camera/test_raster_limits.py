"""The default camera at its limits: inside solids, empty places, any picture size, bad input, long runs."""

import dataclasses
import math
import resource
from pathlib import Path

import numpy as np
import pytest

from follow_env.camera import CameraPose, PinholeCamera
from follow_env.camera.raster.renderer import RasterRenderer
from follow_env.config import CameraConfig
from follow_env.world.people.mesh import Mesh, Placed
from follow_env.world.scene import Box, Capsule, Cylinder, Light, Material, Sphere
from follow_env.world.scenes import make_scene

from ..drawing import RED, SMALL, blob, frames_hash, reference, scene


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


@pytest.mark.parametrize(
    "solid",
    [
        Sphere((0.1, 0.1, 1.2), 0.7, RED),
        Capsule((0.1, 0.1, 1.1), 0.5, 1.5, RED),
        Cylinder((0.0, 0.0, 1.0), 0.6, 1.0, RED),
    ],
)
def test_a_camera_inside_a_round_solid_sees_it_from_inside(solid):
    """Every pixel has the depth of the inside, lit as a surface that faces the lamp if the lamp is inside as well."""
    place = scene(solid, lights=(Light((0.1, 0.05, 1.1), 0.5),))
    for yaw in (0.0, 1.0, 2.5):
        pose = CameraPose(0.15, -0.1, 1.15, yaw)
        frame, outside = (
            RasterRenderer(place, SMALL).render(pose),
            RasterRenderer(scene(solid, lights=()), SMALL).render(pose),
        )
        assert frame.depth == pytest.approx(reference(place, SMALL, pose)[0], abs=1e-5)
        near_lamp = (0.25 + 0.75 / math.sqrt(2.0)) / 2.0  # of a lamp 1 m away that is faced, at the least
        assert frame.rgb[..., 0].min() > outside.rgb[..., 0].max() + 255 * 0.7 * 0.5 * 0.8 * near_lamp


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
    corridor = make_scene("corridor")
    solids = Sphere((2.0, 0.1, 1.0), 0.3, RED), Capsule((3.0, 0.2, 1.0), 0.5, 1.8, RED)
    place = dataclasses.replace(corridor, primitives=(*corridor.primitives, *solids))
    frame = RasterRenderer(place, camera).render(pose)
    assert (frame.rgb.shape, frame.depth.shape, frame.ids.shape) == ((*size[::-1], 3), size[::-1], size[::-1])
    assert (frame.rgb.dtype, frame.depth.dtype, frame.ids.dtype) == (np.uint8, np.float32, np.uint8)
    assert frame.depth == pytest.approx(reference(place, camera, pose)[0], rel=1e-4)
    assert frame.rgb.max() > 50


def test_the_largest_picture():
    """4096 x 4096: the wall ahead, the floor and a sphere have their depths to the last row."""
    camera, corridor = PinholeCamera(CameraConfig(width=4096, height=4096)), make_scene("corridor")
    place = dataclasses.replace(corridor, primitives=(*corridor.primitives, Sphere((3.0, 1.0, 1.0), 0.2, RED)))
    frame = RasterRenderer(place, camera).render(CameraPose(0.0, 0.0, 1.0, 0.0))
    middle = frame.depth[2048, round(2048 - camera.focal / 3.0)]  # the ray to the center, sqrt(10) m away
    assert middle == pytest.approx(3.0 * (1.0 - 0.2 / math.sqrt(10.0)), abs=1e-3)
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
    with pytest.raises(ValueError, match="supersample is 3; expected a whole number >= 1 and <= 2"):
        CameraConfig(supersample=3)
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
        Mesh(good.mesh.faces + np.int32(5), good.mesh.colors, good.mesh.pattern, good.mesh.anchors)


def test_memory_stays_constant_over_10000_frames():
    """Resident memory grows by less than 2 MB, with people who come and go."""
    place = scene(
        Sphere((2.5, 0.3, 1.0), 0.3, RED), Capsule((3.0, -0.4, 0.8), 0.2, 1.6, RED), Box((6, 0, 1), (1, 9, 2), RED)
    )
    renderer = RasterRenderer(place, PinholeCamera(CameraConfig(width=24, height=18)))
    groups = [[], [blob(2.0, 0.0, 0.8)], [blob(3.0, 0.5, 0.8), blob(2.0, -0.5, 0.8, id=2)]]

    def play(frames):
        for k in range(frames):
            renderer.render(CameraPose(0.0001 * k, 0.0, 1.0, 0.0002 * k), groups[k // 10 % 3])
        return int(Path("/proc/self/statm").read_text().split()[1]) * resource.getpagesize()

    before = play(500)
    assert play(10_000) - before < 2 * 2**20
