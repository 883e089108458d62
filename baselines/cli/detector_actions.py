"""What `follow detector` does: each function takes the parsed arguments and returns the text to print."""

import argparse
import dataclasses
from pathlib import Path

import cv2

from baselines.learned.detector.data import DataConfig, SampleSource, without_augmentation
from baselines.learned.detector.evaluation import evaluate as evaluate_network
from baselines.learned.detector.preview import sheet
from baselines.learned.detector.training import TEST_SEED, TrainConfig
from baselines.learned.detector.training import train as train_network
from baselines.papers.zhang2018.sequences import TABLE_2, count
from tracker.detection.detector import PersonDetector
from tracker.detection.networks import NETS


def train(parsed: argparse.Namespace) -> str:
    """Train `net` for `steps` from `seed` at `rate`, perhaps from the weights `start`, into the folder `out`."""
    out = parsed.out or Path("results", f"detector-{parsed.net}")
    config = TrainConfig(
        net=parsed.net,
        steps=parsed.steps,
        seed=parsed.seed,
        rate=parsed.rate,
        start=None if parsed.start is None else str(parsed.start),
        data=DataConfig(walk_share=parsed.walk_share, depth=NETS[parsed.net].depth),
    )
    result = train_network(config, out, parsed.jobs, parsed.resume, _tell)
    return f"Held-out AP {result.ap:.3f}; the run is in {out}, its weights are {out / 'weights.safetensors'}."


def evaluate(parsed: argparse.Namespace) -> str:
    """Score `weights` of `net` on held-out `pictures`, and on the sequences of Table 2 cut to `frames`."""
    detector = PersonDetector(parsed.net, parsed.weights)
    config = DataConfig(depth=NETS[parsed.net].depth)
    lines = [f"{'held-out pictures':22} {'number':>6} {'AP':>6} {'TP':>6} {'FP':>6} {'FN':>6}"]
    for name, shown in (("level camera", without_augmentation(config)), ("as in training", config)):
        score = evaluate_network(detector.network, SampleSource(TEST_SEED + 1, shown), parsed.pictures)
        lines.append(f"{name:22} {score.pictures:6} {score.ap:6.3f} {score.tp:6} {score.fp:6} {score.fn:6}")
    lines.append(f"\n{'Table 2 of paper A':22} {'frames':>6} {'TDA':>6} {'TP':>6} {'FP':>6} {'FN':>6} {'CFN':>6}")
    for row in TABLE_2:
        row = row if parsed.frames is None else dataclasses.replace(row, frames=parsed.frames)
        counts = count(detector, row)
        shares = f"{counts.frames:6} {counts.tda:6.3f} {counts.tp:6} {counts.fp:6} {counts.fn:6} {counts.cfn:6}"
        lines.append(f"{row.suit + ', view ' + str(row.view):22} {shares}")
    return "\n".join(lines)


def preview(parsed: argparse.Namespace) -> str:
    """Write the sheet of the first pictures of `seed` to `out`."""
    cv2.imwrite(str(parsed.out), sheet(SampleSource(parsed.seed))[:, :, ::-1])
    return f"The sheet is {parsed.out}; the boxes of people who are too hard to see are orange."


def _tell(line: str) -> None:
    print(line, flush=True)
