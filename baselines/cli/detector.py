"""`follow detector`: train the person detector, evaluate it, look at its pictures."""

from __future__ import annotations

import argparse
from pathlib import Path

from baselines.cli.arguments import Commands, add_jobs, add_seed, output_file, positive
from baselines.cli.exits import FAILED, CommandError, bad_input


def add(commands: Commands) -> None:
    """Add the command to ``follow``."""
    detector = commands.add_parser("detector", help="train the person detector, evaluate it, look at its pictures")
    actions = detector.add_subparsers(metavar="ACTION", required=True)
    train = actions.add_parser("train", help="train on pictures made from a seed, and keep the run in a folder")
    train.add_argument("--steps", type=positive, default=16_000, metavar="N", help="batches (default: %(default)s)")
    add_seed(train)
    train.add_argument("--start", type=Path, metavar="FILE", help="weights to start from instead of random ones")
    train.add_argument(
        "--rate", type=float, default=1.5e-3, metavar="R", help="largest learning rate (default: %(default)s)"
    )
    train.add_argument(
        "--walk-share", type=float, default=0.15, metavar="S",
        help="share of the people who walk, besides those of all postures (default: %(default)s)",
    )  # fmt: skip
    train.add_argument("--out", type=Path, metavar="DIR", help="folder of the run (default: results/detector-NET)")
    train.add_argument("--resume", action="store_true", help="go on with the run that the folder holds")
    add_jobs(train)
    evaluate = actions.add_parser("evaluate", help="average precision, and the counts of paper A's Table 2")
    evaluate.add_argument("--weights", type=Path, metavar="FILE", help="of the net (default: the shipped ones)")
    evaluate.add_argument(
        "--pictures", type=positive, default=500, metavar="N", help="held-out pictures (default: %(default)s)"
    )
    evaluate.add_argument(
        "--frames", type=positive, metavar="N", help="of each sequence of Table 2 (default: as many as the paper's)"
    )
    for action in (train, evaluate):
        action.add_argument(
            "--net",
            choices=("light", "light_depth", "light_ssd", "paper", "ssd300"),
            default="light",
            help="default: %(default)s",
        )
    preview = actions.add_parser("preview", help="draw a sheet of training pictures with their boxes")
    add_seed(preview)
    preview.add_argument("--out", type=output_file, default=Path("detector_preview.png"), metavar="FILE")
    for name, action in actions.choices.items():
        action.set_defaults(run=_run, action=name)


def _run(parsed: argparse.Namespace) -> None:
    try:
        with bad_input(ValueError, OSError):
            from baselines.cli import detector_actions

            text = getattr(detector_actions, parsed.action)(parsed)
    except ModuleNotFoundError as error:
        raise CommandError(f"{error.name} is missing; `pip install follow-env[learn]` brings it", FAILED) from error
    print(text)
