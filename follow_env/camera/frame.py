"""`RGBDFrame`: one picture with metric depth and instance ids."""

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class RGBDFrame:
    """One frame.

    Attributes:
        rgb: (H, W, 3) uint8.
        depth: (H, W) float32, distance along the optical axis, m; 0 = no reading.
        ids: (H, W) uint8, 0 = scene, 1 = the person to follow.
    """

    rgb: np.ndarray
    depth: np.ndarray
    ids: np.ndarray

    def person_box(self, min_pixels: int = 1, id: int = 1) -> tuple[float, float, float, float] | None:
        """Return the tight box (u0, v0, u1, v1) of a person's visible pixels, in px; None below `min_pixels`."""
        mask = self.ids == id
        if np.count_nonzero(mask) < max(min_pixels, 1):
            return None
        width, flat = mask.shape[1], mask.reshape(-1)
        top, bottom = int(flat.argmax()) // width, (flat.size - 1 - int(flat[::-1].argmax())) // width
        columns = np.flatnonzero(np.logical_or.reduce(mask[top : bottom + 1], axis=0))
        return float(columns[0]), float(top), float(columns[-1] + 1), float(bottom + 1)
