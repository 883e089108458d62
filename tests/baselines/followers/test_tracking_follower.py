"""The follower that sees with the tracker, in closed loop, with a detector that knows whose pixels are whose."""

from types import SimpleNamespace

import numpy as np
import pytest

from baselines.followers.build import build_follower, make_follower
from baselines.followers.recovery import LOOK_RATE
from baselines.followers.tracking_follower import TrackingFollower
from follow_env.config import CameraConfig, EnvConfig, RobotConfig
from follow_env.envs.follow import FollowEnv
from tracker.boxes import Detection

CAMERA = {"width": 160, "height": 120}


class KnowsTheIds:
    """Finds the person by the ids of the environment's picture; `blind` makes it find nobody."""

    def __init__(self, env):
        self.env, self.blind = env, False

    def detect(self, rgb, depth):
        assert np.array_equal(rgb, self.env.observed.rgb)
        box = None if self.blind else self.env.observed.person_box(20)
        return [] if box is None else [Detection(box, 1.0)]


@pytest.fixture
def env():
    made = FollowEnv(obs="rgbd", camera=CAMERA)
    yield made
    made.close()


def follower_in(env, estimator="akf"):
    detector = KnowsTheIds(env)
    return make_follower(estimator, "detector", camera=CameraConfig(**CAMERA), detector=detector), detector


@pytest.mark.parametrize("estimator", ["akf", "akf_cv"])
def test_it_follows_the_person_to_the_end_of_the_route(env, estimator):
    follower, _ = follower_in(env, estimator)
    observation, info = env.reset(seed=2)
    state, states, errors, ended = None, [], [], False
    while not ended:
        action, state = follower.predict(observation, state)
        states.append(state.track.state)
        if state.estimate is not None:
            errors.append((state.estimate.distance - info["distance"], state.estimate.bearing - info["bearing"]))
        observation, _, terminated, ended, info = env.step(action)
        assert not terminated
    assert info["is_success"]
    assert states[:13] == ["confirming"] * 12 + ["tracking"]
    assert set(states[13:]) <= {"tracking", "coasting"}
    assert state.track.confirmations == 1
    distance, bearing = np.sqrt(np.mean(np.square(errors), axis=0))
    assert distance < 0.35
    assert bearing < 0.05


def test_it_stands_until_somebody_is_confirmed(env):
    follower, _ = follower_in(env)
    observation, _ = env.reset(seed=2)
    state = None
    for _ in range(12):
        action, state = follower.predict(observation, state)
        assert action.tolist() == [0.0, 0.0]
        assert state.estimate is None
        observation, *_ = env.step(action)
    assert follower.predict(observation, state)[1].estimate is not None


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_when_the_tracker_stops_the_robot_halts_looks_to_that_side_and_finds_the_person_again(env, side):
    follower, detector = follower_in(env)
    observation, _ = env.reset(seed=2, options={"route": "standing", "robot_pose": (-0.4, 0.0, -0.25 * side)})
    robot = RobotConfig()
    state, actions, tracks = None, [], []
    for k in range(180):
        detector.blind = 30 <= k < 90
        action, state = follower.predict(observation, state)
        actions.append(action)
        tracks.append(state.track)
        observation, *_ = env.step(action)

    alarm = [track.alarm for track in tracks].index(True)
    assert alarm == 57  # the last measurement is that of frame 27
    assert sum(track.alarm for track in tracks) == 1
    for action in actions[alarm:90]:
        assert action[0] == 0.0
        assert action[1] * robot.max_yaw_rate == pytest.approx(side * LOOK_RATE)
    found = [track.confirmations for track in tracks].index(2)
    assert found < 130
    assert all(action.tolist() == [0.0, 0.0] for action in actions[found - 12 : found])
    assert tracks[-1].state == "tracking"


def test_episodes_do_not_share_a_tracker(env):
    follower, _ = follower_in(env)
    observation, _ = env.reset(seed=2)
    _, first = follower.predict(observation)
    _, second = follower.predict(observation, first, episode_start=np.array([True]))
    assert isinstance(follower, TrackingFollower)
    assert second.tracker is not first.tracker


@pytest.mark.parametrize(("recovery", "rate"), [(None, LOOK_RATE), ("none", 0.0), ({"name": "look", "rate": 0.2}, 0.2)])
def test_a_recovery_of_ones_own_replaces_the_look(recovery, rate):
    spec = {"perception": {"name": "detector", "detector": object()}, "recovery": recovery}
    config = EnvConfig.of({"obs": "rgbd", "camera": CAMERA})
    follower = build_follower(spec, config)
    follower._make_tracker = Lost
    frame = {"rgb": None, "depth": np.zeros((2, 2)), "twist": np.zeros(2)}
    _, state = follower.predict(frame)
    state.bearing = 0.3
    for _ in range(30):
        action, state = follower.predict(frame, state)
    assert action[1] == pytest.approx(rate / config.robot.max_yaw_rate)


class Lost:
    """A tracker that has nobody."""

    def update(self, rgb, depth, twist):
        return SimpleNamespace(bearing=None, alarm=False, state="lost")
