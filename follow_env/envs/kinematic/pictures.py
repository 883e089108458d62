"""`Pictures`: what the robots of a batch see, rendered by threads, with the sensor's errors and its latency."""

import itertools
from collections.abc import Callable, Hashable
from functools import partial
from typing import Any

import numpy as np

from follow_env.camera.pinhole import CameraPose, PinholeCamera
from follow_env.camera.raster.scene import ScenePack, pack_scene
from follow_env.camera.raster.work import make_view, make_workspace, pack_people
from follow_env.camera.sensor.errors import RGBDSensor
from follow_env.config import EnvConfig
from follow_env.envs.kinematic.episodes import Episodes
from follow_env.envs.kinematic.kernels import BEGIN, SKIP, STEP
from follow_env.envs.kinematic.render_worlds import Canvas, Studio, paint
from follow_env.world.people.bodies import load_body
from follow_env.world.people.walker import Walker
from follow_env.world.scenes import make_scene

MOST_LOOKS = 64
"""A thread keeps the buffers of so many different people, lights and sensors; then it begins to collect anew."""


class Pictures:
    """The latest pictures of every world, as many as the largest latency wants.

    A world's first picture stands until it is old enough.

    Args:
        episodes: what the worlds play.
        worlds: (n,) `records.WORLD`.
        ranges: of worlds, one for each thread.
    """

    def __init__(self, episodes: Episodes, worlds: np.ndarray, ranges: list[tuple[int, int]]) -> None:
        self._episodes, self._worlds, self._ranges = episodes, worlds, ranges
        config = episodes.nominal
        self._camera = PinholeCamera(config.camera)
        shape = (episodes.longest_delay + 1, len(worlds), self._camera.height, self._camera.width)
        self._rgb, self._depth = np.zeros((*shape, 3), np.uint8), np.zeros(shape, np.float32)
        self._shape = (*shape[1:], 4 if config.obs == "rgbd_uint8" else 3)
        self._scenes: dict[str, ScenePack] = {}
        self._looks: list[dict[Hashable, Studio]] = [{} for _ in ranges]
        self._studios = [self._studio(k, config) for k, (first, last) in enumerate(ranges) for _ in range(last - first)]
        self._observed = self._blank()
        images = self._rgb, self._depth, *self._observed
        paint(0, 0, np.zeros(0, np.int8), worlds, episodes.settings, self._studios[0], *images)

    def jobs(self, todo: np.ndarray) -> list[Callable[[], bool]]:
        """Return what draws the worlds that begin or step, for each thread; False says that one was not finite."""
        configs = self._episodes.configs
        if not self._episodes.is_fixed:
            self._keep_for(self._episodes.longest_delay + 1)
            for k, (first, last) in enumerate(self._ranges):
                for i in first + np.flatnonzero(todo[first:last] == BEGIN):
                    self._studios[i] = self._studio(k, configs[i])
        drawn = configs[:1] if self._episodes.is_fixed else configs
        if any(config.sensor.frames.drop_share > 0.0 for config in drawn):
            todo = self._without_dropped(todo)
        self._observed = self._blank()
        images = self._rgb, self._depth, *self._observed
        given = todo, self._worlds, self._episodes.settings
        return [partial(_paint, self._runs(*ends), given, images) for ends in self._ranges]

    def observed(self) -> tuple[np.ndarray, np.ndarray]:
        """Return fresh colors (n, H, W, 3 or, with nearness, 4) uint8 and depths (n, H, W) float32 m, seen now."""
        return self._observed

    def _blank(self) -> tuple[np.ndarray, np.ndarray]:
        return np.empty(self._shape, np.uint8), np.empty(self._shape[:3], np.float32)

    def _runs(self, first: int, last: int) -> list[tuple[int, int, Studio]]:
        """Return the worlds of a range as runs of neighbors that look alike."""
        runs = []
        for _, group in itertools.groupby(range(first, last), lambda i: id(self._studios[i])):
            members = list(group)
            runs.append((members[0], members[-1] + 1, self._studios[members[0]]))
        return runs

    def _keep_for(self, slots: int) -> None:
        """Make room for more pictures of every world, and put those that there are into their new places."""
        old = len(self._rgb)
        if slots <= old:
            return
        steps, rows = self._worlds["steps"], np.arange(len(self._worlds))
        for name in ("_rgb", "_depth"):
            kept = getattr(self, name)
            grown = np.zeros((slots, *kept.shape[1:]), kept.dtype)
            for age in range(old):
                grown[(steps - age) % slots, rows] = kept[(steps - age) % old, rows]
            setattr(self, name, grown)

    def _without_dropped(self, todo: np.ndarray) -> np.ndarray:
        """Leave out the worlds whose picture never arrives: what they saw last stands."""
        todo, slots = todo.copy(), len(self._rgb)
        for i in np.flatnonzero(todo == STEP):
            draws = np.random.Generator(np.random.Philox(key=int(self._worlds[i]["picture_seed"])))
            if float(draws.random()) < self._episodes.configs[i].sensor.frames.drop_share:
                at, todo[i] = int(self._worlds[i]["steps"]), SKIP
                for kept in (self._rgb, self._depth):
                    kept[at % slots, i] = kept[(at - 1) % slots, i]
        return todo

    def _studio(self, thread: int, config: EnvConfig) -> Studio:
        """Return what a thread needs to draw the worlds of a configuration."""
        looks, robot, sensor = self._looks[thread], config.robot, config.sensor
        mount = robot.camera_forward, robot.camera_height
        key = (config.person, config.outfit, config.light, mount, sensor.depth, sensor.color)
        if key not in looks:
            if len(looks) >= MOST_LOOKS:
                looks.clear()
            looks[key] = self._new_studio(config)
        return looks[key]

    def _new_studio(self, config: EnvConfig) -> Studio:
        camera, robot, body = self._camera, config.robot, load_body(config.person, config.outfit)
        if config.light not in self._scenes:
            self._scenes[config.light] = pack_scene(make_scene(config.scene, config.light))
        scene, eye = self._scenes[config.light], CameraPose(0.0, 0.0, robot.camera_height, 0.0)
        sensor = RGBDSensor(config.sensor.depth, config.sensor.color, camera)
        times = 2 if camera.config.supersample == 2 else 0
        return Studio(
            make_view(camera, eye, 1),
            make_view(camera, eye, 2),
            _canvas(camera.height, camera.width),
            _canvas(camera.height * times, camera.width * times),
            robot.camera_forward,
            scene,
            pack_people([(body.mesh, 1)]),
            make_workspace(scene, len(body.mesh.anchors), len(body.mesh.faces)),
            Walker(body).figure,
            body.bones,
            body.weights,
            np.zeros((len(body.joints), 3, 3)),
            np.zeros((len(body.joints), 3)),
            sensor.model,
            sensor.work,
        )


def _canvas(height: int, width: int) -> Canvas:
    shape = (height, width)
    return Canvas(np.zeros((*shape, 3), np.uint8), np.zeros(shape, np.float32), np.zeros(shape, np.uint8))


def _paint(runs: list[tuple[int, int, Studio]], given: tuple[Any, ...], images: tuple[np.ndarray, ...]) -> bool:
    return all(paint(first, last, *given, studio, *images) for first, last, studio in runs)
