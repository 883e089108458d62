"""`RGBDSensor`: from the rendered frame to what an Xtion would report."""

import math
from contextlib import nullcontext
from statistics import NormalDist

import numpy as np

from follow_env.camera.frame import RGBDFrame
from follow_env.camera.pinhole import PinholeCamera
from follow_env.camera.sensor.kernels import (
    NORMAL_BITS,
    SHIFT_BITS,
    ColorModel,
    DepthModel,
    SensorModel,
    corrupt,
    make_work,
    pack_bytes,
)
from follow_env.compilation import announced
from follow_env.sensors import ColorConfig, DepthConfig

NATIVE_WIDTH = 640
"""Width of the sensor's own picture, px: dials in pixels refer to it unless they say otherwise."""


class RGBDSensor:
    """Errors of a structured-light RGB-D camera.

    **Depth** of a pixel, in this order (the dials are those of `DepthConfig`):

    1. it is taken from the pixel displaced by the lateral jitter, a rounded Gaussian on each axis;
    2. at a depth edge, it is lost with probability `edge_holes`, and with `edge_flying` it lies between the nearest
       and the farthest depth around, uniform in disparity;
    3. axial noise sigma(z) = 0.0012 + 0.0019 (z - 0.4)^2 m is added (Nguyen et al. 2012, without the angle's term);
    4. the disparity f b / z is rounded to `disparity_step`;
    5. it is lost if out of range, or, independently of each other, with probability `shadow` where something hides the
       surface from the projector, `dark_dropout` max(0, 1 - L / dark_level) at luminance L (Rec. 601), and
       `grazing_dropout` max(0, 1 - cos(angle) / cos(grazing_deg)) at this angle between ray and normal.

    **Color** is blurred, multiplied by the exposure's gain, given noise of sigma^2 = read^2 + shot^2 I (I the gray
    level), cut at 0 and 255 and rounded.

    What is lost is lost pixel by pixel; the blotches of real sensors are not modeled.

    Args:
        depth: the dials.
        color: the dials.
        camera: the intrinsics; depth beyond its `far` is nothing seen.
    """

    def __init__(self, depth: DepthConfig, color: ColorConfig, camera: PinholeCamera) -> None:
        height, width, scale = camera.height, camera.width, camera.width / NATIVE_WIDTH
        focal_baseline, step, far = camera.focal * depth.baseline, depth.disparity_step * scale, camera.config.far
        real = np.float32
        dials = DepthModel(
            focal=real(camera.focal),
            focal_baseline=real(focal_baseline),
            axial=real(depth.axial_noise),
            unit=real(focal_baseline / step if step > 0.0 else 0.0),
            nearest=real(depth.min_range),
            farthest=real(depth.max_range),
            beyond=real(far if math.isfinite(depth.max_range) else math.inf),
            ceiling=real(far),
            jump=real(depth.edge_jump),
            holes=real(depth.edge_holes),
            flying=real(depth.edge_flying),
            shadow=real(depth.shadow),
            dark=real(depth.dark_dropout),
            dark_level=real(depth.dark_level),
            grazing=real(depth.grazing_dropout),
            grazing_cosine=real(math.cos(math.radians(depth.grazing_deg))),
            band=depth.edge_band,
        )
        sigma = depth.lateral_noise * scale
        taps = _gaussian_taps(color.blur * scale)
        exact = taps.size == 1 and color.gain == 1.0 and not (color.read_noise or color.shot_noise)
        self.model = SensorModel(
            dials,
            ColorModel(real(color.gain), real(color.read_noise), real(color.shot_noise), taps, exact),
            _quantiles(NORMAL_BITS).astype(np.float32),
            np.rint(sigma * _quantiles(SHIFT_BITS)).astype(np.int32),
        )
        self.work = make_work(height, width, self.model)
        self._warm = False

    def corrupt(self, frame: RGBDFrame, seed: int) -> RGBDFrame:
        """Return `frame` with the errors that `seed` (0 <= seed < 2^64) stands for; the ids stay exact.

        Depth not above 0 or not finite is no reading, 0. With color errors off the colors are those of `frame`, not
        copied.
        """
        true, colors = np.ascontiguousarray(frame.depth), np.ascontiguousarray(frame.rgb)
        depth, rgb = np.empty_like(true), colors if self.model.color.exact else np.empty_like(colors)
        with nullcontext() if self._warm else announced("the camera"):
            corrupt(true, colors, np.uint64(seed), self.model, self.work, depth, rgb)
        self._warm = True
        return RGBDFrame(rgb, depth, frame.ids)


def packed(rgb: np.ndarray, depth: np.ndarray) -> np.ndarray:
    """Return colors (..., H, W, 3) and depths (..., H, W) as one (..., H, W, 4) uint8.

    The fourth is nearness: 255 (1 - z / 8 m), 0 = no reading or beyond.
    """
    out = np.empty((*depth.shape, 4), np.uint8)
    rows = (-1, depth.shape[-1])
    pack_bytes(rgb.reshape(*rows, 3), depth.reshape(rows), out.reshape(*rows, 4))
    return out


def _quantiles(bits: int) -> np.ndarray:
    """Return 2^bits equally likely standard normal values, scaled to unit variance."""
    count, normal = 1 << bits, NormalDist()
    half = [normal.inv_cdf((k + 0.5) / count) for k in range(count // 2)]
    scale = math.sqrt(0.5 * count / math.fsum(value * value for value in half))
    return np.array([*(scale * value for value in half), *(-scale * value for value in reversed(half))])


def _gaussian_taps(sigma: float) -> np.ndarray:
    """Return the discrete Gaussian exp(-t) I_n(t), t = sigma^2 (Lindeberg 1990), for n = 0, 1 ... while above 1e-3.

    Unlike a sampled Gaussian it has the variance sigma^2 also for a sigma below a pixel.
    """
    t = sigma * sigma
    half = [_scaled_bessel(0, t)]
    while (tap := _scaled_bessel(len(half), t)) > 1e-3:
        half.append(tap)
    return np.array([tap / math.fsum((*half, *half[1:])) for tap in half], np.float32)


def _scaled_bessel(order: int, t: float) -> float:
    """Return exp(-t) I_order(t), the modified Bessel function, by its series."""
    if t == 0.0:
        return 1.0 if order == 0 else 0.0
    terms = range(int(2.0 * t) + order + 40)
    logarithms = ((2 * k + order) * math.log(0.5 * t) - math.lgamma(k + 1) - math.lgamma(k + order + 1) for k in terms)
    return math.fsum(math.exp(value - t) for value in logarithms)
