"""Depth of a detected person, read from the *box* and never from mask pixels, so background enters as it does in life.

The box is clipped to the picture first; everything refers to its visible part. Samples that are zero, NaN or out of
range are dropped. Fewer than three valid samples make no measurement.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from types import MappingProxyType
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from follow_env.geometry import Intrinsics, bearing_distance

Rule = Literal["six_smallest", "grid_mean", "grid_median", "centroid"]
Box = tuple[float, float, float, float]

VALID_RANGE = (0.5, 8.0)
"""Depths taken by default, m: an Xtion returns nothing nearer than about 0.5 m and quantizes to 0.2 m at 8 m."""

FEWEST_SAMPLES = 3

EDGE_SHARE = 0.10
"""Of a column's pixels in the middle 80 % of a box's height at least so many must be at a person's depth."""
LEAST_PART = 0.5
"""So much of a box's width must be left where it is cut: what is less shows somebody else, or too little."""


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
        centroid: Paper B, eqs. (24)-(25) read literally: the depth at the box's center, here the median of the valid
            samples of the 3x3 pixels around it.

    Args:
        depth: (H, W) depth along the optical axis, m; 0 or NaN where there is none.
        box: (u0, v0, u1, v1) left, top, right, bottom in pixel coordinates (see `follow_env.geometry`), inside the
            picture or not.
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
        raise ValueError(f"valid_range is {valid_range}, expected 0 < nearest < farthest in meters.")
    if depth.ndim != 2:
        raise ValueError(f"depth has shape {depth.shape}, expected (height, width).")
    visible = _clipped(box, depth.shape[1], depth.shape[0])
    return None if visible is None else sample(depth, visible, nearest, farthest)


def seen_at(
    depth: NDArray[np.float32],
    box: Box,
    expected: float,
    reach: float,
    alone: Box | None = None,
    valid_range: tuple[float, float] = VALID_RANGE,
) -> tuple[Box, float] | None:
    """Return the part of a box that shows a person at an expected depth, and its depth m; None if it shows another.

    Of two people close to each other a detector's boxes are seldom those of one: they take in part of the neighbor or
    both. The middle of such a box and the six smallest of its samples are then nobody's, and a tracker that takes them
    drifts from one person to the other, inside the gate all the way. So the box is cut on its left and right to the
    columns at the expected depth, and only samples at that depth are taken. Where more of them are nearer, somebody
    else stands before the person.

    Args:
        depth: As in `box_depth`.
        box: As in `box_depth`.
        expected: Depth at which the person should be, m.
        reach: So much nearer or farther a sample may be, m.
        alone: The part of the box where nobody else was detected: samples are taken there if enough of what the box
            shows of the person lies in it. None takes them anywhere.
        valid_range: As in `box_depth`.
    """
    visible = _clipped(box, depth.shape[1], depth.shape[0])
    if visible is None:
        return None
    nearest, farthest = max(expected - reach, valid_range[0]), min(expected + reach, valid_range[1])
    u0, v0, u1, v1 = visible
    left, margin = int(u0), 0.1 * (v1 - v0)
    middle = depth[int(v0 + margin) : math.ceil(v1 - margin), left : math.ceil(u1)]
    there = np.count_nonzero((middle >= nearest) & (middle <= farthest), axis=0)
    columns = np.flatnonzero(there >= EDGE_SHARE * middle.shape[0])
    if columns.size == 0:
        return None
    part = max(u0, left + float(columns[0])), v0, min(u1, left + float(columns[-1]) + 1.0), v1
    if part[2] - part[0] < LEAST_PART * (u1 - u0):
        return None
    samples = None
    if alone is not None:
        inner = max(part[0], alone[0]), part[1], min(part[2], alone[2]), part[3]
        if inner[2] - inner[0] >= LEAST_PART * (part[2] - part[0]):
            samples = _valid_sorted(_grid(depth, inner), nearest, farthest)
    if samples is None:
        samples = _valid_sorted(_grid(depth, part), nearest, farthest)
    whole = _grid(depth, visible)
    before = np.count_nonzero((whole >= valid_range[0]) & (whole < nearest))
    if samples is None or before > np.count_nonzero((whole >= nearest) & (whole <= farthest)):
        return None
    return part, _mean(samples[:6])


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


def _grid(depth: NDArray[np.float32], box: Box) -> NDArray[np.float32]:
    """Return the (5, 5) samples spread over the central 60 % of a box inside the picture."""
    u0, v0, u1, v1 = box
    columns = (u0 + (u1 - u0) * _GRID_FRACTIONS).astype(np.intp)
    rows = (v0 + (v1 - v0) * _GRID_FRACTIONS).astype(np.intp)
    return depth[rows[:, None], columns]


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
