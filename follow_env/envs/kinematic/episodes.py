"""`Episodes`: what each world of a batch plays: its settings, its person's motion, its place."""

import dataclasses
import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from gymnasium.utils import seeding

from follow_env.camera.measurement import ErrorModel
from follow_env.config import EnvConfig
from follow_env.envs.kinematic.records import SETTINGS, TABLE_COLUMNS, TASK
from follow_env.envs.observations import largest_twist
from follow_env.world.kinematic.drive import kept_speed_error
from follow_env.world.kinematic.hull import pack_hull
from follow_env.world.kinematic.place import pack_place
from follow_env.world.kinematic.route import KERNEL_ROUTES
from follow_env.world.kinematic.world import check_torque
from follow_env.world.motion.base import MOTIONS, check_motion, make_motion, motion_table
from follow_env.world.motion.profile import PAPER_SPEED
from follow_env.world.people.dimensions import CHEST_HEIGHT
from follow_env.world.scenes import make_scene

SHARED = ("scene", "obs", "action", "camera", "renderer", "control_hz", "engine")
"""Settings that all worlds of a batch have in common."""
PROBES = 8
"""So many configurations are drawn at the start, to refuse early what cannot be played."""
PERSON_STEP = 1.0 / 30.0
"""The path of a person who walks a route of the kernel is integrated (Simpson) in steps of at most this, s."""


class Episodes:
    """The settings and motions of every world's episode, drawn from (seed, world, episode).

    What the compiled code draws itself (the routes of `KERNEL_ROUTES` with fixed settings) is left to it.

    Args:
        domain: what the settings are drawn from.
        worlds: (n,) `records.WORLD`.

    Attributes:
        is_fixed: whether every episode has the same settings.
        nominal: the settings that all worlds share.
        scene: the place.
        configs: of every world; one and the same object in a fixed domain.
        settings: (1,) or (n,) `records.SETTINGS`.
        place: the scene as the compiled code sees it.
        tables: (n, rows, 5), motions; (1, 1, 5) if there are none.
        tapes: (n, steps, 6), given draws of the measurement's errors; (1, 1, 6) if there are none.

    Raises:
        ValueError: for what a batch cannot play.
    """

    def __init__(self, domain: Any, worlds: np.ndarray) -> None:
        self._domain, self._worlds = domain, worlds
        self.is_fixed = bool(domain.is_fixed)
        self.nominal: EnvConfig = domain.nominal
        self._known_routes: set[str] = set()
        self.scene = make_scene(self.nominal.scene, self.nominal.light)
        rng = np.random.default_rng(0)
        for config in (self.nominal, *(domain.sample(rng) for _ in range(0 if self.is_fixed else PROBES))):
            self._check(config)
        self.configs = [self.nominal] * len(worlds)
        self.settings = np.zeros(1 if self.is_fixed else len(worlds), SETTINGS)
        self._heights = sorted((self.nominal.robot.camera_height, CHEST_HEIGHT))
        self.place = pack_place(self.scene, *self._heights)
        for i in range(len(self.settings)):
            self._pack(i, self.nominal)
        self.tables, self.tapes = np.zeros((1, 1, len(TABLE_COLUMNS))), np.zeros((1, 1, 6))
        self._routes: dict[int, Any] = {}
        self._always_drawn = not self.is_fixed or not self._in_kernel(self.nominal.route)

    @property
    def is_drawn(self) -> bool:
        """Whether there is anything to draw."""
        return self._always_drawn or bool(self._routes)

    @property
    def longest_delay(self) -> int:
        """Control steps of the largest latency that any world has now."""
        return int(self.settings["delay"].max())

    def use_route(self, route: Any, chosen: np.ndarray) -> None:
        """Let the next episodes of the chosen worlds (n,) have a route of their own."""
        self._check(dataclasses.replace(self.nominal, route=route))
        for i in np.flatnonzero(chosen):
            self._routes[int(i)] = route

    def draw(self, begins: np.ndarray) -> None:
        """Draw what the compiled code does not, for the worlds (n,) that begin an episode."""
        for i in np.flatnonzero(begins & ~self._worlds["given_motion"]):
            world = self._worlds[i]
            key = np.array((world["key"], world["episode"] + 1), np.uint64)
            rng = np.random.Generator(np.random.Philox(key=key))
            if not self.is_fixed:
                config = self._domain.sample(rng)
                self._check(config)
                self._use(int(i), config)
            config = self.configs[i]
            route = self._routes.pop(int(i), config.route)
            if self._in_kernel(route):
                world["route"] = KERNEL_ROUTES.index(route)
            else:
                self._start(int(i), route, rng)

    def start_as_single(self, seeds: Sequence[int]) -> None:
        """Give every world the start, the motion and the measurement errors that `FollowEnv` draws from a seed."""
        tapes = []
        for i, seed in enumerate(seeds):
            rng, _ = seeding.np_random(seed)
            if not self.is_fixed:
                config = self._domain.sample(rng)
                self._check(config)
                self._use(i, config)
            self._start(i, self.configs[i].route, rng)
            steps = int(self._worlds[i]["rows"])
            tapes.append([[*rng.standard_normal(2), *rng.random(4)] for _ in range(steps)])
        self.tapes = np.zeros((len(seeds), max(map(len, tapes)), 6))
        for tape, draws in zip(self.tapes, tapes, strict=True):
            tape[:] = draws[-1]
            tape[: len(draws)] = draws
        self._worlds["given_draws"] = True

    def _start(self, i: int, route: Any, rng: np.random.Generator) -> None:
        """Place the robot of world i, unless its pose is given, and write down the motion of its person."""
        world, config = self._worlds[i], self.configs[i]
        x, y, yaw = self.scene.start
        y += float(rng.uniform(-1.0, 1.0)) * self.scene.start_width
        if not world["given_pose"]:
            world["x"], world["y"], world["yaw"] = x, y, yaw
        away = config.task.set_point
        ahead = (x + away * math.cos(yaw), y + away * math.sin(yaw), yaw)
        motion = make_motion(route, self.scene, ahead, rng, config.walking_speed)
        table = motion_table(motion, config.dt)
        count, rows, columns = self.tables.shape
        if count < len(self._worlds) or rows < len(table):
            grown = np.zeros((len(self._worlds), max(rows, len(table)), columns))
            grown[:count, :rows] = self.tables
            self.tables = grown
        self.tables[i, : len(table)] = table
        world["duration"], world["rows"], world["given_motion"] = motion.duration, len(table), True

    def _use(self, i: int, config: EnvConfig) -> None:
        self.configs[i] = config
        self._pack(i, config)
        height = config.robot.camera_height
        if not self._heights[0] <= height <= self._heights[1]:
            self._heights = [min(self._heights[0], height), max(self._heights[1], height)]
            self.place = pack_place(self.scene, *self._heights)

    def _check(self, config: EnvConfig) -> None:
        """Raise a ValueError for what a batch cannot play."""
        for name in SHARED:
            one, other = getattr(config, name), getattr(self.nominal, name)
            if one != other:
                raise ValueError(
                    f"{name} is {one!r} in one world and {other!r} in another; the worlds of a batch share it: "
                    "give one value, or make several batches"
                )
        fastest, (v, omega) = config.robot.max_wheel_speed, largest_twist(self.nominal.robot)
        if fastest > v or 2.0 * fastest / config.robot.track_width > omega:
            raise ValueError(
                f"a robot with max_wheel_speed {fastest!r} and track_width {config.robot.track_width!r} is faster than "
                f"the observations hold ({v:.3g} m/s, {omega:.3g} rad/s); give the domain a faster nominal robot"
            )
        check_batchable(config)
        self._check_route(config.route)

    def _check_route(self, route: Any) -> None:
        """Raise a ValueError for a route that nobody can walk here; names are looked up once."""
        key = MOTIONS.parts(route)[0] if isinstance(route, str | Mapping) else repr(route)
        if key in self._known_routes:
            return
        if key == "commanded":
            raise ValueError("route 'commanded' needs somebody who leads each person; expected another one in a batch")
        check_motion(route, self.scene, self.nominal.task.set_point, self.nominal.walking_speed)
        self._known_routes.add(key)

    @staticmethod
    def _in_kernel(route: Any) -> bool:
        return isinstance(route, str) and route in KERNEL_ROUTES

    def _pack(self, i: int, config: EnvConfig) -> None:
        robot, start = config.robot, self.scene.start
        task = config.task
        values = {
            "observe_state": config.obs == "state",
            "measure": config.obs == "measurement",
            "pictures": config.obs.startswith("rgbd"),
            "wheel_actions": config.action == "wheels",
            "route": KERNEL_ROUTES.index(config.route) if self._in_kernel(config.route) else -1,
            "substeps": config.substeps,
            "person_substeps": max(math.ceil(config.dt / PERSON_STEP - 1e-9), 1),
            "delay": config.delay,
            "dt": config.dt,
            "decay": kept_speed_error(config.dt, config.substeps, robot.wheel_time_constant),
            "stretch": PAPER_SPEED / config.walking_speed,
            **dict(zip(("start_x", "start_y", "start_yaw"), start, strict=True)),
            "start_width": self.scene.start_width,
            "half_view": math.tan(0.5 * math.radians(config.camera.hfov_deg)),
            "hull": pack_hull(robot),
            "task": tuple(getattr(task, name) for name in TASK.names or ()),
            **ErrorModel.of(config.sensor.measurement, config.dt)._asdict(),
        }
        for name in SETTINGS.names or ():
            self.settings[name][i] = values[name] if name in values else getattr(robot, name)


def check_batchable(config: EnvConfig) -> None:
    """Raise a ValueError for what `FollowEnv` can do and a batch cannot."""
    if config.obs == "rgbd_box":
        raise ValueError("a batch does not observe 'rgbd_box'; expected another obs, or vectorization_mode='sync'")
    if config.renderer != "raster":
        raise ValueError(f"renderer {config.renderer!r} draws one world only; expected 'raster' in a batch")
    check_torque(config.robot)
