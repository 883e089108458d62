"""The camera: pictures of places and of the person against geometry computed here."""

import math

import gymnasium
import numpy as np
import pytest

import follow_env
from follow_env.camera import RENDERERS, CameraPose, PinholeCamera, make_renderer
from follow_env.config import CameraConfig
from follow_env.world.people.bodies import load_body
from follow_env.world.people.walker import Walker
from follow_env.world.scene import Box, Light, Material, Scene

GRAY = Material((0.5, 0.5, 0.5))
LAMP = (Light((0.0, 0.0, 3.0), 1.0),)
CAMERA = PinholeCamera(CameraConfig())
SMALL = PinholeCamera(CameraConfig(width=80, height=60))
POSES = {
    "origin": CameraPose(0.0, 0.0, 1.0, 0.0),
    "turned": CameraPose(1.5, -0.7, 0.8, 0.6),
    "backwards": CameraPose(-2.0, 1.0, 1.3, 3.0),
}
WALKERS = {outfit: Walker(load_body("man", outfit)) for outfit in ("blue", "green", "orange")}


def scene(*boxes):
    return Scene("test", boxes, GRAY, LAMP, 0.5, (-20.0, 20.0, -20.0, 20.0))


@pytest.fixture(params=RENDERERS)
def picture(request):
    """Draw boxes and a person with each renderer in turn, made anew: the rigid people of "tiny" keep their posture."""

    def draw(camera, pose, boxes, person=None):
        renderer = make_renderer(request.param, scene(*boxes), camera)
        frame = renderer.render(pose, () if person is None else (person,))
        renderer.close()
        return frame

    return draw


def standing(x, y, outfit="blue"):
    """The person who stands there and faces along x."""
    return WALKERS[outfit].place(x, y, 0.0, 0.0, 0.0)


def world_point(pose, ahead, left, up):
    """The world point so far ahead, left and up of the camera, m."""
    cosine, sine = math.cos(pose.yaw), math.sin(pose.yaw)
    return pose.x + cosine * ahead - sine * left, pose.y + sine * ahead + cosine * left, pose.z + up


def plate(pose, ahead, left, up, size=0.3):
    """A thin square plate that faces the camera, with its front at the given place."""
    center = world_point(pose, ahead + 0.0005, left, up)
    return Box(center, (0.001, size, size), GRAY, yaw=pose.yaw)


@pytest.mark.parametrize("pose", POSES.values(), ids=POSES)
@pytest.mark.parametrize(
    ("ahead", "left", "up"),
    [(2.0, 0.0, 0.0), (2.5, 0.8, 0.5), (2.5, -0.8, -0.3), (4.0, 1.2, -0.6), (6.0, -2.0, 1.2)],
)
def test_a_point_appears_where_the_intrinsics_say(picture, pose, ahead, left, up):
    """The centroid of a plate's pixels is the projection of its center: within half a pixel, and 5 mm of depth.

    A plate that faces the camera is imaged without distortion, so its centroid is the image of its center; a rectangle
    covers whole rows and columns, which leaves half a pixel on each axis. The next test averages that away.
    """
    empty = picture(CAMERA, pose, ())
    frame = picture(CAMERA, pose, (plate(pose, ahead, left, up),))
    rows, columns = np.nonzero(frame.depth < empty.depth - 0.05)
    assert len(rows) > 30
    u, v, z = CAMERA.project(pose, world_point(pose, ahead, left, up))
    assert z == pytest.approx(ahead)
    assert (columns + 0.5).mean() == pytest.approx(u, abs=0.52)
    assert (rows + 0.5).mean() == pytest.approx(v, abs=0.52)
    assert frame.depth[rows, columns] == pytest.approx(ahead, abs=0.005)


def test_the_picture_is_not_shifted_on_average(picture):
    """Over 144 plates the mean difference of centroid and projection is below 0.08 px: no half-pixel shift.

    Twelve plates a picture, one in each cell of 80 x 80 px; the rounding of their edges is 0.29 px rms on each axis.
    """
    rng, differences = np.random.default_rng(0), []
    for _ in range(12):
        pose = CameraPose(*rng.uniform(-3.0, 3.0, 2).tolist(), 1.0, float(rng.uniform(-3.0, 3.0)))
        places = []
        for row, column in np.ndindex(3, 4):
            ahead = float(rng.uniform(1.5, 2.5))
            u, v = (80.0 * cell + 40.0 + float(rng.uniform(-12.0, 12.0)) for cell in (column, row))
            places.append((ahead, (CAMERA.cx - u) * ahead / CAMERA.focal, (CAMERA.cy - v) * ahead / CAMERA.focal))
        empty = picture(CAMERA, pose, ())
        frame = picture(CAMERA, pose, tuple(plate(pose, *place, size=0.15) for place in places))
        nearer = frame.depth < empty.depth - 0.05
        for (row, column), place in zip(np.ndindex(3, 4), places, strict=True):
            rows, columns = np.nonzero(nearer[80 * row : 80 * row + 80, 80 * column : 80 * column + 80])
            u, v, _ = CAMERA.project(pose, world_point(pose, *place))
            differences.append((80 * column + (columns + 0.5).mean() - u, 80 * row + (rows + 0.5).mean() - v))
    assert np.abs(np.mean(differences, axis=0)).max() < 0.08
    assert np.sqrt(np.mean(np.square(differences), axis=0)).max() < 0.33


def test_left_is_left_and_up_is_up():
    pose = POSES["turned"]
    u, v, _ = CAMERA.project(pose, world_point(pose, 2.0, 0.5, 0.3))
    assert u < CAMERA.cx
    assert v < CAMERA.cy


@pytest.mark.parametrize("pose", POSES.values(), ids=POSES)
@pytest.mark.parametrize("distance", [0.6, 1.5, 3.0, 7.5, 15.0])
def test_a_wall_ahead_has_its_distance_in_meters(picture, pose, distance):
    """To 1 cm as asked of every renderer; the depth is along the optical axis, so the whole wall reads alike."""
    wall = Box(world_point(pose, distance + 0.05, 0.0, 0.0), (0.1, 40.0, 40.0), GRAY, yaw=pose.yaw)
    frame = picture(SMALL, pose, (wall,))
    upper = frame.depth[: SMALL.height // 2]
    assert upper == pytest.approx(distance, abs=0.01)


def test_nothing_ahead_reads_the_far_plane_and_no_more(picture):
    for near, far in ((0.1, 30.0), (0.05, 25.0), (0.3, 47.0)):
        camera = PinholeCamera(CameraConfig(width=16, height=12, near=near, far=far))
        depth = picture(camera, CameraPose(19.0, 0.0, 1.0, 0.0), ()).depth
        assert depth[0] == pytest.approx(far, rel=1e-4)
        assert depth.max() <= np.float32(far)


def test_the_matrices_say_the_same_as_project():
    """Clip coordinates of a point by the two OpenGL matrices against `project`: picture position and depth buffer."""
    rng = np.random.default_rng(1)
    for pose in POSES.values():
        view = np.array(CAMERA.view_matrix(pose)).reshape(4, 4).T
        projection = np.array(CAMERA.projection_matrix()).reshape(4, 4).T
        assert view[:3, :3] @ view[:3, :3].T == pytest.approx(np.eye(3), abs=1e-12)
        assert np.linalg.det(view[:3, :3]) == pytest.approx(1.0)
        for ahead, across, up in rng.uniform((0.3, -0.6, -0.4), (9.0, 0.6, 0.4), (20, 3)):
            point = world_point(pose, ahead, across * ahead, up * ahead)
            clip = projection @ view @ np.array((*point, 1.0))
            x, y, _ = clip[:3] / clip[3]
            u, v, z = CAMERA.project(pose, point)
            assert (0.5 * (x + 1.0) * CAMERA.width, 0.5 * (1.0 - y) * CAMERA.height) == pytest.approx((u, v))
            assert clip[3] == pytest.approx(z)


def test_a_point_behind_the_camera_is_one_clear_error():
    with pytest.raises(ValueError, match=r"behind the camera .*expected depth > 0"):
        CAMERA.project(POSES["origin"], (-1.0, 0.0, 1.0))


def test_the_edge_of_the_picture_lies_at_half_the_field_of_view():
    pose = POSES["origin"]
    u, _, _ = CAMERA.project(pose, world_point(pose, 3.0, 3.0 * math.tan(math.radians(28.75)), 0.0))
    assert u == pytest.approx(0.0, abs=1e-9)


@pytest.mark.parametrize("pose", POSES.values(), ids=POSES)
@pytest.mark.parametrize(("ahead", "left"), [(1.5, 0.0), (2.5, 0.6), (4.0, -1.0)])
def test_the_persons_pixels_fill_the_projection_of_the_body(picture, pose, ahead, left):
    """The box of the id mask against the projected vertices, clipped to the picture: within a pixel."""
    x, y, _ = world_point(pose, ahead, left, 0.0)
    person = WALKERS["blue"].place(x, y, pose.yaw + 0.4, 3.3, 0.9)
    frame = picture(CAMERA, pose, (), person)
    corners = np.array([CAMERA.project(pose, point)[:2] for point in person.vertices.tolist()])
    low, high = corners.min(axis=0), corners.max(axis=0)
    limit = (CAMERA.width, CAMERA.height)
    wanted = (*np.clip(low, 0.0, limit), *np.clip(high, 0.0, limit))
    assert frame.person_box() == pytest.approx(wanted, abs=1.0)
    assert set(np.unique(frame.ids)) == {0, 1}


def test_the_persons_pixels_have_the_persons_depth_and_color(picture):
    pose = POSES["origin"]
    x, y, _ = world_point(pose, 2.0, 0.0, 0.0)
    frames = {outfit: picture(CAMERA, pose, (), standing(x, y, outfit)) for outfit in WALKERS}
    for frame in frames.values():
        depth = frame.depth[frame.ids == 1]
        assert depth.min() > 2.0 - 0.30
        assert depth.max() < 2.0 + 0.30
        assert np.median(depth) == pytest.approx(2.0 - 0.10, abs=0.06)
    shirts = {outfit: frame.rgb[100:140, 152:168].reshape(-1, 3).mean(axis=0) for outfit, frame in frames.items()}
    assert shirts["blue"].argmax() == 2
    assert shirts["green"].argmax() == 1
    assert shirts["orange"].argmax() == 0


def test_a_person_who_is_not_in_view_has_no_pixels(picture):
    pose = POSES["origin"]
    behind = standing(-2.0, 0.0)
    beside = standing(1.0, 2.0)
    ahead = standing(3.0, 0.0)
    wall = Box((1.5, 0.0, 1.0), (0.1, 6.0, 4.0), GRAY)
    assert picture(SMALL, pose, (), behind).person_box() is None
    assert picture(SMALL, pose, (), beside).person_box() is None
    assert picture(SMALL, pose, (), ahead).person_box() is not None
    assert picture(SMALL, pose, (wall,), ahead).person_box() is None


def test_the_box_is_tight_and_small_glimpses_can_be_ignored(picture):
    frame = picture(SMALL, POSES["origin"], (), standing(3.0, 0.0))
    u0, v0, u1, v1 = (int(edge) for edge in frame.person_box())
    inside = frame.ids == 1
    assert inside.sum() == inside[v0:v1, u0:u1].sum()
    assert inside[v0].any()
    assert inside[v1 - 1].any()
    assert inside[:, u0].any()
    assert inside[:, u1 - 1].any()
    pixels = int(inside.sum())
    assert frame.person_box(pixels) == (u0, v0, u1, v1)
    assert frame.person_box(pixels + 1) is None


def test_the_camera_is_carried_by_the_robot_without_jumps():
    """A swerving drive: the camera stays 10 cm ahead of the axle and moves no faster than the robot can."""
    env = gymnasium.make(follow_env.IDS["indoor"], route="standing").unwrapped
    _, info = env.reset(seed=2)
    before = env.camera_pose()
    for step in range(120):
        action = np.array((0.25 * math.sin(0.2 * step), math.cos(0.13 * step)), np.float32)
        *_, terminated, _, info = env.step(action)
        assert not terminated
        camera = env.camera_pose()
        x, y, yaw = info["robot_pose"]
        assert (camera.x, camera.y) == pytest.approx((x + 0.10 * math.cos(yaw), y + 0.10 * math.sin(yaw)))
        assert (camera.z, camera.yaw) == (1.0, yaw)
        assert math.hypot(camera.x - before.x, camera.y - before.y) < (1.2 + 0.10 * 2.0) * env.dt * 1.02
        assert abs(math.remainder(camera.yaw - before.yaw, 2.0 * math.pi)) < 2.0 * env.dt * 1.02
        before = camera
    env.close()


@pytest.mark.parametrize("renderer", RENDERERS)
def test_the_picture_follows_the_motion(renderer):
    """Driving at the corridor's wall, the depth in the middle falls by just what the robot moved, every step."""
    env = gymnasium.make(
        follow_env.IDS["corridor"],
        obs="rgbd",
        route="standing",
        sensor="ideal",
        renderer=renderer,
        camera={"width": 32, "height": 24},
    ).unwrapped
    observation, _ = env.reset(seed=3, options={"robot_pose": (3.0, -1.0, math.pi / 2)})
    for _ in range(45):
        *_, info = before = env.step(np.array((0.8, 0.0), np.float32))
        observation = before[0]
        assert observation["depth"][12, 16] == pytest.approx(1.8 - info["robot_pose"][1] - 0.10, abs=0.01)
    assert info["robot_pose"][1] > -0.1
    env.close()


@pytest.mark.parametrize("name", ["corridor", "indoor"])
def test_visible_agrees_with_the_picture(name):
    """From random places: who is `visible` has pixels, who is not has next to none."""
    env = gymnasium.make(
        follow_env.IDS[name], obs="rgbd", route="standing", camera={"width": 64, "height": 48}
    ).unwrapped
    rng, seen = np.random.default_rng(4), []
    for seed in range(60):
        place = (float(rng.uniform(-2.0, 12.0)), float(rng.uniform(-1.2, 1.2)), float(rng.uniform(-math.pi, math.pi)))
        _, info = env.reset(seed=seed, options={"robot_pose": place})
        pixels = int((env.frame().ids == 1).sum())
        seen.append(info["visible"])
        if info["visible"]:
            assert pixels > 0, (seed, place)
        elif info["distance"] > 0.5:
            assert pixels < 60, (seed, place)
    env.close()
    assert 5 < sum(seen) < 55
