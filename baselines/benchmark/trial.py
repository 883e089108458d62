"""`Scenario` and `Trial`: what is played, as data that a file, a hash and another process can carry."""

from __future__ import annotations

import dataclasses
import hashlib
import json
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from baselines.benchmark.identity import content, told
from baselines.benchmark.trace import Trace
from baselines.followers.spec import FollowerSpec
from follow_env.domain import Domain


@dataclass(frozen=True)
class Scenario:
    """A situation that followers are measured in.

    Attributes:
        name: within its suite.
        settings: of the environment, as `FollowEnv` takes them; any may be a distribution.
        version: counts the changes of what is asked.
        tags: what it is about.
        card: what it asks, and what success is, in a sentence or two.
    """

    name: str
    settings: Mapping[str, Any] = field(default_factory=dict)
    version: int = 1
    tags: tuple[str, ...] = ()
    card: str = ""

    def domain(self, **changes: Any) -> Domain:
        """Return the environment's settings, with some replaced."""
        return Domain.of(dict(self.settings), **changes)


@dataclass(frozen=True)
class Trial:
    """A follower in a scenario; with a seed it is one episode.

    Attributes:
        suite: name of the suite.
        scenario: where.
        follower: who drives.
        changes: settings that this run replaces, such as the engine.
    """

    suite: str
    scenario: Scenario
    follower: FollowerSpec
    changes: Mapping[str, Any] = field(default_factory=dict)

    @property
    def key(self) -> str:
        """A name that is the same in every process; another setting, object, own source or file gives another."""
        spec = self.follower
        file = Path(spec.policy) if isinstance(spec.policy, str | Path) else None
        whole = {
            "scenario": [self.suite, self.scenario.name, self.scenario.version],
            "settings": told(self.scenario.settings),
            "changes": told(self.changes),
            "follower": {part.name: told(getattr(spec, part.name)) for part in dataclasses.fields(spec)},
            "file": None if file is None or not file.exists() else content(file),
        }
        text = json.dumps(whole, sort_keys=True)
        return (
            f"{self.suite}/{self.scenario.name}/{self.follower.name}/{hashlib.sha256(text.encode()).hexdigest()[:12]}"
        )


class TrialPlayer:
    """Plays trials, and keeps the last environment: trials of one scenario come one after another."""

    def __init__(self) -> None:
        self._env: Any = None
        self._made: Any = None

    def __call__(self, trial: Trial, seed: int) -> Trace:
        """Play the episode of a seed; what was played before does not change it."""
        from baselines.benchmark.rollout import rollout
        from baselines.followers.build import build_follower, observation_settings
        from follow_env.envs.follow import FollowEnv

        made = trial.scenario, observation_settings(trial.follower), dict(trial.changes)
        if self._env is None or self._made != made:
            self.close()
            self._env, self._made = FollowEnv(trial.scenario.domain(**made[1], **made[2])), made
        return rollout(self._env, _Follows(trial.follower, self._env, build_follower), seed)

    def __getstate__(self) -> dict[str, Any]:
        """A player is sent to a worker empty: each process makes its own environments."""
        return {"_env": None, "_made": None}

    def close(self) -> None:
        """Close the environment; calling it again does nothing."""
        if self._env is not None:
            self._env.close()
            self._env = None


class _Follows:
    """Builds the follower when the episode's settings are drawn: at its first observation."""

    def __init__(self, spec: FollowerSpec, env: Any, build: Any) -> None:
        self._spec, self._env, self._build = spec, env, build
        self._policy: Any = None

    def predict(self, observation: Any, state: Any = None, **settings: Any) -> tuple[Any, Any]:
        if self._policy is None:
            self._policy = self._build(self._spec, self._env)
        action, state = self._policy.predict(observation, state, **settings)
        return action, state
