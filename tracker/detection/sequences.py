"""The six sequences of paper A's Table 2, made again: three colours of clothes in two views, turning in every posture.

The paper shows volunteers on the ground; here it is our people, with the headstand that the paper could not test.
"""

import math
from collections.abc import Iterator
from dataclasses import dataclass

from follow_env.camera import CameraPose, PinholeCamera, RGBDFrame
from follow_env.camera.raster import RasterRenderer
from follow_env.config import CameraConfig
from follow_env.person.bodies import SUITS, Outfit, load_body
from follow_env.person.walker import POSTURES, Walker
from follow_env.scenes import make_scene
from tracker.detection.detector import PersonDetector
from tracker.metrics import DetectionCounts, count_detections

VIEWS = (CameraPose(4.2, 0.0, 1.0, 0.0), CameraPose(9.3, 1.1, 1.45, math.atan2(-1.0, -2.6)))
"""Two directions of view on the subject."""
SUBJECT = (6.7, 0.1)
"""Where the subject turns, m."""
TURNS = 1.0
"""Turns in each posture."""


@dataclass(frozen=True)
class Sequence:
    """A row of Table 2: a colour of `SUITS`, a view (1 or 2) and the number of frames."""

    suit: str
    view: int
    frames: int


TABLE_2 = (
    Sequence("green", 1, 1850),
    Sequence("green", 2, 1853),
    Sequence("blue", 1, 2131),
    Sequence("blue", 2, 2050),
    Sequence("indigo", 1, 1675),
    Sequence("indigo", 2, 1893),
)
"""The paper's sequences and their lengths."""


def play(sequence: Sequence) -> Iterator[RGBDFrame]:
    """Yield the frames: the subject takes one posture after the other and turns about once in each."""
    renderer = RasterRenderer(make_scene("indoor"), PinholeCamera(CameraConfig()))
    colour = SUITS[sequence.suit]
    walker = Walker(load_body("man", Outfit(shirt=colour, trousers=colour), "high"))
    for frame in range(sequence.frames):
        posture, share = divmod(frame * len(POSTURES) / sequence.frames, 1.0)
        heading = 2.0 * math.pi * TURNS * share
        name = POSTURES[int(posture)]
        yield renderer.render(VIEWS[sequence.view - 1], [walker.place(*SUBJECT, heading, 1.3 * share, 0.8, name)])


def count(detector: PersonDetector, sequence: Sequence) -> DetectionCounts:
    """Return the paper's counts for a sequence, at its confidence of 0.5 and an overlap of 0.5."""
    truth, found = [], []
    for frame in play(sequence):
        truth.append(frame.person_box())
        found.append([detection.box for detection in detector.detect(frame.rgb, frame.depth)])
    return count_detections(truth, found)
