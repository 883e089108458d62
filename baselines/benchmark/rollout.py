"""`rollout`: plays an episode of any environment settings with any policy, and keeps all of it."""

from __future__ import annotations

import warnings
from collections.abc import Mapping
from typing import Any

import numpy as np

from baselines.benchmark.trace import Trace
from follow_env.envs.task import REWARD_TERMS
from tracker.estimators import LockOutWarning

_NOTHING = (0.0, 0.0)


def rollout(env: Any, policy: Any, seed: int, options: Mapping[str, Any] | None = None) -> Trace:
    """Play an episode and return its trace.

    The observation at reset and the last one are both shown to the policy: what it believes of a moment is kept beside
    what was true then.

    Args:
        env: a `FollowEnv`, wrapped or not.
        policy: anything with `predict(observation, state, episode_start=..., deterministic=...)`. If its state has
            `measurement` and `estimate` (`baselines.followers.policy.Belief`), they are kept too.
        seed: of the environment's reset.
        options: of the environment's reset.
    """
    rows: list[dict[str, Any]] = []
    state, action, terminated, truncated = None, None, False, False
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", LockOutWarning)  # the trace holds the inflated steps
        observation, info = env.reset(seed=seed, options=None if options is None else dict(options))
        while True:
            start = np.array([not rows])
            action, state = policy.predict(observation, state, episode_start=start, deterministic=True)
            rows.append(_moment(info, action, state))
            if terminated or truncated:
                break
            observation, _, terminated, truncated, info = env.step(action)
    config = env.unwrapped.config
    try:
        plain = config.to_json()
    except ValueError:
        plain = {}
    columns = {name: np.array([row[name] for row in rows]) for name in rows[0]}
    return Trace(
        seed=seed,
        config=plain,
        terminated=bool(terminated),
        success=bool(info["is_success"]),
        distance_set_point=config.task.set_point,
        **columns,
    )


def _moment(info: Mapping[str, Any], action: Any, state: Any) -> dict[str, Any]:
    measurement, estimate = getattr(state, "measurement", None), getattr(state, "estimate", None)
    return {
        "time": float(info["time"]),
        "robot": info["robot_pose"],
        "person": info["person_pose"],
        "person_velocity": info["person_velocity"],
        "bearing": float(info["bearing"]),
        "distance": float(info["distance"]),
        "surface_distance": float(info["surface_distance"]),
        "visible": bool(info["visible"]),
        "collision": bool(info["collision"]),
        "saturated": bool(info["saturated"]),
        "collision_with": str(info["collision_with"]),
        "twist": info["twist"],
        "command": info["command"],
        "action": np.asarray(action, np.float64),
        "rewards": [info["rewards"][name] for name in REWARD_TERMS],
        "measured": measurement is not None,
        "measurement": _NOTHING if measurement is None else measurement,
        "estimated": estimate is not None,
        "estimate": _NOTHING if estimate is None else (estimate.bearing, estimate.distance),
        "variance": _NOTHING if estimate is None else estimate.variance,
        "innovation": _NOTHING if estimate is None else estimate.innovation,
        "nis": _NOTHING if estimate is None else estimate.nis,
        "inflation": _NOTHING if estimate is None else estimate.inflation,
        "judged": ("miss", "miss") if estimate is None else estimate.action,
    }
