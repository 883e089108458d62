"""The MultiBox loss (Liu et al., 2016): paper A names it and its equation (2) is missing from the text we have."""

from typing import NamedTuple

import torch
from torch.nn import functional

from tracker.detection.priors import NEGATIVE, POSITIVE

NEGATIVES_PER_POSITIVE = 3


class Loss(NamedTuple):
    """The loss and its two parts, scalars, each summed and divided by the number of positive priors."""

    total: torch.Tensor
    classification: torch.Tensor
    location: torch.Tensor


def multibox_loss(logits: torch.Tensor, offsets: torch.Tensor, labels: torch.Tensor, targets: torch.Tensor) -> Loss:
    """Return softmax cross-entropy over positives and the hardest negatives plus smooth L1 over positives.

    The hardest `NEGATIVES_PER_POSITIVE` negatives for each positive are taken from the whole batch, not from each
    picture as in SSD: pictures without anybody have no positives, and would otherwise teach nothing. A batch without
    any positive counts as one with one.

    Args:
        logits: (B, P, 2), background and person.
        offsets: (B, P, 4).
        labels: (B, P) int64, `POSITIVE`, `NEGATIVE` or `IGNORED`.
        targets: (B, P, 4), read where positive.
    """
    positive = labels == POSITIVE
    negative = labels == NEGATIVE
    count = int(positive.sum())
    entropy = functional.cross_entropy(logits.flatten(0, 1), labels.flatten().clamp(min=0), reduction="none")
    entropy = entropy.view_as(labels)
    hardest = min(NEGATIVES_PER_POSITIVE * max(count, 1), int(negative.sum()))
    classification = entropy[positive].sum() + entropy[negative].topk(hardest, sorted=False).values.sum()
    location = functional.smooth_l1_loss(offsets[positive], targets[positive], reduction="sum")
    share = 1.0 / max(count, 1)
    return Loss((classification + location) * share, classification * share, location * share)
