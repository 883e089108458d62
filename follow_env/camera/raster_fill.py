"""Kernels that decide, within one tile of 16 x 16 pixels, what is nearest at every pixel centre.

A tile holds 1/Z (float32) and the number of the surface seen; nearer means a greater 1/Z, and the first drawn wins a
tie. Rows of 16 pixels are drawn whole, with a test in each lane, so that the compiler can use vector instructions.
"""

import math

import numpy as np
from numba import njit

TILE = 16
_ZERO, _ONE = np.float32(0.0), np.float32(1.0)
_NOWHERE = np.float32(-1.0)

_jit = njit(nogil=True, error_model="numpy")


@_jit
def fill_facet(record, number, tile, limit, floor):
    """Draw a facet of up to four edges into the tile; return the least 1/Z that the tile now has for certain.

    Args:
        record: (16,) float32, edges and 1/Z, see `raster_setup`.
        number: the surface's number.
        tile: the tile's rays and buffers.
        limit: 1 / near.
        floor: the least 1/Z in the tile so far.
    """
    xs, ys, depth, seen = tile.xs, tile.ys, tile.depth, tile.seen
    whole = True
    for i in range(4):
        a, b, c = record[3 * i], record[3 * i + 1], record[3 * i + 2]
        ax0, ax1, by0, by1 = a * xs[0], a * xs[TILE - 1], b * ys[0], b * ys[TILE - 1]
        if (max(ax0, ax1) + max(by0, by1)) + c < _ZERO:
            return floor
        whole &= (min(ax0, ax1) + min(by0, by1)) + c >= _ZERO
    a, b, c = record[12], record[13], record[14]
    ax0, ax1, by0, by1 = a * xs[0], a * xs[TILE - 1], b * ys[0], b * ys[TILE - 1]
    nearest, farthest = (max(ax0, ax1) + max(by0, by1)) + c, (min(ax0, ax1) + min(by0, by1)) + c
    if min(nearest, record[15]) <= floor:
        return floor
    if whole and nearest <= limit:
        for i in range(TILE):
            base = b * ys[i]
            for j in range(TILE):
                value = (a * xs[j] + base) + c
                nearer = value > depth[i, j]
                depth[i, j] = value if nearer else depth[i, j]
                seen[i, j] = number if nearer else seen[i, j]
        return max(floor, farthest)
    a0, a1, a2, a3 = record[0], record[3], record[6], record[9]
    c0, c1, c2, c3 = record[2], record[5], record[8], record[11]
    for i in range(TILE):
        y = ys[i]
        b0, b1, b2, b3 = record[1] * y, record[4] * y, record[7] * y, record[10] * y
        base = b * y
        for j in range(TILE):
            x = xs[j]
            value = (a * x + base) + c
            nearer = (value > depth[i, j]) & (value <= limit)
            nearer &= ((a0 * x + b0) + c0 >= _ZERO) & ((a1 * x + b1) + c1 >= _ZERO)
            nearer &= ((a2 * x + b2) + c2 >= _ZERO) & ((a3 * x + b3) + c3 >= _ZERO)
            depth[i, j] = value if nearer else depth[i, j]
            seen[i, j] = number if nearer else seen[i, j]
    return floor


@_jit
def fill_triangle(record, first_row, last_row, number, tile, limit):
    """Draw the rows `first_row`..`last_row` (of this tile) of a triangle's record, see `raster_setup`."""
    xs, ys, depth, seen = tile.xs, tile.ys, tile.depth, tile.seen
    a0, a1, a2, a = record[0], record[3], record[6], record[9]
    c0, c1, c2, c = record[2], record[5], record[8], record[11]
    for i in range(first_row, last_row + 1):
        y = ys[i]
        b0, b1, b2, base = record[1] * y, record[4] * y, record[7] * y, record[10] * y
        for j in range(TILE):
            x = xs[j]
            value = (a * x + base) + c
            nearer = (value > depth[i, j]) & (value <= limit)
            nearer &= ((a0 * x + b0) + c0 >= _ZERO) & ((a1 * x + b1) + c1 >= _ZERO) & ((a2 * x + b2) + c2 >= _ZERO)
            depth[i, j] = value if nearer else depth[i, j]
            seen[i, j] = number if nearer else seen[i, j]


@_jit
def fill_cylinder(record, number, tile, near):
    """Draw an upright cylinder: side, top and bottom bear the numbers `number`, + 1 and + 2.

    A level camera sees every vertical line of the side at one depth and every row of an end at one depth.
    """
    xs, ys, depth, seen = tile.xs, tile.ys, tile.depth, tile.seen
    x, z, radius, top, bottom = record[0], record[1], record[2], record[3], record[4]
    column, low, high = tile.column, tile.low, tile.high
    for j in range(TILE):
        ray = np.float64(xs[j])
        a, b = ray * ray + 1.0, ray * x + z
        miss = ray * z - x
        inner = a * radius * radius - miss * miss
        column[j] = _NOWHERE
        if inner > 0.0:
            root = math.sqrt(inner)
            distance = (b - root) / a if b - root >= near * a else (b + root) / a
            if distance >= near:
                column[j] = 1.0 / distance
                low[j], high[j] = top / distance, bottom / distance
    for i in range(TILE):
        y = ys[i]
        for j in range(TILE):
            nearer = (column[j] > depth[i, j]) & (y >= low[j]) & (y <= high[j])
            depth[i, j] = column[j] if nearer else depth[i, j]
            seen[i, j] = number if nearer else seen[i, j]
    for end in range(2):
        if record[6 + end] == 0.0:
            continue
        level = record[3 + end]
        for i in range(TILE):
            inverse = ys[i] / level
            if inverse <= 0.0 or inverse * near > 1.0:
                continue
            ahead = 1.0 - z * inverse
            room = np.float32(radius * radius * inverse * inverse - ahead * ahead)
            value, middle = np.float32(inverse), np.float32(x * inverse)
            for j in range(TILE):
                nearer = (value > depth[i, j]) & ((xs[j] - middle) * (xs[j] - middle) <= room)
                depth[i, j] = value if nearer else depth[i, j]
                seen[i, j] = number + np.int32(1 + end) if nearer else seen[i, j]
