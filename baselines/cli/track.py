"""`follow track`: track a person in recorded color and depth pictures."""

from __future__ import annotations

import argparse
import functools
import math
import sys
from pathlib import Path

from baselines.cli.arguments import Commands
from baselines.cli.exits import bad_input, detecting


def add(commands: Commands) -> None:
    """Add the command to ``follow``."""
    track = commands.add_parser(
        "track",
        help="track a person in recorded color and depth pictures",
        description="Track a person through a recording: a folder with camera.json, color/ (or rgb/) and depth/; "
        "`tracker/recording.py` describes it.",
    )
    track.add_argument("source", type=Path, metavar="SOURCE", help="folder of the recording")
    track.add_argument("--out", type=Path, metavar="DIR", help="results folder (default: results/track-SOURCE)")
    track.add_argument("--net", default="light", help="the detector's network (default: %(default)s)")
    track.add_argument("--weights", type=Path, metavar="FILE", help="its weights (default: the shipped ones)")
    track.add_argument(
        "--target",
        type=_pixel,
        metavar="U,V",
        help="a picture point on the person (default: the largest, most central)",
    )
    track.set_defaults(run=_run)


def _run(parsed: argparse.Namespace) -> None:
    from baselines.viewing.track import track
    from tracker.recording import Recording

    with detecting(), bad_input(OSError):
        recording = Recording.open(parsed.source)
        from tracker.detection.detector import PersonDetector

        detector = PersonDetector(parsed.net, parsed.weights)
        out = parsed.out or Path("results", f"track-{parsed.source.resolve().name}")
        print(track(recording, out, detector, parsed.target, functools.partial(print, file=sys.stderr)))


def _pixel(text: str) -> tuple[float, float]:
    try:
        u, v = map(float, text.split(","))
    except ValueError:
        u = v = math.nan
    if not (math.isfinite(u) and math.isfinite(v)):
        raise argparse.ArgumentTypeError(f"{text!r} is no picture point; expected two numbers such as 160,120")
    return u, v
