"""`PersonDetector`: a picture in, people out."""

from pathlib import Path

import cv2
import numpy as np
import torch

from follow_env.registry import choose
from tracker.boxes import Detection, area, nms, vote
from tracker.detection.networks import DEPTH_RANGE, NETS, MultiBoxNet
from tracker.detection.priors import INPUT_SIZE, decode, prior_boxes
from tracker.detection.weights import load_network

CONFIDENCE = 0.5
"""Least score of an effective output (paper A, section 3.2)."""
OVERLAP = 0.45
"""Greatest overlap of two outputs that are both kept (SSD)."""
AGREEMENT = 0.6
"""Least overlap at which an effective output has a vote in a kept one's box, and at which two boxes that were voted for
are the same person's. The most certain output often shows the trunk alone, where an arm is stretched out."""
GRID = 0.25
"""Boxes are rounded to this, px: far below their error and far above the last bits of a convolution (1e-5 px), in which
processors differ. In a closed loop such bits would come back larger."""
SHIPPED = Path(__file__).parent / "assets"
"""Weights that come with the package."""


class PersonDetector:
    """Detects people in single pictures; the same picture gives the same boxes on the same machine.

    Args:
        net: one of `NETS`.
        weights: a file that `follow detector train` wrote; None takes the shipped one.
        threads: that torch uses, in the whole process.

    Raises:
        ValueError: if there is no such net, or the file holds the weights of another.
        FileNotFoundError: if there are no such weights.
    """

    def __init__(self, net: str = "light", weights: Path | None = None, threads: int = 1) -> None:
        choose("net", net, NETS)
        torch.set_num_threads(threads)
        self.network = load_network(net, weights or shipped_weights(net))
        self._priors = prior_boxes(self.network.config.layers)

    def detect(
        self, rgb: np.ndarray, depth: np.ndarray | None = None, confidence: float = CONFIDENCE
    ) -> list[Detection]:
        """Return the people in a picture, the most certain first; boxes in px of that picture, cut at its edge.

        Boxes are rounded to `GRID`.

        Args:
            rgb: (H, W, 3) uint8.
            depth: (H, W) float32, m, 0 = no reading; asked for by nets with a depth channel, unread by the others.
            confidence: least score.
        """
        _check(rgb, depth, self.network.config.depth)
        picture = network_input(rgb, depth if self.network.config.depth else None)
        logits, offsets = predict(self.network, picture[None])
        height, width = rgb.shape[:2]
        return read(logits[0], offsets[0], self._priors, (width, height), confidence, GRID)


def shipped_weights(net: str = "light") -> Path:
    """Return the file of the weights that come with the package; raise FileNotFoundError if there are none."""
    weights = SHIPPED / f"{net}.safetensors"
    if not weights.is_file():
        raise FileNotFoundError(
            f"no weights are shipped for the net {net!r}; "
            f"make some with `follow detector train --net {net}` and name the file"
        )
    return weights


def network_input(rgb: np.ndarray, depth: np.ndarray | None) -> np.ndarray:
    """Return the picture (300, 300, 3 or 4) uint8 that a network reads: squashed, the depth as a fourth color."""
    height, width = rgb.shape[:2]
    size = (INPUT_SIZE, INPUT_SIZE)
    if (width, height) != size:
        shrinks = min(width, height) > INPUT_SIZE
        rgb = cv2.resize(rgb, size, interpolation=cv2.INTER_AREA if shrinks else cv2.INTER_LINEAR)
    if depth is None:
        return rgb
    if depth.shape != rgb.shape[:2]:
        depth = cv2.resize(depth, size, interpolation=cv2.INTER_NEAREST)
    level = np.minimum(depth * np.float32(255.0 / DEPTH_RANGE), np.float32(255.0)).astype(np.uint8)
    return np.dstack([rgb, level])


def to_tensor(pictures: torch.Tensor) -> torch.Tensor:
    """Return pictures (B, 300, 300, C) uint8 as a network takes them: (B, C, 300, 300), from 0 to 1."""
    return pictures.permute(0, 3, 1, 2).to(torch.float32) / 255.0


def predict(network: MultiBoxNet, pictures: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return logits (B, P, 2) and offsets (B, P, 4) for pictures (B, 300, 300, C) uint8."""
    device = next(network.parameters()).device
    with torch.inference_mode():
        logits, offsets = network(to_tensor(torch.from_numpy(pictures).to(device)))
    return logits.float().cpu().numpy(), offsets.float().cpu().numpy()


def read(
    logits: np.ndarray,
    offsets: np.ndarray,
    priors: np.ndarray,
    size: tuple[int, int],
    confidence: float,
    grid: float = 0.0,
) -> list[Detection]:
    """Return the detections of one picture of `size` (width, height) px from its logits (P, 2) and offsets (P, 4).

    Boxes are rounded to multiples of `grid` px, unless that is 0.
    """
    scores = 1.0 / (1.0 + np.exp(logits[:, 0] - logits[:, 1]))
    likely = np.flatnonzero(scores >= confidence)
    width, height = size
    boxes = np.clip(decode(offsets[likely], priors[likely]), 0.0, 1.0) * (width, height, width, height)
    boxes, scores = _rounded(boxes, grid), scores[likely]
    inside = area(boxes) > 0.0  # of a box beside the picture nothing is left
    boxes, scores = boxes[inside], scores[inside]
    best = nms(boxes, scores, OVERLAP)
    agreed, scores = _rounded(vote(boxes[best], boxes, scores, AGREEMENT), grid), scores[best]
    return [Detection(tuple(agreed[k].tolist()), float(scores[k])) for k in nms(agreed, scores, AGREEMENT)]


def _rounded(boxes: np.ndarray, grid: float) -> np.ndarray:
    return grid * np.round(boxes / grid) if grid else boxes


def _check(rgb: np.ndarray, depth: np.ndarray | None, needs_depth: bool) -> None:
    if rgb.ndim != 3 or rgb.shape[2] != 3 or rgb.dtype != np.uint8:
        raise ValueError(f"the picture is {rgb.dtype} of shape {rgb.shape}; expected uint8 of shape (H, W, 3)")
    if needs_depth and (depth is None or depth.shape != rgb.shape[:2]):
        shape = None if depth is None else depth.shape
        raise ValueError(f"the depth has shape {shape}; this net needs one of the picture's, {rgb.shape[:2]}")
