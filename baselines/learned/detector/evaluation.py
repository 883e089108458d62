"""How good a detector is: average precision, and the counts of paper A at its confidence of 0.5."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from baselines.learned.detector.data import Sample, SampleSource
from tracker.boxes import Detection, iou
from tracker.detection.detector import CONFIDENCE, network_input, predict, read
from tracker.detection.networks import MultiBoxNet
from tracker.detection.priors import prior_boxes

TRUE_OVERLAP = 0.5
"""Least overlap of a true positive."""
_FLOOR = 0.02
"""Detections below this score are left out of the precision-recall curve."""


@dataclass(frozen=True)
class Truth:
    """People of one picture: boxes (N, 4), corners, and which of them need not be found, (N,) bool."""

    boxes: np.ndarray
    difficult: np.ndarray


@dataclass(frozen=True)
class Score:
    """What a detector made of a number of pictures.

    Attributes:
        pictures: how many.
        ap: average precision at an overlap of 0.5, all points.
        tp, fp, fn: true positives, false positives and misses at a confidence of 0.5.
    """

    pictures: int
    ap: float
    tp: int
    fp: int
    fn: int


def evaluate(network: MultiBoxNet, source: SampleSource, pictures: int, batch: int = 16) -> Score:
    """Return the score of a network on the first samples of a source."""
    priors = prior_boxes(network.config.layers)
    training = network.training
    network.eval()
    found: list[list[Detection]] = []
    truths: list[Truth] = []
    for first in range(0, pictures, batch):
        samples = [source.sample(k) for k in range(first, min(first + batch, pictures))]
        inputs = np.stack([network_input(s.rgb, s.depth if network.config.depth else None) for s in samples])
        for logits, offsets in zip(*predict(network, inputs), strict=True):
            found.append(read(logits, offsets, priors, (1, 1), _FLOOR))
        truths += [_truth(sample) for sample in samples]
    network.train(training)
    return score(found, truths)


def score(found: Sequence[Sequence[Detection]], truths: Sequence[Truth]) -> Score:
    """Return the score of the detections of some pictures, each in descending order, against the people in them."""
    people = sum(int((~truth.difficult).sum()) for truth in truths)
    scores: list[np.ndarray] = [np.zeros(0)]
    hits: list[np.ndarray] = [np.zeros(0, np.int64)]
    for detections, truth in zip(found, truths, strict=True):
        scores.append(np.array([d.score for d in detections]))
        hits.append(assign(np.array([d.box for d in detections]).reshape(-1, 4), truth))
    confidence, hit = np.concatenate(scores), np.concatenate(hits)
    confidence, hit = confidence[hit >= 0], hit[hit >= 0]
    sure = hit[confidence >= CONFIDENCE]
    tp = int(sure.sum())
    ap = average_precision(confidence, hit, people)
    return Score(len(truths), ap, tp, len(sure) - tp, people - tp)


def assign(boxes: np.ndarray, truth: Truth) -> np.ndarray:
    """Return 1 (true), 0 (false) or -1 (leave out) for detected boxes (N, 4), the most certain first.

    Each takes, of the people nobody took before, the one it overlaps most; a box on a difficult person counts for
    nothing.
    """
    overlaps = iou(boxes, truth.boxes)
    taken = np.zeros(len(truth.boxes), bool)
    hits = np.zeros(len(boxes), np.int64)
    for k, row in enumerate(overlaps):
        asked = np.where(taken | truth.difficult, 0.0, row)
        if asked.max(initial=0.0) >= TRUE_OVERLAP:
            hits[k], taken[asked.argmax()] = 1, True
        elif np.where(truth.difficult, row, 0.0).max(initial=0.0) >= TRUE_OVERLAP:
            hits[k] = -1
    return hits


def average_precision(confidence: np.ndarray, hits: np.ndarray, people: int) -> float:
    """Return the area under the precision-recall curve, its precision made monotonous (VOC 2010 and later).

    Args:
        confidence: (N,).
        hits: (N,), 1 where a detection is true, 0 where it is false.
        people: to be found; without any, the result is 1 if nothing was detected and 0 otherwise.
    """
    if people == 0:
        return float(len(hits) == 0)
    ordered = hits[np.argsort(-confidence, kind="stable")]
    true = np.cumsum(ordered)
    precision = true / np.arange(1, len(ordered) + 1)
    best = np.maximum.accumulate(precision[::-1])[::-1]
    return float((best * ordered).sum() / people)


def _truth(sample: Sample) -> Truth:
    return Truth(sample.boxes, sample.difficult)
