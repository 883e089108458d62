"""A detector that knows the colors of the suits: cheap, never trained, the same everywhere.

A module of its own, because worker processes must be able to import it.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from tracker.boxes import Detection
from tracker.person_tracker import Detector


@dataclass
class SuitDetector:
    """Finds what is more colored than so many gray levels; after so many pictures somebody presses Ctrl-C."""

    least: int
    patience: int = 1_000_000

    def detect(self, rgb: np.ndarray, depth: np.ndarray) -> Sequence[Detection]:
        if self.patience == 0:
            raise KeyboardInterrupt
        self.patience -= 1
        colors = rgb.astype(np.int16)
        vivid = colors.max(axis=2) - colors.min(axis=2) > self.least
        vivid[:, :60] = vivid[:, 260:] = False  # handrails and hoses
        rows, columns = (np.flatnonzero(np.count_nonzero(vivid, axis=axis) > 5) for axis in (1, 0))
        if not (rows.size and columns.size):
            return []
        box = (float(columns[0]), float(rows[0]), float(columns[-1] + 1), float(rows[-1] + 1))
        return [Detection(box, 0.9)]


def detectors(patience: int = 1_000_000) -> Mapping[str, Detector]:
    """Both nets' places taken by a good and a bad one."""
    import suits

    return {"light": suits.SuitDetector(60, patience), "light_ssd": suits.SuitDetector(250)}
