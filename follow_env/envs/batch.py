"""`FollowVectorEnv`: thousands of `FollowEnv`'s worlds at once, kinematic and compiled."""

import math
import os
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from itertools import pairwise
from typing import Any

import gymnasium
import numpy as np
from gymnasium import spaces
from gymnasium.vector import AutoresetMode
from gymnasium.vector.utils import batch_space

from follow_env.camera.pinhole import PinholeCamera
from follow_env.compilation import announced
from follow_env.config import EnvConfig
from follow_env.domain import Domain
from follow_env.envs.kinematic.episodes import Episodes
from follow_env.envs.kinematic.kernels import BEGIN, SKIP, STEP, play
from follow_env.envs.kinematic.pictures import Pictures
from follow_env.envs.kinematic.records import INFO, WORLD
from follow_env.envs.observations import observation_space
from follow_env.envs.task import REWARD_TERMS
from follow_env.registry import choose
from follow_env.world.kinematic.philox import keys
from follow_env.world.kinematic.place import COLLISIONS

WORLDS_PER_THREAD = 512
"""A thread is worth its while from this many worlds."""
_LABELS = np.array(COLLISIONS, object)


class FollowVectorEnv(gymnasium.vector.VectorEnv):
    """`num_envs` worlds of `FollowEnv` in one process, stepped together by compiled code.

    Routes, measurements, rewards, endings, observations and info mean what they mean in `FollowEnv`; the same numbers
    are distributed in the same way, but a seed gives other episodes. The robot moves by kinematics instead of PyBullet:
    the same limits and wheel response, exact arcs, no slip, and what it touches ends the episode but does not push
    back. `metadata["engine"]` is `"kinematic"`. `docs/engines.md` states the differences.

    World i is determined by (seed, i): neither by `num_envs` nor by `threads`. A list of seeds makes world i that of
    world 0 of the i-th seed.

    Args:
        num_envs: number of worlds.
        config: as in `FollowEnv`: an `EnvConfig`, a mapping, a `Domain` or None. Of a domain every world draws its own
            settings in every episode; scene, observation, action, camera, renderer and control rate are the same in
            all worlds.
        autoreset_mode: `AutoresetMode` or its value: `"NextStep"` (Gymnasium's default), `"SameStep"` (what
            Stable-Baselines3 does) or `"Disabled"`.
        threads: threads that share the worlds; by default one for each processor.
        settings: those of `FollowEnv`. A batch refuses `obs="rgbd_box"`, another renderer than `"raster"`, a
            `render_mode`, `route="commanded"` and the robot's `max_wheel_torque`. A route other than `"paper"`,
            `"straight"` and `"standing"` is drawn in Python, episode by episode, and walked from its table.

    Raises:
        ValueError: for an unknown name or an impossible value, in one sentence.
    """

    metadata = {"render_modes": [], "autoreset_mode": AutoresetMode.NEXT_STEP, "engine": "kinematic"}  # noqa: RUF012

    def __init__(
        self,
        num_envs: int = 1,
        config: Any = None,
        autoreset_mode: AutoresetMode | str = AutoresetMode.NEXT_STEP,
        threads: int | None = None,
        **settings: Any,
    ) -> None:
        for what, value in (("num_envs", num_envs), ("threads", threads)):
            if value is not None and (type(value) is not int or value < 1):
                raise ValueError(f"{what} is {value!r}; expected a whole number from 1")
        name = autoreset_mode.value if isinstance(autoreset_mode, AutoresetMode) else autoreset_mode
        mode = AutoresetMode(choose("autoreset_mode", name, [m.value for m in AutoresetMode]))
        if (render_mode := settings.pop("render_mode", None)) is not None:
            raise ValueError(f"render_mode is {render_mode!r}; expected None in a batch: watch a FollowEnv instead")
        self._worlds = np.zeros(num_envs, WORLD)
        self._episodes = Episodes(Domain.of(config, **settings), self._worlds)
        self.num_envs, self._mode = num_envs, mode
        self.config = self._episodes.nominal
        camera = PinholeCamera(self.config.camera)
        self.metadata = {**self.metadata, "render_fps": self.config.control_hz, "autoreset_mode": mode}
        self.single_action_space = spaces.Box(-1.0, 1.0, (2,), np.float32)
        self.single_observation_space = observation_space(self.config.obs, camera, self.config.robot)
        self.action_space = batch_space(self.single_action_space, num_envs)
        self.observation_space = batch_space(self.single_observation_space, num_envs)
        self._queues = np.zeros((num_envs, self._episodes.longest_delay, 3))
        pictures = self.config.obs.startswith("rgbd")
        self._observations = np.zeros((num_envs, 0 if pictures else 8), np.float32)
        self._done = np.zeros(num_envs, bool)
        self._started = False
        threads = threads or os.cpu_count() or 1
        self._ranges = _shares(num_envs, min(threads, max(num_envs // WORLDS_PER_THREAD, 1)))
        self._pictures: Pictures | None = None
        parts = len(self._ranges)
        with announced("the worlds"):
            self._play(0, 0, np.zeros(num_envs, np.int8), np.zeros((num_envs, 2)), *self._outcome())
            if pictures:
                parts = min(threads, num_envs)
                self._pictures = Pictures(self._episodes, self._worlds, _shares(num_envs, parts))
        self._pool = ThreadPoolExecutor(parts - 1) if parts > 1 else None

    @property
    def configs(self) -> tuple[EnvConfig, ...]:
        """The settings of the episode that each world plays."""
        return tuple(self._episodes.configs)

    def reset(
        self, *, seed: int | Sequence[int] | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Any, dict[str, Any]]:
        """Start an episode in every world, or in those of a mask.

        Args:
            seed: a number, or one for each world; None goes on with the worlds' next episodes.
            options: `reset_mask` ((num_envs,) bool: the worlds to start), `route` and `robot_pose` ((x, y, yaw)
                or one for each world, (num_envs, 3); m and rad): for these episodes only.
        """
        options = dict(options or {})
        for key in options:
            choose("reset option of a batch", key, ("reset_mask", "route", "robot_pose"))
        chosen = self._mask(options.get("reset_mask"))
        self._seed(seed, chosen)
        if "route" in options:
            self._episodes.use_route(options["route"], chosen)
        if "robot_pose" in options:
            self._place_robots(options["robot_pose"], chosen)
        return self._begin(chosen)

    def reset_as_single(self, seeds: Sequence[int]) -> tuple[Any, dict[str, Any]]:
        """Start in every world the episode that `FollowEnv.reset(seed=...)` starts: its route and measurement errors.

        What follows after the episode's end is the world's own again.

        Args:
            seeds: one for each world.
        """
        if len(seeds) != self.num_envs:
            raise ValueError(f"{len(seeds)} seeds for {self.num_envs} worlds; expected one for each world")
        self._seed(seeds, np.ones(self.num_envs, bool))
        self._episodes.start_as_single(seeds)
        return self._begin(np.ones(self.num_envs, bool))

    def step(self, actions: np.ndarray) -> tuple[Any, np.ndarray, np.ndarray, np.ndarray, dict[str, Any]]:
        """Drive every world for one control period; a world that ended begins anew as `autoreset_mode` says."""
        if not self._started:
            raise gymnasium.error.ResetNeeded("step() was called before reset(); call reset() first")
        commands = np.ascontiguousarray(actions, np.float64)
        if commands.shape != (self.num_envs, 2):
            raise ValueError(f"the actions have shape {commands.shape}; expected {(self.num_envs, 2)}, in [-1, 1]")
        if not np.isfinite(commands).all():
            i = int(np.argmin(np.isfinite(commands).all(axis=1)))
            raise ValueError(f"the action of world {i} is {commands[i].tolist()}; expected finite numbers in [-1, 1]")
        todo = np.full(self.num_envs, STEP, np.int8)
        if self._mode is AutoresetMode.NEXT_STEP:
            self._draw(self._done)
            todo[self._done] = BEGIN
        elif self._mode is AutoresetMode.DISABLED and self._done.any():
            i = int(np.argmax(self._done))
            raise gymnasium.error.ResetNeeded(
                f"the episode of world {i} has ended; reset it with options={{'reset_mask': terminated | truncated}}"
            )
        outcome = self._outcome()
        observations, infos, rewards, terminated, truncated = outcome
        self._run(todo, commands, *outcome)
        self._done = terminated | truncated
        final: dict[str, Any] = {}
        if self._mode is AutoresetMode.SAME_STEP and self._done.any():
            final = self._finals(*self._observed(observations.copy(), infos.copy(), self._done.copy()))
            self._draw(self._done)
            self._run(np.where(self._done, BEGIN, SKIP).astype(np.int8), commands, *outcome)
        observation, info = self._observed(observations, infos, np.ones(self.num_envs, bool))
        return observation, rewards, terminated, truncated, {**info, **final}

    def close_extras(self, **kwargs: Any) -> None:
        """Stop the threads."""
        if self._pool is not None:
            self._pool.shutdown()

    def _draw(self, begins: np.ndarray) -> None:
        """Draw what the next episodes of these worlds (n,) are, where the compiled code does not."""
        episodes, queues = self._episodes, self._queues
        if episodes.is_drawn and begins.any():
            episodes.draw(begins)
            if episodes.longest_delay > queues.shape[1]:
                self._queues = np.zeros((self.num_envs, episodes.longest_delay, 3))
                self._queues[:, : queues.shape[1]] = queues

    def _begin(self, chosen: np.ndarray) -> tuple[Any, dict[str, Any]]:
        self._draw(chosen)
        outcome = self._outcome()
        observations, infos, *_ = outcome
        if not chosen.all():
            observations[:], infos[:] = self._observations, np.zeros(1, INFO)
        self._run(np.where(chosen, BEGIN, SKIP).astype(np.int8), np.zeros((self.num_envs, 2)), *outcome)
        self._done = self._done & ~chosen
        return self._observed(observations, infos, chosen)

    def _observed(self, observations: np.ndarray, infos: np.ndarray, mask: np.ndarray) -> tuple[Any, dict[str, Any]]:
        """Return the observation and Gymnasium's vector form of info, valid for the worlds of the mask."""
        info = _report(infos, mask)
        if self._pictures is None:
            self._observations = observations.copy()
            return observations, info
        colors, depth = self._pictures.observed()
        if self.config.obs == "rgbd_uint8":
            return colors, info | {"depth": depth, "_depth": mask}
        return {"rgb": colors, "depth": depth, "twist": infos["twist"].astype(np.float32)}, info

    def _outcome(self) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """Return fresh arrays for observations, infos, rewards, terminated and truncated."""
        n = self.num_envs
        ends = np.zeros(n, bool), np.zeros(n, bool)
        return np.empty_like(self._observations), np.empty(n, INFO), np.zeros(n), *ends

    def _run(self, todo: np.ndarray, *arrays: np.ndarray) -> None:
        """Let the threads play all worlds, then draw them."""
        failures = sum(self._share([partial(self._play, *ends, todo, *arrays) for ends in self._ranges]))
        if failures:
            raise ValueError(
                f"no route of 12 m with turns of 20-50 deg fits the scene {self._episodes.scene.name!r} in {failures} "
                "worlds; widen its free lane"
            )
        if self._pictures is not None and not all(self._share(self._pictures.jobs(todo))):
            raise ValueError("a person has a vertex that is not finite; expected world coordinates in meters")

    def _share(self, jobs: list[Callable[[], Any]]) -> list[Any]:
        """Do the jobs, the first in this thread, and return what they return."""
        others = [self._pool.submit(job) for job in jobs[1:]] if self._pool is not None else []
        return [jobs[0](), *(other.result() for other in others)]

    def _play(self, first: int, last: int, todo: np.ndarray, actions: np.ndarray, *outcome: np.ndarray) -> int:
        episodes = self._episodes
        given = (todo, self._worlds, self._queues, episodes.tapes, episodes.tables, episodes.settings, episodes.place)
        return play(first, last, *given, actions, *outcome)

    def _mask(self, mask: Any) -> np.ndarray:
        if mask is None:
            return np.ones(self.num_envs, bool)
        right = isinstance(mask, np.ndarray) and mask.dtype == np.bool_ and mask.shape == (self.num_envs,)
        if not right or not mask.any():
            raise ValueError(f"reset_mask is {mask!r}; expected a bool array ({self.num_envs},) with at least one True")
        if not self._started and not mask.all():
            raise gymnasium.error.ResetNeeded("reset_mask leaves out worlds that never began; call reset() first")
        return np.array(mask)

    def _seed(self, seed: int | Sequence[int] | None, chosen: np.ndarray) -> None:
        """Give the chosen worlds new keys if there is a seed, or if there never was one."""
        if seed is None and self._started:
            return
        if seed is None:
            drawn = keys(np.uint64(self.np_random.integers(0, 2**63)), self.num_envs)
        elif isinstance(seed, int | np.integer):
            super().reset(seed=int(seed))
            drawn = keys(_entropy(int(seed)), self.num_envs)
        else:
            if len(seed) != self.num_envs:
                raise ValueError(f"{len(seed)} seeds for {self.num_envs} worlds; expected one for each world, or one")
            drawn = np.array([keys(_entropy(int(s)), 1)[0] for s in seed], np.uint64)
        self._worlds["key"][chosen] = drawn[chosen]
        self._worlds["episode"][chosen] = 0
        self._worlds["route"][chosen] = self._episodes.settings["route"][0]
        self._started = True

    def _place_robots(self, poses: Any, chosen: np.ndarray) -> None:
        if np.ndim(poses) == 1:
            poses = [poses] * self.num_envs
        if len(poses) != self.num_envs:
            raise ValueError(
                f"{len(poses)} robot poses for {self.num_envs} worlds; expected one for each world, or one"
            )
        for i in np.flatnonzero(chosen):
            world = self._worlds[i]
            world["x"], world["y"], world["yaw"] = _pose(poses[i])
            world["given_pose"] = True

    def _finals(self, observation: Any, info: dict[str, Any]) -> dict[str, Any]:
        """Return `final_obs` and `final_info` of the worlds that are done, as Gymnasium's `SAME_STEP` wants them."""
        last = np.full(self.num_envs, None, object)
        parts = isinstance(observation, dict)
        for i in np.flatnonzero(self._done):
            last[i] = {key: value[i] for key, value in observation.items()} if parts else observation[i]
        mask = self._done.copy()
        return {"final_obs": last, "_final_obs": mask, "final_info": info, "_final_info": mask}


def _shares(count: int, parts: int) -> list[tuple[int, int]]:
    """Return the ends of `parts` ranges that cover 0 <= i < count."""
    edges = [count * k // parts for k in range(parts + 1)]
    return list(pairwise(edges))


def _pose(value: Any) -> tuple[float, float, float]:
    try:
        x, y, yaw = (float(number) for number in value)
    except (TypeError, ValueError):
        x = y = yaw = math.nan
    if not (math.isfinite(x) and math.isfinite(y) and math.isfinite(yaw)):
        raise ValueError(f"robot_pose is {value!r}; expected three finite numbers (x, y, yaw)")
    return x, y, yaw


def _entropy(seed: int) -> np.uint64:
    if seed < 0:
        raise ValueError(f"seed is {seed!r}; expected a whole number >= 0")
    return np.uint64(np.random.SeedSequence(seed).generate_state(1, np.uint64)[0])


def _report(infos: np.ndarray, mask: np.ndarray) -> dict[str, Any]:
    """Return the records as Gymnasium's vector form of info: an array and a mask `_key` for each key."""
    result: dict[str, Any] = {}
    for name in INFO.names or ():
        if name == "rewards":
            terms = {term: infos[name][:, k] for k, term in enumerate(REWARD_TERMS)}
            result[name] = {**terms, **{f"_{term}": mask for term in REWARD_TERMS}}
        else:
            result[name] = _LABELS[infos[name]] if name == "collision_with" else infos[name]
        result[f"_{name}"] = mask
    return result
