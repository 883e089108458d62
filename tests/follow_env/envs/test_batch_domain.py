"""Worlds with settings of their own, drawn from (seed, world, episode)."""

import dataclasses

import numpy as np
import pytest

from follow_env.config import EnvConfig, RobotConfig
from follow_env.envs.batch import FollowVectorEnv
from follow_env.sensors import MeasurementConfig, SensorConfig


class Spread:
    """A domain: the changes that a function draws."""

    is_fixed = False

    def __init__(self, draw, **nominal):
        self.nominal, self._draw = EnvConfig.of(nominal), draw

    def sample(self, rng):
        return dataclasses.replace(self.nominal, **self._draw(rng))


def speeds(rng):
    return {"walking_speed": float(rng.uniform(0.4, 1.6))}


def play(env, steps, count, seed=0):
    """Return what the first worlds saw, with the same actions for any number of worlds."""
    rng, record = np.random.default_rng(1), []
    observation, info = env.reset(seed=seed)
    for _ in range(steps):
        record.append(
            np.concatenate((np.asarray(observation[:count]).reshape(count, -1), info["person_pose"][:count]), 1)
        )
        actions = np.zeros((env.num_envs, 2))
        actions[:count] = rng.uniform(-0.2, 0.8, (count, 2)) * (1.0, 0.1)
        observation, *_, info = env.step(actions)
    return np.array(record)


def everything(rng):
    sensor = SensorConfig(measurement=MeasurementConfig(miss_share=float(rng.uniform(0, 0.3))))
    robot = RobotConfig(max_speed=float(rng.uniform(0.5, 1.2)), camera_height=float(rng.uniform(0.3, 1.3)))
    latency = int(rng.integers(0, 5)) / 30.0
    return {**speeds(rng), "sensor": sensor, "robot": robot, "latency_s": latency}


def test_a_world_depends_on_seed_number_and_episode_only():
    """Not on the number of worlds or of threads, with speeds, misses, latency and robots of their own."""
    few, many = (FollowVectorEnv(n, Spread(everything), threads=t) for n, t in ((4, 1), (1100, 3)))
    one, other = play(few, 700, 4), play(many, 700, 4)
    assert (one == other).all()
    assert len(np.unique(one[100, :, 4])) == 4
    few.close()
    many.close()


def test_each_world_walks_and_measures_by_its_own_settings():
    def draw(rng):
        miss = float(rng.choice((0.0, 0.9)))
        return {**speeds(rng), "sensor": SensorConfig(measurement=MeasurementConfig(miss_share=miss))}

    env = FollowVectorEnv(60, Spread(draw, route="straight"))
    observation, info = env.reset(seed=2)
    valid = np.zeros(60)
    for _ in range(90):
        observation, *_, info = env.step(np.tile((0.3, 0.0), (60, 1)))
        valid += observation[:, 2] / 90.0
    wanted = np.array([config.walking_speed for config in env.configs])
    assert np.linalg.norm(info["person_velocity"], axis=1) == pytest.approx(wanted, rel=1e-9)
    misses = np.array([config.sensor.measurement.miss_share for config in env.configs])
    assert (valid[misses == 0.0] > 0.5).all()
    assert (valid[misses == 0.9] < 0.35).all()
    assert 10 < (misses > 0).sum() < 50
    before = [config.walking_speed for config in env.configs]
    env.reset()
    assert [config.walking_speed for config in env.configs] != before
    env.close()


def test_the_age_of_a_measurement_is_the_latency_of_the_world():
    def draw(rng):
        return {"latency_s": int(rng.integers(0, 6)) / 30.0, "route": "standing"}

    env = FollowVectorEnv(40, Spread(draw, route="standing", sensor="ideal"))
    env.reset(seed=0)
    for _ in range(20):
        observation, *_ = env.step(np.zeros((40, 2)))
    latencies = np.array([config.latency_s for config in env.configs])
    assert (observation[:, 2] == 1.0).all()
    assert observation[:, 3] == pytest.approx(latencies, abs=1e-6)
    assert len(set(latencies)) == 6
    env.close()


def test_worlds_see_people_and_lights_of_their_own():
    """A world draws the same picture as a batch that has its settings for all worlds."""

    def draw(rng):
        outfit, light = str(rng.choice(("blue", "red"))), str(rng.choice(("normal", "dim")))
        return {"outfit": outfit, "light": light, "person": str(rng.choice(("man", "woman"))), "latency_s": 1 / 15}

    small = {"obs": "rgbd", "camera": {"width": 32, "height": 24}, "route": "standing", "sensor": "ideal"}
    env = FollowVectorEnv(10, Spread(draw, **small), threads=3)
    env.reset(seed=7)
    looks = {(config.outfit, config.light, config.person) for config in env.configs}
    assert len(looks) > 4
    for i in range(10):
        config = env.configs[i]
        same = FollowVectorEnv(10, config, threads=1)
        wanted, _ = same.reset(seed=7, options={"robot_pose": (0.0, 0.0, 0.0)})
        mine, _ = env.reset(seed=7, options={"robot_pose": (0.0, 0.0, 0.0)})
        assert (mine["rgb"][i] == wanted["rgb"][i]).all()
        assert (mine["depth"][i] == wanted["depth"][i]).all()
        same.close()
    env.close()


@pytest.mark.parametrize(
    ("changes", "name"),
    [
        ({"control_hz": 60}, "control_hz"),
        ({"obs": "state"}, "obs"),
        ({"scene": "indoor"}, "scene"),
        ({"action": "wheels"}, "action"),
    ],
)
def test_what_worlds_share_cannot_be_drawn(changes, name):
    with pytest.raises(ValueError, match=f"{name} is .* in one world and .* in another; the worlds of a batch share"):
        FollowVectorEnv(2, Spread(lambda rng: changes))


def test_a_robot_too_fast_for_the_observations_is_refused():
    with pytest.raises(ValueError, match=r"max_wheel_speed 2\.5 .* faster than the observations hold"):
        FollowVectorEnv(2, Spread(lambda rng: {"robot": RobotConfig(max_wheel_speed=2.5)}))


def test_the_forms_of_the_constructor_agree():
    config = EnvConfig.of({"obs": "state", "walking_speed": 1.2})
    made = (
        FollowVectorEnv(2, obs="state", walking_speed=1.2),
        FollowVectorEnv(2, config),
        FollowVectorEnv(2, {"obs": "state"}, walking_speed=1.2),
    )
    starts = [env.reset(seed=1)[0] for env in made]
    for env, start in zip(made, starts, strict=True):
        assert env.config == config
        assert (start == starts[0]).all()
        env.close()


def test_the_task_of_the_settings_is_rewarded():
    """Another set point, weight and band: the reward is that of the formula, and success follows the band."""
    task = {"set_point": 2.0, "distance_weight": 0.7, "collision_cost": 3.0, "lost_after": 0.5}
    env = FollowVectorEnv(3, route="standing", task=task, autoreset_mode="Disabled")
    _, info = env.reset(seed=0, options={"robot_pose": (0.0, 0.0, 0.0)})
    _, reward, _, _, info = env.step(np.zeros((3, 2)))
    error = (info["distance"] - 2.0) / 0.5
    assert info["rewards"]["distance"] == pytest.approx(0.7 / (1.0 + error * error))
    assert reward == pytest.approx(
        sum(info["rewards"][key] for key in ("distance", "bearing", "visible", "smoothness"))
    )
    env.reset(seed=0, options={"robot_pose": (0.0, 0.0, 3.1)})
    for step in range(1, 17):
        _, _, terminated, _, _ = env.step(np.zeros((3, 2)))
        assert terminated.all() == (step > 14)
        if terminated.any():
            break
    env.close()
