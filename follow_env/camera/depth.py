"""The depth sensor: from rendered depth to what an Xtion would report."""

import math

import cv2
import numpy as np

from follow_env.config import DepthConfig

NATIVE_WIDTH = 640


class DepthSensor:
    """Structured-light errors: axial noise, disparity quantisation, holes at depth edges, range limits.

    Args:
        config: the dials.
        hfov: horizontal field of view, rad (gives the focal length at the sensor's native 640 px).
    """

    def __init__(self, config: DepthConfig, hfov: float) -> None:
        self._config = config
        self._focal_baseline = 0.5 * NATIVE_WIDTH / math.tan(0.5 * hfov) * config.baseline

    def corrupt(self, depth: np.ndarray, rng: np.random.Generator) -> np.ndarray:
        """Return the reported depth (H, W) float32 in m for the true `depth`; 0 = no reading.

        Axial noise: sigma(z) = 0.0012 + 0.0019 (z - 0.4)^2 m (Nguyen et al. 2012). Quantisation: disparity
        f b / z rounded to `disparity_step`.
        """
        config = self._config
        z = depth
        if config.axial_noise > 0.0:
            offset = z - np.float32(0.4)
            sigma = np.float32(config.axial_noise) * (np.float32(0.0012) + np.float32(0.0019) * offset * offset)
            z = z + sigma * rng.standard_normal(z.shape, dtype=np.float32)
        if config.disparity_step > 0.0:
            unit = np.float32(self._focal_baseline / config.disparity_step)
            z = unit / np.maximum(np.rint(unit / np.maximum(z, np.float32(0.01))), np.float32(1.0))
        valid = (z >= config.min_range) & (z <= config.max_range)
        if config.edge_band > 0:
            window = np.ones((2 * config.edge_band + 1,) * 2, np.uint8)
            valid &= cv2.dilate(depth, window) - cv2.erode(depth, window) <= config.edge_jump * np.maximum(
                depth, np.float32(1.0)
            )
        return np.where(valid, z, np.float32(0.0)).astype(np.float32, copy=False)
