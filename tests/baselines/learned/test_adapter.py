"""The adapter gives Stable-Baselines3 what the batches gave, and Monitor's sums."""

import gymnasium as gym
import numpy as np
import pytest
from gymnasium.vector import AutoresetMode

import follow_env
from baselines.learned.adapter import FollowVecEnv
from tracker.estimators.akf_batch import BatchFilter
from tracker.estimators.base import NoiseModel

CORRIDOR, INDOOR = follow_env.IDS["corridor"], follow_env.IDS["indoor"]


def batch(
    id_: str, worlds: int, mode: AutoresetMode = AutoresetMode.SAME_STEP, **settings: object
) -> gym.vector.VectorEnv:
    return gym.make_vec(id_, num_envs=worlds, autoreset_mode=mode, **settings)


def test_the_worlds_are_those_of_the_batches() -> None:
    worlds = FollowVecEnv([batch(CORRIDOR, 3), batch(INDOOR, 2)])
    alone = [batch(CORRIDOR, 3), batch(INDOOR, 2)]
    worlds.seed(11)
    observations = worlds.reset()
    firsts = [one.reset(seed=11 + 1_000_003 * k)[0] for k, one in enumerate(alone)]
    np.testing.assert_array_equal(observations, np.concatenate(firsts))
    rng = np.random.default_rng(0)
    returns, lengths, finished = np.zeros(5), np.zeros(5, int), 0
    for _ in range(450):
        actions = rng.uniform(-1.0, 1.0, (5, 2)).astype(np.float32)
        observations, rewards, dones, infos = worlds.step(actions)
        steps = [one.step(part) for one, part in zip(alone, (actions[:3], actions[3:]), strict=True)]
        np.testing.assert_array_equal(observations, np.concatenate([step[0] for step in steps]))
        np.testing.assert_array_equal(dones, np.concatenate([step[2] | step[3] for step in steps]))
        returns += rewards
        lengths += 1
        for i in np.flatnonzero(dones):
            _, _, _, truncated, info = steps[int(i >= 3)]
            k = i - 3 * int(i >= 3)
            assert infos[i]["TimeLimit.truncated"] == truncated[k]
            np.testing.assert_array_equal(infos[i]["terminal_observation"], info["final_obs"][k])
            assert infos[i]["episode"]["l"] == lengths[i]
            assert infos[i]["episode"]["r"] == pytest.approx(returns[i], abs=1e-3)
            returns[i], lengths[i] = 0.0, 0
            finished += 1
        assert all(infos[i] == {} for i in np.flatnonzero(~dones))
    assert finished >= 5
    worlds.close()


def test_filters_belong_to_their_batch() -> None:
    noise = NoiseModel((0.01, 0.01), (0.01, 0.01), (0.1, 0.1))
    filtered = FollowVecEnv([batch(CORRIDOR, 2), batch(INDOOR, 2)], [BatchFilter(2, noise, 1.0 / 30.0), None])
    plain = FollowVecEnv([batch(CORRIDOR, 2), batch(INDOOR, 2)])
    for worlds in (filtered, plain):
        worlds.seed(1)
    filtered.reset(), plain.reset()
    action = np.tile(np.float32([0.7, 0.0]), (4, 1))
    different = 0.0
    for _ in range(30):
        estimated, measured = filtered.step(action)[0], plain.step(action)[0]
        np.testing.assert_array_equal(estimated[2:], measured[2:])
        different = max(different, float(np.abs(estimated[:2, :2] - measured[:2, :2]).max()))
    assert different > 1e-3
    filtered.close(), plain.close()


def test_a_batch_that_resets_a_step_later_is_refused() -> None:
    late = batch(CORRIDOR, 2, AutoresetMode.NEXT_STEP)
    with pytest.raises(ValueError, match=r"make it with autoreset_mode=AutoresetMode\.SAME_STEP"):
        FollowVecEnv([late])
    late.close()


def test_batches_of_other_observations_are_refused() -> None:
    pair = [batch(CORRIDOR, 2), batch(CORRIDOR, 2, obs="state")]
    with pytest.raises(ValueError, match="expected one observation space"):
        FollowVecEnv(pair)
    for one in pair:
        one.close()


def test_no_batch_is_refused() -> None:
    with pytest.raises(ValueError, match="no batch of worlds"):
        FollowVecEnv([])


def test_teachers_see_the_truth_of_each_world() -> None:
    worlds = FollowVecEnv([batch(CORRIDOR, 3), batch(INDOOR, 2)])
    truth = [batch(CORRIDOR, 3, obs="state"), batch(INDOOR, 2, obs="state")]
    worlds.seed(2)
    worlds.reset()
    states = np.concatenate([one.reset(seed=2 + 1_000_003 * k)[0] for k, one in enumerate(truth)])
    rng, ended = np.random.default_rng(3), 0
    for _ in range(430):
        np.testing.assert_allclose(worlds.states()[:, :6], states[:, :6], atol=1e-5)
        actions = rng.uniform(-1.0, 1.0, (5, 2)).astype(np.float32)
        _, _, dones, _ = worlds.step(actions)
        ended += int(dones.sum())
        states = np.concatenate(
            [one.step(part)[0] for one, part in zip(truth, (actions[:3], actions[3:]), strict=True)]
        )
    assert ended > 0
    worlds.close()


def test_the_infos_hold_the_terms_of_the_reward() -> None:
    """They add up to the rewards, step by step and over an episode, the last step of it included."""
    worlds = FollowVecEnv([batch(CORRIDOR, 3), batch(INDOOR, 2)], reward_terms=True)
    worlds.seed(3)
    worlds.reset()
    rng, returns, finished = np.random.default_rng(1), np.zeros(5), 0
    for _ in range(450):
        _, rewards, dones, infos = worlds.step(rng.uniform(-1.0, 1.0, (5, 2)).astype(np.float32))
        returns += rewards
        for i, info in enumerate(infos):
            assert sum(info["rewards"].values()) == pytest.approx(rewards[i], abs=1e-6)
            if dones[i]:
                assert sum(info["episode_rewards"].values()) == pytest.approx(returns[i], abs=1e-3)
                assert info["episode_rewards"]["collision"] in (0.0, -1.0)
                returns[i] = 0.0
                finished += 1
    assert finished >= 5
    worlds.close()
