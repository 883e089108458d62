# mypy: disable-error-code="no-untyped-def"
"""Procedural textures: brightness of a surface from its own coordinates, for the pixels of a tile.

The patterns are built from cells and integer hashes, so they need no picture files and are the same on every machine.
Where a cell is smaller than about two pixels its contrast fades, so that distant surfaces do not shimmer.
"""

import numpy as np
from numba import njit

from follow_env.camera.raster.fill import SHADE, SHARP, S, T

TEXTURES = ("plain", "tiles", "wood", "brick", "carpet", "spines")
"""Names for `Material.texture`; the kernels know them by their place."""

_ONE, _HALF = np.float32(1.0), np.float32(0.5)
_SHIFT = np.float32(4096.0)
_BYTE = np.float32(1.0 / 255.0)
# Cells per meter, joints as a share of a cell, brightness of joints, and how far the brightness of cells varies.
_TILE, _GROUT, _GROUT_SHADE, _TILE_VARIETY = np.float32(1 / 0.45), np.float32(0.02), np.float32(0.72), np.float32(0.14)
_GRAIN, _GRAIN_VARIETY = np.float32(1 / 0.012), np.float32(0.26)
_BOARD, _WARP = np.float32(1 / 0.9), np.float32(3.0)
_BRICK, _BRICK_JOINT, _BRICK_VARIETY = np.float32(1 / 0.25), np.float32(0.04), np.float32(0.3)
_COURSE, _MORTAR, _MORTAR_SHADE = np.float32(1 / 0.075), np.float32(0.13), np.float32(1.5)
_TUFT, _TUFT_VARIETY = np.float32(1 / 0.015), np.float32(0.35)
_SPINE, _SPINE_VARIETY = np.float32(1 / 0.035), np.float32(1.1)

_jit = njit(nogil=True, error_model="numpy")


@_jit
def paint(texture, first, last, lanes):
    """Write the brightness factor of the pixels `first` <= k < `last` (uint64) into plane `SHADE`.

    Args:
        texture: index into `TEXTURES`, not 0.
        first: first pixel.
        last: the pixel after the last.
        lanes: the tile; its planes `S` and `T` are the surface coordinates, m, `SHARP` the pixels per meter there.
    """
    if texture == 1:
        _tiles(first, last, lanes)
    elif texture == 2:
        _wood(first, last, lanes)
    elif texture == 3:
        _brick(first, last, lanes)
    elif texture == 4:
        _carpet(first, last, lanes)
    else:
        _spines(first, last, lanes)


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
def _tiles(first, last, lanes):
    for k in range(first, last):
        a, b = lanes[S + k] * _TILE, lanes[T + k] * _TILE
        i, m = _cell(a), _cell(b)
        fa, fb = a - np.float32(i), b - np.float32(m)
        body = _ONE + _TILE_VARIETY * (_hash(i, m) - _HALF)
        joint = (fa < _GROUT) | (fb < _GROUT)
        fade = min(_ONE, lanes[SHARP + k] * (_GROUT / _TILE))
        lanes[SHADE + k] = body + fade * ((_GROUT_SHADE if joint else body) - body)


@_jit
def _wood(first, last, lanes):
    for k in range(first, last):
        wave = lanes[S + k] * _BOARD
        wave = abs(wave - np.float32(_cell(wave)) - _HALF)
        fade = min(_ONE, lanes[SHARP + k] * (_HALF / _GRAIN))
        grain = _hash(_cell(lanes[T + k] * _GRAIN + _WARP * wave), np.int32(7))
        lanes[SHADE + k] = _ONE + fade * _GRAIN_VARIETY * (grain - _HALF)


@_jit
def _brick(first, last, lanes):
    for k in range(first, last):
        b = lanes[T + k] * _COURSE
        m = _cell(b)
        a = lanes[S + k] * _BRICK + _HALF * np.float32(m & np.int32(1))
        i = _cell(a)
        fa, fb = a - np.float32(i), b - np.float32(m)
        body = _ONE + _BRICK_VARIETY * (_hash(i, m) - _HALF)
        joint = (fa < _BRICK_JOINT) | (fb < _MORTAR)
        fade = min(_ONE, lanes[SHARP + k] * (_MORTAR / _COURSE))
        lanes[SHADE + k] = _ONE + fade * ((_MORTAR_SHADE if joint else body) - _ONE)


@_jit
def _carpet(first, last, lanes):
    for k in range(first, last):
        fade = min(_ONE, lanes[SHARP + k] * (_HALF / _TUFT))
        tuft = _hash(_cell(lanes[S + k] * _TUFT), _cell(lanes[T + k] * _TUFT))
        lanes[SHADE + k] = _ONE + fade * _TUFT_VARIETY * (tuft - _HALF)


@_jit
def _spines(first, last, lanes):
    for k in range(first, last):
        fade = min(_ONE, lanes[SHARP + k] * (_HALF / _SPINE))
        spine = _hash(_cell(lanes[S + k] * _SPINE), np.int32(3))
        lanes[SHADE + k] = _ONE + fade * _SPINE_VARIETY * (spine - _HALF)
