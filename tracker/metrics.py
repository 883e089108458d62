"""How well people are detected and one of them tracked: paper A's counts (Table 2) and what its experiment 2 asks for.

One subject per picture, as in the paper; a frame's truth is its box, or None where it is not to be seen.
"""

from __future__ import annotations

from collections.abc import Hashable, Mapping, Sequence
from dataclasses import dataclass

from tracker.depth import Box

MATCH = 0.5
"""Least intersection over union of a detection and the truth that it is taken for."""


@dataclass(frozen=True, slots=True)
class DetectionCounts:
    """Counts over a sequence.

    Attributes:
        frames: Number of frames.
        tp: Frames in which the subject was detected.
        fp: Detections of nobody, second ones of the subject included.
        fn: Frames in which the subject was missed.
        cfn: Longest run of missed frames; a frame without the subject ends a run.
    """

    frames: int
    tp: int
    fp: int
    fn: int
    cfn: int

    @property
    def tda(self) -> float:
        """Total detection accuracy: TP over all frames; NaN without frames."""
        return self.tp / self.frames if self.frames else float("nan")


def count_detections(truth: Sequence[Box | None], detections: Sequence[Sequence[Box]]) -> DetectionCounts:
    """Return the counts of a sequence: per frame the subject's true box and all boxes detected.

    Raises:
        ValueError: If the two differ in length.
    """
    _check_lengths(truth, detections)
    tp = fp = fn = run = cfn = 0
    for true_box, boxes in zip(truth, detections, strict=True):
        hit = true_box is not None and any(overlap(box, true_box) >= MATCH for box in boxes)
        missed = true_box is not None and not hit
        tp, fp, fn = tp + hit, fp + len(boxes) - hit, fn + missed
        run = run + 1 if missed else 0
        cfn = max(cfn, run)
    return DetectionCounts(len(truth), tp, fp, fn, cfn)


@dataclass(frozen=True, slots=True)
class TrackingCounts:
    """Whom a tracker followed, over the frames in which it accepted a detection.

    Attributes:
        right: Frames in which the box was the target's.
        wrong: Frames in which it was another person's.
        nobody: Frames in which it was nobody's.
        switches: How often it went over to another person: frames on a person other than the target before which the
            last person followed was somebody else (the target, or another one).
    """

    right: int
    wrong: int
    nobody: int
    switches: int


def count_tracking(
    people: Sequence[Mapping[Hashable, Box]], tracked: Sequence[Box | None], target: Hashable
) -> TrackingCounts:
    """Return whom the tracked boxes show: in each frame the person of the largest overlap, if it reaches `MATCH`.

    Args:
        people: Per frame the true box of everybody visible, by name.
        tracked: Per frame the box accepted by the tracker, or None.
        target: Name of the person to be tracked.

    Raises:
        ValueError: If the two differ in length.
    """
    _check_lengths(people, tracked)
    right = wrong = nobody = switches = 0
    last = target
    for boxes, box in zip(people, tracked, strict=True):
        if box is None:
            continue
        name, share = max(((n, overlap(b, box)) for n, b in boxes.items()), key=lambda e: e[1], default=(None, 0.0))
        if share < MATCH:
            nobody += 1
            continue
        right, wrong = right + (name == target), wrong + (name != target)
        switches += name not in (target, last)
        last = name
    return TrackingCounts(right, wrong, nobody, switches)


def time_to_stop(visible: Sequence[bool], stopped: Sequence[bool], rate: float) -> float | None:
    """Return the seconds from the first frame of a target's disappearance to the first frame in which tracking stopped.

    Args:
        visible: Per frame whether the target can be seen.
        stopped: Per frame whether the tracker has stopped (`Track.alarm`).
        rate: Frames/s.

    Returns:
        Seconds, of the disappearance that lasts when the tracker stops; None if it never stops or stops although the
        target can be seen.

    Raises:
        ValueError: If the two differ in length.
    """
    _check_lengths(visible, stopped)
    gone = 0
    for seen, stop in zip(visible, stopped, strict=True):
        gone = 0 if seen else gone + 1
        if stop:
            return (gone - 1) / rate if gone else None
    return None


def overlap(one: Box, other: Box) -> float:
    """Return the intersection over union of two boxes, 0 to 1."""
    width = min(one[2], other[2]) - max(one[0], other[0])
    height = min(one[3], other[3]) - max(one[1], other[1])
    if width <= 0.0 or height <= 0.0:
        return 0.0
    return width * height / (area(one) + area(other) - width * height)


def area(box: Box) -> float:
    """Return the area of a box, px²."""
    return (box[2] - box[0]) * (box[3] - box[1])


def _check_lengths(one: Sequence, other: Sequence) -> None:
    if len(one) != len(other):
        raise ValueError(f"the sequences have {len(one)} and {len(other)} frames; expected one entry each per frame.")
