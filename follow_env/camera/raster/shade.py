# mypy: disable-error-code="no-untyped-def"
"""Kernels that color a tile once it is known what every pixel sees."""

import math

import numpy as np
from numba import njit

from follow_env.camera.raster.fill import (
    DEPTH,
    DISTANCE,
    LIGHT,
    NORMAL_X,
    NORMAL_Y,
    POINT_X,
    POINT_Y,
    POINT_Z,
    SHADE,
    SHARP,
    TILE,
    S,
    T,
    X,
    Y,
)
from follow_env.camera.raster.textures import paint

BACKGROUND = np.uint32(178 + 256 * 178 + 65536 * 204)
"""Color of a pixel that sees nothing, as TinyRenderer's: red + 256 green + 65536 blue."""
SOFT = np.float32(1.0)
"""Added to the squared distance to a lamp, m^2: a lamp is no point."""
BOUNCE, DIRECT = np.float32(0.25), np.float32(0.75)
"""Shares of a lamp's light that come back from the walls and that follow Lambert's law."""
_ZERO, _ONE, _ROUND, _FULL = np.float32(0.0), np.float32(1.0), np.float32(0.5), np.float32(255.0)
_STRIPE, _CHECK, _DARK = np.float32(1 / 0.045), np.float32(1 / 0.07), np.float32(0.55)
_SHIFT = np.float32(1024.0)

_jit = njit(nogil=True, error_model="numpy")


@_jit
def lamp_lights(dx, dy, dz, nx, ny, nz, strength):
    """Return the light of one lamp at the offset (dx, dy, dz) m on both sides of a surface with this unit normal."""
    q = _ONE / math.sqrt(((dx * dx + dy * dy) + dz * dz) + SOFT)
    facing, full = ((nx * dx + ny * dy) + nz * dz) * q, strength * (q * q)
    return full * (BOUNCE + DIRECT * max(facing, _ZERO)), full * (BOUNCE + DIRECT * max(-facing, _ZERO))


@_jit
def lamp_light(dx, dy, dz, nx, ny, nz, strength):
    """Return the light of one lamp on the side of a surface that its normal points to: see `lamp_lights`."""
    return lamp_lights(dx, dy, dz, nx, ny, nz, strength)[0]


@_jit
def shade_surface(number, first, last, view, surfaces, texture, lamps, ambient, lanes, seen, colors):
    """Color the pixels `first` <= k < `last` (uint64, whole rows) that see surface `number` of the scene.

    All pixels of the range are shaded as if they saw it, and those that do are kept.
    """
    ex, ey, ez = np.float32(view.x), np.float32(view.y), np.float32(view.z)
    c, s = np.float32(view.cosine), np.float32(view.sine)
    n0, n1, n2, bend = surfaces[number, 0], surfaces[number, 1], surfaces[number, 2], surfaces[number, 3]
    height = ((n0 * ex + n1 * ey) + n2 * ez) - surfaces[number, 4] if bend == _ZERO else np.float32(view.far)
    if height < _ZERO:
        n0, n1, n2, height = -n0, -n1, -n2, -height
    swell = surfaces[number, 16]
    if bend != _ZERO and swell == _ZERO and (n0 + bend * ex) ** 2 + (n1 + bend * ey) ** 2 < _ONE:
        n0, n1, bend = -n0, -n1, -bend  # a cylinder from inside
    for k in range(first, last):
        distance = lanes[DISTANCE + k]
        px = ex + distance * (c + s * lanes[X + k])
        py = ey + distance * (s - c * lanes[X + k])
        lanes[POINT_X + k], lanes[POINT_Y + k] = px, py
        lanes[POINT_Z + k] = ez - distance * lanes[Y + k]
        lanes[NORMAL_X + k], lanes[NORMAL_Y + k] = n0 + bend * px, n1 + bend * py
        lanes[LIGHT + k] = ambient
    for n in range(lamps.shape[0]):
        lx, ly, lz, strength = lamps[n, 0], lamps[n, 1], lamps[n, 2], lamps[n, 3]
        if swell == _ZERO:
            for k in range(first, last):
                dx, dy, dz = lx - lanes[POINT_X + k], ly - lanes[POINT_Y + k], lz - lanes[POINT_Z + k]
                lanes[LIGHT + k] += lamp_light(dx, dy, dz, lanes[NORMAL_X + k], lanes[NORMAL_Y + k], n2, strength)
            continue
        for k in range(first, last):
            px, py, pz = lanes[POINT_X + k], lanes[POINT_Y + k], lanes[POINT_Z + k]
            nx, ny, nz = lanes[NORMAL_X + k], lanes[NORMAL_Y + k], n2 + swell * pz
            seen_from_inside = (nx * (px - ex) + ny * (py - ey)) + nz * (pz - ez) > _ZERO
            side = -_ONE if seen_from_inside else _ONE
            lanes[LIGHT + k] += lamp_light(lx - px, ly - py, lz - pz, side * nx, side * ny, side * nz, strength)
    if texture:
        s0, s1, s2, s3 = surfaces[number, 5], surfaces[number, 6], surfaces[number, 7], surfaces[number, 8]
        t0, t1, t2, t3 = surfaces[number, 9], surfaces[number, 10], surfaces[number, 11], surfaces[number, 12]
        focal = np.float32(1.0 / view.step)
        for k in range(first, last):
            px, py, pz = lanes[POINT_X + k], lanes[POINT_Y + k], lanes[POINT_Z + k]
            lanes[S + k] = ((s0 * px + s1 * py) + s2 * pz) + s3
            lanes[T + k] = ((t0 * px + t1 * py) + t2 * pz) + t3
            lanes[SHARP + k] = focal * lanes[DEPTH + k] * min(height * lanes[DEPTH + k], _ONE)
        paint(texture, first, last, lanes)
        for k in range(first, last):
            lanes[LIGHT + k] *= lanes[SHADE + k]
    red, green, blue = _FULL * surfaces[number, 13], _FULL * surfaces[number, 14], _FULL * surfaces[number, 15]
    for k in range(first, last):
        light = lanes[LIGHT + k]
        color = _color(red * light, green * light, blue * light)
        colors[k] = color if seen[k] == number else colors[k]


@_jit
def shade_triangles(height, width, static, places, pattern, albedo, triangles, lanes, seen, colors):
    """Color the pixels of the first `height` rows and `width` columns that see a triangle: number `static` and above.

    One loop in one call: numba counts references to the arrays of a call by atomic operations.
    """
    for i in range(height):
        for k in range(np.uint64(TILE * i), np.uint64(TILE * i + width)):
            if seen[k] < static:
                continue
            t = np.uint64(seen[k] - static)
            f = np.uint64(places[t, 0])
            kind = pattern[f]
            x, y, distance = lanes[X + k], lanes[Y + k], lanes[DISTANCE + k]
            light = max((triangles[t, 12] * x + triangles[t, 13] * y + triangles[t, 14]) * distance, _ZERO) * _FULL
            odd = np.int32(0)
            if kind:
                az = (triangles[t, 21] * x + triangles[t, 22] * y + triangles[t, 23]) * distance
                if kind == 1:
                    odd = np.int32(az * _STRIPE + _SHIFT)
                else:
                    ax = (triangles[t, 15] * x + triangles[t, 16] * y + triangles[t, 17]) * distance
                    ay = (triangles[t, 18] * x + triangles[t, 19] * y + triangles[t, 20]) * distance
                    odd = np.int32(np.int32(ax * _CHECK + _SHIFT) + np.int32(ay * _CHECK + _SHIFT))
                    odd = np.int32(odd + np.int32(az * _CHECK + _SHIFT))
            light = light * _DARK if odd & np.int32(1) else light
            colors[k] = _color(albedo[f, 0] * light, albedo[f, 1] * light, albedo[f, 2] * light)


@_jit
def _color(red, green, blue):
    """Pack three numbers >= 0, cut at 255 and rounded, as red + 256 green + 65536 blue."""
    r = np.int32(min(red, _FULL) + _ROUND)
    g = np.int32(min(green, _FULL) + _ROUND)
    b = np.int32(min(blue, _FULL) + _ROUND)
    return np.uint32(r | np.int32(g << np.int32(8)) | np.int32(b << np.int32(16)))
