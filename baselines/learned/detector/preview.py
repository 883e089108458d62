"""A sheet of training pictures with their boxes, to look at before anybody trains on them."""

import cv2
import numpy as np

from baselines.learned.detector.data import Sample, SampleSource

TILE = (200, 150)
"""Width and height of a picture on the sheet, px: unsquashed."""
ASKED, UNASKED = (40, 230, 60), (255, 150, 0)
"""Colors of the boxes of people who have to be found, and of difficult ones."""


def sheet(source: SampleSource, rows: int = 4, columns: int = 6) -> np.ndarray:
    """Return (rows 150, columns 200, 3) uint8: one picture of each of the first scenes."""
    step = source.config.pictures_per_scene
    tiles = [draw(source.sample(k * step)) for k in range(rows * columns)]
    return np.vstack([np.hstack(tiles[row * columns : (row + 1) * columns]) for row in range(rows)])


def draw(sample: Sample) -> np.ndarray:
    """Return the picture of a sample in its own proportions, with its boxes."""
    picture = cv2.resize(sample.rgb, TILE, interpolation=cv2.INTER_AREA)
    for box, difficult in zip(sample.boxes, sample.difficult, strict=True):
        u0, v0, u1, v1 = (box * (*TILE, *TILE)).astype(int).tolist()
        cv2.rectangle(picture, (u0, v0), (u1 - 1, v1 - 1), UNASKED if difficult else ASKED, 1)
    return picture
