"""`Pictures`: what the robots of a batch see, rendered by threads, with the sensor's errors and its latency."""

import math

import numpy as np

from follow_env.camera import CameraPose, PinholeCamera
from follow_env.camera.depth import DepthSensor
from follow_env.camera.frame import RGBDFrame
from follow_env.camera.raster import RasterRenderer
from follow_env.config import DepthConfig, RobotConfig
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
        depth: the sensor's errors.
        body: the person.
    """

    def __init__(self, scene: Scene, camera: PinholeCamera, robot: RobotConfig, depth: DepthConfig, body: Body) -> None:
        self._camera, self._robot = camera, robot
        self._renderer = RasterRenderer(scene, camera)
        self._walker = Walker(body)
        self._sensor = DepthSensor(depth, camera.hfov)

    def draw(self, world: np.void) -> RGBDFrame:
        """Return what the camera of a world (a record `WORLD`) reports."""
        x, y, yaw = float(world["x"]), float(world["y"]), float(world["yaw"])
        forward = self._robot.camera_forward
        eye = CameraPose(x + forward * math.cos(yaw), y + forward * math.sin(yaw), self._robot.camera_height, yaw)
        x, y, heading, *gait = (float(world[name]) for name in ("person_x", "person_y", "heading", "walked", "speed"))
        person = self._walker.place(x, y, heading, walked=gait[0], speed=gait[1])
        return self._sense(self._renderer.render(eye, (person,)), int(world["picture_seed"]))

    def _sense(self, frame: RGBDFrame, seed: int) -> RGBDFrame:
        """Return the frame with the sensor's errors that the seed (64 bits) stands for."""
        rng = np.random.Generator(np.random.Philox(key=seed))
        depth = np.minimum(self._sensor.corrupt(frame.depth, rng), np.float32(self._camera.config.far))
        return RGBDFrame(frame.rgb, depth, frame.ids)


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
            frame = artist.draw(worlds[i])
            at = slice(None) if todo[i] == BEGIN else int(worlds[i]["steps"]) % slots
            self._rgb[at, i], self._depth[at, i] = frame.rgb, frame.depth

    def observed(self, worlds: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return fresh colours (n, H, W, 3) uint8 and depths (n, H, W) float32 m as they are observed now."""
        oldest, every = (worlds["steps"] + 1) % len(self._rgb), np.arange(len(worlds))
        return self._rgb[oldest, every], self._depth[oldest, every]


def near_bytes(depth: np.ndarray) -> np.ndarray:
    """Return 255 (1 - z / 8 m) as uint8; 0 = no reading or beyond: the fourth channel of `rgbd_uint8`."""
    return np.where((depth > 0.0) & (depth < 8.0), 255.0 * (1.0 - depth / 8.0), 0.0).astype(np.uint8)
