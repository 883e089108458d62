# mypy: disable-error-code="no-untyped-def"
"""The compiled sensor errors, `corrupt`, and `pack_bytes`.

Every column of a picture has its own xorshift generators, seeded by a hash of (frame, stream, column) and advanced from
row to row: vectors of them need no multiplication, and the bits are the same on any processor. Buffers are wider than
the picture, a multiple of `LANES`: what is computed beyond its edge is never read, and no vector has to be cut.
"""

import math
from typing import NamedTuple

import numpy as np
from numba import njit

NORMAL_BITS, SHIFT_BITS = 12, 10
"""Axial noise takes one of 2^12 equally likely normal quantiles, the lateral jitter of each axis one of 2^10."""
LANES = 16
"""Numbers in the widest vectors of processors."""
_PLACE, _FATE, _COLOR = (np.uint32(n) for n in (0x00000000, 0x6C8E9CF5, 0xD192ED03))
_ZERO, _HALF, _ONE = np.float32(0.0), np.float32(0.5), np.float32(1.0)
_FINE, _BLIND = np.float32(256.0), np.float32(1e6)
_MOST = np.float32(1e9)
_TINY = np.float32(1e-30)
_NEAREST = np.float32(0.01)
_SHARE = np.float32(2.0**-16)
_CONSTANT, _SQUARE, _CENTER = np.float32(0.0012), np.float32(0.0019), np.float32(0.4)
_RED, _GREEN, _BLUE, _PER_MILLE = np.int32(299), np.int32(587), np.int32(114), np.float32(0.001)
_FULL = np.float32(255.0)
_BYTES_MEAN = np.float32(510.0)
_BYTES_SCALE = np.float32(1.0 / math.sqrt(4.0 * (256.0**2 - 1.0) / 12.0))
_SPAN = np.float32(8.0)

_jit = njit(cache=True, nogil=True, error_model="numpy")
_inline = njit(nogil=True, error_model="numpy", forceinline=True)


class DepthModel(NamedTuple):
    """`DepthConfig` in the units of the picture: lengths in px, depths in m."""

    focal: np.float32
    focal_baseline: np.float32
    axial: np.float32
    unit: np.float32
    nearest: np.float32
    farthest: np.float32
    beyond: np.float32
    ceiling: np.float32
    jump: np.float32
    holes: np.float32
    flying: np.float32
    shadow: np.float32
    dark: np.float32
    dark_level: np.float32
    grazing: np.float32
    grazing_cosine: np.float32
    band: int


class ColorModel(NamedTuple):
    """`ColorConfig`: exposure, noise in gray levels, the blur's weights (r + 1,) from the middle outwards.

    `exact` says that there are no errors.
    """

    gain: np.float32
    read_noise: np.float32
    shot_noise: np.float32
    taps: np.ndarray
    exact: bool


class SensorModel(NamedTuple):
    """A sensor: its dials, 2^NORMAL_BITS float32 normal quantiles and 2^SHIFT_BITS int32 displacements in px."""

    depth: DepthModel
    color: ColorModel
    normal: np.ndarray
    shift: np.ndarray


class SensorWork(NamedTuple):
    """Buffers for pictures H x W, with P = `padded(W)` and the blur's radius r.

    Inverse depth (H, P), chance of no reading (P,), five rows (5, P + 2 pad), bits (2, P), places seen (P,); a row of
    colors before and after the blur across (2, Q + 6 r), its bits and its levels (Q,), Q = `padded(3 W)`.
    """

    inverse: np.ndarray
    lost: np.ndarray
    rows: np.ndarray
    bits: np.ndarray
    places: np.ndarray
    color_rows: np.ndarray
    color_bits: np.ndarray
    levels: np.ndarray


def make_work(height: int, width: int, model: SensorModel) -> SensorWork:
    """Return buffers for pictures of this size."""
    one, three = padded(width), padded(3 * width)
    return SensorWork(
        np.zeros((height, one), np.float32),
        np.zeros(one, np.float32),
        np.zeros((5, one + 2 * max(model.depth.band, 1)), np.float32),
        np.zeros((2, one), np.uint32),
        np.zeros(one, np.int32),
        np.zeros((2, three + 6 * (model.color.taps.size - 1)), np.float32),
        np.zeros(three, np.uint32),
        np.zeros(three, np.int32),
    )


def padded(count: int) -> int:
    """Return the least multiple of `LANES` from `count` on."""
    return -(-count // LANES) * LANES


@_jit
def corrupt(depth, rgb, seed, model, work, depth_out, rgb_out):
    """Write what the sensor reports; 0 = no reading.

    Args:
        depth: (H, W) float32, m; not above 0 or not finite = nothing there.
        rgb: (H, W, 3) uint8.
        seed: uint64, the frame's random key.
        model: `SensorModel`.
        work: `SensorWork`.
        depth_out: (H, W) float32, out.
        rgb_out: (H, W, 3) uint8, out; not written if the colors are exact.
    """
    _corrupt_depth(depth, rgb, seed, model.depth, model.normal, model.shift, work, depth_out)
    if not model.color.exact:
        _corrupt_color(rgb, seed, model.color, work, rgb_out)


@_inline
def _corrupt_depth(depth, rgb, seed, model, normal, shift, work, out):
    inverse, lost, rows, bits, places = work.inverse, work.lost, work.rows, work.bits, work.places
    for i in range(np.uint64(depth.shape[0])):
        for j in range(np.uint64(depth.shape[1])):
            z = depth[i, j]
            inverse[i, j] = _ONE / z if z > _ZERO and z < np.inf else _ZERO
    _seed(seed, _PLACE, bits[0])
    _seed(seed, _FATE, bits[1])
    for i in range(np.uint64(depth.shape[0])):
        _slopes(i, np.uint64(depth.shape[1]), inverse, model, rows, lost)
        _darkness(i, rgb, model, lost)
        _shadows(i, np.uint64(depth.shape[1]), inverse, model, places, lost)
        _extremes(i, np.uint64(depth.shape[1]), inverse, np.uint64(model.band), rows)
        _read_row(i, depth, inverse, model, normal, shift, lost, rows, bits, out)


@_inline
def _slopes(i, width, inverse, model, rows, lost):
    """Set `lost` to the chance that row i is lost to grazing incidence.

    On a plane the inverse depth q is linear in the picture, q = n . r with the ray r = (x, y, 1), so its gradient gives
    the normal n and the cosine of the incidence q / (|n| |r|). Of the forward and the backward difference the smaller
    is taken, so that a depth edge is not a slope.
    """
    height, columns = np.uint64(inverse.shape[0]), np.uint64(inverse.shape[1])
    one, last = np.uint64(1), height - np.uint64(1)
    up, down = (i - one if i > 0 else i + one), (i + one if i < last else i - one)
    if last == 0:
        up = down = i
    for j in range(columns):
        rows[0, j + one] = inverse[i, j]
    before = width - one if width > one else np.uint64(0)
    rows[0, 0] = np.float32(2.0) * inverse[i, 0] - inverse[i, min(one, before)]
    rows[0, width + one] = np.float32(2.0) * inverse[i, before] - inverse[i, before - one if before > 0 else before]
    sign_up = _ONE if i > 0 else -_ONE
    sign_down = _ONE if i < last else -_ONE
    y = np.float32(i) + _HALF - _HALF * np.float32(height)
    middle, per_focal = _HALF * np.float32(width) - _HALF, _ONE / model.focal
    row = _ONE + (y * per_focal) * (y * per_focal)
    per_cosine = _ONE / model.grazing_cosine
    for j in range(columns):
        q = inverse[i, j]
        x = np.float32(np.int32(j)) - middle
        back, ahead = q - rows[0, j], rows[0, j + np.uint64(2)] - q
        qu = back if abs(back) < abs(ahead) else ahead
        back, ahead = sign_up * (q - inverse[up, j]), sign_down * (inverse[down, j] - q)
        qv = back if abs(back) < abs(ahead) else ahead
        along = q - x * qu - y * qv
        squared = (model.focal * qu) * (model.focal * qu) + (model.focal * qv) * (model.focal * qv) + along * along
        cosine = q / math.sqrt(squared * (row + (x * per_focal) * (x * per_focal)) + _TINY)
        lost[j] = model.grazing * max(_ONE - cosine * per_cosine, _ZERO)


@_inline
def _darkness(i, rgb, model, lost):
    """Add the chance that a pixel of row i is lost because it is dark."""
    per_level = _PER_MILLE / model.dark_level
    for j in range(np.uint64(rgb.shape[1])):
        level = _RED * np.int32(rgb[i, j, 0]) + _GREEN * np.int32(rgb[i, j, 1]) + _BLUE * np.int32(rgb[i, j, 2])
        dark = model.dark * max(_ONE - np.float32(np.int32(level)) * per_level, _ZERO)
        lost[j] = _ONE - (_ONE - lost[j]) * (_ONE - dark)


@_inline
def _shadows(i, width, inverse, model, places, lost):
    """Add the chance that a pixel of row i is lost because something hides it from the projector, right of the camera.

    The projector sees the pixel of column u at u - f b / z; what is seen left of a pixel further right is behind it.
    """
    columns = np.uint64(inverse.shape[1])
    for j in range(columns):
        places[j] = np.int32(_FINE * (np.float32(np.int32(j)) - min(model.focal_baseline * inverse[i, j], _BLIND)))
    first = places[width - np.uint64(1)]
    for k in range(width):
        column = width - np.uint64(1) - k
        place = places[column]
        places[column] = np.int32(place > first)
        first = min(place, first)
    for j in range(columns):
        lost[j] = _ONE - (_ONE - lost[j]) * (_ONE - model.shadow * np.float32(places[j]))


@_inline
def _extremes(i, width, inverse, band, rows):
    """Write the largest and smallest inverse depth within `band` px of each pixel of row i to rows 1 and 2."""
    height, columns = np.uint64(inverse.shape[0]), np.uint64(inverse.shape[1])
    top, bottom = (i - band if i > band else np.uint64(0)), min(i + band + np.uint64(1), height)
    for j in range(columns):
        rows[3, j + band] = inverse[i, j]
        rows[4, j + band] = inverse[i, j]
    for k in range(top, bottom):
        for j in range(columns):
            q = inverse[k, j]
            rows[3, j + band] = max(rows[3, j + band], q)
            rows[4, j + band] = min(rows[4, j + band], q)
    for k in range(band):
        for n in range(3, 5):
            rows[n, k] = rows[n, band]
            rows[n, width + band + k] = rows[n, width + band - np.uint64(1)]
    for j in range(columns):
        rows[1, j], rows[2, j] = rows[3, j], rows[4, j]
    for k in range(np.uint64(1), np.uint64(2) * band + np.uint64(1)):
        for j in range(columns):
            rows[1, j] = max(rows[1, j], rows[3, j + k])
            rows[2, j] = min(rows[2, j], rows[4, j + k])


@_inline
def _read_row(i, depth, inverse, model, normal, shift, lost, rows, bits, out):
    """Read row i: displaced, flying at edges, with axial noise, in steps of disparity, or not at all.

    Of `rows` it finds the extremes in 1 and 2; it puts what is seen into 4, the noise into 3, the readings into 0.
    """
    width, columns = np.uint64(depth.shape[1]), np.uint64(inverse.shape[1])
    bottom, right = np.int32(depth.shape[0] - 1), np.int32(depth.shape[1] - 1)
    row = np.int32(i)
    steps = np.uint32((1 << SHIFT_BITS) - 1)
    for j in range(columns):
        bits[0, j] = _advance(bits[0, j])
        bits[1, j] = _advance(bits[1, j])
    for j in range(width):
        place = bits[0, j]
        v = min(max(row + shift[(place >> np.uint32(SHIFT_BITS)) & steps], np.int32(0)), bottom)
        u = min(max(np.int32(j) + shift[place & steps], np.int32(0)), right)
        rows[4, j] = depth[np.uint64(v), np.uint64(u)]
        rows[3, j] = normal[place >> np.uint32(32 - NORMAL_BITS)]
    if model.band:
        lively, either = _ONE / max(model.flying, _TINY), model.holes + model.flying
        for j in range(columns):
            own, z, least, span = inverse[i, j], rows[4, j], rows[2, j], rows[1, j] - rows[2, j]
            chance = np.float32(np.int32(bits[1, j] & np.uint32(0xFFFF))) * _SHARE
            flown = _ONE / max(least + (chance - model.holes) * lively * span, _TINY)
            read = flown if chance < either else z
            read = _ZERO if chance < model.holes else read
            # far - near > jump max(z, 1), multiplied by the inverse depths
            rows[4, j] = read if span * min(own, _ONE) > model.jump * (rows[1, j] * least) else z
    for j in range(columns):
        true = rows[4, j]
        chance = np.float32(np.int32(bits[1, j] >> np.uint32(16))) * _SHARE
        spread = true - _CENTER
        z = true + model.axial * (_CONSTANT + _SQUARE * (spread * spread)) * rows[3, j]
        disparity = np.int32(min(model.unit / max(z, _NEAREST), _MOST) + _HALF)
        level = model.unit / max(np.float32(disparity), _ONE)
        z = level if model.unit > _ZERO else z
        z = z if true > _ZERO else _ZERO
        z = z if true < model.beyond else _ZERO
        z = z if z >= model.nearest else _ZERO
        z = z if z <= model.farthest else _ZERO
        z = z if chance >= lost[j] else _ZERO
        rows[0, j] = min(z, model.ceiling)
    for j in range(width):
        out[i, j] = rows[0, j]


@_inline
def _corrupt_color(rgb, seed, model, work, out):
    """Write the blurred, exposed and noisy picture."""
    height, three, one = np.uint64(rgb.shape[0]), np.uint64(3), np.uint64(1)
    source, target = rgb.reshape(rgb.shape[0], -1), out.reshape(rgb.shape[0], -1)
    taps, bits, levels = model.taps, work.color_bits, work.levels
    line, smooth = work.color_rows[0], work.color_rows[1]
    count, columns, pad = np.uint64(source.shape[1]), np.uint64(bits.size), np.uint64(3 * (taps.size - 1))
    gain, read, shot = model.gain, model.read_noise * model.read_noise, model.shot_noise * model.shot_noise
    _seed(seed, _COLOR, bits)
    for i in range(height):
        for k in range(count):
            line[pad + k] = gain * taps[0] * np.float32(source[i, k])
        for t in range(one, np.uint64(taps.size)):
            above, below, weight = (i - t if i > t else np.uint64(0)), min(i + t, height - one), gain * taps[t]
            for k in range(count):
                line[pad + k] += weight * np.float32(np.int32(np.int32(source[above, k]) + np.int32(source[below, k])))
        for k in range(pad):
            line[k] = line[pad + k % three]
            line[pad + count + k] = line[pad + count - three + k % three]
        for k in range(columns):
            smooth[k] = taps[0] * line[pad + k]
        for t in range(one, np.uint64(taps.size)):
            left, right, weight = pad - three * t, pad + three * t, taps[t]
            for k in range(columns):
                smooth[k] += weight * (line[left + k] + line[right + k])
        for k in range(columns):
            state = _advance(bits[k])
            bits[k] = state
            level = smooth[k]
            level += math.sqrt(read + shot * level) * _near_normal(state)
            levels[k] = np.int32(min(max(level, _ZERO), _FULL) + _HALF)
        for k in range(count):
            target[i, k] = np.uint8(levels[k])


@_jit
def pack_bytes(rgb, depth, out):
    """Write color and nearness 255 (1 - z / 8 m), 0 = no reading or beyond, to `out` (H, W, 4) uint8."""
    for i in range(np.uint64(depth.shape[0])):
        for j in range(np.uint64(depth.shape[1])):
            z = depth[i, j]
            near = _FULL * (_ONE - z / _SPAN) if z > _ZERO and z < _SPAN else _ZERO
            out[i, j, 0], out[i, j, 1], out[i, j, 2] = rgb[i, j, 0], rgb[i, j, 1], rgb[i, j, 2]
            out[i, j, 3] = np.uint8(np.int32(near))


@_inline
def _seed(key, stream, states):
    """Start a generator for each column: the mixing of MurmurHash3, a word of the frame's key before each round."""
    first, second = np.uint32(key), np.uint32(np.uint32(key >> np.uint64(32)) ^ stream)
    for k in range(np.uint64(states.size)):
        h = np.uint32(np.uint32(np.uint32(k) * np.uint32(0x9E3779B1)) + first)
        h = np.uint32((h ^ (h >> np.uint32(16))) * np.uint32(0x21F0AAAD))
        h = np.uint32((h ^ (h >> np.uint32(15))) ^ second)
        h = np.uint32((h ^ (h >> np.uint32(16))) * np.uint32(0x85EBCA6B))
        h = np.uint32((h ^ (h >> np.uint32(13))) * np.uint32(0xC2B2AE35))
        h = np.uint32(h ^ (h >> np.uint32(16)))
        states[k] = h if h else np.uint32(1)


@_inline
def _advance(state):
    """Return the next state of Marsaglia's xorshift32 (2003)."""
    state = np.uint32(state ^ (state << np.uint32(13)))
    state = np.uint32(state ^ (state >> np.uint32(17)))
    return np.uint32(state ^ (state << np.uint32(5)))


@_inline
def _near_normal(bits):
    """Return a number of mean 0 and variance 1, the sum of the four bytes: near to normal, within 3.5 sigma."""
    mask = np.uint32(255)
    total = (bits & mask) + ((bits >> np.uint32(8)) & mask) + ((bits >> np.uint32(16)) & mask) + (bits >> np.uint32(24))
    return (np.float32(np.int32(total)) - _BYTES_MEAN) * _BYTES_SCALE
