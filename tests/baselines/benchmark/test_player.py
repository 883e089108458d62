"""An episode as the benchmark plays it agrees with what the environment says of it."""

import pytest

from baselines.benchmark.build import driver, environment
from baselines.benchmark.cells import Cell
from baselines.benchmark.player import play
from baselines.followers.build import make_follower
from follow_env.envs.follow import FollowEnv


class Witness:
    """An environment that remembers the last info."""

    def __init__(self, env):
        self._env = env

    def reset(self, **arguments):
        observation, self.info = self._env.reset(**arguments)
        return observation, self.info

    def step(self, action):
        *result, self.info = self._env.step(action)
        return (*result, self.info)


@pytest.mark.parametrize(("estimator", "seed"), [("akf", 0), ("none", 3), ("kf", 50), ("akf_cv", 76)])
def test_success_is_what_the_environment_says(estimator, seed):
    cell = Cell("emulated", "indoor", estimator)
    env = environment(cell)
    witness = Witness(env)

    episode = play(witness, driver(cell), cell, seed)

    env.close()
    assert episode.row["success"] == int(witness.info["is_success"])
    assert episode.row["duration_s"] == witness.info["time"]
    assert (episode.row["ended"] == "collision") == witness.info["collision"]


@pytest.mark.parametrize("control_hz", [10, 30, 60])
def test_the_reference_follows_at_any_control_rate(control_hz):
    env = FollowEnv(scene="indoor", control_hz=control_hz)
    policy = make_follower("akf", scene="indoor", control_hz=control_hz)
    for seed in range(2):
        observation, info = env.reset(seed=seed)
        state, ended = None, False
        while not ended:
            action, state = policy.predict(observation, state)
            observation, _, terminated, truncated, info = env.step(action)
            ended = terminated or truncated
        assert info["is_success"], (seed, info["time"])
    env.close()
