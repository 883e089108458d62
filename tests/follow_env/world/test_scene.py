"""The scene is one source: what the camera, the physics, the plan and the clearance say of the same primitives."""

import dataclasses
import math

import gymnasium
import numpy as np
import pytest

import follow_env
from follow_env.camera import CameraPose, make_renderer
from follow_env.config import RobotConfig
from follow_env.envs.dashboard import Dashboard
from follow_env.world.bullet import World
from follow_env.world.scene import Box, Capsule, Cylinder, Material, Sphere
from follow_env.world.scenes import LIGHTS, SCENES, make_scene

from ..drawing import RED, SMALL, scene

ROUND = (
    Sphere((3.0, 0.4, 0.6), 0.35, RED),
    Capsule((4.0, -0.6, 0.8), 0.2, 1.6, RED),
    Capsule((5.0, 0.8, 1.5), 0.45, 1.2, RED),
    Cylinder((3.5, 1.2, 0.5), 0.25, 1.0, RED),
)


def to_axis(point, solid):
    """Distance from a point to a sphere's center or to the straight axis of a capsule, m."""
    half = 0.5 * solid.straight if isinstance(solid, Capsule) else 0.0
    x, y, z = np.subtract(point, solid.center)
    return math.hypot(x, y, z - min(max(z, -half), half))


def test_clearance_is_the_distance_to_the_nearest_round_solid():
    rng, place = np.random.default_rng(0), scene(*ROUND)
    for point in rng.uniform((1.0, -2.0), (7.0, 2.0), (50, 2)):
        gaps = [math.hypot(point[0] - p.center[0], point[1] - p.center[1]) - p.radius for p in ROUND]
        assert place.clearance(point[None]) == pytest.approx(max(min(gaps), 0.0), abs=1e-12)


def test_what_is_high_up_or_not_solid_is_no_obstacle():
    low, high = Sphere((0.0, 0.0, 2.2), 0.3, RED), Sphere((0.0, 0.0, 2.4), 0.3, RED)
    tall, short = Capsule((0.0, 0.0, 2.5), 0.2, 1.1, RED), Capsule((0.0, 0.0, 2.5), 0.2, 0.9, RED)
    ghost = Capsule((0.0, 0.0, 1.0), 0.2, 0.9, RED, solid=False)
    assert scene(low, high, tall, short, ghost).obstacles() == (low, tall)
    assert scene(high, ghost).clearance(np.zeros((1, 2))) == math.inf


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: Sphere((0.0, 0.0, 0.0), 0.0, RED), r"Sphere\(.*radius=0.0.* cannot be; expected finite .* sizes > 0"),
        (lambda: Sphere((math.nan, 0.0, 0.0), 0.1, RED), "nan.* cannot be; expected finite meters"),
        (lambda: Box((0.0, 0.0, 0.0), (1.0, -1.0, 1.0), RED), r"size=\(1.0, -1.0, 1.0\).* cannot be"),
        (lambda: Cylinder((0.0, 0.0, 0.0), 0.1, math.inf, RED), "height=inf.* cannot be"),
        (lambda: Capsule((0.0, 0.0, 0.0), 0.3, 0.6, RED), "radius 0.3 m has the height 0.6 m; expected more than the"),
    ],
)
def test_impossible_primitives_are_clear_errors(make, message):
    with pytest.raises(ValueError, match=message):
        make()


def test_physics_and_geometry_agree_on_who_stands_in_the_way():
    """Lines of sight past spheres and capsules: blocked just when a point of the line lies inside a solid."""
    rng, solids = np.random.default_rng(1), ROUND[:3]
    world = World(scene(*solids), RobotConfig())
    blocked = 0
    for _ in range(300):
        start, stop = rng.uniform((1.5, -1.5, 0.2), (2.0, 1.5, 2.0)), rng.uniform((6.0, -1.5, 0.2), (6.5, 1.5, 2.0))
        near = min(to_axis(p, s) - s.radius for p in np.linspace(start, stop, 300) for s in solids)
        if abs(near) > 0.01:
            assert world.line_of_sight(tuple(start), tuple(stop)) == (near > 0.0)
            blocked += near < 0.0
    world.close()
    assert 50 < blocked < 250


@pytest.mark.parametrize(
    "solid", [Sphere((1.5, 0.0, 0.15), 0.3, RED), Capsule((1.5, 0.0, 0.5), 0.25, 1.0, RED)], ids=["sphere", "capsule"]
)
def test_the_robot_runs_into_round_solids(solid):
    """It touches when its front (0.10 m ahead of the axle, 0.11 m to each side) reaches the surface at its height."""
    world = World(scene(solid), RobotConfig())
    world.reset((0.0, 0.0, 0.0), (-3.0, 3.0, 0.0))
    for _ in range(90):
        world.step(0.5, 0.5, 8)
        if world.collision() != "none":
            break
    assert world.collision() == "wall"
    front = (world.robot_pose()[0] + 0.10, 0.0)
    gap = min(to_axis((*front, z), solid) for z in np.linspace(0.05, 0.15, 11)) - solid.radius
    assert gap == pytest.approx(0.0, abs=0.03)
    world.close()


@pytest.mark.parametrize("solid", ROUND[:2], ids=["sphere", "capsule"])
def test_the_plan_shows_round_solids_in_place(solid):
    """What a solid adds to the plan is a disc of its radius at its center, each edge to 2 px."""
    place = dataclasses.replace(scene(), bounds=(0.0, 6.0, -1.5, 1.5))
    pictures = []
    for primitives in ((), (solid,)):
        dashboard = Dashboard(dataclasses.replace(place, primitives=primitives), SMALL, 0.1)
        frame = make_renderer("raster", place, SMALL).render(CameraPose(0.0, 0.0, 1.0, 0.0))
        still = np.zeros(3)
        info = {"time": 0.0, "bearing": 0.0, "distance": 1.5, "robot_pose": still, "person_pose": still}
        dashboard.update(info, frame)
        pictures.append(dashboard.image()[360:, :480].astype(int))
    rows, columns = np.nonzero(np.abs(pictures[0] - pictures[1]).max(axis=2))
    scale = (480 - 24) / 6.0
    assert (np.ptp(rows) + 1, np.ptp(columns) + 1) == pytest.approx([2.0 * scale * solid.radius] * 2, abs=4.0)
    assert columns.mean() == pytest.approx(12.0 + scale * solid.center[0], abs=1.0)
    middle = 30 + 0.5 * (360 - 60)
    assert rows.mean() == pytest.approx(middle - scale * solid.center[1], abs=1.0)


@pytest.mark.parametrize("name", SCENES)
def test_a_light_changes_only_the_light(name):
    """Normal is the scene as built; dim is 15 % of it at every pixel, to one level; depth and geometry never change."""
    assert make_scene(name) == make_scene(name, "normal") == SCENES.get(name)()
    pose, frames = CameraPose(1.0, 0.2, 1.0, 0.1), {}
    for light in LIGHTS:
        place = make_scene(name, light)
        assert dataclasses.replace(place, ambient=1.0, lights=()) == dataclasses.replace(
            make_scene(name), ambient=1.0, lights=()
        )
        frames[light] = make_renderer("raster", place, SMALL).render(pose)
        assert np.array_equal(frames[light].depth, frames["normal"].depth)
    bright, dim = frames["normal"].rgb.astype(float), frames["dim"].rgb
    unclipped = bright < 255
    assert unclipped.mean() > 0.9
    assert (np.abs(dim - 0.15 * bright)[unclipped] <= 0.6).all()
    lamps = [lamp.intensity for lamp in make_scene(name, "uneven").lights]
    assert max(lamps) > 5.0 * min(lamps)


def test_the_environment_passes_the_light_on():
    frames = []
    for settings in ({}, {"light": "normal"}, {"light": "dim"}):
        env = gymnasium.make(follow_env.IDS["indoor"], obs="rgbd", camera={"width": 32, "height": 24}, **settings)
        observation, _ = env.reset(seed=0)
        frames.append(observation["rgb"].astype(int))
        env.close()
    assert np.array_equal(frames[0], frames[1])
    assert frames[2].mean() < 0.2 * frames[0].mean()
    with pytest.raises(ValueError, match=r"light 'dimm' is not known.*did you mean 'dim'"):
        gymnasium.make(follow_env.IDS["indoor"], light="dimm")


def test_materials_of_the_primitives_reach_the_picture():
    """Side by side a sphere, a capsule and a box of one material have about one color where they face the camera."""
    blue = Material((0.1, 0.2, 0.8))
    place = scene(
        Sphere((2.2, 0.5, 1.0), 0.2, blue),
        Capsule((2.2, 0.0, 1.0), 0.2, 0.6, blue),
        Box((2.2, -0.5, 1.0), (0.4,) * 3, blue),
    )
    frame = make_renderer("raster", place, SMALL).render(CameraPose(0.0, 0.0, 1.0, 0.0))
    columns = [round(SMALL.cx - SMALL.focal * y / 2.0) for y in (0.5, 0.0, -0.5)]
    colors = frame.rgb[60, columns].astype(int)
    assert (colors.argmax(axis=1) == 2).all()
    assert np.ptp(colors, axis=0).max() < 25
