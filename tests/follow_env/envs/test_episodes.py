"""Episodes: one seed gives one, what `info` and the reward say of it, and how it ends."""

import itertools
import math

import numpy as np
import pytest

from follow_env import IDS
from follow_env.config import OBSERVATIONS

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


def parked(info):
    return STOP


def forward(info):
    return np.array((0.6, 0.0), np.float32)


@every_environment
def test_twin_environments_agree_in_every_bit(make, equal, chase, id_, obs):
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


def test_different_seeds_give_different_episodes(make, episode):
    env = make()
    starts = [tuple(episode(env, seed, steps=90)[-1][-1]["person_pose"]) for seed in range(20)]
    assert len(set(starts)) == 20


@pytest.mark.parametrize("obs", ["measurement", "rgbd_box"])
def test_an_episode_does_not_depend_on_what_was_played_before(make, equal, episode, obs):
    """The same seed after nothing, other routes, people and sensors, a crash, a part of an episode, and `close`."""
    length = 420 if obs == "measurement" else 60
    wanted = episode(make(INDOOR, obs=obs), seed=5, steps=length)
    env = make(INDOOR, obs=obs)

    def crash():
        record = episode(env, 1, {"route": "standing"}, forward)
        assert record[-1][-1]["collision_with"] == "person"

    def refused(call, *arguments, **keywords):
        with pytest.raises(ValueError, match="expected"):
            call(*arguments, **keywords)

    histories = {
        "another seed": lambda: episode(env, seed=6, steps=length),
        "another route": lambda: episode(env, 2, {"route": "straight"}, steps=50),
        "other options": lambda: episode(
            env, 3, {"person": "woman", "outfit": "orange", "sensor": "ideal", "robot_pose": (1.0, 0.5, 1.0)}, steps=20
        ),
        "a crash": crash,
        "half an episode": lambda: episode(env, seed=5, steps=33),
        "nothing but resets": lambda: [env.reset(seed=seed) for seed in range(10)],
        "a refused action": lambda: refused(env.step, np.array((math.nan, 0.0))),
        "a refused option": lambda: refused(env.reset, options={"route": "nowhere"}),
        "close": env.close,
    }
    for name, play in histories.items():
        play()
        assert equal(episode(env, seed=5, steps=length), wanted), name


def test_without_a_seed_episodes_follow_from_the_first(make, equal, episode):
    """Gymnasium's rule: `reset()` goes on with the generator, so a row of episodes follows from one seed."""
    one, two = make(), make()
    rows = [[episode(env, seed, steps=40) for seed in (3, None, None)] for env in (one, two)]
    assert equal(*rows)
    assert not equal(rows[0][1], rows[0][2])


def test_returned_values_are_the_callers_own(make, equal):
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


@every_environment
def test_info_has_the_same_keys_and_types_always(make, episode, id_, obs):
    wanted = INFO_KEYS | ({"depth"} if obs == "rgbd_uint8" else set())
    wanted |= {"frame_time"} if obs.startswith("rgbd") else set()
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
def test_the_truth_in_info_is_consistent(make, episode, id_):
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


@pytest.mark.parametrize("id_", IDS.values())
def test_a_robot_that_knows_the_truth_follows_all_the_way(make, episode, id_):
    """Ends by the route's end after 14 s and is a success; so the task can be done, in several routes."""
    env = make(id_)
    for seed in range(8):
        record = episode(env, seed)
        _, _, terminated, truncated, info = record[-1]
        assert (terminated, truncated) == (False, True), seed
        assert info["time"] == pytest.approx(14.0)
        assert info["is_success"], seed


@pytest.mark.parametrize("rate", [10, 30, 60])
def test_the_routes_end_truncates_after_14_seconds_at_every_rate(make, episode, rate):
    record = episode(make(route="standing", control_hz=rate), 0, policy=parked)
    assert len(record) == 14 * rate + 1
    assert [row[2:4] for row in record[1:-1]] == [(False, False)] * (14 * rate - 1)
    assert record[-1][2:4] == (False, True)
    assert record[-1][-1]["is_success"]


def test_driving_into_the_person_ends_the_episode(make, episode):
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
def test_driving_into_a_wall_ends_the_episode(make, episode, id_):
    env = make(id_, route="standing")
    record = episode(env, 0, {"robot_pose": (-1.0, env.scene.bounds[3] - 1.2, math.pi / 2)}, forward)
    *_, terminated, _, info = record[-1]
    assert terminated
    assert info["collision_with"] == "wall"
    assert env.scene.bounds[3] - info["robot_pose"][1] == pytest.approx(0.10, abs=0.03), "the chassis ends 10 cm ahead"


@pytest.mark.parametrize("rate", [10, 30, 60])
def test_a_person_out_of_view_ends_the_episode_after_five_seconds(make, episode, rate):
    env = make(route="standing", control_hz=rate)
    x, y, yaw = env.reset(seed=0)[1]["robot_pose"]
    record = episode(env, 0, {"robot_pose": (x, y, yaw + math.pi)}, parked)
    *_, terminated, truncated, info = record[-1]
    assert (terminated, truncated) == (True, False)
    assert info["time"] == pytest.approx(5.0, abs=1.01 / rate)
    assert not info["collision"]
    assert not info["is_success"]
    assert not any(row[-1]["visible"] for row in record)


def test_a_person_seen_again_within_five_seconds_is_not_lost(make, episode):
    """One whole turn takes 3.1 s, of which the person is out of view for 2.6 s."""
    record = episode(make(route="standing"), 0, policy=lambda info: np.array((0.0, 1.0), np.float32))
    visible = np.array([row[-1]["visible"] for row in record])
    assert record[-1][2:4] == (False, True)
    assert 0.1 < visible.mean() < 0.3
    assert not record[-1][-1]["is_success"], "out of view for longer than a second"


def test_a_parked_robot_never_succeeds_with_a_walker(make, episode):
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


def test_success_means_what_the_benchmark_says(make, chase, episode):
    """Over drivers from good to bad; some succeed and some do not."""
    env = make(INDOOR)
    outcomes = []
    for seed, lag in itertools.product(range(4), (0.0, 0.15, 0.3, 0.45, 0.6)):
        record = [row[-1] for row in episode(env, seed, policy=lambda info, lag=lag: chase(info, (-lag, 0.0)))]
        assert record[-1]["is_success"] == success(record, env.dt), (seed, lag)
        outcomes.append(record[-1]["is_success"])
    assert 2 <= sum(outcomes) <= 18


@pytest.mark.parametrize(("wait", "wanted"), [(0.1, True), (0.9, False)])
def test_looking_away_for_more_than_a_second_is_no_success(make, episode, wait, wanted):
    """Turn by 1 rad, wait, turn back: almost always in band, but out of view for somewhat less or more than 1 s."""

    def look_away(info):
        turn = 1.0 if 1.0 < info["time"] < 1.5 else -1.0 if 1.5 + wait < info["time"] < 2.0 + wait else 0.0
        return np.array((0.0, turn), np.float32)

    record = [row[-1] for row in episode(make(route="standing"), 0, policy=look_away)]
    out_of_view = sum(not info["visible"] for info in record) / 30.0
    assert abs(out_of_view - 1.0) < 0.5
    assert np.mean([abs(info["bearing"]) < math.radians(30.0) for info in record]) > 0.85
    assert record[-1]["is_success"] == success(record, 1.0 / 30.0) == wanted


@pytest.mark.parametrize(("wait", "wanted"), [(1.0, True), (2.2, False)])
def test_a_fifth_of_the_time_out_of_band_is_no_success(make, chase, episode, wait, wanted):
    """Start 3 m behind the person, wait, drive up: never out of view, but late."""
    env = make(route="standing")
    x, y, yaw = env.reset(seed=0)[1]["person_pose"]

    def drive_up(info):
        return chase(info) if info["time"] > wait else STOP

    record = [row[-1] for row in episode(env, 0, {"robot_pose": (x - 3.0, y, yaw)}, drive_up)]
    assert all(info["visible"] for info in record)
    assert 0.72 < np.mean([info["distance"] <= 2.0 for info in record]) < 0.88
    assert record[-1]["is_success"] == success(record, 1.0 / 30.0) == wanted


@every_environment
def test_the_reward_is_the_sum_of_its_bounded_terms(make, id_, obs):
    env = make(id_, obs=obs, route="standing")
    bounds = {"distance": (0.0, 0.4), "bearing": (0.0, 0.4), "visible": (0.0, 0.1), "smoothness": (0.0, 0.1)}
    bounds["collision"] = (-1.0, 0.0)
    rng = np.random.default_rng(2)
    _, info = env.reset(seed=0)
    assert info["rewards"].keys() == bounds.keys()
    for _ in range(60):
        _, reward, terminated, _, info = env.step(rng.uniform((-0.6, -1.0), (1.4, 1.0)))
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
