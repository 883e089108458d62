# mypy: disable-error-code="no-untyped-def"
"""Random numbers by counting: Philox4x32-10 (Salmon et al., "Parallel random numbers: as easy as 1, 2, 3", SC11).

A number depends only on the world's key, the episode, the step and what it is for: not on other worlds, on their number
or on threads, and a number that nobody wants need not be drawn.
"""

import math

import numpy as np
from numba import njit

NOISE, OUTLIER, START, ROUTE, PICTURE = range(5)
"""What numbers are for: the last word of the counter."""

_MULTIPLIERS = (np.uint64(0xD2511F53), np.uint64(0xCD9E8D57))
_WEYL = (np.uint64(0x9E3779B9), np.uint64(0xBB67AE85))
_LOW, _WORD = np.uint64(0xFFFFFFFF), np.uint64(32)

_jit = njit(nogil=True, error_model="numpy")


@_jit
def philox(c0, c1, c2, c3, key):
    """Return four random 32-bit words (as uint64) of a counter of four such words and a 64-bit key."""
    k0, k1 = key & _LOW, key >> _WORD
    for _ in range(10):
        product0, product1 = _MULTIPLIERS[0] * c0, _MULTIPLIERS[1] * c2
        c0, c1, c2, c3 = (product1 >> _WORD) ^ c1 ^ k0, product1 & _LOW, (product0 >> _WORD) ^ c3 ^ k1, product0 & _LOW
        k0, k1 = (k0 + _WEYL[0]) & _LOW, (k1 + _WEYL[1]) & _LOW
    return c0, c1, c2, c3


@_jit
def words(world, step, block, purpose):
    """Return four random words of a world's episode."""
    return philox(np.uint64(block), np.uint64(step), np.uint64(world.episode), np.uint64(purpose), world.key)


@_jit
def uniforms(world, step, block, purpose):
    """Return four uniform numbers in [0, 1) of 32 bits."""
    a, b, c, d = words(world, step, block, purpose)
    scale = 1.0 / 4294967296.0
    return a * scale, b * scale, c * scale, d * scale


@_jit
def normals(world, step, block, purpose):
    """Return two standard normal numbers (Box and Muller)."""
    a, b, c, d = words(world, step, block, purpose)
    scale = 1.0 / 9007199254740992.0
    above_zero = (((a << _WORD | b) >> np.uint64(11)) + np.uint64(1)) * scale
    angle = 2.0 * math.pi * (((c << _WORD | d) >> np.uint64(11)) * scale)
    radius = math.sqrt(-2.0 * math.log(above_zero))
    return radius * math.cos(angle), radius * math.sin(angle)


@njit(cache=True)
def keys(seed, count):
    """Return the keys (count,) uint64 of worlds 0, 1, ... of a seed (uint64)."""
    result = np.empty(count, np.uint64)
    for i in range(count):
        a, b, _, _ = philox(np.uint64(i), np.uint64(0), np.uint64(0), _LOW, seed)
        result[i] = a << _WORD | b
    return result
