"""Followers: what they remember, what they do without a measurement, and how they fit SB3's `predict`."""

import gymnasium as gym
import numpy as np
import pytest

import follow_env
from baselines.followers.build import make_follower
from baselines.followers.follower import Follower
from baselines.followers.perception import make_perception, perceive_measurement
from tracker.estimators import NoFilter
from tracker.estimators.base import NoiseModel

NOISE = NoiseModel((1e-4, 1e-2), (1e-4, 1e-3), (1e-2, 1e-1))


def observation(bearing=0.0, distance=1.5, valid=1.0, v=0.0, omega=0.0):
    return np.array((bearing, distance, valid, 0.0, v, omega, 0.0, 0.0), np.float32)


def test_a_target_to_the_left_is_turned_to_and_a_far_one_approached():
    follower = make_follower("none", noise=NOISE)

    left, _ = follower.predict(observation(bearing=0.3))
    far, _ = follower.predict(observation(distance=2.0))
    near, _ = follower.predict(observation(distance=1.0))

    assert left[1] > 0.0
    assert far[0] > 0.0 > near[0]


def test_it_stands_still_until_it_has_seen_the_person():
    follower = make_follower("akf", noise=NOISE)

    action, state = follower.predict(observation(valid=0.0))

    assert action.tolist() == [0.0, 0.0]
    assert state.estimate is None
    assert state.measurement is None


def test_an_invalid_measurement_never_reaches_the_filter():
    follower = make_follower("kf", noise=NOISE)
    _, state = follower.predict(observation(distance=1.8))

    _, state = follower.predict(observation(distance=0.0, bearing=0.0, valid=0.0), state)

    assert state.estimate.action == ("miss", "miss")
    assert state.estimate.distance == pytest.approx(1.8, abs=1e-6)


def test_the_filter_predicts_with_the_twist_of_the_odometry():
    follower = make_follower("kf", noise=NOISE)
    _, state = follower.predict(observation(bearing=0.2, distance=1.8))

    _, state = follower.predict(observation(valid=0.0, v=0.6, omega=0.3), state)

    assert state.estimate.distance == pytest.approx(1.8 - 0.6 / 30, abs=1e-6)
    assert state.estimate.bearing == pytest.approx(0.2 - 0.3 / 30, abs=1e-6)


def test_episode_start_forgets_the_state():
    follower = make_follower("akf", noise=NOISE)
    first, state = follower.predict(observation(distance=2.5))
    _, state = follower.predict(observation(distance=2.4), state)

    again, _ = follower.predict(observation(distance=2.5), state, episode_start=np.array([True]))

    assert again.tolist() == first.tolist()


def test_a_batch_is_the_same_as_one_by_one():
    follower = make_follower("akf", noise=NOISE)
    batches = [np.stack([observation(0.1 * i, 1.5 + 0.1 * k, v=0.1 * k) for i in range(3)]) for k in range(4)]
    states, singles = None, [None] * 3

    for batch in batches:
        actions, states = follower.predict(batch, states, episode_start=np.zeros(3, bool))
        for i, row in enumerate(batch):
            action, singles[i] = follower.predict(row, singles[i])
            assert action.tolist() == actions[i].tolist()


def test_actions_stay_in_the_action_space():
    follower = make_follower("none", noise=NOISE)

    action, _ = follower.predict(observation(bearing=-3.0, distance=19.0))

    assert action.tolist() == [1.0, -1.0]
    assert action.dtype == np.float32


@pytest.mark.parametrize("scene", follow_env.IDS)
@pytest.mark.parametrize("perception", ["truth", "emulated", "mask"])
def test_every_perception_reads_its_observation_and_agrees_with_the_truth(perception, scene):
    from baselines.followers.perception import OBSERVATION_OF

    env = gym.make(follow_env.IDS[scene], obs=OBSERVATION_OF[perception], sensor="ideal", disable_env_checker=True)
    obs, info = env.reset(seed=3)

    measurement, twist = make_perception(perception)(obs)

    assert measurement[0] == pytest.approx(info["bearing"], abs=0.02)
    assert measurement[1] == pytest.approx(info["distance"], abs=0.15)
    assert twist == (0.0, 0.0)
    env.close()


@pytest.mark.parametrize(("field", "value"), [("estimator", "ekf"), ("perception", "maks"), ("controller", "pid")])
def test_unknown_names_are_refused_with_what_is_known(field, value):
    with pytest.raises(ValueError, match=f"{field} '{value}' is not known; expected one of"):
        make_follower(**{field: value})


def test_sb3_can_evaluate_a_follower():
    from stable_baselines3.common.evaluation import evaluate_policy
    from stable_baselines3.common.monitor import Monitor

    env = Monitor(gym.make("follow_env/Corridor-v0", disable_env_checker=True))

    mean, _ = evaluate_policy(make_follower("akf"), env, n_eval_episodes=1)

    assert 0.5 * 420 < mean <= 420


def test_a_custom_follower_needs_only_callables():
    follower = Follower(perceive_measurement, NoFilter)

    _, state = follower.predict(observation(distance=1.7))

    assert state.estimate.distance == pytest.approx(1.7, abs=1e-6)
