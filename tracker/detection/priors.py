"""Prior boxes: where they are, how a box is coded against them, and which of them have to find a person.

Everything is in shares of the picture: u and v from 0 to 1. "Corners" are (u0, v0, u1, v1), "centers" (u, v, w, h).
"""

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from tracker.boxes import iou

INPUT_SIZE = 300
"""Side of the picture that every network takes, px."""
VARIANCES = (0.1, 0.2)
"""Divisors of the coded center and of the coded size (SSD)."""
MATCH_OVERLAP = 0.5
"""Least overlap at which a prior has to find a person (paper A, figure 8; SSD)."""
NEAR_OVERLAP, NEAR_SHARE = 0.4, 0.8
"""A prior may find the person that it overlaps most from this overlap on, or from this share of the greatest overlap
that any has with that person, if that is less: what it says then is suppressed by the better ones anyway."""
OWN_PRIORS, OWN_OVERLAP = 3, 0.2
"""So many of the priors that overlap nobody more have to find a person, if they overlap it by this at least (Zhang et
al., S3FD, 2017): somebody thin or far away would be learned by a single one."""
POSITIVE, NEGATIVE, IGNORED = 1, 0, -1
"""Labels of priors: person, background, neither (it overlaps a person a little too little, or one too hard to see)."""


@dataclass(frozen=True)
class PriorLayer:
    """Priors of one prediction layer (a row of paper A's Table 1).

    Attributes:
        cells: of the feature map, in both directions.
        step: between the centers, px.
        smallest: L_min, px.
        largest: L_max, px.
        ratios: width over height, besides the two squares.
    """

    cells: int
    step: int
    smallest: int
    largest: int
    ratios: tuple[float, ...]

    @property
    def per_cell(self) -> int:
        """Priors in a cell: the squares L_min and sqrt(L_min L_max), and one for each ratio."""
        return 2 + len(self.ratios)


_TWO, _THREE = (1 / 2, 2.0), (1 / 2, 2.0, 1 / 3, 3.0)

PAPER_LAYERS = (
    PriorLayer(19, 16, 60, 115, _TWO),
    PriorLayer(10, 30, 115, 170, _THREE),
    PriorLayer(5, 60, 170, 225, _THREE),
    PriorLayer(3, 100, 225, 280, _THREE),
    PriorLayer(1, 300, 280, 320, _TWO),
)
"""Conv6, Concat7, Concat8, Concat9 and Conv10 of paper A: 2252 priors. L_max of the last is as printed."""

SSD300_LAYERS = (
    PriorLayer(38, 8, 30, 60, _TWO),
    PriorLayer(19, 16, 60, 111, _THREE),
    PriorLayer(10, 32, 111, 162, _THREE),
    PriorLayer(5, 64, 162, 213, _THREE),
    PriorLayer(3, 100, 213, 264, _TWO),
    PriorLayer(1, 300, 264, 315, _TWO),
)
"""Liu et al. (2016), as their code has it for the pictures of VOC: 8732 priors."""


def prior_boxes(layers: tuple[PriorLayer, ...]) -> np.ndarray:
    """Return the priors (P, 4) as centers, float32, clipped to the picture; order: layer, row, column, shape.

    Shapes: w = L_min sqrt(ratio), h = L_min / sqrt(ratio), and the square of side sqrt(L_min L_max) (paper A, 3.1.3).
    """
    parts = []
    for layer in layers:
        side = math.sqrt(layer.smallest * layer.largest)
        roots = [math.sqrt(ratio) for ratio in layer.ratios]
        shapes = [(layer.smallest, layer.smallest), (side, side)]
        shapes += [(layer.smallest * root, layer.smallest / root) for root in roots]
        at = (np.arange(layer.cells) + 0.5) * layer.step
        boxes = np.empty((layer.cells, layer.cells, layer.per_cell, 4))
        boxes[..., 0], boxes[..., 1], boxes[..., 2:] = at[None, :, None], at[:, None, None], shapes
        parts.append(boxes.reshape(-1, 4) / INPUT_SIZE)
    return to_centers(np.clip(to_corners(np.concatenate(parts)), 0.0, 1.0)).astype(np.float32)


def to_corners(boxes: np.ndarray) -> np.ndarray:
    """Return boxes (..., 4) given as centers as corners."""
    half = 0.5 * boxes[..., 2:]
    return np.concatenate([boxes[..., :2] - half, boxes[..., :2] + half], axis=-1)


def to_centers(boxes: np.ndarray) -> np.ndarray:
    """Return boxes (..., 4) given as corners as centers."""
    return np.concatenate([0.5 * (boxes[..., :2] + boxes[..., 2:]), boxes[..., 2:] - boxes[..., :2]], axis=-1)


def encode(boxes: np.ndarray, priors: np.ndarray) -> np.ndarray:
    """Return the offsets (P, 4) of boxes (P, 4; corners) from the priors (P, 4; centers), one box for each prior."""
    centers = to_centers(boxes)
    shift = (centers[:, :2] - priors[:, :2]) / (VARIANCES[0] * priors[:, 2:])
    return np.concatenate([shift, np.log(centers[:, 2:] / priors[:, 2:]) / VARIANCES[1]], axis=1)


def decode(offsets: np.ndarray, priors: np.ndarray) -> np.ndarray:
    """Return the boxes (P, 4; corners) at these offsets (P, 4) from the priors (P, 4; centers)."""
    centers = priors[:, :2] + VARIANCES[0] * offsets[:, :2] * priors[:, 2:]
    return to_corners(np.concatenate([centers, priors[:, 2:] * np.exp(VARIANCES[1] * offsets[:, 2:])], axis=1))


class Targets(NamedTuple):
    """What the priors have to say of a picture, or of each picture of a batch.

    Attributes:
        labels: (P,) int64, `POSITIVE`, `NEGATIVE` or `IGNORED`.
        offsets: (P, 4) float32, where positive.
        weights: (P,) float32, where positive: 1 / sqrt(n), n being the priors that have to find the same person.
    """

    labels: np.ndarray
    offsets: np.ndarray
    weights: np.ndarray


def match(boxes: np.ndarray, difficult: np.ndarray, priors: np.ndarray) -> Targets:
    """Return what every prior has to say of a picture.

    As SSD: the best pair of a person and a prior is joined, then the best of what is left, until every person has a
    prior of its own; then each prior that overlaps a person by `MATCH_OVERLAP` takes the one it overlaps most. The
    first step matters here: beyond 3.8 m no prior of paper A reaches that overlap with an adult. Unlike in SSD, a
    person has `OWN_PRIORS` of its own where they are near enough, and a prior that overlaps one nearly enough
    (`NEAR_OVERLAP`, `NEAR_SHARE`) is ignored: those were nearly all of the hardest negatives, and taught little else.

    Args:
        boxes: (N, 4) people, corners.
        difficult: (N,) bool, people that are too hard to see: priors that would take one of them are ignored.
        priors: (P, 4), centers.

    Raises:
        ValueError: if a box is empty, inverted, or not finite, or there are more people than priors.
    """
    if not (np.isfinite(boxes).all() and (boxes[:, 2:] > boxes[:, :2]).all()):
        raise ValueError(f"the boxes {boxes.tolist()} are not all (u0, v0, u1, v1) with u0 < u1 and v0 < v1")
    if len(boxes) > len(priors):
        raise ValueError(f"there are {len(boxes)} people for {len(priors)} priors; expected at most one each")
    labels, offsets = np.zeros(len(priors), np.int64), np.zeros((len(priors), 4), np.float32)
    weights = np.zeros(len(priors), np.float32)
    if len(boxes) == 0:
        return Targets(labels, offsets, weights)
    overlaps = iou(boxes, to_corners(priors))
    owner = overlaps.argmax(axis=0)
    best = overlaps.max(axis=0)
    owned = best >= MATCH_OVERLAP
    near = np.minimum(NEAR_OVERLAP, NEAR_SHARE * overlaps.max(axis=1))[owner]
    labels[(best >= near) & (best > 0.0)] = IGNORED
    overlaps = np.where(difficult[:, None], -1.0, overlaps)  # these need no prior of their own
    left = overlaps.copy()
    for _ in range(int((~difficult).sum())):
        person, prior = divmod(int(left.argmax()), len(priors))
        owner[prior], owned[prior] = person, True
        left[person], left[:, prior] = -1.0, -1.0
    mine = np.where(owner == np.arange(len(boxes))[:, None], overlaps, -1.0)
    own = np.argsort(-mine, axis=1, kind="stable")[:, :OWN_PRIORS]
    owned[own[np.take_along_axis(mine, own, axis=1) >= OWN_OVERLAP]] = True
    labels[owned] = np.where(difficult[owner[owned]], IGNORED, POSITIVE)
    found = labels == POSITIVE
    offsets[found] = encode(boxes[owner[found]], priors[found])
    weights[found] = 1.0 / np.sqrt(np.bincount(owner[found])[owner[found]])
    return Targets(labels, offsets, weights)
