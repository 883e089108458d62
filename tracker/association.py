"""Which detection is the person that is tracked: gate and similarity of paper A, eqs. (3)-(4) and (15)-(19).

The gate compares positions in space, the similarity compares boxes in the picture with the last box that was *tracked*.
The similarity of eq. (16) is a score, not a probability; it is kept as a logarithm, so that it never underflows.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from tracker.depth import LEAST_PART, Box
from tracker.metrics import area
from tracker.person_filter import Vector

GATE = 0.30
"""R_thre of eq. (15), m."""
ALPHAS = (1.0, 1.0, 0.8)
"""alpha_0 (shift), alpha_1 (shape) and alpha_2 (aspect ratio within shape) of eq. (16)."""
PLAUSIBLE = 16.27
"""Largest squared distance from the prediction over its variance: chi-squared, three degrees of freedom, 99.9 %."""
SHARED = 0.5
"""So much of the smaller of two people's boxes may be common to both."""
COVERED = 0.75
"""So much of a box must two others cover for it to show nobody but them; so much of another, and it is a part of it."""


@dataclass(frozen=True, slots=True)
class Candidate:
    """A detection with a place in space.

    Attributes:
        box: (u0, v0, u1, v1) in the picture, px.
        confidence: The detector's, in [0, 1]; the association does not look at it.
        position: (x, y, z) measured, m, in the frame of the prediction.
    """

    box: Box
    confidence: float
    position: Vector


@dataclass(frozen=True, slots=True)
class Association:
    """What was decided.

    Attributes:
        chosen: The candidate that is the person, or None.
        distance: Between the prediction and the chosen candidate, or the nearest when none is chosen, m; None without
            candidates.
        log_score: Logarithm of eq. (16), at most 0; None when none is chosen.
    """

    chosen: Candidate | None
    distance: float | None
    log_score: float | None


def associate(
    candidates: Sequence[Candidate],
    prediction: Vector,
    tracked: Box,
    size: tuple[int, int],
    gate: float = GATE,
    variance: float | None = None,
) -> Association:
    """Return the most likely of the candidates inside the gate, eq. (4); of equals the nearest.

    As printed, eq. (15), all places inside the gate are equally likely and the similarity alone decides. It is a poor
    judge between people side by side: half a meter costs less than a box that has grown by a tenth.

    Args:
        candidates: Detections of the frame that have a depth. Their positions are the raw S_k, never smoothed.
        prediction: Predicted position of the person, m.
        tracked: Box of the last frame in which the person was tracked, px.
        size: Width and height of the picture, px.
        gate: Largest distance from the prediction, m, itself included.
        variance: Of a measured place around the prediction in each direction, m²: inside the gate the likelihood of the
            place is then Gaussian instead of eq. (15), and one that is not `PLAUSIBLE` is outside. None is the print.
    """
    if not candidates:
        return Association(None, None, None)
    ranked = [(math.dist(candidate.position, prediction), candidate) for candidate in candidates]
    farthest = gate if variance is None else min(gate, math.sqrt(PLAUSIBLE * variance))
    inside = [
        (log_similarity(candidate.box, tracked, size), distance, candidate)
        for distance, candidate in ranked
        if distance <= farthest
    ]
    if not inside:
        return Association(None, min(distance for distance, _ in ranked), None)
    weight = 0.0 if variance is None else 0.5 / variance
    score, distance, chosen = max(inside, key=lambda entry: (entry[0] - weight * entry[1] ** 2, -entry[1]))
    return Association(chosen, distance, score)


def between(box: Box, others: Sequence[Box]) -> bool:
    """Return whether a box shows nobody but two others' people, one on its left and one on its right.

    Of two people close to each other a detector may report a third one, who is half the one and half the other. A box
    that lies in this one but for a quarter shows a part of the same person, not another one.

    Args:
        box: Of a detection, px.
        others: Of the other detections.
    """
    others = [other for other in others if area(_common(box, other)) < COVERED * area(other)]
    left = [other for other in others if other[0] < box[0] and other[2] < box[2]]
    right = [other for other in others if other[0] > box[0] and other[2] > box[2]]
    return any(_covered(box, one, other) >= COVERED for one in left for other in right)


def alone(box: Box, others: Sequence[Box]) -> Box:
    """Return the part of a box between those of the people on its left and on its right, or the box if that is little.

    A detection that shares half of itself with this one, or half of this one, shows the same person.

    Args:
        box: Of a detection, px.
        others: Of the other detections.
    """
    u0, v0, u1, v1 = box
    for other in others:
        if 0.0 < area(_common(box, other)) < SHARED * min(area(box), area(other)):
            if other[0] < box[0] and other[2] < box[2]:
                u0 = max(u0, other[2])
            elif other[0] > box[0] and other[2] > box[2]:
                u1 = min(u1, other[0])
    return (u0, v0, u1, v1) if u1 - u0 >= LEAST_PART * (box[2] - box[0]) else box


def log_similarity(box: Box, tracked: Box, size: tuple[int, int], alphas: tuple[float, float, float] = ALPHAS) -> float:
    """Return the logarithm of eq. (16), from -inf to 0 for equal boxes.

    Boxes are taken in SSD's coordinates, the picture being 1 wide and 1 high; in pixels even a perfect match would
    score e^-72. The square root covers the area's difference alone.

    Args:
        box: Of a detection, px.
        tracked: Of the person in the last tracked frame, px.
        size: Width and height of the picture, px.
        alphas: alpha_0, alpha_1 and alpha_2.

    Raises:
        ValueError: If a box is empty, inverted or not finite.
    """
    u, v, width, height = _normalized(box, size)
    tracked_u, tracked_v, tracked_width, tracked_height = _normalized(tracked, size)
    shift = math.sqrt((u - tracked_u) ** 2 + (v - tracked_v) ** 2)  # (17)
    growth = abs(width * height - tracked_width * tracked_height)  # (18)
    aspect = abs(width / height - tracked_width / tracked_height)  # (19)
    return -(alphas[0] * shift + alphas[1] * (math.sqrt(growth) + alphas[2] * aspect))


def _covered(box: Box, one: Box, other: Box) -> float:
    """Return the share of a box that lies in at least one of two others."""
    both = _common(_common(box, one), other)
    return (area(_common(box, one)) + area(_common(box, other)) - area(both)) / area(box)


def _common(one: Box, other: Box) -> Box:
    """Return the intersection of two boxes, without area if they have none."""
    u0, v0 = max(one[0], other[0]), max(one[1], other[1])
    return u0, v0, max(min(one[2], other[2]), u0), max(min(one[3], other[3]), v0)


def _normalized(box: Box, size: tuple[int, int]) -> tuple[float, float, float, float]:
    """Return center, width and height as shares of the picture."""
    u0, v0, u1, v1 = box
    if not (-math.inf < u0 < u1 < math.inf and -math.inf < v0 < v1 < math.inf):
        raise ValueError(
            f"box is {box}, expected finite pixels (left, top, right, bottom) with left < right, top < bottom."
        )
    return (u0 + u1) / 2.0 / size[0], (v0 + v1) / 2.0 / size[1], (u1 - u0) / size[0], (v1 - v0) / size[1]
