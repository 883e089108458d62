"""`follow watch`: record a video of one episode."""

from __future__ import annotations

import argparse
from pathlib import Path

from baselines.benchmark.cells import ESTIMATORS, PERCEPTIONS, SCENES, Cell
from baselines.cli.arguments import Commands, add_seed, add_trial, natural, output_file, trial_of
from baselines.cli.exits import detecting


def add(commands: Commands) -> None:
    """Add the command to ``follow``."""
    watch = commands.add_parser("watch", help="record a video of one episode")
    watch.add_argument("--estimator", choices=ESTIMATORS, default="akf", help="default: %(default)s")
    watch.add_argument("--perception", choices=PERCEPTIONS, default="mask", help="default: %(default)s")
    watch.add_argument("--scene", choices=SCENES, default="corridor", help="default: %(default)s")
    add_trial(watch)
    add_seed(watch)
    watch.add_argument(
        "--video", type=output_file, default=Path("watch.mp4"), metavar="FILE", help="default: %(default)s"
    )
    watch.add_argument(
        "--renderer", default="raster", metavar="NAME", help="raster, opengl or tiny (default: %(default)s)"
    )
    watch.add_argument("--size", type=_size, metavar="WIDTHxHEIGHT", help="show the robot's view alone, in this size")
    watch.add_argument("--shadows", action="store_true", help="with --size and --renderer opengl: lamps cast shadows")
    watch.add_argument("--lead", action="store_true", help="with --follower: arrow keys lead the person in a window")
    watch.set_defaults(run=_run)


def _run(parsed: argparse.Namespace) -> None:
    from baselines.viewing.watch import watch

    if parsed.lead:
        with detecting():
            print(_lead(parsed))
        return
    with detecting():
        cell = trial_of(parsed) or Cell(parsed.perception, parsed.scene, parsed.estimator)
        renderer, size, shadows = parsed.renderer, parsed.size, parsed.shadows
        print(watch(cell, parsed.seed, parsed.video, renderer=renderer, size=size, shadows=shadows))


def _lead(parsed: argparse.Namespace) -> str:
    from baselines.viewing.lead import lead

    trial = trial_of(parsed)
    if trial is None:
        raise ValueError("--lead needs somebody who follows; add --follower, for example --follower akf")
    return lead(trial, parsed.seed)


def _size(text: str) -> tuple[int, int]:
    width, _, height = text.partition("x")
    try:
        return natural(width), natural(height)
    except argparse.ArgumentTypeError:
        raise argparse.ArgumentTypeError(f"{text!r} is no size; expected WIDTHxHEIGHT, such as 1280x720") from None
