"""The batch as a Gymnasium vector environment: spaces, seeds, endings, autoreset, errors."""

import gymnasium
import numpy as np
import pytest
from gymnasium.vector import AutoresetMode
from gymnasium.wrappers.vector import RecordEpisodeStatistics

from follow_env import IDS
from follow_env.envs.batch import FollowVectorEnv
from follow_env.envs.follow import FollowEnv
from follow_env.envs.task import SET_POINT
from follow_env.world.kinematic.philox import philox

CRASH = {"robot_pose": (1.0, 1.2, 1.5)}


@pytest.fixture(scope="module")
def make():
    made = []

    def one(num_envs, **settings):
        env = gymnasium.make_vec(IDS[settings.pop("scene", "corridor")], num_envs=num_envs, **settings)
        made.append(env)
        return env

    yield one
    for env in made:
        env.close()
        env.close()


def actions(count, steps, seed=0):
    return np.random.default_rng(seed).uniform(-0.3, 1.0, (steps, count, 2)).astype(np.float32)


def play(env, steps, seed=0, count=None):
    """Return observations and rewards of the first `count` worlds under random actions that are the same for all N."""
    count = count or env.num_envs
    record = [env.reset(seed=seed)[0][:count]]
    for row in actions(count, steps):
        padded = np.zeros((env.num_envs, 2), np.float32)
        padded[:count] = row
        observation, reward, *_ = env.step(padded)
        record += [observation[:count], reward[:count]]
    return record


@pytest.mark.parametrize("obs", ["measurement", "state"])
@pytest.mark.parametrize("scene", IDS)
def test_the_entry_point_is_the_batch_and_its_spaces_are_those_of_the_single_environment(make, scene, obs):
    env, single = make(5, scene=scene, obs=obs), FollowEnv(scene=scene, obs=obs)
    assert isinstance(env.unwrapped, FollowVectorEnv)
    assert env.metadata["autoreset_mode"] is AutoresetMode.NEXT_STEP
    assert env.metadata["engine"] == "kinematic"
    assert (env.single_observation_space, env.single_action_space) == (single.observation_space, single.action_space)
    observation, info = env.reset(seed=1)
    assert env.observation_space.contains(observation)
    for action in actions(5, 200):
        observation, reward, terminated, truncated, info_now = env.step(action)
        assert env.observation_space.contains(observation)
        assert info_now.keys() == info.keys()
        assert {reward.shape, terminated.shape, truncated.shape, info_now["_time"].shape} == {(5,)}
        assert reward == pytest.approx(sum(v for k, v in info_now["rewards"].items() if k[0] != "_"), abs=1e-12)
        info = info_now
    assert info.keys() == {k for key in single.reset(seed=0)[1] for k in (key, f"_{key}")}
    single.close()


def test_philox_gives_the_published_numbers():
    """Known answers of Random123's kat_vectors for philox4x32-10."""
    cases = (
        ((0, 0, 0, 0), (0, 0), "6627e8d5 e169c58d bc57ac4c 9b00dbd8"),
        ((2**32 - 1,) * 4, (2**32 - 1,) * 2, "408f276d 41c83b0e a20bc7c6 6d5451fd"),
        (
            (0x243F6A88, 0x85A308D3, 0x13198A2E, 0x03707344),
            (0xA4093822, 0x299F31D0),
            "d16cfe09 94fdcceb 5001e420 24126ea1",
        ),
    )
    for counter, (low, high), wanted in cases:
        words = philox(*(np.uint64(c) for c in counter), np.uint64(high << 32 | low))
        assert " ".join(f"{int(word):08x}" for word in words) == wanted


def test_a_world_depends_on_its_seed_and_number_only(make):
    """Not on the number of worlds or threads; world i of a list of seeds is world 0 of its seed."""
    few = play(make(7, threads=1), 500, seed=3)
    many = play(make(1500, threads=3), 500, seed=3, count=7)
    assert all((a == b).all() for a, b in zip(few, many, strict=True))
    listed, _ = make(7).reset(seed=[9, 3, 3, 5, 6, 7, 8])
    alone, _ = make(1).reset(seed=3)
    assert (listed[1] == alone[0]).all()
    assert (listed[2] == alone[0]).all()
    assert (listed[0] != alone[0]).any()
    assert len(np.unique(many[0][:, 1])) == 7


def test_episodes_differ_and_a_seed_repeats_them(make):
    env = make(3)
    first, _ = env.reset(seed=4)
    second, _ = env.reset()
    again, _ = env.reset(seed=4)
    again_second, _ = env.reset()
    assert (first == again).all()
    assert (second == again_second).all()
    assert (first != second).any()


def test_next_step_begins_anew_one_step_after_the_end(make):
    env = make(2)
    env.reset(seed=0, options=CRASH)
    ended = np.zeros(2, bool)
    for _ in range(40):
        observation, reward, terminated, _, info = env.step(np.tile(np.float32([1.0, 0.0]), (2, 1)))
        ended = terminated
        if ended.any():
            break
    assert ended.all()
    assert (info["collision_with"] == "wall").all()
    assert (reward < 0.0).all()
    observation, reward, terminated, _, info = env.step(np.ones((2, 2), np.float32))
    assert (reward == 0.0).all()
    assert not terminated.any()
    assert (info["time"] == 0.0).all()
    assert info["distance"] == pytest.approx(SET_POINT)
    assert (observation[:, 4:] == 0.0).all()


def test_same_step_hands_over_the_last_observation_and_begins_at_once(make):
    env, other = make(3, autoreset_mode="SameStep"), make(3)
    options = {"robot_pose": np.array([(1.0, 1.2, 1.5), (0.0, 0.0, 0.0), (1.0, -1.2, -1.5)])}
    env.reset(seed=0, options=options)
    other.reset(seed=0, options=options)
    for _ in range(40):
        step, plain = env.step(np.ones((3, 2)) * (1.0, 0.0)), other.step(np.ones((3, 2)) * (1.0, 0.0))
        if step[2].any():
            break
    observation, reward, terminated, _, info = step
    mask = np.array([True, False, True])
    assert (terminated == mask).all()
    assert (reward == plain[1]).all()
    assert (info["_final_obs"] == mask).all()
    assert (info["_final_info"] == mask).all()
    for i in (0, 2):
        assert (info["final_obs"][i] == plain[0][i]).all()
        assert info["final_info"]["collision_with"][i] == "wall"
        assert info["final_info"]["rewards"]["collision"][i] == -1.0
    assert info["final_obs"][1] is None
    assert (observation[1] == plain[0][1]).all()
    assert (info["time"][mask] == 0.0).all()
    assert info["time"][1] > 0.0
    begun, *_ = other.step(np.zeros((3, 2)))
    assert (begun[mask] == observation[mask]).all()


def test_without_autoreset_the_mask_starts_the_chosen_worlds(make):
    env = make(3, autoreset_mode=AutoresetMode.DISABLED)
    env.reset(seed=0, options=CRASH)
    for _ in range(40):
        observation, _, terminated, _, _ = env.step(np.ones((3, 2)) * (1.0, 0.0))
        if terminated.any():
            break
    with pytest.raises(gymnasium.error.ResetNeeded, match="world 0 has ended"):
        env.step(np.zeros((3, 2)))
    mask = np.array([True, False, True])
    begun, info = env.reset(options={"reset_mask": mask})
    assert (begun[1] == observation[1]).all()
    assert (info["_time"] == mask).all()
    assert (info["time"][mask] == 0.0).all()


def test_statistics_of_episodes_are_recorded(make):
    """A standing person and a parked robot: every episode is truncated after 14 s with the same return."""
    env = RecordEpisodeStatistics(make(4, route="standing"))
    env.reset(seed=0)
    for _ in range(419):
        assert not np.logical_or(*env.step(np.zeros((4, 2), np.float32))[2:4]).any()
    *_, truncated, info = env.step(np.zeros((4, 2), np.float32))
    assert truncated.all()
    assert info["is_success"].all()
    assert (info["episode"]["l"] == 420).all()
    assert info["episode"]["r"] == pytest.approx(np.full(4, 420.0))


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ({"num_envs": 0}, "num_envs is 0; expected a whole number from 1"),
        ({"num_envs": 2, "threads": 0}, "threads is 0"),
        ({"num_envs": 2, "autoreset_mode": "SameSteps"}, "did you mean 'SameStep'"),
        ({"num_envs": 2, "obs": "rgbd_box"}, "a batch does not observe 'rgbd_box'"),
        ({"num_envs": 2, "renderer": "tiny"}, "'tiny' draws one world only"),
        ({"num_envs": 2, "render_mode": "rgb_array"}, "expected None in a batch"),
        ({"num_envs": 2, "robot": {"max_wheel_torque": 0.1}}, "knows no torque"),
        ({"num_envs": 2, "rout": "paper"}, "did you mean 'route'"),
        ({"num_envs": 2, "scene": "cabin"}, "no route of 12 m .* fits the scene 'cabin'; take route='standing'"),
    ],
)
def test_an_impossible_batch_is_refused_in_one_sentence(settings, message):
    with pytest.raises(ValueError, match=message):
        gymnasium.make_vec(IDS["corridor"], **settings)


def test_impossible_calls_are_refused_in_one_sentence(make):
    env = make(3)
    with pytest.raises(gymnasium.error.ResetNeeded, match=r"call reset\(\) first"):
        env.step(np.zeros((3, 2)))
    env.reset(seed=0)
    with pytest.raises(ValueError, match=r"shape \(2,\); expected \(3, 2\)"):
        env.step(np.zeros(2))
    with pytest.raises(ValueError, match=r"world 1 is \[nan, 0.0\]"):
        env.step(np.array([[0.0, 0.0], [np.nan, 0.0], [0.0, 0.0]]))
    with pytest.raises(ValueError, match="2 seeds for 3 worlds"):
        env.reset(seed=[1, 2])
    with pytest.raises(ValueError, match="reset_mask is"):
        env.reset(options={"reset_mask": np.zeros(3, bool)})
    with pytest.raises(ValueError, match="did you mean 'robot_pose'"):
        env.reset(options={"robot_poses": (0, 0, 0)})
    with pytest.raises(ValueError, match="expected three finite numbers"):
        env.reset(options={"robot_pose": (0.0, np.nan, 0.0)})


def test_a_route_that_is_too_long_for_the_scene_is_refused_for_one_episode_too():
    env = gymnasium.make_vec(IDS["corridor"], num_envs=2, scene="cabin", route="standing")
    env.reset(seed=0)
    with pytest.raises(ValueError, match=r"'straight' .* in the scene 'cabin'; .* take route='standing'"):
        env.reset(options={"route": "straight"})
    env.close()


def test_pictures_depend_on_the_worlds_seed_only_and_begin_anew_with_the_episode(make):
    """Also with latency: the first picture of an episode stands until it is old enough."""
    settings = {"obs": "rgbd_uint8", "camera": {"width": 32, "height": 24}, "latency_s": 1 / 15}
    one, many = make(2, threads=1, **settings), make(5, threads=3, autoreset_mode="SameStep", **settings)
    pose = {"robot_pose": (1.0, 1.2, 1.5)}
    first, _ = one.reset(seed=3, options=pose)
    assert (many.reset(seed=3, options=pose)[0][:2] == first).all()
    for _ in range(40):
        mine, *_ = one.step(np.ones((2, 2)) * (1.0, 0.0))
        theirs, _, terminated, _, info = many.step(np.ones((5, 2)) * (1.0, 0.0))
        if terminated.any():
            break
        assert (mine == theirs[:2]).all()
    assert terminated.all()
    assert (np.stack(list(info["final_obs"]))[:2] == mine).all()
    assert info["final_info"]["depth"].shape == (5, 24, 32)
    begun, *_ = one.step(np.zeros((2, 2)))
    assert (begun == theirs[:2]).all()
    assert (begun != mine).mean() > 0.1
    for _ in range(2):
        again, *_ = one.step(np.zeros((2, 2)))
        assert (again == begun).all()
    again, *_ = one.step(np.zeros((2, 2)))
    assert (again != begun).any()


def test_dropped_pictures_leave_the_last_one(make):
    """Half of them: of 3 x 60 pictures 90 on average are the one before, with a standard deviation of 6.7."""
    drops = {"preset": "xtion", "frames": {"drop_share": 0.5}}
    env = make(3, obs="rgbd_uint8", camera={"width": 32, "height": 24}, sensor=drops)
    last, _ = env.reset(seed=4)
    repeated = 0
    for _ in range(60):
        observation, *_ = env.step(np.zeros((3, 2)))
        repeated += int((observation == last).all(axis=(1, 2, 3)).sum())
        last = observation
    assert 60 < repeated < 120
