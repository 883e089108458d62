"""Boxes in a picture: `Detection`, overlap and non-maximum suppression. Needs no torch.

A box is (u0, v0, u1, v1): left, upper, right and lower edge; u to the right, v down, in px or any other one unit.
"""

from dataclasses import dataclass

import numba
import numpy as np

Box = tuple[float, float, float, float]


@dataclass(frozen=True, slots=True)
class Detection:
    """A person that was detected.

    Attributes:
        box: (u0, v0, u1, v1), px.
        score: confidence in [0, 1].
    """

    box: Box
    score: float


def iou(first: np.ndarray, second: np.ndarray) -> np.ndarray:
    """Return the overlap (N, M) of boxes (N, 4) with boxes (M, 4): intersection over union, 0 where the union is."""
    a, b = np.asarray(first)[:, None, :], np.asarray(second)[None, :, :]
    width = np.minimum(a[..., 2], b[..., 2]) - np.maximum(a[..., 0], b[..., 0])
    height = np.minimum(a[..., 3], b[..., 3]) - np.maximum(a[..., 1], b[..., 1])
    shared = np.maximum(width, 0.0) * np.maximum(height, 0.0)
    union = area(a) + area(b) - shared
    return np.divide(shared, union, out=np.zeros_like(shared), where=union > 0.0)


def area(boxes: np.ndarray) -> np.ndarray:
    """Return the areas (...) of boxes (..., 4)."""
    return (boxes[..., 2] - boxes[..., 0]) * (boxes[..., 3] - boxes[..., 1])


def nms(boxes: np.ndarray, scores: np.ndarray, overlap: float = 0.45) -> np.ndarray:
    """Return the indices (K,) of the boxes that remain, best first: none overlaps a better one by more than `overlap`.

    Args:
        boxes: (N, 4).
        scores: (N,); among equals the first is the better.
        overlap: greatest intersection over union of two that remain (SSD: 0.45).
    """
    order = np.argsort(-scores, kind="stable")
    edges = np.ascontiguousarray(np.asarray(boxes, dtype=np.float64)[order].T)
    return order[_suppress(edges, area(edges.T), overlap)]


def vote(chosen: np.ndarray, boxes: np.ndarray, scores: np.ndarray, overlap: float) -> np.ndarray:
    """Return the chosen boxes (K, 4), each as the mean of all boxes that overlap it enough, weighted by their scores.

    "Box voting" (Gidaris and Komodakis, 2015): the most certain box of a person is not always the one that fits best.

    Args:
        chosen: (K, 4), some of the boxes.
        boxes: (N, 4).
        scores: (N,), positive.
        overlap: least intersection over union of a box that has a vote.
    """
    votes = np.where(iou(chosen, boxes) >= overlap, scores, 0.0)
    return (votes[:, :, None] * boxes).sum(axis=1) / votes.sum(axis=1)[:, None]


@numba.njit(cache=True)
def _suppress(edges: np.ndarray, areas: np.ndarray, overlap: float) -> np.ndarray:
    """Return which of the sorted boxes remain, (N,) bool, from their edges (4, N) and areas (N,).

    Unsigned indices and selections instead of branches let the compiler compare several boxes at once.
    """
    left, top, right, bottom = edges[0], edges[1], edges[2], edges[3]
    count = len(areas)
    remains = np.ones(count, np.bool_)
    for i in range(count):
        if remains[i]:
            u0, v0, u1, v1, size = left[i], top[i], right[i], bottom[i], areas[i]
            for j in range(np.uint64(i + 1), np.uint64(count)):
                width = (u1 if u1 < right[j] else right[j]) - (u0 if u0 > left[j] else left[j])
                height = (v1 if v1 < bottom[j] else bottom[j]) - (v0 if v0 > top[j] else top[j])
                shared = (width if width > 0.0 else 0.0) * (height if height > 0.0 else 0.0)
                remains[j] &= shared <= overlap * (size + areas[j] - shared)
    return remains
