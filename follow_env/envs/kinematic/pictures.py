"""`Pictures`: what the robots of a batch see, rendered by threads, with the sensor's errors and its latency."""

from collections.abc import Callable
from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from follow_env.camera.pinhole import CameraPose
from follow_env.camera.raster.scene import pack_scene
from follow_env.camera.raster.work import make_view, make_workspace, pack_people
from follow_env.camera.sensor.errors import RGBDSensor
from follow_env.envs.kinematic.kernels import SKIP, STEP
from follow_env.envs.kinematic.render_worlds import Canvas, Studio, paint
from follow_env.world.people.bodies import load_body
from follow_env.world.people.walker import Walker

if TYPE_CHECKING:
    from follow_env.envs.follow import FollowEnv


class Pictures:
    """The latest `delay + 1` pictures of every world.

    A world's first picture stands until it is old enough.

    Args:
        single: the environment of which there are many.
        worlds: (n,) `records.WORLD`.
        ranges: of worlds, one for each thread.
    """

    def __init__(self, single: "FollowEnv", worlds: np.ndarray, ranges: list[tuple[int, int]]) -> None:
        self._worlds, self._ranges = worlds, ranges
        self._drop_share = single._sensor.frames.drop_share
        shape = (single._delay + 1, len(worlds), single.camera.height, single.camera.width)
        self._rgb, self._depth = np.zeros((*shape, 3), np.uint8), np.zeros(shape, np.float32)
        self._shape = (*shape[1:], 4 if single._obs == "rgbd_uint8" else 3)
        self._studios = [_studio(single) for _ in ranges]
        self._observed = self._blank()
        paint(0, 0, np.zeros(0, np.int8), worlds, self._studios[0], self._rgb, self._depth, *self._observed)

    def jobs(self, todo: np.ndarray) -> list[Callable[[], bool]]:
        """Return what draws the worlds that begin or step, for each thread; False says that one was not finite."""
        if self._drop_share > 0.0:
            todo = self._without_dropped(todo)
        self._observed = self._blank()
        given = (todo, self._worlds)
        latest = (self._rgb, self._depth, *self._observed)
        parts = zip(self._ranges, self._studios, strict=True)
        return [partial(paint, *ends, *given, studio, *latest) for ends, studio in parts]

    def observed(self) -> tuple[np.ndarray, np.ndarray]:
        """Return fresh colors (n, H, W, 3 or, with nearness, 4) uint8 and depths (n, H, W) float32 m, seen now."""
        return self._observed

    def _blank(self) -> tuple[np.ndarray, np.ndarray]:
        return np.empty(self._shape, np.uint8), np.empty(self._shape[:3], np.float32)

    def _without_dropped(self, todo: np.ndarray) -> np.ndarray:
        """Leave out the worlds whose picture never arrives: what they saw last stands."""
        todo, slots = todo.copy(), len(self._rgb)
        for i in np.flatnonzero(todo == STEP):
            draws = np.random.Generator(np.random.Philox(key=int(self._worlds[i]["picture_seed"])))
            if float(draws.random()) < self._drop_share:
                at, todo[i] = int(self._worlds[i]["steps"]), SKIP
                for kept in (self._rgb, self._depth):
                    kept[at % slots, i] = kept[(at - 1) % slots, i]
        return todo


def _studio(single: "FollowEnv") -> Studio:
    """Return what a thread needs to draw the worlds of `single`."""
    camera, robot, body = single.camera, single.robot_config, load_body(*single._dressed)
    eye, scene = CameraPose(0.0, 0.0, robot.camera_height, 0.0), pack_scene(single.scene)
    sensor = RGBDSensor(single._sensor.depth, single._sensor.color, camera)
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
