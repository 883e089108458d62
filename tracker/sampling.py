"""Depth of a detected person, read from the *box* and never from mask pixels, so background enters as it does in life.

The box is clipped to the picture first; everything refers to its visible part. Samples that are zero, NaN or out of
range are dropped. Fewer than three valid samples make no measurement.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from types import MappingProxyType
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from tracker.geometry import Intrinsics, bearing_distance

Rule = Literal["six_smallest", "grid_mean", "grid_median", "centroid"]
Box = tuple[float, float, float, float]

VALID_RANGE = (0.5, 8.0)
"""Depths taken by default, m: an Xtion returns nothing nearer than about 0.5 m and quantises to 0.2 m at 8 m."""

FEWEST_SAMPLES = 3

IN_FRONT = 0.15
"""By so much a person's samples must be nearer than those of one whose box surrounds theirs, m: half a body."""


def box_depth(
    depth: NDArray[np.float32], box: Box, rule: Rule = "six_smallest", valid_range: tuple[float, float] = VALID_RANGE
) -> float | None:
    """Return the depth of what the box shows, m, or None when it shows too little.

    Rules:
        six_smallest: Paper A: mean of the six smallest of a sparse grid. The grid is not given there; here it is 5x5
            over the central 60 % of the box. Of fewer than six valid samples all are taken. For Gaussian noise the
            result lies 1.25 standard deviations before the mean.
        grid_mean: Mean of the valid samples of that grid.
        grid_median: Their median.
        centroid: Paper B, eqs. (24)-(25) read literally: the depth at the box's centre, here the median of the valid
            samples of the 3x3 pixels around it.

    Args:
        depth: (H, W) depth along the optical axis, m; 0 or NaN where there is none.
        box: (u0, v0, u1, v1) left, top, right, bottom in pixel coordinates (see `tracker.geometry`), inside the picture
            or not.
        rule: Name of the rule.
        valid_range: Nearest and farthest depth taken, m, both included.

    Returns:
        Depth in m, or None if fewer than three samples are valid or the box, being empty, inverted or outside, covers
        nothing of the picture.

    Raises:
        ValueError: If the picture is not two-dimensional, the box not finite, the rule unknown or the range empty.
    """
    sample = RULES.get(rule)
    if sample is None:
        raise ValueError(f"depth rule is {rule!r}, expected one of {', '.join(RULES)}.")
    nearest, farthest = valid_range
    if not 0.0 < nearest < farthest:
        raise ValueError(f"valid_range is {valid_range}, expected 0 < nearest < farthest in metres.")
    if depth.ndim != 2:
        raise ValueError(f"depth has shape {depth.shape}, expected (height, width).")
    visible = _clipped(box, depth.shape[1], depth.shape[0])
    return None if visible is None else sample(depth, visible, nearest, farthest)


def depths_apart(
    depth: NDArray[np.float32], boxes: Sequence[Box], valid_range: tuple[float, float] = VALID_RANGE
) -> list[float | None]:
    """Return the depth of each box by paper A's rule, less the samples that belong to somebody nearer.

    Where boxes overlap, the six smallest samples of the farther one are the nearer person's. A tracker that takes them
    drifts to whoever steps before its target, inside the gate all the way. So a box loses its samples inside the box of
    a nearer one. Who is nearer shows in the part that each box has for itself; a box that has none lies inside the
    others and counts as behind them unless its samples are nearer by `IN_FRONT`.

    Args:
        depth: As in `box_depth`.
        boxes: As in `box_depth`; one that overlaps no other has the depth that `box_depth` gives.
        valid_range: As in `box_depth`.
    """
    depths = [box_depth(depth, box, valid_range=valid_range) for box in boxes]
    for i, box in enumerate(boxes):
        hiding = [other for j, other in enumerate(boxes) if j != i and _hides(depth, other, box, valid_range)]
        if hiding and depths[i] is not None:
            visible = _clipped(box, depth.shape[1], depth.shape[0])
            assert visible is not None
            samples = _outside(depth, *_grid_places(visible), hiding, valid_range)
            depths[i] = None if samples is None else _mean(samples[:6])
    return depths


def _hides(depth: NDArray[np.float32], one: Box, other: Box, valid_range: tuple[float, float]) -> bool:
    """Return whether one box overlaps the other and shows somebody nearer."""
    if not (one[0] < other[2] and other[0] < one[2] and one[1] < other[3] and other[1] < one[3]):
        return False
    own, others_own = _front(depth, one, other, valid_range), _front(depth, other, one, valid_range)
    if own is not None and others_own is not None:
        return own < others_own
    whole = _front(depth, one if own is None else other, None, valid_range)
    if whole is None or own is others_own:
        return False
    return whole > own - IN_FRONT if own is not None else whole <= others_own - IN_FRONT  # type: ignore[operator]


def _front(depth: NDArray[np.float32], box: Box, less: Box | None, valid_range: tuple[float, float]) -> float | None:
    """Return the mean of the six smallest of many samples of a box, outside another; None if there are too few."""
    visible = _clipped(box, depth.shape[1], depth.shape[0])
    if visible is None:
        return None
    u0, v0, u1, v1 = visible
    columns = (u0 + (u1 - u0) * _FINE_FRACTIONS).astype(np.intp)
    rows = (v0 + (v1 - v0) * _FINE_FRACTIONS).astype(np.intp)
    samples = _outside(depth, columns, rows, [less] if less else [], valid_range)
    return None if samples is None else _mean(samples[:6])


def _outside(
    depth: NDArray[np.float32],
    columns: NDArray[np.intp],
    rows: NDArray[np.intp],
    boxes: Sequence[Box],
    valid_range: tuple[float, float],
) -> NDArray[np.float32] | None:
    """Return the valid samples at the crossings of columns and rows that lie in none of the boxes, ascending."""
    free = np.ones((rows.size, columns.size), np.bool_)
    for u0, v0, u1, v1 in boxes:
        across, down = (columns + 1 > u0) & (columns < u1), (rows + 1 > v0) & (rows < v1)
        free &= ~(down[:, None] & across)
    return _valid_sorted(depth[rows[:, None], columns][free], *valid_range)


def measure(
    depth: NDArray[np.float32],
    box: Box,
    intrinsics: Intrinsics,
    camera_forward: float,
    rule: Rule = "six_smallest",
    valid_range: tuple[float, float] = VALID_RANGE,
) -> tuple[float, float] | None:
    """Return the measurement (bearing rad, left positive; forward distance m) of a box in the robot frame, or None.

    The bearing is that of the middle of the box's visible part at the depth of `box_depth`, eqs. (27)-(31) of paper B.

    Args:
        depth: As in `box_depth`.
        box: As in `box_depth`.
        intrinsics: Of the depth picture.
        camera_forward: Camera ahead of the axle midpoint, m.
        rule: As in `box_depth`.
        valid_range: As in `box_depth`.

    Raises:
        ValueError: As `box_depth`, and if the intrinsics are of another picture size.
    """
    z_c = box_depth(depth, box, rule, valid_range)
    height, width = depth.shape
    if (width, height) != (intrinsics.width, intrinsics.height):
        raise ValueError(
            f"depth is {width}x{height} but the intrinsics are of {intrinsics.width}x{intrinsics.height}; "
            f"use intrinsics.scaled({width}, {height})."
        )
    if z_c is None:
        return None
    u = (max(box[0], 0.0) + min(box[2], width)) / 2.0
    return bearing_distance(u, z_c, intrinsics, camera_forward)


def _six_smallest(depth: NDArray[np.float32], box: Box, nearest: float, farthest: float) -> float | None:
    samples = _valid_sorted(_grid(depth, box), nearest, farthest)
    return None if samples is None else _mean(samples[:6])


def _grid_mean(depth: NDArray[np.float32], box: Box, nearest: float, farthest: float) -> float | None:
    samples = _valid_sorted(_grid(depth, box), nearest, farthest)
    return None if samples is None else _mean(samples)


def _grid_median(depth: NDArray[np.float32], box: Box, nearest: float, farthest: float) -> float | None:
    return _median(_valid_sorted(_grid(depth, box), nearest, farthest))


def _centroid(depth: NDArray[np.float32], box: Box, nearest: float, farthest: float) -> float | None:
    u0, v0, u1, v1 = box
    column, row = int((u0 + u1) / 2.0), int((v0 + v1) / 2.0)
    around = depth[max(row - 1, 0) : row + 2, max(column - 1, 0) : column + 2]
    return _median(_valid_sorted(around, nearest, farthest))


RULES: MappingProxyType[str, Callable[[NDArray[np.float32], Box, float, float], float | None]] = MappingProxyType(
    {"six_smallest": _six_smallest, "grid_mean": _grid_mean, "grid_median": _grid_median, "centroid": _centroid}
)
"""The sampling rules by name."""

_GRID_FRACTIONS = np.array([0.20, 0.35, 0.50, 0.65, 0.80])
_FINE_FRACTIONS = (np.arange(20) + 0.5) / 20.0


def _grid(depth: NDArray[np.float32], box: Box) -> NDArray[np.float32]:
    """Return the (5, 5) samples spread over the central 60 % of a box inside the picture."""
    columns, rows = _grid_places(box)
    return depth[rows[:, None], columns]


def _grid_places(box: Box) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Return the columns and the rows of the grid's pixels, (5,) each."""
    u0, v0, u1, v1 = box
    columns = (u0 + (u1 - u0) * _GRID_FRACTIONS).astype(np.intp)
    return columns, (v0 + (v1 - v0) * _GRID_FRACTIONS).astype(np.intp)


def _valid_sorted(samples: NDArray[np.float32], nearest: float, farthest: float) -> NDArray[np.float32] | None:
    """Return the samples in range, ascending, or None if they are too few; NaN compares false and drops out."""
    valid = samples[(samples >= nearest) & (samples <= farthest)]
    if valid.size < FEWEST_SAMPLES:
        return None
    valid.sort()
    return valid


def _mean(samples: NDArray[np.float32]) -> float:
    return float(np.add.reduce(samples, dtype=np.float64)) / samples.size


def _median(ascending: NDArray[np.float32] | None) -> float | None:
    if ascending is None:
        return None
    count = ascending.size
    return (float(ascending[(count - 1) // 2]) + float(ascending[count // 2])) / 2.0


def _clipped(box: Box, width: int, height: int) -> Box | None:
    """Return the part of the box inside the picture, or None if there is none."""
    u0, v0, u1, v1 = box
    if not (math.isfinite(u0) and math.isfinite(v0) and math.isfinite(u1) and math.isfinite(v1)):
        raise ValueError(f"box is {box}, expected four finite pixel coordinates (left, top, right, bottom).")
    u0, v0, u1, v1 = max(u0, 0.0), max(v0, 0.0), min(u1, float(width)), min(v1, float(height))
    return (u0, v0, u1, v1) if u0 < u1 and v0 < v1 else None
