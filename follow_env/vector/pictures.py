"""`Pictures`: what the robots of a batch see, rendered by threads, with the sensor's errors and its latency."""

import math

import numpy as np

from follow_env.camera import CameraPose, PinholeCamera
from follow_env.camera.frame import RGBDFrame
from follow_env.camera.raster import RasterRenderer
from follow_env.camera.sensor import RGBDSensor
from follow_env.config import RobotConfig, SensorConfig
from follow_env.person.bodies import Body
from follow_env.person.walker import Walker
from follow_env.scene import Scene
from follow_env.vector.kernels import BEGIN, SKIP


class Artist:
    """Draws worlds one after another; one for each thread.

    Args:
        scene: the place.
        camera: the intrinsics.
        robot: says where the camera is.
        sensor: the camera's errors.
        body: the person.
    """

    def __init__(
        self, scene: Scene, camera: PinholeCamera, robot: RobotConfig, sensor: SensorConfig, body: Body
    ) -> None:
        self._robot, self._drop_share = robot, sensor.frames.drop_share
        self._renderer = RasterRenderer(scene, camera)
        self._walker = Walker(body)
        self._sensor = RGBDSensor(sensor.depth, sensor.colour, camera)

    def drops(self, world: np.void) -> bool:
        """Whether the picture of a world (a record `WORLD`) never arrives."""
        if self._drop_share <= 0.0:
            return False
        return float(np.random.Generator(np.random.Philox(key=int(world["picture_seed"]))).random()) < self._drop_share

    def draw(self, world: np.void) -> RGBDFrame:
        """Return what the camera of a world (a record `WORLD`) reports."""
        x, y, yaw = float(world["x"]), float(world["y"]), float(world["yaw"])
        forward = self._robot.camera_forward
        eye = CameraPose(x + forward * math.cos(yaw), y + forward * math.sin(yaw), self._robot.camera_height, yaw)
        x, y, heading, *gait = (float(world[name]) for name in ("person_x", "person_y", "heading", "walked", "speed"))
        person = self._walker.place(x, y, heading, walked=gait[0], speed=gait[1])
        return self._sensor.corrupt(self._renderer.render(eye, (person,)), int(world["picture_seed"]))


class Pictures:
    """The latest `delay + 1` pictures of every world.

    A world's first picture stands until it is old enough.

    Args:
        count: number of worlds.
        camera: the intrinsics.
        delay: age of what is observed, steps.
    """

    def __init__(self, count: int, camera: PinholeCamera, delay: int) -> None:
        shape = (delay + 1, count, camera.height, camera.width)
        self._rgb, self._depth = np.zeros((*shape, 3), np.uint8), np.zeros(shape, np.float32)

    def take(self, first: int, last: int, todo: np.ndarray, worlds: np.ndarray, artist: Artist) -> None:
        """Draw the worlds first <= i < last that begin or step."""
        slots = len(self._rgb)
        for i in range(first, last):
            if todo[i] == SKIP:
                continue
            at = slice(None) if todo[i] == BEGIN else int(worlds[i]["steps"]) % slots
            if todo[i] != BEGIN and artist.drops(worlds[i]):
                latest = (int(worlds[i]["steps"]) - 1) % slots
                self._rgb[at, i], self._depth[at, i] = self._rgb[latest, i], self._depth[latest, i]
                continue
            frame = artist.draw(worlds[i])
            self._rgb[at, i], self._depth[at, i] = frame.rgb, frame.depth

    def observed(self, worlds: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return fresh colours (n, H, W, 3) uint8 and depths (n, H, W) float32 m as they are observed now."""
        oldest, every = (worlds["steps"] + 1) % len(self._rgb), np.arange(len(worlds))
        return self._rgb[oldest, every], self._depth[oldest, every]
