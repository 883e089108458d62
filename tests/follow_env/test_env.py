"""The environments as a user meets them: Gymnasium's contract, determinism, ends, rewards, errors."""

import itertools
import math
import os
import pickle
import sys
import types
import warnings
from pathlib import Path

import gymnasium
import numpy as np
import pytest
from gymnasium.envs.registration import EnvSpec
from gymnasium.utils.env_checker import check_env
from stable_baselines3.common.env_checker import check_env as check_env_of_sb3

from follow_env import IDS
from follow_env.env import OBSERVATIONS

SMALL = {"width": 48, "height": 36}
PIXELS = tuple(obs for obs in OBSERVATIONS if obs.startswith("rgbd"))
EVERY = list(itertools.product(IDS.values(), OBSERVATIONS))
CORRIDOR, INDOOR = IDS["corridor"], IDS["indoor"]
INFO_KEYS = {
    "time", "bearing", "distance", "visible", "collision", "collision_with", "surface_distance", "robot_pose",
    "person_pose", "person_velocity", "twist", "command", "saturated", "rewards", "is_success",
}  # fmt: skip
STOP = np.zeros(2, np.float32)

every_environment = pytest.mark.parametrize(
    ("id_", "obs"), EVERY, ids=[f"{id_.split('/')[1]}-{obs}" for id_, obs in EVERY]
)


@pytest.fixture
def make():
    """Make environments without wrappers and with a small camera, closed when the test ends."""
    made = []

    def one(id_=CORRIDOR, **settings):
        env = gymnasium.make(id_, **{"camera": SMALL, **settings}).unwrapped
        made.append(env)
        return env

    yield one
    for env in made:
        env.close()


def equal(one, two):
    """Whether two nested values agree in structure, type, shape and every bit."""
    if type(one) is not type(two):
        return False
    if isinstance(one, dict):
        return one.keys() == two.keys() and all(equal(one[key], two[key]) for key in one)
    if isinstance(one, list | tuple):
        return len(one) == len(two) and all(equal(a, b) for a, b in zip(one, two, strict=True))
    if isinstance(one, np.ndarray):
        return one.dtype == two.dtype and one.shape == two.shape and one.tobytes() == two.tobytes()
    return one == two


def chase(info, noise=(0.0, 0.0)):
    """An action that follows the person by the truth in `info`, disturbed by `noise`."""
    forward = 1.0 * (info["distance"] - 1.5) + info["person_velocity"] @ np.array(
        [math.cos(info["robot_pose"][2]), math.sin(info["robot_pose"][2])]
    )
    return np.clip(np.array((forward / 1.2, 1.5 * info["bearing"] / 2.0)) + noise, -1.0, 1.0).astype(np.float32)


def episode(env, seed=None, options=None, policy=chase, steps=10**6):
    """Everything that the environment returned in one episode, reset first."""
    observation, info = env.reset(seed=seed, options=options)
    record = [(observation, info)]
    for _ in range(steps):
        record.append(env.step(policy(info)))
        *_, terminated, truncated, info = record[-1]
        if terminated or truncated:
            break
    return record


def parked(info):
    return STOP


def forward(info):
    return np.array((0.6, 0.0), np.float32)


# Gymnasium's and Stable-Baselines3's checks


@pytest.fixture
def window(monkeypatch):
    """A stand-in for pygame (not a dependency) that keeps what would be shown."""
    shown = []
    surface = types.SimpleNamespace(blit=lambda picture, place: shown.append(picture))
    pygame = types.SimpleNamespace(
        display=types.SimpleNamespace(
            init=lambda: None, get_surface=lambda: surface, set_mode=lambda size: surface, flip=lambda: None
        ),
        surfarray=types.SimpleNamespace(make_surface=np.copy),
        event=types.SimpleNamespace(pump=lambda: None),
        time=types.SimpleNamespace(Clock=lambda: types.SimpleNamespace(tick=lambda rate: None)),
    )
    monkeypatch.setitem(sys.modules, "pygame", pygame)
    return shown


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


# One seed, one episode


@every_environment
def test_twin_environments_agree_in_every_bit(make, id_, obs):
    """300 steps, across the ends of episodes: observation, reward, ends and the whole info."""
    twins = [make(id_, obs=obs, camera={"width": 32, "height": 24}) for _ in range(2)]
    one, two = (env.reset(seed=7) for env in twins)
    assert equal(one, two)
    rng, resets = np.random.default_rng(1), 0
    for step in range(300):
        action = chase(one[-1], rng.normal(0.0, 0.5, 2))
        if step == 180:
            action = np.array((1.0, 0.0), np.float32)
        one, two = (env.step(action) for env in twins)
        assert equal(one, two), step
        if one[2] or one[3] or step == 220:
            one, two = (env.reset() for env in twins)
            assert equal(one, two), step
            resets += 1
    assert resets >= 1


def test_different_seeds_give_different_episodes(make):
    env = make()
    starts = [tuple(episode(env, seed, steps=90)[-1][-1]["person_pose"]) for seed in range(20)]
    assert len(set(starts)) == 20


@pytest.mark.parametrize("obs", ["measurement", "rgbd_box"])
def test_an_episode_does_not_depend_on_what_was_played_before(make, obs):
    """The same seed after nothing, other routes, clothes and sensors, a crash, a part of an episode, and `close`."""
    length = 420 if obs == "measurement" else 60
    wanted = episode(make(INDOOR, obs=obs), seed=5, steps=length)
    env = make(INDOOR, obs=obs)

    def crash():
        record = episode(env, 1, {"route": "standing"}, forward)
        assert record[-1][-1]["collision_with"] == "person"

    histories = {
        "another seed": lambda: episode(env, seed=6, steps=length),
        "another route": lambda: episode(env, 2, {"route": "straight"}, steps=50),
        "other options": lambda: episode(
            env, 3, {"person": "orange", "sensor": "ideal", "robot_pose": (1.0, 0.5, 1.0)}, steps=20
        ),
        "a crash": crash,
        "half an episode": lambda: episode(env, seed=5, steps=33),
        "nothing but resets": lambda: [env.reset(seed=seed) for seed in range(10)],
        "a refused action": lambda: pytest.raises(ValueError, env.step, np.array((math.nan, 0.0))),
        "a refused option": lambda: pytest.raises(ValueError, env.reset, options={"route": "nowhere"}),
        "close": env.close,
    }
    for name, play in histories.items():
        play()
        assert equal(episode(env, seed=5, steps=length), wanted), name


def test_without_a_seed_episodes_follow_from_the_first(make):
    """Gymnasium's rule: `reset()` goes on with the generator, so a row of episodes follows from one seed."""
    one, two = make(), make()
    rows = [[episode(env, seed, steps=40) for seed in (3, None, None)] for env in (one, two)]
    assert equal(*rows)
    assert not equal(rows[0][1], rows[0][2])


def test_returned_values_are_the_callers_own(make):
    """Later steps change nothing that was returned, and a caller's scribbling changes no later step."""
    for obs in OBSERVATIONS:
        env, twin = make(obs=obs), make(obs=obs)
        env.reset(seed=1), twin.reset(seed=1)
        for _ in range(5):
            mine, other = env.step(np.array((0.5, 0.1))), twin.step(np.array((0.5, 0.1)))
            assert equal(mine, other)
            for part in (mine[0] if isinstance(mine[0], dict) else {"": mine[0]}).values():
                part.fill(0)
            for value in mine[-1].values():
                if isinstance(value, np.ndarray):
                    value.fill(0)
            mine[-1]["rewards"].clear()


def test_looking_does_not_disturb(make):
    """The same episode with every render mode, and with `frame` called or not."""
    wanted = episode(make(obs="rgbd_box"), seed=4, steps=8)
    for mode in ("rgb_array", "rgbd_tuple"):
        env = make(obs="rgbd_box", render_mode=mode)

        def look(info, env=env):
            env.render()
            env.frame()
            return chase(info)

        assert equal(episode(env, seed=4, policy=look, steps=8), wanted), mode


# Specs, copies, vectors


@pytest.mark.parametrize("obs", OBSERVATIONS)
def test_specs_survive_pickle_and_json(make, obs):
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
def test_a_vector_of_environments_is_its_environments(make, mode, obs):
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
    """Less than 5 MB of growth, clothes changed each time (which makes the renderer anew) once there are pixels."""
    env = make(INDOOR, obs=obs)
    clothes = itertools.cycle(("blue", "green", "orange"))

    def use(times):
        for seed in range(times):
            env.reset(seed=seed, options={"person": next(clothes)})
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


# The contract of info, reward and ends


@every_environment
def test_info_has_the_same_keys_and_types_always(make, id_, obs):
    wanted = INFO_KEYS | ({"depth"} if obs == "rgbd_uint8" else set())
    env = make(id_, obs=obs, route="standing")
    record = episode(env, seed=0, policy=forward)
    assert record[-1][-1]["collision"]
    kinds = {key: type(value) for key, value in record[0][-1].items()}
    for *_, info in record:
        assert info.keys() == wanted
        assert {key: type(value) for key, value in info.items()} == kinds
    info = record[0][-1]
    shapes = {key: info[key].shape for key in ("robot_pose", "person_pose", "person_velocity", "twist", "command")}
    assert shapes == {
        "robot_pose": (3,), "person_pose": (3,), "person_velocity": (2,), "twist": (2,), "command": (2,)
    }  # fmt: skip
    for key in ("visible", "collision", "saturated", "is_success"):
        assert kinds[key] is bool
    for key in ("time", "bearing", "distance", "surface_distance"):
        assert kinds[key] is float


@pytest.mark.parametrize("id_", IDS.values())
def test_the_truth_in_info_is_consistent(make, id_):
    """Bearing and distance from the two poses; velocity and odometry against how the poses change."""
    env = make(id_)
    record = [row[-1] for row in episode(env, seed=3)]
    assert len(record) == 421
    for info in record:
        x, y, yaw = info["robot_pose"]
        away = complex(*info["person_pose"][:2]) - complex(x, y)
        seen = away * complex(math.cos(yaw), -math.sin(yaw))
        assert info["distance"] == pytest.approx(seen.real)
        assert info["bearing"] == pytest.approx(math.atan2(seen.imag, seen.real))
        assert info["surface_distance"] == pytest.approx(max(abs(away) - 0.25 - 0.25, 0.0))
    times = np.array([info["time"] for info in record])
    assert times == pytest.approx(np.arange(421) / 30.0)
    person = np.array([info["person_pose"] for info in record])
    velocity = np.array([info["person_velocity"] for info in record])
    assert (person[2:, :2] - person[:-2, :2]) / (2.0 / 30.0) == pytest.approx(velocity[1:-1], abs=0.01)
    robot, twist = (np.array([info[key] for info in record]) for key in ("robot_pose", "twist"))
    moved = np.diff(robot, axis=0)
    assert moved[:, 2] * 30.0 == pytest.approx(twist[1:, 1], abs=0.02)
    middle = 0.5 * (robot[1:, 2] + robot[:-1, 2])
    along = moved[:, 0] * np.cos(middle) + moved[:, 1] * np.sin(middle)
    assert along * 30.0 == pytest.approx(twist[1:, 0], abs=0.01)


def test_the_state_observation_is_the_truth(make):
    env = make(INDOOR, obs="state")
    observation, info = env.reset(seed=5)
    last = (0.0, 0.0)
    for _ in range(200):
        yaw = info["robot_pose"][2]
        relative = complex(*info["person_velocity"]) * complex(math.cos(yaw), -math.sin(yaw))
        wanted = (info["bearing"], info["distance"], relative.real, relative.imag, *info["twist"], *last)
        assert observation == pytest.approx(np.array(wanted), abs=1e-6)
        last = chase(info)
        observation, *_, info = env.step(last)


@pytest.mark.parametrize("id_", IDS.values())
def test_a_robot_that_knows_the_truth_follows_all_the_way(make, id_):
    """Ends by the route's end after 14 s and is a success; so the task can be done, in several routes."""
    env = make(id_)
    for seed in range(8):
        record = episode(env, seed)
        _, _, terminated, truncated, info = record[-1]
        assert (terminated, truncated) == (False, True), seed
        assert info["time"] == pytest.approx(14.0)
        assert info["is_success"], seed


@pytest.mark.parametrize("rate", [10, 30, 60])
def test_the_routes_end_truncates_after_14_seconds_at_every_rate(make, rate):
    record = episode(make(route="standing", control_hz=rate), 0, policy=parked)
    assert len(record) == 14 * rate + 1
    assert [row[2:4] for row in record[1:-1]] == [(False, False)] * (14 * rate - 1)
    assert record[-1][2:4] == (False, True)
    assert record[-1][-1]["is_success"]


def test_driving_into_the_person_ends_the_episode(make):
    record = episode(make(route="standing"), 0, policy=forward)
    _, reward, terminated, truncated, info = record[-1]
    assert (terminated, truncated) == (True, False)
    assert info["collision"]
    assert info["collision_with"] == "person"
    assert info["surface_distance"] == 0.0
    assert info["rewards"]["collision"] == -1.0
    assert reward < 0.0
    assert not info["is_success"]
    assert not any(row[-1]["collision"] for row in record[:-1])


@pytest.mark.parametrize("id_", IDS.values())
def test_driving_into_a_wall_ends_the_episode(make, id_):
    env = make(id_, route="standing")
    record = episode(env, 0, {"robot_pose": (-1.0, env.scene.bounds[3] - 1.2, math.pi / 2)}, forward)
    *_, terminated, _, info = record[-1]
    assert terminated
    assert info["collision_with"] == "wall"
    assert env.scene.bounds[3] - info["robot_pose"][1] == pytest.approx(0.10, abs=0.03), "the chassis ends 10 cm ahead"


@pytest.mark.parametrize("rate", [10, 30, 60])
def test_a_person_out_of_view_ends_the_episode_after_five_seconds(make, rate):
    env = make(route="standing", control_hz=rate)
    x, y, yaw = env.reset(seed=0)[1]["robot_pose"]
    record = episode(env, 0, {"robot_pose": (x, y, yaw + math.pi)}, parked)
    *_, terminated, truncated, info = record[-1]
    assert (terminated, truncated) == (True, False)
    assert info["time"] == pytest.approx(5.0, abs=1.01 / rate)
    assert not info["collision"]
    assert not info["is_success"]
    assert not any(row[-1]["visible"] for row in record)


def test_a_person_seen_again_within_five_seconds_is_not_lost(make):
    """One whole turn takes 3.1 s, of which the person is out of view for 2.6 s."""
    record = episode(make(route="standing"), 0, policy=lambda info: np.array((0.0, 1.0), np.float32))
    visible = np.array([row[-1]["visible"] for row in record])
    assert record[-1][2:4] == (False, True)
    assert 0.1 < visible.mean() < 0.3
    assert not record[-1][-1]["is_success"], "out of view for longer than a second"


def test_a_parked_robot_never_succeeds_with_a_walker(make):
    env = make(INDOOR)
    for seed in range(5):
        assert not episode(env, seed, policy=parked)[-1][-1]["is_success"]


def success(infos, dt):
    """The benchmark's ungameable success, from the recorded truth."""
    longest = current = 0
    for info in infos:
        current = 0 if info["visible"] else current + 1
        longest = max(longest, current)
    inside = [1.0 <= i["distance"] <= 2.0 and abs(i["bearing"]) <= math.radians(30.0) for i in infos]
    return not any(i["collision"] for i in infos) and longest * dt <= 1.0 and np.mean(inside) >= 0.8


def test_success_means_what_the_benchmark_says(make):
    """Over drivers from good to bad; some succeed and some do not."""
    env = make(INDOOR)
    outcomes = []
    for seed, lag in itertools.product(range(4), (0.0, 0.15, 0.3, 0.45, 0.6)):
        record = [row[-1] for row in episode(env, seed, policy=lambda info, lag=lag: chase(info, (-lag, 0.0)))]
        assert record[-1]["is_success"] == success(record, env.dt), (seed, lag)
        outcomes.append(record[-1]["is_success"])
    assert 2 <= sum(outcomes) <= 18


@every_environment
def test_the_reward_is_the_sum_of_its_bounded_terms(make, id_, obs):
    env = make(id_, obs=obs, route="standing")
    bounds = {"distance": (0.0, 0.4), "bearing": (0.0, 0.4), "visible": (0.0, 0.1), "smoothness": (0.0, 0.1)}
    bounds["collision"] = (-1.0, 0.0)
    rng = np.random.default_rng(2)
    _, info = env.reset(seed=0)
    assert info["rewards"].keys() == bounds.keys()
    for _ in range(60):
        _, reward, terminated, _, info = env.step(rng.uniform(-1.0, 1.0, 2) + (0.4, 0.0))
        assert type(reward) is float
        assert reward == pytest.approx(sum(info["rewards"].values()), abs=1e-12)
        assert info["rewards"].keys() == bounds.keys()
        for name, (low, high) in bounds.items():
            assert low <= info["rewards"][name] <= high, name
        assert -1.0 <= reward <= 1.0
        if terminated:
            break


def test_the_reward_prefers_the_set_point(make):
    """Standing at 1.5 m straight behind the person earns the maximum; a shift in any direction earns less."""
    env = make(route="standing")
    _, info = env.reset(seed=0)
    x, y, _ = info["person_pose"]
    earned = {}
    for name, (ahead, left, turn) in {
        "best": (1.5, 0.0, 0.0), "near": (1.2, 0.0, 0.0), "far": (1.8, 0.0, 0.0), "left": (1.5, 0.2, 0.0),
        "turned": (1.5, 0.0, 0.2), "away": (1.5, 0.0, 2.0),
    }.items():  # fmt: skip
        env.reset(seed=0, options={"robot_pose": (x - ahead, y + left, turn)})
        earned[name] = env.step(STOP)[1]
    assert earned["best"] == pytest.approx(1.0, abs=1e-3)
    assert max(earned, key=earned.get) == "best"
    assert min(earned, key=earned.get) == "away"


def test_jerky_actions_cost_smoothness(make):
    env = make(route="standing")
    env.reset(seed=0)
    assert env.step(np.array((0.0, 1.0)))[-1]["rewards"]["smoothness"] == pytest.approx(0.05)
    assert env.step(np.array((0.0, 1.0)))[-1]["rewards"]["smoothness"] == pytest.approx(0.1)
    assert env.step(np.array((0.0, -1.0)))[-1]["rewards"]["smoothness"] == pytest.approx(0.0)


# Actions


def test_both_action_spaces_drive_the_same_robot(make):
    """(v, omega) and the wheel speeds that belong to it, each as a share of its own limit."""
    twist, wheels = make(action="twist"), make(action="wheels")
    twist.reset(seed=6), wheels.reset(seed=6)
    for step in range(60):
        v, omega = 0.5, math.sin(0.1 * step)
        one = twist.step(np.array((v / 1.2, omega / 2.0)))
        two = wheels.step(np.array((v - 0.15 * omega, v + 0.15 * omega)) / 1.5)
        assert two[-1]["robot_pose"] == pytest.approx(one[-1]["robot_pose"], abs=1e-6)


def test_actions_beyond_the_limits_are_clipped(make):
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
def test_a_bad_action_is_one_clear_error_and_changes_nothing(make, action, word):
    env, twin = make(), make()
    env.reset(seed=0), twin.reset(seed=0)
    with pytest.raises(ValueError, match="expected") as raised:
        env.step(np.array(action))
    assert word in str(raised.value)
    assert "\n" not in str(raised.value)
    assert equal(env.step(np.array((0.3, 0.1))), twin.step(np.array((0.3, 0.1))))


# Life cycle


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


# Options of reset


def test_a_route_can_be_chosen_for_one_episode(make):
    env = make(route="paper")
    walked = {}
    for name in ("standing", "straight", "paper"):
        options = None if name == "paper" else {"route": name}
        track = np.array([row[-1]["person_pose"] for row in episode(env, 1, options)])
        walked[name] = track[-1] - track[0]
    assert walked["standing"] == pytest.approx((0.0, 0.0, 0.0))
    assert walked["straight"] == pytest.approx((12.0, 0.0, 0.0), abs=1e-6)
    assert np.abs(track[:, 2]).max() > math.radians(19.0)


def test_the_robot_can_be_placed(make):
    env = make(INDOOR)
    for pose in ((0.0, 0.0, 0.0), (1.0, -0.5, 2.0), (-2.0, 0.7, -3.0)):
        _, info = env.reset(seed=0, options={"robot_pose": pose})
        assert info["robot_pose"] == pytest.approx(pose, abs=1e-6)
        *_, info = env.step(STOP)
        assert info["robot_pose"] == pytest.approx(pose, abs=1e-3)


def test_the_placement_of_the_robot_does_not_change_the_walk(make):
    env = make()
    free = [row[-1]["person_pose"] for row in episode(env, 1, None, parked, 50)]
    placed = [row[-1]["person_pose"] for row in episode(env, 1, {"robot_pose": (0.0, 0.0, 0.0)}, parked, 50)]
    assert equal(free, placed)


def test_a_sensor_can_be_chosen_for_one_episode(make):
    env = make()
    usual, _ = env.reset(seed=2)
    exact, info = env.reset(seed=2, options={"sensor": "ideal"})
    assert exact[:2] == pytest.approx((info["bearing"], info["distance"]), abs=1e-6)
    blind, _ = env.reset(seed=2, options={"sensor": {"measurement": {"miss_share": 0.999999}}})
    assert blind[:3].tolist() == [0.0, 0.0, 0.0]
    again, _ = env.reset(seed=2)
    assert equal(again, usual)
    assert abs(usual[1] - info["distance"]) > 0.05


def test_clothes_can_be_chosen_for_one_episode(make):
    env = make(obs="rgbd", person="blue", route="standing")
    dressed = {}
    for clothes in ("green", "orange", None):
        observation, _ = env.reset(seed=2, options={"person": clothes} if clothes else None)
        mask = env.frame().ids == 1
        dressed[clothes] = observation["rgb"][mask].mean(axis=0)
    assert dressed["orange"][0] > dressed[None][0] + 20.0
    assert dressed[None][2] > dressed["orange"][2] + 20.0
    assert dressed["green"][1] > dressed["green"][2]


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"rout": "paper"}, ("'rout'", "did you mean 'route'")),
        ({"route": "papr"}, ("'papr'", "did you mean 'paper'")),
        ({"person": "bleu"}, ("'bleu'", "did you mean 'blue'")),
        ({"sensor": {"measurement": {"mis_share": 0.5}}}, ("'mis_share'", "did you mean 'miss_share'")),
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


# Latency


@pytest.mark.parametrize("obs", ["measurement", "rgbd_box", "rgbd_uint8"])
@pytest.mark.parametrize("steps", [1, 4])
def test_latency_delays_what_is_seen_by_exactly_so_many_steps(make, obs, steps):
    """Against a twin without latency that drives the same way; odometry and the last action are not delayed."""
    latency = steps / 30.0
    now, late = make(INDOOR, obs=obs), make(INDOOR, obs=obs, latency_s=latency)
    one, two = episode(now, 3, steps=25), episode(late, 3, steps=25)
    for k, (delayed, prompt) in enumerate(zip(two, one, strict=True)):
        past = one[max(k - steps, 0)][0]
        seen, current = delayed[0], prompt[0]
        if obs == "measurement":
            assert equal(seen[:3], past[:3]), k
            assert equal(seen[4:], current[4:]), k
        elif obs == "rgbd_uint8":
            assert equal(seen, past), k
            assert equal(delayed[-1]["depth"], one[max(k - steps, 0)][-1]["depth"]), k
        else:
            assert equal({**seen, "twist": None}, {**past, "twist": None}), k
            assert equal(seen["twist"], current["twist"]), k
        assert equal({**delayed[-1], "depth": None}, {**prompt[-1], "depth": None}), "the truth is never delayed"


def test_the_age_of_a_measurement_is_the_time_since_it_was_taken(make):
    """With latency and misses: a valid one is as old as the latency, or as the episode when that is younger."""
    latency = 0.1
    env = make(latency_s=latency, sensor={"measurement": {"miss_share": 0.5}}, route="standing")
    twin = make(sensor={"measurement": {"miss_share": 0.5}}, route="standing")
    for seed in range(4):
        late, prompt = (episode(e, seed, policy=parked, steps=60) for e in (env, twin))
        taken = None
        for k, (delayed, _) in enumerate(zip(late, prompt, strict=True)):
            source = max(k - 3, 0)
            if prompt[source][0][2]:
                taken = source
                assert delayed[0][2] == 1.0
            if taken is not None:
                assert delayed[0][3] == pytest.approx((k - taken) / 30.0, abs=1e-6), (seed, k)


# Rendering


def test_rgb_array_is_a_dashboard_that_changes(make):
    env = make(INDOOR, render_mode="rgb_array")
    _, info = env.reset(seed=0)
    pictures = []
    for _ in range(3):
        pictures.append(env.render())
        for _ in range(10):
            *_, info = env.step(chase(info))
    for picture in pictures:
        assert picture.dtype == np.uint8
        assert picture.shape == (720, 960, 3)
        assert picture.std() > 20.0
    assert (pictures[0] != pictures[1]).any()
    assert (pictures[1] != pictures[2]).any()


def test_rgbd_tuple_is_what_the_robot_sees(make):
    env = make(obs="rgbd", sensor="ideal", render_mode="rgbd_tuple")
    observation, _ = env.reset(seed=0)
    for _ in range(3):
        rgb, depth = env.render()
        assert equal(rgb, observation["rgb"])
        assert equal(depth, observation["depth"])
        observation, *_ = env.step(np.array((0.5, 0.2)))


def test_rgbd_uint8_is_the_same_picture_in_bytes(make):
    """Nearer is brighter, 255 (1 - z / 8 m); no reading and beyond 8 m are 0; info keeps the metric depth."""
    whole, packed = make(obs="rgbd"), make(obs="rgbd_uint8")
    (one, _), (two, info) = whole.reset(seed=1), packed.reset(seed=1)
    assert equal(np.ascontiguousarray(two[:, :, :3]), one["rgb"])
    assert equal(info["depth"], one["depth"])
    depth = one["depth"].astype(float)
    wanted = np.where((depth > 0.0) & (depth < 8.0), 255.0 * (1.0 - depth / 8.0), 0.0)
    assert np.abs(two[:, :, 3] - wanted).max() <= 1.0
    assert (depth == 0.0).any()


def test_human_without_pygame_says_what_is_missing(monkeypatch):
    monkeypatch.setitem(sys.modules, "pygame", None)
    with pytest.raises((ValueError, ImportError, gymnasium.error.DependencyNotInstalled)) as raised:
        gymnasium.make(CORRIDOR, render_mode="human")
    message = str(raised.value)
    assert "\n" not in message
    for word in ("'human'", "pygame", "pip install", "'rgb_array'"):
        assert word in message


def test_human_shows_every_step(make, window):
    env = make(render_mode="human")
    env.reset(seed=0)
    for _ in range(4):
        env.step(np.array((0.5, 0.0)))
    assert len(window) == 5
    assert all(picture.shape == (960, 720, 3) for picture in window)


# Sensors on pictures


def test_the_box_is_the_persons_box_with_the_stated_jitter(make):
    """Around the tight box of the mask; centre and size err by their shares of width and height."""
    env = make(INDOOR, obs="rgbd_box", route="standing", sensor={"box": {"correlation_s": 0.0}})
    observation, info = env.reset(seed=0, options={"robot_pose": (-2.5, 0.0, 0.0)})
    tight = np.array(env.frame().person_box())
    size = tight[2:] - tight[:2]
    errors = []
    for _ in range(400):
        box = observation["box"].astype(float)
        errors.append(((box[:2] + box[2:] - tight[:2] - tight[2:]) / 2 / size, (box[2:] - box[:2]) / size - 1.0))
        observation, *_, info = env.step(STOP)
    assert np.array(env.frame().person_box()) == pytest.approx(tight, abs=1.0)
    errors = np.array(errors).reshape(-1, 4)
    assert errors.std(axis=0) == pytest.approx((0.03, 0.03, 0.04, 0.04), rel=0.15)
    assert errors.mean(axis=0) == pytest.approx((0.0,) * 4, abs=0.01)


def test_without_a_person_in_view_the_box_is_zero(make):
    env = make(obs="rgbd_box", route="standing")
    observation, _ = env.reset(seed=0, options={"robot_pose": (0.0, 0.0, math.pi)})
    assert observation["box"].tolist() == [0.0] * 4
