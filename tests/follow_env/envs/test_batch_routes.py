"""Any route in the batch: drawn in Python, walked from its table, the same path as in `FollowEnv`."""

import math

import numpy as np
import pytest

from follow_env.envs.batch import FollowVectorEnv
from follow_env.envs.follow import FollowEnv
from follow_env.world.motion.base import MOTIONS

STOP, TURN = (4.0, 6.0), (6.0, 8.0)
SPEED = 0.8


class UTurn:
    """Walk ahead for 4 s, stand for 2 s, turn about on the spot in 2 s, walk back for 4 s."""

    duration = 12.0

    def __init__(self, start):
        self.start = start

    def at_speed(self, speed):
        return self

    def walked(self, t):
        return SPEED * (min(t, STOP[0]) + max(t - TURN[1], 0.0))

    def speed(self, t):
        return SPEED if t < STOP[0] or t > TURN[1] else 0.0

    def heading(self, t):
        return self.start[2] + math.pi * min(max((t - TURN[0]) / (TURN[1] - TURN[0]), 0.0), 1.0)

    def velocity(self, t):
        return self.speed(t) * math.cos(self.heading(t)), self.speed(t) * math.sin(self.heading(t))

    def pose(self, t):
        x, y, yaw = self.start
        away = SPEED * (min(t, STOP[0]) - max(t - TURN[1], 0.0))
        return x + away * math.cos(yaw), y + away * math.sin(yaw), self.heading(t)


def u_turn(scene, start, rng, speed=1.0):
    return UTurn(start)


def test_a_u_turn_with_a_stop_is_walked_as_in_the_single_environment(monkeypatch):
    """Defect of the past: a route that the batch did not know was walked straight ahead."""
    monkeypatch.setitem(MOTIONS._components, "u_turn", u_turn)
    single, batch = FollowEnv(route="u_turn"), FollowVectorEnv(2, route="u_turn", autoreset_mode="Disabled")
    _, info = single.reset(seed=3)
    _, infos = batch.reset_as_single([3, 4])
    start, steps, truncated = info["person_pose"], 0, False
    while not truncated:
        assert np.abs(infos["person_pose"][0] - info["person_pose"]).max() < 1e-3
        assert infos["person_velocity"][0] == pytest.approx(info["person_velocity"], abs=1e-9)
        ahead = np.array(((info["distance"] - 1.5) / 1.2, 0.0))
        _, _, terminated, truncated, info = single.step(ahead)
        _, _, ends, cuts, infos = batch.step(np.tile(ahead, (2, 1)))
        assert (terminated, truncated) == (ends[0], cuts[0])
        if terminated:
            break
        steps += 1
    assert steps > 200
    assert abs(infos["person_pose"][0][2] - start[2]) > 1.0
    single.close()
    batch.close()


def test_every_episode_draws_its_own_motion_and_the_number_of_worlds_does_not_matter():
    """Also without a name: a callable is a route."""

    def somewhere(scene, start, rng, speed):
        return UTurn((*start[:2], rng.uniform(-0.2, 0.2)))

    few, many = FollowVectorEnv(2, route=somewhere, threads=1), FollowVectorEnv(600, route=somewhere, threads=2)
    seen = []
    for env in (few, many):
        _, info = env.reset(seed=5)
        poses = [info["person_pose"][:2].copy()]
        for _ in range(380):  # beyond the end of the first episode
            *_, info = env.step(np.tile((0.3, 0.0), (env.num_envs, 1)))
            poses.append(info["person_pose"][:2].copy())
        seen.append(np.array(poses))
        env.close()
    assert (seen[0] == seen[1]).all()
    headings = np.unique(seen[0][:, :, 2])
    first = seen[0][0, :, 2]
    assert first[0] != first[1]
    assert len(headings) > 4


def test_a_route_may_be_given_for_one_episode():
    env = FollowVectorEnv(3, route="straight", autoreset_mode="Disabled")
    env.reset(seed=0)
    mask = np.array([False, True, False])
    env.reset(options={"route": u_turn, "reset_mask": mask})
    for _ in range(230):
        *_, info = env.step(np.zeros((3, 2)))
    assert info["person_pose"][1, 2] > 2.0
    assert info["person_pose"][[0, 2], 2] == pytest.approx(0.0)
    env.reset(options={"reset_mask": mask})
    for _ in range(185):
        *_, info = env.step(np.zeros((3, 2)))
    assert info["person_pose"][1, 2] == 0.0
    assert info["person_velocity"][1, 0] > 0.9
    env.close()


def test_the_robot_starts_where_it_is_put_and_the_person_where_the_route_begins():
    env = FollowVectorEnv(2, route=u_turn)
    _, info = env.reset(seed=1, options={"robot_pose": (0.5, 0.1, 0.2)})
    assert info["robot_pose"] == pytest.approx(np.tile((0.5, 0.1, 0.2), (2, 1)))
    assert info["person_pose"][:, 0] == pytest.approx(1.5)
    env.close()


def test_nobody_can_lead_the_people_of_a_batch():
    with pytest.raises(ValueError, match="route 'commanded' needs somebody who leads each person"):
        FollowVectorEnv(2, route="commanded")
