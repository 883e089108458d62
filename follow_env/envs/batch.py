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
from gymnasium.utils import seeding
from gymnasium.vector import AutoresetMode
from gymnasium.vector.utils import batch_space

from follow_env.compilation import announced
from follow_env.envs.follow import FollowEnv, _pose
from follow_env.envs.kinematic.kernels import BEGIN, SKIP, STEP, play
from follow_env.envs.kinematic.pictures import Pictures
from follow_env.envs.task import REWARD_TERMS, SET_POINT
from follow_env.registry import choose
from follow_env.world.kinematic.philox import keys
from follow_env.world.kinematic.place import COLLISIONS, pack_place
from follow_env.world.kinematic.records import INFO, ROUTE_NUMBERS, TABLE_COLUMNS, WORLD, pack_settings
from follow_env.world.kinematic.world import check_torque
from follow_env.world.motion.routes import Route, choose_route, make_route
from follow_env.world.people.dimensions import CHEST_HEIGHT

OBSERVATIONS = ("measurement", "state", "rgbd", "rgbd_uint8")
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
        autoreset_mode: `AutoresetMode` or its value: `"NextStep"` (Gymnasium's default), `"SameStep"` (what
            Stable-Baselines3 does) or `"Disabled"`.
        threads: threads that share the worlds; by default one for each processor.
        settings: those of `FollowEnv`. Not to be had in a batch: `obs="rgbd_box"`, `renderer="tiny"`, a `render_mode`,
            the robot's `max_wheel_torque`.

    Raises:
        ValueError: for an unknown name or an impossible value, in one sentence.
    """

    metadata = {"render_modes": [], "autoreset_mode": AutoresetMode.NEXT_STEP, "engine": "kinematic"}  # noqa: RUF012

    def __init__(
        self,
        num_envs: int = 1,
        autoreset_mode: AutoresetMode | str = AutoresetMode.NEXT_STEP,
        threads: int | None = None,
        **settings: Any,
    ) -> None:
        for what, value in (("num_envs", num_envs), ("threads", threads)):
            if value is not None and (type(value) is not int or value < 1):
                raise ValueError(f"{what} is {value!r}; expected a whole number from 1")
        name = autoreset_mode.value if isinstance(autoreset_mode, AutoresetMode) else autoreset_mode
        mode = AutoresetMode(choose("autoreset_mode", name, [m.value for m in AutoresetMode]))
        single = FollowEnv(**settings)
        _check_batchable(single)
        self.num_envs, self._mode, self._single = num_envs, mode, single
        self.metadata = {**self.metadata, "render_fps": single.metadata["render_fps"], "autoreset_mode": mode}
        self.single_action_space, self.single_observation_space = single.action_space, single.observation_space
        self.action_space = batch_space(single.action_space, num_envs)
        self.observation_space = batch_space(single.observation_space, num_envs)
        self._settings = pack_settings(single)
        self._place = pack_place(single.scene, single.robot_config.camera_height, CHEST_HEIGHT)
        self._worlds = np.zeros(num_envs, WORLD)
        self._queues = np.zeros((num_envs, single._delay, 3))
        self._tapes = np.zeros((1, 1, 6))
        self._tables = np.zeros((1, 1, len(TABLE_COLUMNS)))
        self._observations = np.zeros((num_envs, 0 if self._settings["pictures"][0] else 8), np.float32)
        self._done = np.zeros(num_envs, bool)
        self._started = False
        threads = threads or os.cpu_count() or 1
        self._ranges = _shares(num_envs, min(threads, max(num_envs // WORLDS_PER_THREAD, 1)))
        self._pictures: Pictures | None = None
        parts = len(self._ranges)
        with announced("the worlds"):
            self._play(0, 0, np.zeros(num_envs, np.int8), np.zeros((num_envs, 2)), *self._outcome())
            if self._settings["pictures"][0]:
                parts = min(threads, num_envs)
                self._pictures = Pictures(single, self._worlds, _shares(num_envs, parts))
        self._pool = ThreadPoolExecutor(parts - 1) if parts > 1 else None

    def reset(
        self, *, seed: int | Sequence[int] | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Any, dict[str, Any]]:
        """Start an episode in every world, or in those of a mask.

        Args:
            seed: a number, or one for each world; None goes on with the worlds' next episodes.
            options: `reset_mask` ((num_envs,) bool: the worlds to start), `route` (name) and `robot_pose` ((x, y, yaw)
                or one for each world, (num_envs, 3); m and rad): for these episodes only.
        """
        options = dict(options or {})
        for key in options:
            choose("reset option of a batch", key, ("reset_mask", "route", "robot_pose"))
        chosen = self._mask(options.get("reset_mask"))
        self._seed(seed, chosen)
        if "route" in options:
            self._worlds["route"][chosen] = ROUTE_NUMBERS[choose_route(options["route"], self._single.scene)]
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
        single, tapes, tables = self._single, [], []
        for i, seed in enumerate(seeds):
            rng, _ = seeding.np_random(seed)
            x, y, yaw = single.scene.start
            y += float(rng.uniform(-1.0, 1.0)) * single.scene.start_width
            ahead = (x + SET_POINT * math.cos(yaw), y + SET_POINT * math.sin(yaw), yaw)
            route = make_route(single._route_name, single.scene, ahead, rng, single._walking_speed)
            steps = math.ceil(route.duration / single.dt) + 1
            tables.append(_table(route, steps, single.dt))
            world = self._worlds[i]
            world["x"], world["y"], world["yaw"] = x, y, yaw
            world["duration"], world["rows"] = route.duration, steps
            tapes.append([[*rng.standard_normal(2), *rng.random(4)] for _ in range(steps)])
        self._tapes, self._tables = np.array(tapes), np.array(tables)
        everyone = np.ones(self.num_envs, bool)
        self._seed(seeds, everyone)
        self._worlds["given_start"] = True
        return self._begin(everyone)

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
            self._run(np.where(self._done, BEGIN, SKIP).astype(np.int8), commands, *outcome)
        observation, info = self._observed(observations, infos, np.ones(self.num_envs, bool))
        return observation, rewards, terminated, truncated, {**info, **final}

    def close_extras(self, **kwargs: Any) -> None:
        """Stop the threads."""
        if self._pool is not None:
            self._pool.shutdown()

    def _begin(self, chosen: np.ndarray) -> tuple[Any, dict[str, Any]]:
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
        if self._single._obs == "rgbd_uint8":
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
                f"no route of 12 m with turns of 20-50 deg fits the scene {self._single.scene.name!r} in {failures} "
                "worlds; widen its free lane"
            )
        if self._pictures is not None and not all(self._share(self._pictures.jobs(todo))):
            raise ValueError("a person has a vertex that is not finite; expected world coordinates in meters")

    def _share(self, jobs: list[Callable[[], Any]]) -> list[Any]:
        """Do the jobs, the first in this thread, and return what they return."""
        others = [self._pool.submit(job) for job in jobs[1:]] if self._pool is not None else []
        return [jobs[0](), *(other.result() for other in others)]

    def _play(self, first: int, last: int, todo: np.ndarray, actions: np.ndarray, *outcome: np.ndarray) -> int:
        given = (todo, self._worlds, self._queues, self._tapes, self._tables, self._settings, self._place, actions)
        return play(first, last, *given, *outcome)

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
        self._worlds["route"][chosen] = self._settings["route"][0]
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


def _table(route: Route, rows: int, dt: float) -> np.ndarray:
    """Return a route's `TABLE_COLUMNS` at times 0, dt, ..., (rows, 5)."""
    times = [k * dt for k in range(rows)]
    return np.array([(*route.pose(t), route.speed(t), route.walked(t)) for t in times])


def _check_batchable(single: FollowEnv) -> None:
    """Raise a ValueError for what `FollowEnv` can do and a batch cannot."""
    if single._obs not in OBSERVATIONS:
        raise ValueError(
            f"obs {single._obs!r} is not to be had in a batch; expected one of {', '.join(map(repr, OBSERVATIONS))}, "
            "or vectorization_mode='sync'"
        )
    if single._renderer_name != "raster":
        raise ValueError(f"renderer {single._renderer_name!r} draws one world only; expected 'raster' in a batch")
    if single.render_mode is not None:
        raise ValueError(f"render_mode is {single.render_mode!r}; expected None in a batch: watch a FollowEnv instead")
    check_torque(single.robot_config)


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
