"""What paper A's two experiments share: a camera that stands in the cabin, the truth in its pictures, the tracker.

A static camera's frame is the tracker's: x forward (the depth), y left, z up, origin in the camera, m. The stream has
30 frames/s of which the tracker processes every third; only those are rendered, the others pass it as time.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from follow_env.camera.pinhole import CameraPose, PinholeCamera
from follow_env.camera.raster.renderer import RasterRenderer
from follow_env.camera.sensor.errors import RGBDSensor
from follow_env.config import CameraConfig
from follow_env.geometry import XTION_PRO
from follow_env.sensors import SensorConfig
from follow_env.world.people.mesh import Placed
from follow_env.world.scenes import make_scene
from tracker.boxes import Detection
from tracker.depth import Box
from tracker.person_tracker import PersonTracker, Track, TrackerSettings

CAMERA = CameraPose(-3.9, 0.0, 1.0, 0.0)
"""The camera hovers at one end of the cabin, half way up, and looks along it."""
SETTINGS = TrackerSettings()
"""Of the tracker: the paper's, but for what it does in company."""
PRINTED = dataclasses.replace(SETTINGS, company="printed")
"""The paper's to the letter."""
PERIOD = SETTINGS.every / SETTINGS.rate
"""Between two processed frames, s."""
VISIBLE = 0.25
"""Least share of a person's pixels in the picture that is not hidden for the person to count as visible."""


@dataclass(frozen=True)
class Picture:
    """A picture as the sensor reports it, and the truth about it.

    Attributes:
        rgb: (H, W, 3) uint8.
        depth: (H, W) float32, m, 0 = no reading.
        boxes: Of the visible pixels of everybody of whom there are any, by id, px.
        shares: Visible pixels over those that the same person would have alone in an empty room, by id; 0 for who is
            outside the picture.
    """

    rgb: NDArray[np.uint8]
    depth: NDArray[np.float32]
    boxes: Mapping[int, Box]
    shares: Mapping[int, float]

    def perfect_detections(self) -> list[Detection]:
        """Return what a detector without errors reports: the true boxes of who is visible."""
        return [Detection(box, 1.0) for id, box in self.boxes.items() if self.shares[id] >= VISIBLE]


class Stage:
    """The cabin, the camera in it and the sensor's errors. What was drawn before changes nothing."""

    def __init__(self) -> None:
        cabin, camera, sensor = make_scene("cabin"), PinholeCamera(CameraConfig()), SensorConfig()
        self._renderer = RasterRenderer(cabin, camera)
        self._empty = dataclasses.replace(cabin, primitives=())
        self._camera = camera
        self._alone: dict[int, RasterRenderer] = {}
        self._sensor = RGBDSensor(sensor.depth, sensor.color, camera)

    def take(self, people: Sequence[Placed], noise: int) -> Picture:
        """Return the picture of people (their ids differ) with the sensor errors that `noise` stands for."""
        frame = self._renderer.render(CAMERA, people)
        boxes, shares = {}, {}
        for person in people:
            box = frame.person_box(id=person.id)
            shares[person.id] = 0.0
            if box is not None:
                boxes[person.id] = box
                seen = int(np.count_nonzero(frame.ids == person.id))
                shares[person.id] = seen / max(seen, self._pixels_alone(person))
        reported = self._sensor.corrupt(frame, noise)
        return Picture(reported.rgb, reported.depth, boxes, shares)

    def _pixels_alone(self, person: Placed) -> int:
        if person.id not in self._alone:
            self._alone[person.id] = RasterRenderer(self._empty, self._camera)
        return int(np.count_nonzero(self._alone[person.id].render(CAMERA, [person]).ids))


@lru_cache(maxsize=1)
def stage() -> Stage:
    """Return the stage of this process, built when first asked for."""
    return Stage()


@dataclass
class _Told:
    """A detector that reports what it is told, so that a picture's detections serve several trackers and the truth."""

    detections: Sequence[Detection] = field(default_factory=tuple)

    def detect(self, rgb: NDArray[np.uint8], depth: NDArray[np.float32]) -> Sequence[Detection]:
        return self.detections


class Watch:
    """A `PersonTracker` that is shown the processed frames only; its clock runs through those between."""

    def __init__(self, settings: TrackerSettings = SETTINGS) -> None:
        self._detector = _Told()
        self.tracker = PersonTracker(self._detector, XTION_PRO.scaled(320, 240), settings=settings)
        self._started = False

    def see(self, picture: Picture, detections: Sequence[Detection]) -> Track:
        """Return what the tracker knows after the next processed frame."""
        if self._started:
            for _ in range(SETTINGS.every - 1):
                self.tracker.skip()
        self._started = True
        self._detector.detections = detections
        return self.tracker.update(picture.rgb, picture.depth)
