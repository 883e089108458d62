"""Followers built from a specification for an environment: each part is honored, and nothing is guessed."""

import json
import math
import pickle
import shutil

import numpy as np
import pytest

from baselines.controllers import CONTROLLERS
from baselines.followers.agents import weights_file
from baselines.followers.build import build_follower, make_follower, observation_settings
from baselines.followers.noise import noise_of
from baselines.followers.references import POLICIES
from baselines.followers.spec import FollowerSpec
from follow_env.config import EnvConfig
from follow_env.envs.follow import FollowEnv
from tracker.estimators.base import ESTIMATORS
from tracker.estimators.kf import KalmanFilter


class Gentle:
    """A controller of one's own: proportional, half as strong as the paper's."""

    def __init__(self, config, gain=0.5):
        self.gain, self.set_point = gain, config.task.set_point

    def reset(self):
        pass

    def command(self, bearing, distance, dt):
        return self.gain * (distance - self.set_point), self.gain * bearing


class Doubtful(KalmanFilter):
    """An estimator of one's own: believes measurements less."""

    def __init__(self, noise, doubt=4.0):
        super().__init__(noise.process, tuple(doubt * r for r in noise.measurement))


class Straight:
    """A stateless policy."""

    def predict(self, observation, state=None, episode_start=None, deterministic=True):
        return np.array((0.5, 0.0), np.float32), None


def drive(follower, env, steps=None, seed=0):
    """Return the bearings and distances of an episode."""
    (observation, info), state, record = env.reset(seed=seed), None, []
    while steps is None or len(record) < steps:
        action, state = follower.predict(observation, state)
        observation, _, terminated, truncated, info = env.step(action)
        record.append((info["bearing"], info["distance"]))
        if terminated or truncated:
            break
    return np.array(record)


@pytest.mark.parametrize(
    ("text", "parts"),
    [
        ("akf", ("emulated", "akf", "pi")),
        ("mask/kf", ("mask", "kf", "pi")),
        ("truth/none+pi", ("truth", "none", "pi")),
        ("akf+my_lab:lqr", ("emulated", "akf", "my_lab:lqr")),
        ('{"estimator": "kf"}', ("emulated", "kf", "pi")),
        ("emulated/my_lab:ekf+pi", ("emulated", "my_lab:ekf", "pi")),
    ],
)
def test_a_text_names_the_parts(text, parts):
    spec = FollowerSpec.parse(text)
    assert (spec.perception, spec.estimator, spec.controller) == parts
    assert spec.policy is None
    assert spec.kind == ("own" if "my_lab" in text else "classical")
    assert FollowerSpec.parse(json.loads(json.dumps(spec.to_json()))) == spec


@pytest.mark.parametrize(
    ("value", "words"),
    [
        ("akff", ("'akff'", "did you mean 'akf'")),
        ("ppo-00", ("'ppo-00'", "did you mean 'ppo-0'")),
        ("maks/akf", ("'maks'", "did you mean 'mask'")),
        ("akf+pid", ("'pid'", "did you mean 'pi'")),
        ({"estimater": "kf"}, ("'estimater'", "did you mean 'estimator'")),
        (3, ("3", "predict")),
        ("{kf}", ("{kf}", "no JSON")),
    ],
)
def test_what_names_nothing_is_one_clear_error(value, words):
    with pytest.raises(ValueError, match=r"did you mean|expected") as raised:
        FollowerSpec.parse(value)
    for word in words:
        assert word in str(raised.value)


def test_the_kind_is_told_and_not_read_from_a_label():
    assert FollowerSpec.parse("ppo-0").kind == "learned"
    assert FollowerSpec.parse("oracle").kind == "reference"
    assert FollowerSpec.parse(Straight()).kind == "own"
    assert FollowerSpec(controller="my_lab:lqr", label="PI-free").kind == "classical"


def test_a_controller_of_ones_own_drives():
    """Defect of the past: the controller was checked and then ignored."""
    env = FollowEnv(engine="kinematic", sensor="ideal")
    records = [
        drive(build_follower({"controller": part}, env), env, 90)
        for part in ("pi", Gentle, {"name": f"{__name__}:Gentle", "gain": 0.5} if __name__ in _modules() else Gentle)
    ]
    assert not np.array_equal(records[0], records[1])
    assert np.array_equal(records[1], records[2])
    follower = make_follower("akf", controller=Gentle(env.config))
    assert follower._make_controller().__class__ is Gentle


def _modules():
    import sys

    return sys.modules


def test_an_estimator_of_ones_own_filters_and_settings_reach_it():
    env = FollowEnv(engine="kinematic")
    records = [
        drive(build_follower({"estimator": part}, env), env, 60)
        for part in ("kf", Doubtful, {"name": "akf", "alpha": 0.5}, {"name": "akf", "alpha": 1e-9})
    ]
    assert not np.array_equal(records[0], records[1])
    assert not np.array_equal(records[2], records[3])
    assert np.array_equal(records[0], records[3]), "a test that nothing fails is no test: KF"
    with pytest.raises(ValueError, match="cannot be made with"):
        build_follower({"estimator": {"name": "kf", "alpha": 0.1}}, env)


@pytest.mark.parametrize("name", ESTIMATORS)
def test_the_same_follower_by_names_and_by_the_papers_function(name):
    """With the environments' own sensor: R is its squares, Q the calibrated one."""
    env = FollowEnv()
    one, other = build_follower(name, env), make_follower(name, sensor="default")
    mine = drive(one, env, 40)
    assert np.abs(mine - drive(other, env, 40)).max() < 1e-6
    env.close()


def test_noise_belongs_to_the_sensor():
    quiet, loud = (
        EnvConfig.of({"sensor": {"measurement": {"bearing_noise": 0.01 * k, "distance_noise": 0.02 * k}}})
        for k in (1, 3)
    )
    assert noise_of(loud, "emulated").measurement == pytest.approx(
        [9.0 * r for r in noise_of(quiet, "emulated").measurement]
    )
    assert noise_of(quiet, "emulated").measurement == pytest.approx((1e-4, 4e-4))
    assert noise_of(EnvConfig(scene="indoor"), "mask") == noise_of(EnvConfig(scene="corridor"), "mask")
    slow = noise_of(EnvConfig(control_hz=10), "emulated").process
    assert slow == pytest.approx([9.0 * q for q in noise_of(EnvConfig(), "emulated").process])


def test_an_own_robot_is_driven_as_it_is():
    """Defect of the past: a follower took every robot for the default one, without a word."""
    env = FollowEnv(robot="turtlebot3_burger", walking_speed=0.2, camera={"hfov_deg": 69.0})
    told = drive(build_follower("akf", env), env)
    guessed = drive(make_follower("akf", sensor="default"), env)
    errors = [math.sqrt(np.mean((record[:, 1] - 1.5) ** 2)) for record in (told, guessed)]
    assert errors[0] < 0.12
    assert errors[1] > 1.5 * errors[0]
    env.close()


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"robot": "turtlebot3_burger"}, ("another robot", "track_width 0.3, here 0.16")),
        ({"control_hz": 60}, ("another control_hz", "30, here 60")),
        ({"latency_s": 0.1}, ("another latency_s", "0.0, here 0.1")),
        ({"task": {"set_point": 1.2}}, ("another task", "set_point 1.5, here 1.2")),
        ({"obs": "state"}, ("reads obs='measurement'", "gives obs='state'")),
    ],
)
def test_a_follower_built_for_another_environment_says_so(changes, words):
    built = build_follower("akf", EnvConfig())
    with pytest.raises(ValueError, match=r"build it from this environment|make it with obs") as raised:
        build_follower({"policy": built, "observation": "measurement"}, EnvConfig.of(changes))
    for word in words:
        assert word in str(raised.value)


def test_the_camera_matters_to_those_who_look():
    built = build_follower("mask/akf", EnvConfig(obs="rgbd_box"))
    with pytest.raises(ValueError, match=r"another camera \(hfov_deg 57.5, here 69.0\)"):
        build_follower(
            {"policy": built, "observation": "rgbd_box"}, EnvConfig.of(obs="rgbd_box", camera={"hfov_deg": 69.0})
        )


@pytest.mark.parametrize(
    ("spec", "obs"),
    [
        ("akf", "measurement"),
        ("truth/none", "state"),
        ("mask/kf", "rgbd_box"),
        ("oracle", "state"),
        ("ppo-0", "measurement"),
    ],
)
def test_a_follower_says_what_it_needs_to_see(spec, obs):
    assert observation_settings(spec)["obs"] == obs


def test_an_agent_that_sees_asks_for_its_picture():
    assert observation_settings("ppo_pixels-0") == {"obs": "rgbd_uint8", "camera": {"width": 84, "height": 84}}


def test_the_set_point_of_the_task_is_followed():
    env = FollowEnv(engine="kinematic", sensor="ideal", task={"set_point": 1.2}, route="standing")
    record = drive(build_follower("akf", env), env)
    assert record[-1, 1] == pytest.approx(1.2, abs=0.02)


def test_a_follower_that_looks_finds_the_person_again():
    """The person is behind a robot that has seen it at the left: it turns there, and not to the right."""
    env = FollowEnv(engine="kinematic", route="standing")
    follower = build_follower({"recovery": "look"}, env)
    observation, _ = env.reset(seed=0)
    _, state = follower.predict(observation)
    state.last_bearing = 0.4
    blind = observation.copy()
    blind[:4] = (0.0, 0.0, 0.0, 1.0)
    actions = [follower.predict(blind, state)[0] for _ in range(60)]
    assert actions[-1][1] == pytest.approx(0.5 / env.config.robot.max_yaw_rate)
    assert actions[-1][0] == 0.0
    still = build_follower("akf", env)
    _, state = still.predict(observation)
    assert [still.predict(blind, state)[0] for _ in range(60)][-1][1] == pytest.approx(0.0, abs=0.05)


def test_specifications_travel_and_objects_are_not_json():
    spec = FollowerSpec(estimator={"name": "akf", "alpha": 0.01})
    assert pickle.loads(pickle.dumps(spec)) == spec
    with pytest.raises(ValueError, match="JSON cannot carry"):
        FollowerSpec(policy=Straight()).to_json()


def test_every_registered_part_says_what_it_is():
    for registry in (ESTIMATORS, CONTROLLERS, POLICIES):
        for name in registry:
            assert registry.get(name).__doc__, name


def test_a_model_of_stable_baselines3_is_a_follower(tmp_path):
    from stable_baselines3 import PPO, SAC

    for algorithm in (PPO, SAC):
        env = FollowEnv(engine="kinematic")
        model = algorithm("MlpPolicy", env, seed=1, device="cpu")
        model.save(tmp_path / "mine.zip")
        follower = build_follower(str(tmp_path / "mine.zip"), env)
        observation, _ = env.reset(seed=0)
        assert np.array_equal(follower.predict(observation)[0], model.predict(observation, deterministic=True)[0])
    (tmp_path / "no.zip").write_bytes(b"nothing")
    with pytest.raises(ValueError, match="is no model of Stable-Baselines3"):
        build_follower(str(tmp_path / "no.zip"), FollowEnv(engine="kinematic"))


@pytest.mark.parametrize("name", ["akf", "oracle"])
def test_wheels_are_driven_like_twists(name):
    """The same twist asked of either action space: the paths are one but for float32."""
    records = []
    for action in ("twist", "wheels"):
        env = FollowEnv(engine="kinematic", action=action, **observation_settings(name))
        records.append(drive(build_follower(name, env), env))
    assert records[0].shape == records[1].shape
    assert np.abs(records[0] - records[1]).max() < 1e-3


def test_an_estimator_given_as_an_object_is_not_shared_by_episodes():
    own = KalmanFilter((1e-4, 1e-4), (1e-3, 1e-3))
    env = FollowEnv(engine="kinematic")
    follower = build_follower({"estimator": own}, env)
    first, second = drive(follower, env, 40), drive(follower, env, 40)
    assert np.array_equal(first, second)
    assert own.update(None) is None


@pytest.mark.parametrize("changes", [{"control_hz": 60}, {"action": "wheels"}])
def test_an_agent_drives_only_as_it_was_trained(changes):
    with pytest.raises(ValueError, match=r"ppo-0 was trained at 30 Hz with action='twist', but .*make it with"):
        build_follower("ppo-0", EnvConfig.of(changes))


@pytest.mark.parametrize("path", ["runs/mine.zip", "./mine", "/nowhere/agent.safetensors"])
def test_a_path_that_is_not_there_is_called_so(path):
    with pytest.raises(ValueError, match=r"is no file or folder"):
        FollowerSpec.parse(path)


def test_a_depth_rule_without_calibrated_noise_asks_for_it():
    spec = {"perception": {"name": "mask", "rule": "grid_median"}}
    config = EnvConfig(obs="rgbd_box")
    with pytest.raises(ValueError, match="calibrated noise of 'mask/grid_median'"):
        build_follower(spec, config)
    noise = {"measurement": (1e-4, 1e-3), "process": (1e-4, 1e-4), "acceleration": (0.1, 0.1)}
    build_follower({**spec, "noise": noise}, config)
    with pytest.raises(ValueError, match=r"depth rule 'grid_medan'.*did you mean 'grid_median'"):
        build_follower({"perception": {"name": "mask", "rule": "grid_medan"}}, config)


def test_a_model_says_what_it_was_trained_to_see(tmp_path):
    from stable_baselines3 import PPO

    asked = {
        "rgbd_uint8": {"obs": "rgbd_uint8", "camera": {"height": 48, "width": 64}},
        "measurement": {"obs": "measurement"},
    }
    for mode, settings in asked.items():
        env = FollowEnv(engine="kinematic", obs=mode, camera={"width": 64, "height": 48})
        policy = "CnnPolicy" if mode == "rgbd_uint8" else "MlpPolicy"
        PPO(policy, env, n_steps=8, batch_size=8, device="cpu").save(tmp_path / f"{mode}.zip")
        assert observation_settings(str(tmp_path / f"{mode}.zip")) == settings
        env.close()


@pytest.mark.parametrize(
    ("mapping", "kind"),
    [
        ({"estimator": {"name": "akf", "alpha": 0.1}}, "classical"),
        ({"controller": Gentle}, "own"),
        ({"estimator": {"name": "my_lab:ekf"}}, "own"),
        ({"policy": "ppo-0", "label": "PPO"}, "learned"),
        ({"policy": {"name": "oracle", "gain": 2.0}}, "reference"),
        ({"policy": Straight(), "kind": "learned"}, "learned"),
    ],
)
def test_a_mapping_has_the_kind_of_its_parts(mapping, kind):
    assert FollowerSpec.parse(mapping).kind == kind


def test_what_a_policy_reads_is_checked_only_where_it_is_known():
    policy = Straight()
    assert build_follower(policy, EnvConfig(obs="state")) is policy
    built = build_follower("truth/akf", EnvConfig(obs="state"))
    assert observation_settings(built) == {"obs": "state"}
    assert build_follower(built, EnvConfig(obs="state")) is built
    with pytest.raises(ValueError, match="reads obs='state'"):
        build_follower(built, EnvConfig())


def test_the_folder_of_a_training_is_a_follower(tmp_path):
    shutil.copy(weights_file("ppo-0"), tmp_path)
    observation = np.array((0.1, 2.0, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0), np.float32)
    actions = [build_follower(name, EnvConfig()).predict(observation)[0] for name in (str(tmp_path), "ppo-0")]
    assert np.array_equal(*actions)
    assert observation_settings(tmp_path) == {"obs": "measurement"}
    (tmp_path / "ppo-0.safetensors").unlink()
    with pytest.raises(ValueError, match="holds no agent"):
        build_follower(tmp_path, EnvConfig())
