"""Procedural textures: brightness of a surface from its own coordinates, one row of pixels at a time.

The patterns are built from cells and integer hashes, so they need no picture files and are the same on every machine.
Where a cell is smaller than about two pixels its contrast fades, so that distant surfaces do not shimmer.
"""

import numpy as np
from numba import njit

TEXTURES = ("plain", "tiles", "wood", "brick", "carpet", "spines")
"""Names for `Material.texture`; the kernels know them by their place."""

LANES = 16
_ZERO, _ONE, _HALF, _TWO = np.float32(0.0), np.float32(1.0), np.float32(0.5), np.float32(2.0)
_SHIFT = np.float32(4096.0)
_BYTE = np.float32(1.0 / 255.0)
_TILE, _GROUT, _GROUT_SHADE, _TILE_VARIETY = np.float32(1 / 0.45), np.float32(0.02), np.float32(0.72), np.float32(0.14)
_GRAIN, _BOARD, _WARP, _GRAIN_VARIETY = np.float32(1 / 0.012), np.float32(1 / 0.9), np.float32(3.0), np.float32(0.26)
_COURSE, _BRICK, _MORTAR, _BRICK_VARIETY = np.float32(1 / 0.075), np.float32(1 / 0.25), np.float32(0.13), np.float32(0.3)
_BRICK_JOINT = np.float32(0.04)
_TUFT, _TUFT_VARIETY = np.float32(1 / 0.015), np.float32(0.35)
_SPINE, _SPINE_VARIETY = np.float32(1 / 0.035), np.float32(1.1)

_jit = njit(nogil=True, error_model="numpy")


@_jit
def paint(texture, s, t, sharpness, shade):
    """Write the brightness factor of 16 surface points into `shade`.

    Args:
        texture: index into `TEXTURES`.
        s: (16,) float32, first surface coordinate, m, within 4 km of 0 in cells.
        t: (16,) float32, second surface coordinate, m.
        sharpness: (16,) float32, pixels per metre on the surface.
        shade: (16,) float32, out.
    """
    if texture == 1:
        _tiles(s, t, sharpness, shade)
    elif texture == 2:
        _wood(s, t, sharpness, shade)
    elif texture == 3:
        _brick(s, t, sharpness, shade)
    elif texture == 4:
        _carpet(s, t, sharpness, shade)
    elif texture == 5:
        _spines(s, sharpness, shade)
    else:
        for j in range(LANES):
            shade[j] = _ONE


@_jit
def _hash(i, j):
    """Return a float32 in [0, 1] that depends on both whole numbers as if by chance."""
    h = np.uint32(np.uint32(i) * np.uint32(0x9E3779B1)) ^ np.uint32(np.uint32(j) * np.uint32(0x85EBCA77))
    h = np.uint32(np.uint32(h ^ np.uint32(h >> np.uint32(15))) * np.uint32(0x2C1B3C6D))
    return np.float32(np.int32(h >> np.uint32(24))) * _BYTE


@_jit
def _cell(x):
    """Return the largest whole number below x as int32, for |x| < 4096."""
    return np.int32(np.int32(x + _SHIFT) - np.int32(4096))


@_jit
def _tiles(s, t, sharpness, shade):
    for j in range(LANES):
        a, b = s[j] * _TILE, t[j] * _TILE
        i, k = _cell(a), _cell(b)
        fa, fb = a - np.float32(i), b - np.float32(k)
        body = _ONE + _TILE_VARIETY * (_hash(i, k) - _HALF)
        joint = (fa < _GROUT) | (fb < _GROUT)
        fade = min(_ONE, sharpness[j] * (_GROUT / _TILE))
        shade[j] = body + fade * ((_GROUT_SHADE if joint else body) - body)


@_jit
def _wood(s, t, sharpness, shade):
    for j in range(LANES):
        wave = s[j] * _BOARD
        wave = abs(wave - np.float32(_cell(wave)) - _HALF)
        fade = min(_ONE, sharpness[j] * (_HALF / _GRAIN))
        shade[j] = _ONE + fade * _GRAIN_VARIETY * (_hash(_cell(t[j] * _GRAIN + _WARP * wave), np.int32(7)) - _HALF)


@_jit
def _brick(s, t, sharpness, shade):
    for j in range(LANES):
        b = t[j] * _COURSE
        k = _cell(b)
        a = s[j] * _BRICK + _HALF * np.float32(k & np.int32(1))
        i = _cell(a)
        fa, fb = a - np.float32(i), b - np.float32(k)
        body = _ONE + _BRICK_VARIETY * (_hash(i, k) - _HALF)
        joint = (fa < _BRICK_JOINT) | (fb < _MORTAR)
        fade = min(_ONE, sharpness[j] * (_MORTAR / _COURSE))
        shade[j] = _ONE + fade * ((_TWO - _HALF if joint else body) - _ONE)


@_jit
def _carpet(s, t, sharpness, shade):
    for j in range(LANES):
        fade = min(_ONE, sharpness[j] * (_HALF / _TUFT))
        shade[j] = _ONE + fade * _TUFT_VARIETY * (_hash(_cell(s[j] * _TUFT), _cell(t[j] * _TUFT)) - _HALF)


@_jit
def _spines(s, sharpness, shade):
    for j in range(LANES):
        fade = min(_ONE, sharpness[j] * (_HALF / _SPINE))
        shade[j] = _ONE + fade * _SPINE_VARIETY * (_hash(_cell(s[j] * _SPINE), np.int32(3)) - _HALF)
