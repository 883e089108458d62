# mypy: disable-error-code="no-untyped-def"
"""Kernels that decide, within one tile of 16 x 16 pixels, what is nearest at every pixel center.

A tile is one flat float32 array of planes of 256 numbers, `lanes[PLANE + 16 * row + column]`, beside `seen` (256,)
int32, the number of the surface at each pixel. Plane `DEPTH` holds 1/Z; nearer means greater, the first drawn wins a
tie. All pixels are computed and tested alike, one array and no branch, so that the compiler uses vector instructions.
"""

import math

import numpy as np
from numba import njit

TILE = 16
PIXELS = np.uint64(TILE * TILE)
# Planes of a tile: the pixel's ray, 1/Z, surface point, normal, texture coordinates, pixels per meter, light, Z.
X, Y, DEPTH, POINT_X, POINT_Y, POINT_Z, NORMAL_X, NORMAL_Y, S, T, SHARP, SHADE, LIGHT, DISTANCE, COLUMN = np.arange(
    0, 15 * TILE * TILE, TILE * TILE, dtype=np.uint64
)
LOW, HIGH = COLUMN + np.uint64(TILE), COLUMN + np.uint64(2 * TILE)
PLANES = 15
_ZERO = np.float32(0.0)
_NOWHERE = np.float32(-1.0)

_jit = njit(nogil=True, error_model="numpy")


@_jit
def clear(lanes, seen, left, top, step, background):
    """Make the tile empty: the rays of its pixels, 1/Z = `background` and nothing seen."""
    for k in range(PIXELS):
        lanes[X + k] = np.float32(left) + np.float32(np.int32(k) & np.int32(15)) * np.float32(step)
    for k in range(PIXELS):
        lanes[Y + k] = np.float32(top) + np.float32(np.int32(k) >> np.int32(4)) * np.float32(step)
    for k in range(PIXELS):
        lanes[DEPTH + k] = background
    for k in range(PIXELS):
        seen[k] = 0


@_jit
def fill_facet(facets, f, number, lanes, seen, limit, floor):
    """Draw facet `f` (see `raster_setup`) into the tile; return the least 1/Z that the tile now has for certain.

    `limit` is 1 / near, `floor` the least 1/Z in the tile so far: what lies behind it is left out.
    """
    x0, x1, y0, y1 = lanes[X], lanes[X + PIXELS - np.uint64(1)], lanes[Y], lanes[Y + PIXELS - np.uint64(1)]
    whole = True
    for i in range(4):
        a, b, c = facets[f, 3 * i], facets[f, 3 * i + 1], facets[f, 3 * i + 2]
        ax0, ax1, by0, by1 = a * x0, a * x1, b * y0, b * y1
        if (max(ax0, ax1) + max(by0, by1)) + c < _ZERO:
            return floor
        whole &= (min(ax0, ax1) + min(by0, by1)) + c >= _ZERO
    a, b, c = facets[f, 12], facets[f, 13], facets[f, 14]
    ax0, ax1, by0, by1 = a * x0, a * x1, b * y0, b * y1
    nearest, farthest = (max(ax0, ax1) + max(by0, by1)) + c, (min(ax0, ax1) + min(by0, by1)) + c
    if min(nearest, facets[f, 15]) <= floor:
        return floor
    if whole and nearest <= limit:
        for k in range(PIXELS):
            value = (a * lanes[X + k] + b * lanes[Y + k]) + c
            nearer = value > lanes[DEPTH + k]
            lanes[DEPTH + k] = value if nearer else lanes[DEPTH + k]
            seen[k] = number if nearer else seen[k]
        return max(floor, farthest)
    a0, a1, a2, a3 = facets[f, 0], facets[f, 3], facets[f, 6], facets[f, 9]
    b0, b1, b2, b3 = facets[f, 1], facets[f, 4], facets[f, 7], facets[f, 10]
    c0, c1, c2, c3 = facets[f, 2], facets[f, 5], facets[f, 8], facets[f, 11]
    for k in range(PIXELS):
        x, y = lanes[X + k], lanes[Y + k]
        value = (a * x + b * y) + c
        nearer = (value > lanes[DEPTH + k]) & (value <= limit)
        nearer &= ((a0 * x + b0 * y) + c0 >= _ZERO) & ((a1 * x + b1 * y) + c1 >= _ZERO)
        nearer &= ((a2 * x + b2 * y) + c2 >= _ZERO) & ((a3 * x + b3 * y) + c3 >= _ZERO)
        lanes[DEPTH + k] = value if nearer else lanes[DEPTH + k]
        seen[k] = number if nearer else seen[k]
    return floor


@_jit
def fill_triangle(triangles, t, first_row, last_row, number, lanes, seen, limit):
    """Draw the rows `first_row`..`last_row` (of this tile) of triangle `t`, see `raster_setup`."""
    a0, a1, a2, a = triangles[t, 0], triangles[t, 3], triangles[t, 6], triangles[t, 9]
    b0, b1, b2, b = triangles[t, 1], triangles[t, 4], triangles[t, 7], triangles[t, 10]
    c0, c1, c2, c = triangles[t, 2], triangles[t, 5], triangles[t, 8], triangles[t, 11]
    for k in range(np.uint64(TILE * first_row), np.uint64(TILE * (last_row + 1))):
        x, y = lanes[X + k], lanes[Y + k]
        value = (a * x + b * y) + c
        nearer = (value > lanes[DEPTH + k]) & (value <= limit)
        nearer &= (a0 * x + b0 * y) + c0 >= _ZERO
        nearer &= ((a1 * x + b1 * y) + c1 >= _ZERO) & ((a2 * x + b2 * y) + c2 >= _ZERO)
        lanes[DEPTH + k] = value if nearer else lanes[DEPTH + k]
        seen[k] = number if nearer else seen[k]


@_jit
def fill_cylinder(rounds, n, number, lanes, seen, near):
    """Draw upright cylinder `n`: side, top and bottom bear the numbers `number`, + 1 and + 2.

    A level camera sees every vertical line of the side at one depth and every row of an end at one depth.
    """
    x, z, radius, top, bottom = rounds[n, 0], rounds[n, 1], rounds[n, 2], rounds[n, 3], rounds[n, 4]
    for j in range(np.uint64(TILE)):
        ray = np.float64(lanes[X + j])
        a, b = ray * ray + 1.0, ray * x + z
        miss = ray * z - x
        inner = a * radius * radius - miss * miss
        lanes[COLUMN + j], lanes[LOW + j], lanes[HIGH + j] = _NOWHERE, _ZERO, _ZERO
        if inner > 0.0:
            root = math.sqrt(inner)
            distance = (b - root) / a if b - root >= near * a else (b + root) / a
            if distance >= near:
                lanes[COLUMN + j] = 1.0 / distance
                lanes[LOW + j], lanes[HIGH + j] = top / distance, bottom / distance
    for i in range(TILE):
        row = np.uint64(TILE * i)
        y = lanes[Y + row]
        for j in range(np.uint64(TILE)):
            k = row + j
            value = lanes[COLUMN + j]
            nearer = (value > lanes[DEPTH + k]) & (y >= lanes[LOW + j]) & (y <= lanes[HIGH + j])
            lanes[DEPTH + k] = value if nearer else lanes[DEPTH + k]
            seen[k] = number if nearer else seen[k]
    for end in range(2):
        if rounds[n, 6 + end] == 0.0:
            continue
        level, other = rounds[n, 3 + end], np.int32(number + 1 + end)
        for i in range(TILE):
            row = np.uint64(TILE * i)
            inverse = np.float64(lanes[Y + row]) / level
            if inverse <= 0.0 or inverse * near > 1.0:
                continue
            ahead = 1.0 - z * inverse
            room = np.float32(radius * radius * inverse * inverse - ahead * ahead)
            value, middle = np.float32(inverse), np.float32(x * inverse)
            for j in range(np.uint64(TILE)):
                k = row + j
                aside = lanes[X + j] - middle
                nearer = (value > lanes[DEPTH + k]) & (aside * aside <= room)
                lanes[DEPTH + k] = value if nearer else lanes[DEPTH + k]
                seen[k] = other if nearer else seen[k]


@_jit
def fill_ball(balls, n, number, lanes, seen, near):
    """Draw ball `n`: of the two points where a ray meets it, the first that counts (beyond `near`, within the part)."""
    x, y, z, gap = balls[n, 0], balls[n, 1], balls[n, 2], balls[n, 3]
    low, high = balls[n, 4], balls[n, 5]
    for k in range(PIXELS):
        across, down = np.float64(lanes[X + k]), np.float64(lanes[Y + k])
        a, b = (across * across + down * down) + 1.0, (across * x + down * y) + z
        inner = b * b - a * gap
        root = math.sqrt(max(inner, 0.0))
        first, second = (b - root) / a, (b + root) / a
        one = (first >= near) & (down * first >= low) & (down * first <= high)
        two = (second >= near) & (down * second >= low) & (down * second <= high)
        value = np.float32(1.0 / (first if one else second))
        nearer = (inner > 0.0) & (one | two) & (value > lanes[DEPTH + k])
        lanes[DEPTH + k] = value if nearer else lanes[DEPTH + k]
        seen[k] = number if nearer else seen[k]
