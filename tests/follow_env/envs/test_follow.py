"""The environments as a user meets them: Gymnasium's contract, specs, actions, options, errors."""

import itertools
import math
import os
import pickle
import warnings
from pathlib import Path

import gymnasium
import numpy as np
import pytest
from gymnasium.envs.registration import EnvSpec
from gymnasium.utils.env_checker import check_env
from stable_baselines3.common.env_checker import check_env as check_env_of_sb3

from follow_env import IDS
from follow_env.config import OBSERVATIONS

SMALL = {"width": 48, "height": 36}
EVERY = list(itertools.product(IDS.values(), OBSERVATIONS))
CORRIDOR, INDOOR = IDS["corridor"], IDS["indoor"]
STOP = np.zeros(2, np.float32)

every_environment = pytest.mark.parametrize(
    ("id_", "obs"), EVERY, ids=[f"{id_.split('/')[1]}-{obs}" for id_, obs in EVERY]
)


@every_environment
def test_gymnasiums_checker_finds_nothing(make, window, id_, obs):
    """Every render mode included; pytest turns any warning into an error."""
    check_env(make(id_, obs=obs))
    assert len(window) >= 1


@every_environment
def test_stable_baselines3s_checker_finds_nothing(make, id_, obs):
    """The metric depth is a picture of one float channel: nothing for SB3's CNNs, which `rgbd_uint8` is made for."""
    expected = {"rgbd": ["observation depth has an unconventional shape"]}
    expected["rgbd_box"] = expected["rgbd"]
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        check_env_of_sb3(make(id_, obs=obs))
    messages = [str(warning.message) for warning in caught]
    allowed = expected.get(obs, [])
    assert [m for m in messages if not any(part in m for part in allowed)] == []
    assert len(messages) == len(allowed), "an allowed warning has gone: shorten the list"


@every_environment
def test_every_observation_is_in_its_space(make, id_, obs):
    """Also while the robot whirls at its limits and loses the person, with a bad sensor and a short-sighted camera."""
    bad = {"bearing_noise": 3.0, "outlier_share": 0.3, "outlier_high": 90.0}
    env = make(id_, obs=obs, action="wheels", sensor={"measurement": bad}, camera={**SMALL, "far": 5.0})
    rng = np.random.default_rng(0)
    for seed in range(2):
        observation, info = env.reset(seed=seed)
        assert env.observation_space.contains(observation)
        for step in range(60):
            whirl = np.array((-1.0, 1.0)) * (1.0 if step % 40 < 30 else -1.0)
            observation, *_, info = env.step(np.clip(whirl + rng.normal(0.0, 0.2, 2), -1.0, 1.0))
            assert env.observation_space.contains(observation), (step, info)


@pytest.mark.parametrize("obs", OBSERVATIONS)
def test_specs_survive_pickle_and_json(make, equal, episode, obs):
    settings = {
        "obs": obs, "route": "straight", "sensor": {"measurement": {"miss_share": 0.2}}, "latency_s": 0.1,
        "camera": {"width": 40, "height": 40},
    }  # fmt: skip
    env = make(INDOOR, **settings)
    wanted = episode(env, seed=2, steps=10)
    for spec in (pickle.loads(pickle.dumps(env.spec)), EnvSpec.from_json(env.spec.to_json())):
        assert {key: spec.kwargs[key] for key in settings} == settings
        again = gymnasium.make(spec).unwrapped
        assert equal(episode(again, seed=2, steps=10), wanted)
        again.close()


@pytest.mark.parametrize("mode", ["sync", "async"])
@pytest.mark.parametrize("obs", ["measurement", "rgbd_uint8"])
def test_a_vector_of_environments_is_its_environments(make, equal, chase, mode, obs):
    """Two workers with seeds 7 and 8 against two single environments; pictures travel in the workers' shared memory."""
    vector = gymnasium.make_vec(INDOOR, num_envs=2, vectorization_mode=mode, obs=obs, camera=SMALL)
    single = [make(INDOOR, obs=obs) for _ in range(2)]
    observation, infos = vector.reset(seed=7)
    alone = [env.reset(seed=seed) for env, seed in zip(single, (7, 8), strict=True)]
    for _ in range(40):
        for i in range(2):
            assert equal(np.asarray(observation[i]), alone[i][0])
            for key in ("bearing", "distance", "visible", "robot_pose", "time"):
                assert equal(np.asarray(infos[key][i]), np.asarray(alone[i][-1][key])), key
        actions = np.stack([chase(result[-1]) for result in alone])
        observation, rewards, terminated, truncated, infos = vector.step(actions)
        alone = [env.step(action) for env, action in zip(single, actions, strict=True)]
        assert rewards.tolist() == [result[1] for result in alone]
        assert not (terminated | truncated).any()
    vector.close()


def resident():
    """Resident memory of this process, MB."""
    return int(Path("/proc/self/statm").read_text().split()[1]) * os.sysconf("SC_PAGE_SIZE") / 1e6


@pytest.mark.skipif(not Path("/proc/self/statm").exists(), reason="needs Linux's /proc")
@pytest.mark.parametrize(("obs", "resets"), [("measurement", 200), ("rgbd_box", 80)])
def test_resets_do_not_leak(make, obs, resets):
    """Less than 5 MB of growth, with another body in another outfit each time."""
    env = make(INDOOR, obs=obs)
    dressed = itertools.cycle(itertools.product(("man", "woman", "child"), ("blue", "stripes")))

    def use(times):
        for seed in range(times):
            body, outfit = next(dressed)
            env.reset(seed=seed, options={"person": body, "outfit": outfit})
            for _ in range(3):
                env.step(STOP)

    use(30)
    before = resident()
    use(resets)
    assert resident() - before < 5.0


@pytest.mark.skipif(not Path("/proc/self/statm").exists(), reason="needs Linux's /proc")
def test_environments_that_are_closed_give_everything_back():
    """More environments one after the other than PyBullet has clients at once, in numbers and in memory."""

    def use(times):
        for _ in range(times):
            env = gymnasium.make(CORRIDOR, obs="rgbd", camera=SMALL).unwrapped
            env.reset(seed=0)
            env.close()
            env.close()

    use(10)
    before = resident()
    use(30)
    assert resident() - before < 8.0


def test_both_action_spaces_drive_the_same_robot(make):
    """(v, omega) and the wheel speeds that belong to it, each as a share of its own limit."""
    twist, wheels = make(action="twist"), make(action="wheels")
    twist.reset(seed=6), wheels.reset(seed=6)
    for step in range(60):
        v, omega = 0.5, math.sin(0.1 * step)
        one = twist.step(np.array((v / 1.2, omega / 2.0)))
        two = wheels.step(np.array((v - 0.15 * omega, v + 0.15 * omega)) / 1.5)
        assert two[-1]["robot_pose"] == pytest.approx(one[-1]["robot_pose"], abs=1e-6)


def test_actions_beyond_the_limits_are_clipped(make, equal):
    """But a larger value is a warning sign, not an error: the step is that of the limit."""
    clipped, plain = make(), make()
    clipped.reset(seed=0), plain.reset(seed=0)
    for _ in range(10):
        assert equal(clipped.step(np.array((7.0, -3.0))), plain.step(np.array((1.0, -1.0))))


def test_saturation_is_reported_when_the_drive_does_not_do_as_told(make):
    """From rest full speed is out of reach of the acceleration limit; at speed it is not."""
    env = make(route="standing")
    env.reset(seed=0, options={"robot_pose": (0.0, 0.0, math.pi)})
    flags = [env.step(np.array((0.6, 0.0)))[-1] for _ in range(30)]
    assert flags[0]["saturated"]
    assert flags[0]["command"] == pytest.approx((2.0 / 30.0, 0.0))
    assert not flags[-1]["saturated"]
    assert flags[-1]["command"] == pytest.approx((0.72, 0.0))
    *_, info = env.step(np.array((1.0, 1.0)))
    assert info["saturated"]


@pytest.mark.parametrize(
    ("action", "word"),
    [
        ((math.nan, 0.0), "nan"),
        ((0.0, math.inf), "inf"),
        ((0.5,), "(1,)"),
        ((0.5, 0.0, 0.0), "(3,)"),
        (((0.5, 0.0),), "(1, 2)"),
        (0.5, "()"),
    ],
)
def test_a_bad_action_is_one_clear_error_and_changes_nothing(make, equal, action, word):
    env, twin = make(), make()
    env.reset(seed=0), twin.reset(seed=0)
    with pytest.raises(ValueError, match="expected") as raised:
        env.step(np.array(action))
    assert word in str(raised.value)
    assert "\n" not in str(raised.value)
    assert equal(env.step(np.array((0.3, 0.1))), twin.step(np.array((0.3, 0.1))))


@pytest.mark.parametrize("use", ["step", "render", "frame"])
def test_using_an_environment_before_its_reset_is_a_clear_error(make, use):
    env = make(render_mode="rgb_array")
    calls = {"step": lambda: env.step(STOP), "render": env.render, "frame": env.frame}
    with pytest.raises(gymnasium.error.ResetNeeded, match=r"reset\(\)"):
        calls[use]()
    env.reset(seed=0)
    calls[use]()
    env.close()
    with pytest.raises(gymnasium.error.ResetNeeded, match=r"reset\(\)"):
        calls[use]()


@pytest.mark.parametrize("obs", OBSERVATIONS)
def test_closing_twice_or_unused_does_nothing(make, obs):
    env = make(obs=obs)
    env.close()
    env.reset(seed=0)
    env.close()
    env.close()


def test_gymnasiums_wrappers_and_the_time_of_an_episode_agree():
    """Through `gymnasium.make` as everybody uses it, with its order enforcement and passive checker."""
    env = gymnasium.make(CORRIDOR, route="standing")
    with pytest.raises(gymnasium.error.ResetNeeded):
        env.step(STOP)
    env.reset(seed=0)
    for _ in range(420):
        _, _, terminated, truncated, _ = env.step(STOP)
        assert not terminated
    assert truncated
    env.close()


def test_a_route_can_be_chosen_for_one_episode(make, episode):
    env = make(route="paper")
    walked = {}
    for name in ("standing", "straight", "paper"):
        options = None if name == "paper" else {"route": name}
        track = np.array([row[-1]["person_pose"] for row in episode(env, 1, options)])
        walked[name] = track[-1] - track[0]
    assert walked["standing"] == pytest.approx((0.0, 0.0, 0.0))
    assert walked["straight"] == pytest.approx((12.0, 0.0, 0.0), abs=1e-6)
    assert np.abs(track[:, 2]).max() > math.radians(19.0)


@pytest.mark.parametrize("route", ["paper", "straight"])
def test_a_route_that_is_too_long_for_the_scene_is_one_clear_error(make, route):
    message = r"scene 'cabin'; .*take route='standing'"
    with pytest.raises(ValueError, match=message):
        make(scene="cabin", route=route)
    env = make(scene="cabin", route="standing")
    env.reset(seed=0)
    with pytest.raises(ValueError, match=message):
        env.reset(options={"route": route})


def test_the_robot_can_be_placed(make):
    env = make(INDOOR)
    for pose in ((0.0, 0.0, 0.0), (1.0, -0.5, 2.0), (-2.0, 0.7, -3.0)):
        _, info = env.reset(seed=0, options={"robot_pose": pose})
        assert info["robot_pose"] == pytest.approx(pose, abs=1e-6)
        *_, info = env.step(STOP)
        assert info["robot_pose"] == pytest.approx(pose, abs=1e-3)


def test_the_placement_of_the_robot_does_not_change_the_walk(make, equal, episode):
    env = make()
    free = [row[-1]["person_pose"] for row in episode(env, 1, None, lambda info: STOP, 50)]
    placed = [row[-1]["person_pose"] for row in episode(env, 1, {"robot_pose": (0.0, 0.0, 0.0)}, lambda info: STOP, 50)]
    assert equal(free, placed)


def test_a_sensor_can_be_chosen_for_one_episode(make, equal):
    env = make()
    usual, _ = env.reset(seed=2)
    exact, info = env.reset(seed=2, options={"sensor": "ideal"})
    assert exact[:2] == pytest.approx((info["bearing"], info["distance"]), abs=1e-6)
    blind, _ = env.reset(seed=2, options={"sensor": {"measurement": {"miss_share": 0.999999}}})
    assert blind[:3].tolist() == [0.0, 0.0, 0.0]
    again, _ = env.reset(seed=2)
    assert equal(again, usual)
    assert abs(usual[1] - info["distance"]) > 0.05


def test_a_walking_speed_can_be_chosen_for_one_episode(make):
    """The speed of the person is that in the middle of the walk, then the setting's again; the path is the same."""
    env, ends = make(obs="state", walking_speed=0.5), []
    for speed, wanted in ((1.1, 1.1), (None, 0.5)):
        env.reset(seed=2, options={"walking_speed": speed} if speed else None)
        truncated, speeds = False, []
        while not truncated:
            *_, truncated, info = env.step(np.zeros(2))
            speeds.append(math.hypot(*info["person_velocity"]))
        assert speeds[len(speeds) // 2] == pytest.approx(wanted)
        ends.append(info["person_pose"])
    assert ends[0] == pytest.approx(ends[1], abs=1e-3)


def test_an_outfit_can_be_chosen_for_one_episode(make):
    env = make(obs="rgbd", outfit="blue", route="standing")
    dressed = {}
    for outfit in ("green", "orange", None):
        observation, _ = env.reset(seed=2, options={"outfit": outfit} if outfit else None)
        mask = env.frame().ids == 1
        dressed[outfit] = observation["rgb"][mask].mean(axis=0)
    assert dressed["orange"][0] > dressed[None][0] + 20.0
    assert dressed[None][2] > dressed["orange"][2] + 20.0
    assert dressed["green"][1] > dressed["green"][2]


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"rout": "paper"}, ("'rout'", "did you mean 'route'")),
        ({"route": "papr"}, ("'papr'", "did you mean 'paper'")),
        ({"person": "wman"}, ("'wman'", "did you mean 'woman'")),
        ({"outfit": "bleu"}, ("'bleu'", "did you mean 'blue'")),
        ({"sensor": {"measurement": {"mis_share": 0.5}}}, ("'mis_share'", "did you mean 'miss_share'")),
        ({"walking_speed": 3.0}, ("3.0", ">= 0.2 and <= 2 (m/s)")),
        ({"robot_pose": (1.0, 2.0)}, ("(1.0, 2.0)", "three finite numbers")),
        ({"robot_pose": (1.0, 2.0, math.nan)}, ("nan", "three finite numbers")),
        ({"robot_pose": 3}, ("3", "three finite numbers")),
        ({"robot_pose": "abc"}, ("'abc'", "three finite numbers")),
    ],
    ids=str,
)
def test_a_bad_option_is_one_clear_error(make, options, words):
    env = make()
    with pytest.raises((ValueError, TypeError)) as raised:
        env.reset(seed=0, options=options)
    for word in words:
        assert word in str(raised.value)
