"""`PersonTracker`: the life cycle of paper A's tracker on a stream of RGB-D frames, from any detector's boxes.

A person is *confirmed* by being detected in all processed frames for half a second, then *tracked*: predicted by the
filter, accepted only inside the gate, chosen by similarity. Missing frames are *coasted* over; after one second of them
the tracker stops (*lost*), which is how an occlusion ends, and waits until somebody confirms a person again.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal, Protocol

import numpy as np
from numpy.typing import NDArray

from follow_env.geometry import CAMERA_FRAME, CameraMount, Intrinsics, back_project
from tracker.association import GATE, Association, Candidate, alone, associate, between
from tracker.boxes import Detection
from tracker.depth import Box, box_depth, seen_at
from tracker.metrics import area, overlap
from tracker.person_filter import (
    ACCELERATION_DENSITY,
    MEASUREMENT_NOISE,
    STANDING,
    Motion,
    PersonFilter,
    Vector,
    arc,
    moved,
)

State = Literal["searching", "confirming", "tracking", "coasting", "lost"]
Twist = tuple[float, float]
Pixel = tuple[float, float]

PROCESSING_RATE = 10.0
"""Frames processed per second in paper A."""
NAMED_OVERLAP = 0.5
"""A detection is the person that a box names if their intersection over union reaches this."""


class Detector(Protocol):
    """What finds people: pictures in, boxes out."""

    def detect(self, rgb: NDArray[np.uint8], depth: NDArray[np.float32]) -> Sequence[Detection]:
        """Return everybody in the picture (H, W, 3) uint8, its depth being (H, W) m with 0 for no reading."""


@dataclass(frozen=True, slots=True)
class TrackerSettings:
    """Settings of paper A's tracker; times are seconds, turned into processed frames once.

    Attributes:
        rate: Of the stream, frames/s.
        every: Of so many frames one is processed, the first included; between them the track is the prediction.
        confirm_time: For so long a person must be detected without a miss to be tracked, s; at least two frames.
        stop_time: After so long without the person the tracker stops, s; at least one frame.
        gate: Largest distance between a measurement and its prediction, m, eq. (15).
        company: What is done once others have been detected: `apart` reads a box only where it is at the predicted
            depth (`seen_at`) and nobody else was detected (`alone`), leaves out boxes between two people (`between`),
            weighs places by their likelihood and takes none that is not plausible, be it inside the gate
            (`associate`); `printed` goes on as with one person. As printed the tracker drifts to whoever steps before
            its target. With one person there is no difference.
        frame: In which frame the person's velocity is taken to be constant: `odom`, the ground, or `body`, the robot,
            as printed. A turning robot is no frame for a constant velocity.
        smoothing: Eq. (9), see `PersonFilter`.
        acceleration_density: Of the filter, m²/s³.
        measurement_noise: Of the filter, m².

    Raises:
        ValueError: If a number is not positive and finite, `every` is not a whole number, or `company` or `frame` is
            not known.
    """

    rate: float = 30.0
    every: int = 3
    confirm_time: float = 0.5
    stop_time: float = 1.0
    gate: float = GATE
    company: Literal["apart", "printed"] = "apart"
    frame: Literal["odom", "body"] = "odom"
    smoothing: bool = True
    acceleration_density: float = ACCELERATION_DENSITY
    measurement_noise: float = MEASUREMENT_NOISE

    def __post_init__(self) -> None:
        for name in ("rate", "every", "confirm_time", "stop_time", "gate"):
            value = getattr(self, name)
            if not 0.0 < value < math.inf:
                raise ValueError(f"tracker {name} is {value!r}, expected a positive finite number.")
        if self.every != int(self.every):
            raise ValueError(f"tracker every is {self.every!r}, expected a whole number of frames.")
        if self.company not in ("apart", "printed"):
            raise ValueError(f"tracker company is {self.company!r}, expected 'apart' or 'printed'.")
        if self.frame not in ("odom", "body"):
            raise ValueError(f"tracker frame is {self.frame!r}, expected 'odom' or 'body'.")

    @classmethod
    def for_rate(cls, rate: float) -> TrackerSettings:
        """Return the settings for a stream of `rate` frames/s, processed as nearly as possible 10 times a second."""
        return cls(rate=rate, every=max(1, round(rate / PROCESSING_RATE)))

    @property
    def confirm_frames(self) -> int:
        """Processed frames in a row that confirm a person."""
        return max(2, round(self.confirm_time * self.rate / self.every))

    @property
    def stop_frames(self) -> int:
        """Processed frames in a row without the person after which the tracker stops."""
        return max(1, round(self.stop_time * self.rate / self.every))


@dataclass(frozen=True, slots=True)
class Track:
    """What the tracker knows after a frame. Robot frame: x forward, y left, z up, origin as the camera mount's.

    Attributes:
        state: `searching`, `confirming`, `tracking`, `coasting` or `lost`.
        position: Estimate (x, y, z), or the prediction where nothing was measured, m; None unless tracking or coasting.
        velocity: Over ground (`odom`) or relative to the robot (`body`), along the robot's axes, m/s; None likewise.
        measurement: Position measured in this very frame and accepted, m; None without one. Never held.
        box: Last accepted box, px, in company without what it shows of others; while confirming that of the person to
            be confirmed; else None.
        confidence: The detector's for that box; None without one.
        gate_distance: Between this frame's prediction and the accepted or else nearest detection that can be
            measured, m; None without one.
        score: Log-similarity of the accepted detection, eq. (16); None without.
        failures: Processed frames in a row without the person.
        age: Since the last measurement, s; 0 in its frame. It stands when the tracker stops.
        confirmations: How often a person has been confirmed; a change means that the target may be another one.
        processed: Whether this frame was one of those in which people are looked for.
    """

    state: State
    position: Vector | None
    velocity: Vector | None
    measurement: Vector | None
    box: Box | None
    confidence: float | None
    gate_distance: float | None
    score: float | None
    failures: int
    age: float
    confirmations: int
    processed: bool

    @property
    def bearing(self) -> float | None:
        """Of the position, rad, positive to the left; None without one."""
        return None if self.position is None else math.atan2(self.position[1], self.position[0])

    @property
    def distance(self) -> float | None:
        """Forward distance of the position, m; None without one."""
        return None if self.position is None else self.position[0]

    @property
    def alarm(self) -> bool:
        """Whether the tracker has stopped, the person being hidden or gone, and asks for another confirmation."""
        return self.state == "lost"


class PersonTracker:
    """Tracks one person; searches for the largest, most central one from the start.

    Args:
        detector: Finds the people in a picture; run on the processed frames only.
        intrinsics: Of the color picture and the depth, which are registered and equally large.
        mount: Where the camera is on the robot; the default gives positions in the camera's own place.
        settings: See `TrackerSettings`.
    """

    def __init__(
        self,
        detector: Detector,
        intrinsics: Intrinsics,
        mount: CameraMount = CAMERA_FRAME,
        settings: TrackerSettings | None = None,
    ) -> None:
        if not isinstance(intrinsics, Intrinsics):
            raise TypeError(f"intrinsics are {intrinsics!r}, expected follow_env.geometry.Intrinsics of the pictures.")
        self._detector, self._intrinsics, self._mount = detector, intrinsics, mount
        self._settings = settings = settings or TrackerSettings()
        self._dt = 1.0 / settings.rate
        self._period = settings.every / settings.rate
        self._confirm_frames, self._stop_frames = settings.confirm_frames, settings.stop_frames
        self._frames = self._confirmations = 0
        self.confirm()

    def confirm(self, target: Pixel | Box | None = None) -> None:
        """Search for a person to confirm, whatever was tracked before: the answer to the alarm.

        Args:
            target: Whom to confirm: the person around a picture point (u, v), the one in a box (u0, v0, u1, v1), or
                None for the largest, most central one. It holds for the next frames, until somebody is confirmed.

        Raises:
            ValueError: If the target is neither a point nor a box of finite pixels.
        """
        if target is not None and (len(target) not in (2, 4) or not all(map(math.isfinite, target))):
            raise ValueError(f"target is {target}, expected finite pixels: a point (u, v) or a box (u0, v0, u1, v1).")
        self._target = target
        self._state: State = "searching"
        self._filter: PersonFilter | None = None
        self._samples: list[Vector] = []
        self._last: Candidate | None = None
        self._failures, self._age = 0, 0.0
        self._in_company = False

    def update(self, rgb: NDArray[np.uint8], depth: NDArray[np.float32], twist: Twist = (0.0, 0.0)) -> Track:
        """Take in a frame. A depth without any reading is no error: nobody can be measured in it.

        Args:
            rgb: (H, W, 3) uint8.
            depth: (H, W) floating point, along the optical axis, m; 0 or NaN where there is no reading.
            twist: Odometry (v m/s, omega rad/s ccw) driven since the frame before; zeros for a standing camera.

        Raises:
            TypeError: If the depth is not floating point.
            ValueError: If the pictures and the intrinsics differ in size, or the twist is not finite.
        """
        self._check(rgb, depth)
        due = self._advance(twist)
        return self._track(self._process(self._candidates(rgb, depth)) if due else _NOTHING, due)

    def skip(self, twist: Twist = (0.0, 0.0)) -> Track:
        """Take in a frame that could not be read: time goes on, and if it was to be processed, nobody was found."""
        due = self._advance(twist)
        return self._track(self._process([]) if due else _NOTHING, due)

    def _advance(self, twist: Twist) -> bool:
        """Move everything known into the present frame; return whether this frame is to be processed."""
        motion: Motion = arc(twist, self._dt)
        if self._settings.frame == "body":
            motion = STANDING
        if self._filter is not None:
            self._filter.predict(self._dt, motion)
        self._samples = [moved(sample, motion) for sample in self._samples]
        due = self._frames % self._settings.every == 0
        self._frames += 1
        if self._last is not None:
            self._age += self._dt
        return due and self._state != "lost"

    def _process(self, candidates: list[Candidate]) -> Association:
        if self._filter is not None:
            return self._follow(self._filter, candidates)
        return self._confirm(candidates)

    def _follow(self, filter_: PersonFilter, candidates: list[Candidate]) -> Association:
        assert self._last is not None
        variance = filter_.covariance[0] + self._settings.measurement_noise if self._in_company else None
        found = associate(candidates, filter_.position, self._last.box, self._size, self._settings.gate, variance)
        if found.chosen is not None:
            filter_.update(found.chosen.position)
            self._accept(found.chosen)
            self._state, self._failures = "tracking", 0
            return found
        filter_.update(None)
        self._state = "coasting"
        self._failures += 1
        if self._failures >= self._stop_frames:
            self._state, self._filter, self._last = "lost", None, None
        return found

    def _confirm(self, candidates: list[Candidate]) -> Association:
        found = _NOTHING
        if self._last is not None:
            found = associate(candidates, self._samples[-1], self._last.box, self._size, self._settings.gate)
        if found.chosen is None:
            self._samples = []
            found = Association(self._chosen(candidates), found.distance, None)
        if found.chosen is None:
            self._state, self._last, self._age = "searching", None, 0.0
            self._failures += 1
            return found
        self._samples.append(found.chosen.position)
        self._accept(found.chosen)
        self._state, self._failures = "confirming", 0
        if len(self._samples) == self._confirm_frames:
            settings = self._settings
            line = [(-self._period * back, sample) for back, sample in enumerate(reversed(self._samples))]
            self._filter = PersonFilter(
                line, settings.acceleration_density, settings.measurement_noise, settings.smoothing
            )
            self._state, self._target, self._samples = "tracking", None, []
            self._confirmations += 1
        return found

    def _chosen(self, candidates: list[Candidate]) -> Candidate | None:
        """Return whom to begin to confirm."""
        if self._target is None:
            return max(candidates, key=self._prominence, default=None)
        if len(self._target) == 2:
            u, v = self._target
            around = [c for c in candidates if c.box[0] <= u <= c.box[2] and c.box[1] <= v <= c.box[3]]
            return min(around, key=lambda c: area(c.box), default=None)
        best = max(candidates, key=lambda c: overlap(c.box, self._target), default=None)  # type: ignore[arg-type]
        return best if best is not None and overlap(best.box, self._target) >= NAMED_OVERLAP else None

    def _prominence(self, candidate: Candidate) -> float:
        """Return the box's area times its nearness to the picture's middle, 1 there and 0 in a corner."""
        u0, v0, u1, v1 = candidate.box
        width, height = self._size
        off = math.sqrt(((u0 + u1) / width - 1.0) ** 2 + ((v0 + v1) / height - 1.0) ** 2)
        return area(candidate.box) * (1.0 - off / math.sqrt(2.0))

    def _accept(self, candidate: Candidate) -> None:
        self._last, self._age = candidate, 0.0

    def _candidates(self, rgb: NDArray[np.uint8], depth: NDArray[np.float32]) -> list[Candidate]:
        """Return the detections that have a depth, with their boxes clipped to the picture."""
        detections = self._detector.detect(rgb, depth)
        boxes = [detection.box for detection in detections]
        if self._settings.company == "apart":
            self._in_company |= len(detections) > 1
        found = []
        for k, detection in enumerate(detections):
            seen = self._seen(depth, detection.box, boxes[:k] + boxes[k + 1 :])
            if seen is not None:
                box, z = seen
                right, down, forward = back_project(
                    (box[0] + box[2]) / 2.0, (box[1] + box[3]) / 2.0, z, self._intrinsics, self._mount
                )
                found.append(Candidate(box, detection.score, (forward, -right, -down)))
        return found

    def _seen(self, depth: NDArray[np.float32], box: Box, others: Sequence[Box]) -> tuple[Box, float] | None:
        """Return what a box shows of the person, inside the picture, and at which depth."""
        expected = self._filter.position if self._filter is not None else self._samples[-1] if self._samples else None
        if self._in_company and between(box, others):
            return None
        if self._in_company and expected is not None:
            return seen_at(depth, box, expected[0] - self._mount.forward, self._settings.gate, alone(box, others))
        z = box_depth(depth, box)
        if z is None:
            return None
        width, height = self._size
        return (max(box[0], 0.0), max(box[1], 0.0), min(box[2], float(width)), min(box[3], float(height))), z

    def _track(self, found: Association, processed: bool) -> Track:
        tracking = self._filter is not None
        return Track(
            self._state,
            self._filter.position if self._filter is not None else None,
            self._filter.velocity if self._filter is not None else None,
            found.chosen.position if found.chosen is not None and tracking else None,
            None if self._last is None else self._last.box,
            None if self._last is None else self._last.confidence,
            found.distance,
            found.log_score,
            self._failures,
            self._age,
            self._confirmations,
            processed,
        )

    @property
    def _size(self) -> tuple[int, int]:
        return self._intrinsics.width, self._intrinsics.height

    def _check(self, rgb: NDArray[np.uint8], depth: NDArray[np.float32]) -> None:
        if rgb.ndim != 3 or depth.ndim != 2 or rgb.shape[:2] != depth.shape:
            raise ValueError(
                f"color has shape {rgb.shape} and depth {depth.shape}; expected (H, W, 3) and (H, W), equally large."
            )
        if depth.shape[::-1] != self._size:
            raise ValueError(
                f"the pictures are {depth.shape[1]}x{depth.shape[0]} but the intrinsics are of "
                f"{self._size[0]}x{self._size[1]}; use intrinsics.scaled({depth.shape[1]}, {depth.shape[0]})."
            )
        if not np.issubdtype(depth.dtype, np.floating):
            raise TypeError(
                f"depth has type {depth.dtype}; expected floating point meters (divide millimeters by 1000)."
            )


_NOTHING = Association(None, None, None)
