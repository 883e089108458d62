"""Pictures of people with true boxes, made from a seed while they are needed: nothing is kept on disk.

A frame is rendered with a wider angle than wanted, then one homography takes from it what a pitched and rolled camera
would see, crops, zooms, mirrors and squashes it to the networks' input. Boxes are those of the pixels that remain.
"""

import dataclasses
import math
from dataclasses import dataclass

import cv2
import numpy as np

from baselines.learned.detector.augment import disturb, draw_backdrop
from baselines.learned.detector.random_people import DRAWN_BODIES, Look, draw_look, draw_posture
from baselines.learned.detector.random_scenes import draw_scene
from follow_env.camera.frame import RGBDFrame
from follow_env.camera.pinhole import CameraPose, PinholeCamera
from follow_env.camera.raster.renderer import RasterRenderer
from follow_env.camera.sensor.errors import RGBDSensor
from follow_env.config import CameraConfig
from follow_env.sensors import IDEAL_SENSOR, DepthConfig
from follow_env.world.people.bodies import DETAILS, load_body
from follow_env.world.people.mesh import Placed
from follow_env.world.people.walker import Walker
from follow_env.world.scene import Scene
from tracker.detection.priors import INPUT_SIZE

CAMERA = CameraConfig(width=400, height=300, hfov_deg=75.0)
"""What is rendered: the Xtion's 57.5 degrees and a margin to turn and to move in, at the same px per degree."""
ASPECT = 0.75
"""Height over width of the pictures that a network sees squashed to a square."""


@dataclass(frozen=True)
class DataConfig:
    """What the pictures show.

    Attributes:
        people: most people in a picture.
        empty_share: share of pictures without anybody.
        nearest, farthest: distance of the people, m; half of them are nearer than 3 m by default.
        lowest, highest: height of the camera, m.
        pitch_deg, roll_deg: largest inclination of the camera, degrees.
        zoom: largest enlargement of a crop.
        crop_share: share of the pictures that are cropped.
        walk_share: share of the people who walk, besides those of all postures.
        pair_share: share of the pictures in which somebody stands close to another, before, behind or beside them.
        pictures_per_scene: pictures before another scene is built.
        min_pixels: a person of fewer visible pixels (of 300 x 300) is difficult.
        min_share: so is one whose visible share of what lies inside the picture is smaller.
        depth: whether to make the depth that the sensor would report.
    """

    people: int = 4
    empty_share: float = 0.06
    nearest: float = 0.6
    farthest: float = 6.0
    lowest: float = 0.35
    highest: float = 1.6
    pitch_deg: float = 12.0
    roll_deg: float = 5.0
    zoom: float = 1.7
    crop_share: float = 0.3
    walk_share: float = 0.15
    pair_share: float = 0.3
    pictures_per_scene: int = 8
    min_pixels: int = 150
    min_share: float = 0.25
    depth: bool = False

    def __post_init__(self) -> None:
        if not 1 <= self.people <= 8:
            raise ValueError(f"people is {self.people}; expected 1 to 8 in a picture")
        if not 0.5 <= self.nearest <= self.farthest <= 20.0:
            raise ValueError(
                f"people stand from {self.nearest} to {self.farthest} m; expected 0.5 <= nearest <= farthest <= 20"
            )
        for name in ("walk_share", "pair_share"):
            if not 0.0 <= getattr(self, name) <= 1.0:
                raise ValueError(f"{name} is {getattr(self, name)}; expected a share from 0 to 1")
        if self.pictures_per_scene < 1 or self.zoom < 1.0:
            raise ValueError(
                f"pictures_per_scene, zoom are {self.pictures_per_scene}, {self.zoom}; expected at least 1 each"
            )


@dataclass(frozen=True)
class Sample:
    """A picture and the people in it.

    Attributes:
        rgb: (300, 300, 3) uint8.
        depth: (300, 300) float32, m, 0 = no reading; None where it was not asked for.
        ids: (300, 300) uint8, 0 = no person, 1.. = people.
        boxes: (N, 4) float32, corners of each person's visible pixels, shares of the picture.
        difficult: (N,) bool, people of whom too little is seen to ask for them.
    """

    rgb: np.ndarray
    depth: np.ndarray | None
    ids: np.ndarray
    boxes: np.ndarray
    difficult: np.ndarray


class SampleSource:
    """Samples by number: the same seed and number give the same sample, whatever was made before.

    Args:
        seed: samples of different seeds are independent; train and test with different ones.
        config: what they show.
    """

    def __init__(self, seed: int, config: DataConfig | None = None) -> None:
        self.seed, self.config = seed, config or DataConfig()
        self._camera = PinholeCamera(CAMERA)
        square = PinholeCamera(CameraConfig(width=INPUT_SIZE, height=INPUT_SIZE, hfov_deg=CAMERA.hfov_deg))
        self._sensor = RGBDSensor(DepthConfig(), IDEAL_SENSOR.color, square)
        self._walkers = {
            (name, detail): Walker(load_body(name, detail=detail)) for name in DRAWN_BODIES for detail in DETAILS
        }
        self._group = -1
        self._scene: Scene
        self._renderer: RasterRenderer

    def sample(self, number: int) -> Sample:
        """Return sample `number` >= 0; consecutive ones share a scene and are cheaper one after the other."""
        config = self.config
        group = number // config.pictures_per_scene
        if group != self._group:
            self._scene = draw_scene(np.random.default_rng((self.seed, 0, group)))
            self._renderer = RasterRenderer(self._scene, self._camera)
            self._group = group
        rng = np.random.default_rng((self.seed, 1, number))
        pose, people = self._draw_people(rng)
        frame = self._renderer.render(pose, people)
        window = self._draw_window(rng)
        rgb = self._warp(frame.rgb, window, cv2.INTER_LINEAR, cv2.BORDER_REPLICATE)
        ids = self._warp(frame.ids, window, cv2.INTER_NEAREST, cv2.BORDER_CONSTANT)
        depth = self._sensed(frame.depth, rgb, window, rng) if config.depth else None
        if rng.random() < 0.07:
            rgb = np.where(ids[:, :, None] == 0, draw_backdrop(ids.shape, rng), rgb)
        if rng.random() < 0.15:
            _cover(rgb, depth, ids, rng)
        boxes, difficult = [], []
        for person in people:
            mask = (ids == person.id).view(np.uint8)
            pixels = cv2.countNonZero(mask)
            if pixels:
                u, v, width, height = cv2.boundingRect(mask)
                boxes.append((u, v, u + width, v + height))
                share = _visible_share(person, pose, window, ids)
                difficult.append(pixels < config.min_pixels or share < config.min_share)
        return Sample(
            disturb(rgb, rng),
            depth,
            ids,
            np.array(boxes, np.float32).reshape(-1, 4) / np.float32(INPUT_SIZE),
            np.array(difficult, bool),
        )

    def _draw_people(self, rng: np.random.Generator) -> tuple[CameraPose, list[Placed]]:
        """Return a camera that looks at a free place, and people who stand where there is room for them."""
        config, scene = self.config, self._scene
        x, y = self._draw_free(rng)
        aim_x, aim_y = self._draw_free(rng)
        height, yaw = rng.uniform(config.lowest, config.highest), math.atan2(aim_y - y, aim_x - x)
        pose = CameraPose(x, y, height, yaw)
        count = 0 if rng.random() < config.empty_share else 1 + int(config.people * rng.random() ** 2)
        spots: list[tuple[float, float]] = []
        for _ in range(8 * count):
            distance = config.nearest + (config.farthest - config.nearest) * rng.random() ** 1.2
            bearing = yaw + rng.triangular(-0.55, 0.0, 0.55)
            spot = (x + distance * math.cos(bearing), y + distance * math.sin(bearing))
            if all(math.dist(spot, other) > 0.45 for other in spots) and _free(scene, spot):
                spots.append(spot)
            if len(spots) == count:
                break
        looks = [draw_look(rng) for _ in spots]
        if spots and rng.random() < config.pair_share:
            beside = self._draw_beside(rng, (x, y), spots)
            spots += beside
            looks += [looks[0] if rng.random() < 0.5 else draw_look(rng) for _ in beside]
        people = zip(spots, looks, strict=True)
        return pose, [self._draw_person(rng, spot, look, id) for id, (spot, look) in enumerate(people, 1)]

    def _draw_beside(
        self, rng: np.random.Generator, camera: tuple[float, float], spots: list[tuple[float, float]]
    ) -> list[tuple[float, float]]:
        """Return a place up to 1.1 m from the first of some, in depth or across, or none if there is no room."""
        (x, y), away = spots[0], math.dist(camera, spots[0])
        c, s = (x - camera[0]) / away, (y - camera[1]) / away
        for _ in range(8):
            far, near = rng.uniform(0.3, 1.0) * rng.choice((-1.0, 1.0)), rng.uniform(-0.45, 0.45)
            ahead, left = (far, near) if rng.random() < 0.5 else (near, far)
            spot = (x + c * ahead - s * left, y + s * ahead + c * left)
            apart = all(math.dist(spot, other) > 0.45 for other in spots[1:])
            if apart and away + ahead > self.config.nearest and _free(self._scene, spot):
                return [spot]
        return []

    def _draw_free(self, rng: np.random.Generator) -> tuple[float, float]:
        """Return a place on the floor, without furniture if one is found."""
        x0, x1, y0, y1 = self._scene.bounds
        spot = (0.5 * (x0 + x1), 0.5 * (y0 + y1))
        for _ in range(10):
            spot = (rng.uniform(x0 + 0.4, x1 - 0.4), rng.uniform(y0 + 0.4, y1 - 0.4))
            if self._scene.clearance(np.array([spot])) > 0.3:
                break
        return spot

    def _draw_person(self, rng: np.random.Generator, spot: tuple[float, float], look: Look, id: int) -> Placed:
        """Return a person of any build and posture."""
        (x, y), (name, detail, outfit) = spot, look
        posture = "walk" if rng.random() < self.config.walk_share else draw_posture(rng)
        heading, walked, speed = rng.uniform(-math.pi, math.pi), rng.uniform(0.0, 1.6), rng.uniform(0.0, 1.8)
        placed = self._walkers[name, detail].place(x, y, heading, walked, speed, posture)
        broad, tall = rng.uniform(0.92, 1.12), rng.uniform(0.92, 1.08)
        lift = rng.uniform(0.0, 0.7) if posture in ("floating", "head_down") else 0.0
        stretch, origin = np.array((broad, broad, tall)), np.array((x, y, 0.0))
        vertices = (origin + stretch * (placed.vertices - origin) + (0.0, 0.0, lift)).astype(np.float32)
        return Placed(load_body(name, outfit, detail).mesh, vertices, placed.normals, id, placed.pose)

    def _draw_window(self, rng: np.random.Generator) -> np.ndarray:
        """Return (3, 3): from (u, v, 1) in the sample, px, to a ray in the optical frame of the rendered picture."""
        config = self.config
        wide = math.tan(math.radians(rng.uniform(53.0, 63.0)) / 2)
        high = ASPECT * wide
        right, down = 0.0, 0.0
        if rng.random() < config.crop_share:
            zoom, stretch = rng.uniform(1.0, config.zoom), rng.uniform(0.87, 1.15)
            part_wide, part_high = min(wide / zoom * stretch, wide), min(high / zoom / stretch, high)
            right, down = rng.uniform(-1.0, 1.0) * (wide - part_wide), rng.uniform(-1.0, 1.0) * (high - part_high)
            wide, high = part_wide, part_high
        if rng.random() < 0.5:
            wide = -wide
        scale = 2.0 / INPUT_SIZE
        crop = np.array([[wide * scale, 0.0, right - wide], [0.0, high * scale, down - high], [0.0, 0.0, 1.0]])
        pitch, roll = (math.radians(a) * rng.uniform(-1.0, 1.0) for a in (config.pitch_deg, config.roll_deg))
        c, s = math.cos(pitch), math.sin(pitch)
        tilt = np.array([[1.0, 0.0, 0.0], [0.0, c, s], [0.0, -s, c]])
        c, s = math.cos(roll), math.sin(roll)
        return tilt @ np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]]) @ crop

    def _warp(self, picture: np.ndarray, window: np.ndarray, interpolation: int, border: int) -> np.ndarray:
        camera = self._camera
        lens = np.array([[camera.focal, 0.0, camera.cx - 0.5], [0.0, camera.focal, camera.cy - 0.5], [0.0, 0.0, 1.0]])
        center = np.array([[1.0, 0.0, 0.5], [0.0, 1.0, 0.5], [0.0, 0.0, 1.0]])
        flags = interpolation | cv2.WARP_INVERSE_MAP
        size = (INPUT_SIZE, INPUT_SIZE)
        return cv2.warpPerspective(picture, lens @ window @ center, size, flags=flags, borderMode=border)

    def _sensed(self, depth: np.ndarray, rgb: np.ndarray, window: np.ndarray, rng: np.random.Generator) -> np.ndarray:
        """Return the reported depth along the inclined camera's axis, for the colors `rgb` of the network's input."""
        at = np.arange(INPUT_SIZE, dtype=np.float32) + np.float32(0.5)
        along = window[2, 0] * at[None, :] + window[2, 1] * at[:, None] + window[2, 2]
        turned = self._warp(depth, window, cv2.INTER_NEAREST, cv2.BORDER_CONSTANT) / along.astype(np.float32)
        nowhere = np.zeros(turned.shape, np.uint8)
        seed = int(rng.integers(1 << 63))
        return self._sensor.corrupt(RGBDFrame(rgb, turned, nowhere), seed).depth


def _free(scene: Scene, spot: tuple[float, float]) -> bool:
    """Return whether somebody can stand there."""
    x0, x1, y0, y1 = scene.bounds
    inside = x0 + 0.3 < spot[0] < x1 - 0.3 and y0 + 0.3 < spot[1] < y1 - 0.3
    return inside and bool(scene.clearance(np.array([spot])) > 0.2)


def _visible_share(person: Placed, pose: CameraPose, window: np.ndarray, ids: np.ndarray) -> float:
    """Return the share of a person's vertices inside the picture that lie on visible pixels of that person.

    It is 0 for somebody of whom fewer than 3 % of the vertices lie inside: a hand at the edge is no person to ask for.
    """
    offset = person.vertices.astype(np.float64) - (pose.x, pose.y, pose.z)
    c, s = math.cos(pose.yaw), math.sin(pose.yaw)
    optical = np.stack([s * offset[:, 0] - c * offset[:, 1], -offset[:, 2], c * offset[:, 0] + s * offset[:, 1]])
    u, v, z = np.linalg.solve(window, optical)
    front = z > 0.05
    columns, rows = (np.floor(axis[front] / z[front]) for axis in (u, v))
    inside = (columns >= 0) & (columns < INPUT_SIZE) & (rows >= 0) & (rows < INPUT_SIZE)
    if inside.sum() < 0.03 * len(offset):
        return 0.0
    seen = ids[rows[inside].astype(int), columns[inside].astype(int)] == person.id
    return float(seen.mean())


def _cover(rgb: np.ndarray, depth: np.ndarray | None, ids: np.ndarray, rng: np.random.Generator) -> None:
    """Hide a rectangle of the picture behind something near."""
    height, width = rng.integers(20, 140, 2)
    v, u = rng.integers(0, INPUT_SIZE - height), rng.integers(0, INPUT_SIZE - width)
    part = (slice(v, v + height), slice(u, u + width))
    rgb[part] = draw_backdrop((int(height), int(width)), rng) if rng.random() < 0.5 else rng.integers(0, 256, 3)
    ids[part] = 0
    if depth is not None:
        depth[part] = rng.uniform(0.5, 1.0)


def without_augmentation(config: DataConfig) -> DataConfig:
    """Return the settings of a level camera that crops nothing: what a robot sees."""
    return dataclasses.replace(config, crop_share=0.0, pitch_deg=0.0, roll_deg=0.0)
