"""Scenes, robots and tasks of one's own in the environment, the batch and other processes; life without PyBullet."""

import subprocess
import sys

import gymnasium
import numpy as np
import pytest
from gymnasium.vector import AsyncVectorEnv

from follow_env.config import EnvConfig, RobotConfig
from follow_env.envs.batch import FollowVectorEnv
from follow_env.envs.follow import FollowEnv
from follow_env.world.robots import ROBOTS
from follow_env.world.scene import Box, Light, Material, Scene

WALL = Material((0.8, 0.8, 0.8))
HALL = Scene(
    "hall",
    (Box((6.0, 3.05, 1.25), (20.0, 0.1, 2.5), WALL), Box((6.0, -3.05, 1.25), (20.0, 0.1, 2.5), WALL)),
    WALL,
    (Light((6.0, 0.0, 2.4), 1.0),),
    0.4,
    (-4.0, 16.0, -3.0, 3.0),
)


def hall(width=6.0):
    """The hall as a function of its width, m."""
    y = 0.5 * width + 0.05
    walls = tuple(Box((6.0, side * y, 1.25), (20.0, 0.1, 2.5), WALL) for side in (1.0, -1.0))
    return Scene("hall", walls, WALL, HALL.lights, 0.4, (-4.0, 16.0, -0.5 * width, 0.5 * width))


def hall_env():
    return FollowEnv(scene=HALL, engine="kinematic")


def test_a_scene_of_ones_own_as_object_function_and_path(monkeypatch):
    monkeypatch.setitem(sys.modules, "my_lab", sys.modules[__name__])
    records = []
    for scene in (HALL, "my_lab:hall", {"name": "my_lab:hall", "width": 6.0}):
        env = FollowEnv(scene=scene, engine="kinematic")
        env.reset(seed=2)
        records.append([env.step(np.array((0.7, 0.0)))[0] for _ in range(50)])
    assert np.array_equal(records[0], records[1])
    assert np.array_equal(records[0], records[2])
    assert EnvConfig.of(EnvConfig(scene={"name": "my_lab:hall", "width": 8.0}).to_json()).scene["width"] == 8.0
    with pytest.raises(ValueError, match="scene is an object, Scene, which JSON cannot carry"):
        EnvConfig(scene=HALL).to_json()


def test_a_scene_of_ones_own_in_the_batch_is_that_of_the_single_environment():
    single, batch = hall_env(), FollowVectorEnv(1, scene=HALL, autoreset_mode="Disabled")
    observation, _ = single.reset(seed=4)
    observations, _ = batch.reset_as_single([4])
    for _ in range(100):
        assert np.array_equal(observation, observations[0])
        observation, *_ = single.step(np.array((0.6, 0.05)))
        observations, *_ = batch.step(np.array(((0.6, 0.05),)))


@pytest.mark.slow
def test_own_parts_travel_to_spawned_workers():
    here = hall_env()
    workers = AsyncVectorEnv([hall_env, hall_env], context="spawn")
    try:
        observations, _ = workers.reset(seed=[6, 7])
        expected, _ = here.reset(seed=7)
        assert np.array_equal(observations[1], expected)
    finally:
        workers.close()


@pytest.mark.parametrize("name", ROBOTS)
@pytest.mark.parametrize("engine", ["bullet", "kinematic"])
def test_a_named_robot_drives_as_its_limits_say(name, engine):
    """Straight ahead at full speed it goes max_speed, turning on the spot max_yaw_rate, and it does not fall over."""
    robot = ROBOTS.get(name)
    env = FollowEnv(robot=name, route="standing", engine=engine)
    env.reset(seed=0, options={"robot_pose": (-0.5, 0.0, 0.0)})
    for _ in range(60):
        *_, info = env.step(np.array((0.3 if name == "dong2018" else 1.0, 0.0)))
    speed = (0.3 if name == "dong2018" else 1.0) * robot.max_speed
    assert info["twist"] == pytest.approx((speed, 0.0), abs=0.01)
    for _ in range(60):
        *_, info = env.step(np.array((0.0, 1.0)))
    assert info["twist"] == pytest.approx((0.0, robot.max_yaw_rate), abs=0.05)
    assert info["collision_with"] == "none"
    env.close()


def test_the_hull_contains_every_named_robot():
    from follow_env.world.kinematic.hull import HULL, pack_hull

    for name in ROBOTS:
        robot = ROBOTS.get(name)
        assert np.array([pack_hull(robot)], HULL)[0]["reach"] <= robot.hull_radius + 1e-9, name


def test_a_robot_faster_than_the_observations_hold_is_refused_for_one_episode():
    env = FollowEnv(engine="kinematic")
    with pytest.raises(ValueError, match="is faster than the observations hold"):
        env.reset(seed=0, options={"robot": {"max_wheel_speed": 9.0}})


def test_the_task_is_a_setting():
    env = FollowEnv(engine="kinematic", task={"set_point": 1.0, "band_near": 0.6, "distance_weight": 2.0})
    _, info = env.reset(seed=0)
    assert info["distance"] == pytest.approx(1.0)
    *_, info = env.step(np.zeros(2))
    assert info["rewards"]["distance"] == pytest.approx(2.0, abs=1e-3)


def test_a_task_without_its_set_point_in_its_band_is_refused():
    with pytest.raises(ValueError, match="expected near <= set_point <= far"):
        FollowEnv(task={"set_point": 2.5})


def test_without_pybullet_the_kinematic_engine_drives_and_the_other_says_what_to_do():
    code = """
import sys; sys.modules["pybullet"] = None
import numpy as np
from follow_env.envs.follow import FollowEnv
env = FollowEnv(engine="kinematic")
env.reset(seed=0)
print(env.step(np.zeros(2))[4]["time"])
try:
    FollowEnv().reset(seed=0)
except ImportError as error:
    print(error)
"""
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    time, message = done.stdout.splitlines()
    assert float(time) == pytest.approx(1.0 / 30.0)
    assert "engine='bullet' needs PyBullet" in message
    assert "engine='kinematic'" in message


def test_a_config_and_settings_make_the_same_environment():
    config = EnvConfig(scene="indoor", walking_speed=1.1, engine="kinematic", robot=RobotConfig(max_speed=1.0))
    made = (
        FollowEnv(config),
        FollowEnv(config.to_json()),
        FollowEnv(scene="indoor", walking_speed=1.1, engine="kinematic", robot={"max_speed": 1.0}),
        gymnasium.make(
            "follow_env/Indoor-v0", walking_speed=1.1, engine="kinematic", robot={"max_speed": 1.0}
        ).unwrapped,
    )
    assert len({env.config for env in made}) == 1
    observations = [env.reset(seed=3)[0] for env in made]
    assert all(np.array_equal(observation, observations[0]) for observation in observations)
