"""The MultiBox loss (Liu et al., 2016): paper A names it and its equation (2) is missing from the text we have."""

from typing import NamedTuple

import torch
from torch.nn import functional

from tracker.detection.priors import NEGATIVE, POSITIVE

NEGATIVES_PER_POSITIVE = 3


class Loss(NamedTuple):
    """The loss and its two parts, scalars, for a unit of weight."""

    total: torch.Tensor
    classification: torch.Tensor
    location: torch.Tensor


def multibox_loss(
    logits: torch.Tensor, offsets: torch.Tensor, labels: torch.Tensor, targets: torch.Tensor, weights: torch.Tensor
) -> Loss:
    """Return softmax cross-entropy over positives and the hardest negatives plus smooth L1 over positives.

    Two things differ from SSD. A person counts by the root of the number of priors that have to find it, not by that
    number: it is some 60 for one who fills the picture and 3 for one 4 m away, who would be learned last. And the
    hardest negatives, `NEGATIVES_PER_POSITIVE` for each positive in number and in weight, are those of the whole batch,
    not of each picture: pictures without anybody have no positives, and would teach nothing. A batch without anybody
    counts as one with one positive prior.

    Args:
        logits: (B, P, 2), background and person.
        offsets: (B, P, 4).
        labels: (B, P) int64, `POSITIVE`, `NEGATIVE` or `IGNORED`.
        targets: (B, P, 4), read where positive.
        weights: (B, P), read where positive: what each counts.
    """
    positive, negative = labels == POSITIVE, labels == NEGATIVE
    weight = weights[positive]
    mass = weight.sum().clamp(min=1.0)
    entropy = functional.cross_entropy(logits.flatten(0, 1), labels.flatten().clamp(min=0), reduction="none")
    entropy = entropy.view_as(labels)
    hardest = min(NEGATIVES_PER_POSITIVE * max(len(weight), 1), int(negative.sum()))
    background = entropy[negative].topk(hardest, sorted=False).values.mean()
    classification = (weight * entropy[positive]).sum() / mass + NEGATIVES_PER_POSITIVE * background
    apart = functional.smooth_l1_loss(offsets[positive], targets[positive], reduction="none").sum(dim=1)
    location = (weight * apart).sum() / mass
    return Loss(classification + location, classification, location)
