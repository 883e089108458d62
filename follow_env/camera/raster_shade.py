"""Kernels that colour a tile once it is known what every pixel sees."""

import math

import numpy as np
from numba import njit

from follow_env.camera.raster_fill import TILE
from follow_env.camera.raster_setup import lamp_light
from follow_env.camera.textures import paint

_ZERO, _ONE, _ROUND, _FULL = np.float32(0.0), np.float32(1.0), np.float32(0.5), np.float32(255.0)
_STRIPE, _CHECK, _DARK = np.float32(1 / 0.045), np.float32(1 / 0.07), np.float32(0.55)
_SHIFT = np.float32(1024.0)
BACKGROUND = (np.uint8(178), np.uint8(178), np.uint8(204))
"""Colour of a pixel that sees nothing, as TinyRenderer's."""

_jit = njit(nogil=True, error_model="numpy")


@_jit
def shade_row(i, width, view, scene, people, work, colour):
    """Colour the first `width` pixels of row i of the tile into `colour` (width, 3) uint8.

    Neighbours that see the same surface are shaded together, 16 lanes at a time.
    """
    tile = work.tile
    seen, depth, light = tile.seen, tile.depth, tile.light
    surfaces = scene.surfaces
    static = np.int32(surfaces.shape[0])
    start = 0
    while start < width:
        number = seen[i, start]
        stop = start + 1
        while stop < width and seen[i, stop] == number:
            stop += 1
        if number == 0:
            for j in range(start, stop):
                colour[j, 0], colour[j, 1], colour[j, 2] = BACKGROUND
        elif number < static:
            _light_lanes(i, surfaces[number], scene.textures[number], view, scene, tile)
            red, green, blue = surfaces[number, 13], surfaces[number, 14], surfaces[number, 15]
            for j in range(start, stop):
                colour[j, 0], colour[j, 1], colour[j, 2] = (
                    _byte(red * light[j]),
                    _byte(green * light[j]),
                    _byte(blue * light[j]),
                )
        else:
            k = number - static
            face = work.triangle_places[k, 0]
            record = work.triangles[k]
            red, green, blue = people.colours[face, 0], people.colours[face, 1], people.colours[face, 2]
            y = tile.ys[i]
            for j in range(start, stop):
                x, distance = tile.xs[j], _FULL / depth[i, j]
                value = max((record[12] * x + record[13] * y + record[14]) * distance, _ZERO)
                if people.pattern[face]:
                    value *= _pattern(people.pattern[face], record, x, y, _ONE / depth[i, j])
                colour[j, 0], colour[j, 1], colour[j, 2] = _byte(red * value), _byte(green * value), _byte(blue * value)
        start = stop


@_jit
def _light_lanes(i, surface, texture, view, scene, tile):
    """Write light times texture, in units of 1/255, of the row's 16 pixels as if all saw `surface` into `tile.light`."""
    px, py, pz, light = tile.px, tile.py, tile.pz, tile.light
    nx, ny = tile.nx, tile.ny
    ex, ey, ez = np.float32(view.x), np.float32(view.y), np.float32(view.z)
    c, s, y = np.float32(view.cosine), np.float32(view.sine), tile.ys[i]
    focal = np.float32(1.0 / view.step)
    bend, nz = surface[3], surface[2]
    side = ((surface[0] * ex + surface[1] * ey) + nz * ez) - surface[4]
    sign = -_ONE if bend == _ZERO and side < _ZERO else _ONE
    nz *= sign
    for j in range(TILE):
        distance = _ONE / tile.depth[i, j]
        px[j] = ex + distance * (c + s * tile.xs[j])
        py[j] = ey + distance * (s - c * tile.xs[j])
        pz[j] = ez - distance * y
        nx[j] = sign * (surface[0] + bend * px[j])
        ny[j] = sign * (surface[1] + bend * py[j])
        light[j] = scene.ambient
    for n in range(scene.lamps.shape[0]):
        lx, ly, lz, strength = scene.lamps[n, 0], scene.lamps[n, 1], scene.lamps[n, 2], scene.lamps[n, 3]
        for j in range(TILE):
            light[j] += lamp_light(lx - px[j], ly - py[j], lz - pz[j], nx[j], ny[j], nz, strength)
    if texture:
        for j in range(TILE):
            tile.s[j] = ((surface[5] * px[j] + surface[6] * py[j]) + surface[7] * pz[j]) + surface[8]
            tile.t[j] = ((surface[9] * px[j] + surface[10] * py[j]) + surface[11] * pz[j]) + surface[12]
            tile.sharpness[j] = focal * tile.depth[i, j]
        paint(texture, tile.s, tile.t, tile.sharpness, tile.shade)
        for j in range(TILE):
            light[j] *= tile.shade[j]
    for j in range(TILE):
        light[j] *= _FULL


@_jit
def _byte(value):
    return np.uint8(np.int32(min(value + _ROUND, _FULL)))


@_jit
def _pattern(kind, record, x, y, distance):
    """Return the brightness of a patterned shirt at the anchor point under the pixel."""
    az = (record[21] * x + record[22] * y + record[23]) * distance
    if kind == 1:
        return _DARK if np.int32(az * _STRIPE + _SHIFT) & np.int32(1) else _ONE
    ax = (record[15] * x + record[16] * y + record[17]) * distance
    ay = (record[18] * x + record[19] * y + record[20]) * distance
    cells = np.int32(ax * _CHECK + _SHIFT) + np.int32(ay * _CHECK + _SHIFT) + np.int32(az * _CHECK + _SHIFT)
    return _DARK if cells & np.int32(1) else _ONE
