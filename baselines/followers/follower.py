"""`Follower`: perception + estimator + controller; its belief is part of its state, so that it can be measured."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from baselines.controllers import Controller
from baselines.controllers.pi import PIController
from baselines.followers.perception import Percept
from baselines.followers.recovery import Recovery
from follow_env.config import EnvConfig, RobotConfig
from follow_env.world.robots.diff_drive import wheel_speeds
from tracker.estimators import Estimate, Estimator
from tracker.estimators.base import Pair


@dataclass
class FollowerState:
    """What a follower remembers within one episode.

    Attributes:
        estimator, controller: their memory.
        measurement: latest measurement (bearing rad, distance m), or None when the last step had none.
        estimate: latest estimate, or None while nothing was ever measured.
        last_bearing: of the latest measurement, rad, kept for a recovery.
        missing: time since then, s.
    """

    estimator: Estimator
    controller: Controller
    measurement: Pair | None = None
    estimate: Estimate | None = None
    last_bearing: float = 0.0
    missing: float = 0.0


class Follower:
    """Perception, then estimation, then control; stands still until the person was seen once.

    Args:
        perceive: turns one observation into (measurement, odometry twist).
        make_estimator: returns a fresh estimator for an episode.
        make_controller: returns a fresh controller for an episode.
        robot: gives the scale of the action.
        dt: control period, s.
        recovery: drives while measurements are missing.
        config: what it was built for, if it was built for an environment; without one, actions are twists.
    """

    def __init__(
        self,
        perceive: Callable[[Any], Percept],
        make_estimator: Callable[[], Estimator],
        make_controller: Callable[[], Controller] = PIController.from_paper,
        robot: RobotConfig | None = None,
        dt: float = 1.0 / 30.0,
        recovery: Recovery | None = None,
        config: EnvConfig | None = None,
    ) -> None:
        self.config, self._recovery = config, recovery
        self._perceive = perceive
        self._make_estimator, self._make_controller = make_estimator, make_controller
        self._robot, self._kind = robot or RobotConfig(), config.action if config else "twist"
        self._dt = dt

    def predict(
        self,
        observation: Any,
        state: Any = None,
        episode_start: np.ndarray | None = None,
        deterministic: bool = True,
    ) -> tuple[np.ndarray, Any]:
        """Return (action, state) for one observation, or for a batch of n with a list of n states.

        Args:
            observation: of the mode that the perception reads, single or batched along the first axis.
            state: what the last call returned; None at the start.
            episode_start: (n,) or scalar; True forgets the state.
            deterministic: followers always are.

        Returns:
            Actions float32 in [-1, 1], (2,) or (n, 2): twist or wheel speeds as shares of the robot's limits.
        """
        batch = _split(observation)
        if batch is None:
            starts = state is None or (episode_start is not None and bool(np.any(episode_start)))
            return self._step(observation, None if starts else state)
        flags = np.zeros(len(batch), bool) if episode_start is None else np.asarray(episode_start).reshape(-1)
        states = [None] * len(batch) if state is None else state
        results = [self._step(o, None if f else s) for o, s, f in zip(batch, states, flags, strict=True)]
        return np.stack([action for action, _ in results]), [new for _, new in results]

    def _step(self, observation: Any, state: Any) -> tuple[np.ndarray, FollowerState]:
        if state is None:
            state = FollowerState(self._make_estimator(), self._make_controller())
        measurement, twist = self._perceive(observation)
        return self._drive(state, measurement, twist), state

    def _drive(self, state: FollowerState, measurement: Pair | None, twist: Pair) -> np.ndarray:
        """Estimate, and return the controller's action."""
        state.measurement = measurement
        state.estimator.predict(twist, self._dt)
        state.estimate = state.estimator.update(measurement)
        if state.estimate is None:
            return self._action(0.0, 0.0)
        if self._recovery is not None:
            state.missing = 0.0 if measurement is not None else state.missing + self._dt
            if measurement is not None:
                state.last_bearing = measurement[0]
            elif (search := self._recovery.command(state.last_bearing, state.missing)) is not None:
                state.controller.reset()
                return self._action(*search)
        return self._action(*state.controller.command(state.estimate.bearing, state.estimate.distance, self._dt))

    def _action(self, v: float, omega: float) -> np.ndarray:
        return action_of(v, omega, self._robot, self._kind)


def action_of(v: float, omega: float, robot: RobotConfig, kind: str = "twist") -> np.ndarray:
    """Return the action (2,) float32 in [-1, 1] that asks a robot for a twist, cut to its limits.

    Args:
        v: forward, m/s.
        omega: counter-clockwise, rad/s.
        robot: whose limits scale the action.
        kind: `"twist"`, or `"wheels"`: rim speeds (left, right), scaled together where one exceeds its limit.
    """
    shares = [min(max(share, -1.0), 1.0) for share in (v / robot.max_speed, omega / robot.max_yaw_rate)]
    if kind == "wheels":
        wheels = wheel_speeds(shares[0] * robot.max_speed, shares[1] * robot.max_yaw_rate, robot.track_width)
        top = max(robot.max_wheel_speed, *(abs(wheel) for wheel in wheels))
        shares = [wheel / top for wheel in wheels]
    return np.array(shares, np.float32)


def _split(observation: Any) -> list[Any] | None:
    """Return the single observations of a batch, or None when the observation is a single one."""
    if isinstance(observation, Mapping):
        if observation["depth"].ndim == 2:
            return None
        return [{key: value[i] for key, value in observation.items()} for i in range(len(observation["depth"]))]
    return None if np.ndim(observation) == 1 else list(observation)
