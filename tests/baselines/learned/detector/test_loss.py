"""The MultiBox loss against plain arithmetic."""

import math

import numpy as np
import torch

from baselines.learned.detector.loss import NEGATIVES_PER_POSITIVE, multibox_loss
from tracker.detection.priors import IGNORED, NEGATIVE, POSITIVE


def plain_loss(
    logits: np.ndarray, offsets: np.ndarray, labels: np.ndarray, targets: np.ndarray, weights: np.ndarray
) -> tuple[float, float]:
    positives, negatives, location, mass = [], [], 0.0, 0.0
    for b in range(labels.shape[0]):
        for p in range(labels.shape[1]):
            total = math.log(sum(math.exp(value) for value in logits[b, p]))
            if labels[b, p] == POSITIVE:
                positives.append(weights[b, p] * (total - logits[b, p, 1]))
                mass += weights[b, p]
                for difference in np.abs(offsets[b, p] - targets[b, p]):
                    location += weights[b, p] * (0.5 * difference**2 if difference < 1.0 else difference - 0.5)
            elif labels[b, p] == NEGATIVE:
                negatives.append(total - logits[b, p, 0])
    hardest = sorted(negatives, reverse=True)[: NEGATIVES_PER_POSITIVE * max(len(positives), 1)]
    mass = max(mass, 1.0)
    return sum(positives) / mass + NEGATIVES_PER_POSITIVE * sum(hardest) / len(hardest), location / mass


def case(labels: np.ndarray) -> tuple[np.ndarray, ...]:
    rng = np.random.default_rng(4)
    shape = labels.shape
    logits, offsets = 2 * rng.standard_normal((*shape, 2)), 2 * rng.standard_normal((*shape, 4))
    return logits, offsets, labels, rng.random((*shape, 4)), rng.uniform(0.2, 1.0, shape)


def test_it_equals_the_sum_by_hand() -> None:
    labels = np.random.default_rng(3).choice((POSITIVE, NEGATIVE, IGNORED), p=(0.1, 0.7, 0.2), size=(3, 40))
    arrays = case(labels)
    loss = multibox_loss(*(torch.from_numpy(array) for array in arrays))
    classification, location = plain_loss(*arrays)
    np.testing.assert_allclose(
        [loss.classification, loss.location, loss.total], [classification, location, classification + location]
    )


def test_a_batch_without_people_teaches_its_hardest_background() -> None:
    arrays = case(np.full((2, 30), NEGATIVE))
    loss = multibox_loss(*(torch.from_numpy(array) for array in arrays))
    np.testing.assert_allclose([loss.classification, loss.location], plain_loss(*arrays))
    assert loss.total > 0.0


def test_three_negatives_teach_for_each_positive_and_ignored_priors_nothing() -> None:
    labels = np.full((2, 100), NEGATIVE)
    labels[0, :5], labels[1, 50:80] = POSITIVE, IGNORED
    logits, offsets, labels, targets, weights = (torch.from_numpy(array) for array in case(labels))
    logits.requires_grad_()
    multibox_loss(logits, offsets, labels, targets, weights).total.backward()
    taught = logits.grad.abs().sum(dim=2) > 0
    assert taught[labels == POSITIVE].all()
    assert taught[labels == NEGATIVE].sum() == NEGATIVES_PER_POSITIVE * 5
    assert not taught[labels == IGNORED].any()
