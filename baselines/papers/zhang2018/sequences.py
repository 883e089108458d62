"""The six sequences of paper A's Table 2, made again: three colors of clothes in two views, turning in every posture.

The paper shows volunteers on the ground; here it is our people, with the headstand that the paper could not test.
"""

import math
from collections.abc import Iterable, Iterator
from dataclasses import dataclass

from follow_env.camera import CameraPose, PinholeCamera, RGBDFrame
from follow_env.camera.raster.renderer import RasterRenderer
from follow_env.camera.sensor.errors import RGBDSensor
from follow_env.config import CameraConfig
from follow_env.sensors import SensorConfig
from follow_env.world.people.bodies import SUITS, load_body
from follow_env.world.people.walker import Walker
from follow_env.world.scenes import make_scene
from tracker.metrics import DetectionCounts, count_detections
from tracker.person_tracker import Detector

SCENE = "cabin"
VIEWS = (
    CameraPose(-1.75, 0.15, 1.05, math.atan2(-0.15, 2.65)),
    CameraPose(3.3, 1.0, 1.15, math.atan2(-1.0, -2.4)),
)
"""Two directions of view on the subject: along the module from one end, across it from the other; both from 2.6 m."""
SUBJECT = (0.9, 0.0)
"""Where the subject turns, m."""
TURNS = 1.0
"""Turns in each posture."""

POSTURES = ("walk", "stand", "crouch", "arms_raised", "sideways", "bent", "floating", "head_down")
"""The postures that Table 2 shows, one after the other: a new posture of the package changes no sequence."""


@dataclass(frozen=True)
class Sequence:
    """A row of Table 2: a color of `SUITS`, a view (1 or 2) and the number of frames."""

    suit: str
    view: int
    frames: int

    def posture(self, frame: int) -> str:
        """Return the posture in a frame: one of `POSTURES` after the other, for equally long."""
        return POSTURES[frame * len(POSTURES) // self.frames]

    def part(self, number: int) -> range:
        """Return the frames of a posture by its number in `POSTURES`."""
        first, after = (-(-k * self.frames // len(POSTURES)) for k in (number, number + 1))
        return range(first, after)


TABLE_2 = (
    Sequence("green", 1, 1850),
    Sequence("green", 2, 1853),
    Sequence("blue", 1, 2131),
    Sequence("blue", 2, 2050),
    Sequence("indigo", 1, 1675),
    Sequence("indigo", 2, 1893),
)
"""The paper's sequences and their lengths."""


def play(sequence: Sequence, frames: Iterable[int] | None = None) -> Iterator[RGBDFrame]:
    """Yield frames, all by default: the subject takes one posture after the other and turns about once in each.

    They have the sensor's errors, which are the same for every suit; the ids are exact.
    """
    camera = PinholeCamera(CameraConfig())
    renderer, config = RasterRenderer(make_scene(SCENE), camera), SensorConfig()
    sensor = RGBDSensor(config.depth, config.color, camera)
    walker = Walker(load_body("man", SUITS[sequence.suit], "high"))
    for frame in range(sequence.frames) if frames is None else frames:
        share = math.fmod(frame * len(POSTURES) / sequence.frames, 1.0)
        heading, posture = 2.0 * math.pi * TURNS * share, sequence.posture(frame)
        person = walker.place(*SUBJECT, heading, 1.3 * share, 0.8, posture)
        yield sensor.corrupt(renderer.render(VIEWS[sequence.view - 1], [person]), 1_000_000 * sequence.view + frame)


def count(detector: Detector, sequence: Sequence) -> DetectionCounts:
    """Return the paper's counts for a sequence, at the detector's confidence and an overlap of 0.5."""
    truth, found = [], []
    for frame in play(sequence):
        truth.append(frame.person_box())
        found.append([detection.box for detection in detector.detect(frame.rgb, frame.depth)])
    return count_detections(truth, found)
