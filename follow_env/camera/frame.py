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

    def person_box(self, min_pixels: int = 1) -> tuple[float, float, float, float] | None:
        """Return the tight box (u0, v0, u1, v1) of the person's visible pixels, in px; None below `min_pixels`."""
        mask = self.ids == 1
        if int(mask.sum()) < max(min_pixels, 1):
            return None
        columns, rows = np.flatnonzero(mask.any(axis=0)), np.flatnonzero(mask.any(axis=1))
        return float(columns[0]), float(rows[0]), float(columns[-1] + 1), float(rows[-1] + 1)
