"""`TrackingFollower`: sees with the person tracker, which can lose the person; then it stops and looks."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from baselines.controllers import Controller
from baselines.controllers.pi import PIController
from baselines.followers.follower import Follower, FollowerState
from baselines.followers.perception import perceive_odometry
from baselines.followers.recovery import Recovery, look_rate
from follow_env.config import EnvConfig, RobotConfig
from tracker.estimators import Estimator
from tracker.estimators.base import Pair
from tracker.person_tracker import PersonTracker, Track


@dataclass(kw_only=True)
class TrackingState(FollowerState):
    """What a `TrackingFollower` remembers within one episode.

    Attributes:
        tracker: its memory.
        track: of the latest frame.
        bearing: of the person when it was tracked last, rad; None while nobody was tracked.
        looked: for so long the robot has turned to look since then, s.
    """

    tracker: PersonTracker
    track: Track | None = None
    bearing: float | None = None
    looked: float = 0.0


class TrackingFollower(Follower):
    """Follows whom a tracker tracks in `rgbd` observations.

    A measurement is a position measured in that very frame, as bearing and forward distance; frames between the
    processed ones and coasted frames have none. Until a person is confirmed the robot stands. When the tracker stops,
    the robot halts, forgets its estimate and answers the alarm itself: it turns at `LOOK_RATE` to the side where it
    tracked the person last, sweeps back after `LOOK_TIME` (the person may be where it was, and the detector to blame),
    stands while somebody is being confirmed, and then follows whom the tracker confirmed, the largest, most central
    person. It cannot know whether that is the one it lost; `state.track.confirmations` tells that
    it was asked.

    Args:
        make_tracker: returns a fresh tracker for an episode; its rate is that of the observations.
        make_estimator, make_controller, robot, dt, config: as in `Follower`.
        recovery: drives while nobody is tracked, in place of the turns described; where it returns None the robot
            stands.
    """

    def __init__(
        self,
        make_tracker: Callable[[], PersonTracker],
        make_estimator: Callable[[], Estimator],
        make_controller: Callable[[], Controller] = PIController.from_paper,
        robot: RobotConfig | None = None,
        dt: float = 1.0 / 30.0,
        config: EnvConfig | None = None,
        recovery: Recovery | None = None,
    ) -> None:
        super().__init__(perceive_odometry, make_estimator, make_controller, robot, dt, config=config)
        self._make_tracker, self._look = make_tracker, recovery

    def _step(self, observation: Any, state: Any) -> tuple[np.ndarray, FollowerState]:
        if state is None:
            state = TrackingState(self._make_estimator(), self._make_controller(), tracker=self._make_tracker())
        _, twist = self._perceive(observation)
        state.track = track = state.tracker.update(observation["rgb"], observation["depth"], twist)
        if track.bearing is not None:
            state.bearing, state.looked = track.bearing, 0.0
            place = track.measurement
            measurement = None if place is None else (math.atan2(place[1], place[0]), place[0])
            return self._drive(state, measurement, twist), state
        if track.alarm:
            state.tracker.confirm()
        state.estimator.reset()
        state.controller.reset()
        state.measurement = state.estimate = None
        if state.bearing is None or track.state == "confirming":
            return self._action(0.0, 0.0), state
        turn: Pair | None = (0.0, look_rate(state.bearing, state.looked))
        if self._look is not None:
            turn = self._look.command(state.bearing, state.looked)
        state.looked += self._dt
        return self._action(*(turn or (0.0, 0.0))), state
