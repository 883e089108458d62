"""What a cheap camera and a strange place do to a picture's colors: light, white balance, blur, noise, clutter.

Nothing here moves a pixel, so boxes stay true.
"""

import cv2
import numpy as np

_NOISE = np.random.default_rng(20180712).standard_normal(1 << 20).astype(np.float32)
"""Noise is read from here at an offset of chance: drawing it anew for every pixel would cost more than rendering."""


def disturb(rgb: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """Return the picture (H, W, 3) uint8 under other light, less sharp and noisier."""
    if rng.random() < 0.85:
        rgb = _develop(rgb, rng)
    if rng.random() < 0.3:
        rgb = cv2.transform(rgb, _hue_turn(rng))
    if rng.random() < 0.35:
        rgb = _blur(rgb, rng)
    if rng.random() < 0.7:
        sigma = np.float32(14.0 * rng.random() ** 2)
        start = int(rng.integers(len(_NOISE) - rgb.size))
        noise = _NOISE[start : start + rgb.size].reshape(rgb.shape)
        rgb = np.clip(rgb + sigma * noise, 0.0, 255.0).astype(np.uint8)
    if rng.random() < 0.1:
        _, packed = cv2.imencode(".jpg", rgb, (cv2.IMWRITE_JPEG_QUALITY, int(rng.integers(25, 90))))
        rgb = np.asarray(cv2.imdecode(packed, cv2.IMREAD_COLOR))
    return rgb


def draw_backdrop(shape: tuple[int, int], rng: np.random.Generator) -> np.ndarray:
    """Return a picture (H, W, 3) uint8 of blots, bars and rectangles without any meaning."""
    height, width = shape
    cells = rng.integers(0, 256, (*rng.integers(2, 40, 2), 3), dtype=np.uint8)
    smooth = cv2.INTER_CUBIC if rng.random() < 0.6 else cv2.INTER_NEAREST
    picture = cv2.resize(cells, (width, height), interpolation=smooth)
    for _ in range(rng.integers(0, 12)):
        (u0, u1), (v0, v1) = rng.integers(-20, width + 20, 2), rng.integers(-20, height + 20, 2)
        color = rng.integers(0, 256, 3).tolist()
        kind = rng.integers(3)
        if kind == 0:
            cv2.rectangle(picture, (int(u0), int(v0)), (int(u1), int(v1)), color, -1)
        elif kind == 1:
            cv2.line(picture, (int(u0), int(v0)), (int(u1), int(v1)), color, int(rng.integers(1, 16)))
        else:
            axes = (int(rng.integers(4, 70)), int(rng.integers(4, 110)))
            cv2.ellipse(picture, (int(u0), int(v0)), axes, float(rng.uniform(0, 180)), 0, 360, color, -1)
    return picture


def _develop(rgb: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """Return the picture with an exposure that aims at a mean brightness, as cameras do, gamma and white balance."""
    brightness = max(float(rgb[::8, ::8].mean()), 1.0)
    gain = min(max(rng.uniform(60.0, 160.0) / brightness, 0.5), 4.0) * rng.uniform(0.88, 1.12, 3)
    gamma, contrast = rng.uniform(0.75, 1.3), rng.uniform(0.7, 1.2)
    level = np.linspace(0.0, 1.0, 256)[:, None] * gain
    table = 255.0 * ((np.clip(level, 0.0, 1.0) ** gamma - 0.4) * contrast + 0.4)
    return cv2.LUT(rgb, np.clip(table, 0.0, 255.0).astype(np.uint8)[:, None, :])


def _hue_turn(rng: np.random.Generator) -> np.ndarray:
    """Return a matrix (3, 3) that turns the hue and changes the saturation: a turn about the gray axis."""
    angle, saturation = rng.uniform(-0.6, 0.6), rng.uniform(0.3, 1.4)
    third = np.full((3, 3), 1.0 / 3.0)
    across = np.array([[0.0, -1.0, 1.0], [1.0, 0.0, -1.0], [-1.0, 1.0, 0.0]]) / np.sqrt(3.0)
    turn = np.cos(angle) * (np.eye(3) - third) + np.sin(angle) * across
    return third + saturation * turn


def _blur(rgb: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """Return the picture out of focus or smeared along the rows or columns."""
    if rng.random() < 0.6:
        return cv2.GaussianBlur(rgb, (0, 0), rng.uniform(0.4, 1.6))
    length = int(rng.integers(2, 9))
    return cv2.blur(rgb, (length, 1) if rng.random() < 0.75 else (1, length))
