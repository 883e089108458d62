"""The command line: `follow`. Errors are one sentence on stderr; exit code 2 means that the input was bad."""

from __future__ import annotations

import argparse
import functools
import math
import os
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import NoReturn, TypeAlias

from baselines.benchmark.cells import ESTIMATORS, PERCEPTIONS, SCENES, Cell

FAILED, BAD_INPUT, INTERRUPTED = 1, 2, 130
"""Exit codes: something broke, the input was bad, Ctrl-C."""


def main(arguments: Sequence[str] | None = None) -> int:
    """Run one command and return its exit code.

    Args:
        arguments: Words after ``follow``; None takes those of this process.
    """
    parsed = _parser().parse_args(arguments)
    try:
        code: int = parsed.run(parsed)
    except KeyboardInterrupt as interruption:
        print(f"\n{interruption.args[0] if interruption.args else 'interrupted'}", file=sys.stderr)
        return INTERRUPTED
    return code


def _reproduce(parsed: argparse.Namespace) -> int:
    from baselines import calibration
    from baselines.benchmark.configuration import Plan
    from baselines.benchmark.episodes import Player
    from baselines.benchmark.pool import EpisodeError
    from baselines.benchmark.reproduce import reproduce
    from baselines.benchmark.store import InputError

    out = parsed.out or Path("results", "reproduced" if parsed.episodes is None else f"reproduced-{parsed.episodes}")
    plan = Plan.of(parsed.perception or ["emulated", "mask"], parsed.episodes, list(calibration.family()))
    player = Player()
    try:
        text = reproduce(plan, calibration.settings(), player, out, parsed.jobs, parsed.resume)
    except InputError as error:
        print(f"follow: {error}", file=sys.stderr)
        return BAD_INPUT
    except EpisodeError as error:
        print(f"follow: {error}\nWhat was finished is kept in {out}: --resume goes on with it.", file=sys.stderr)
        return FAILED
    finally:
        player.close()
    print(text)
    print(f"Tables, raw episodes and figures are in {out}.")
    return 0


def _watch(parsed: argparse.Namespace) -> int:
    from baselines.watch import watch

    try:
        print(watch(Cell(parsed.perception, parsed.scene, parsed.estimator), parsed.seed, parsed.video))
    except ValueError as error:
        print(f"follow: {error}", file=sys.stderr)
        return BAD_INPUT
    return 0


def _track(parsed: argparse.Namespace) -> int:
    from baselines.track import track
    from tracker.recording import Recording

    try:
        recording = Recording.open(parsed.source)
        from tracker.detection.detector import PersonDetector

        detector = PersonDetector(parsed.net, parsed.weights)
        out = parsed.out or Path("results", f"track-{parsed.source.resolve().name}")
        print(track(recording, out, detector, parsed.target, functools.partial(print, file=sys.stderr)))
    except ModuleNotFoundError as error:
        print(
            f"follow: the detector needs {error.name}; install it with pip install 'follow-env[learn]'", file=sys.stderr
        )
        return BAD_INPUT
    except (ValueError, OSError) as error:
        print(f"follow: {error}", file=sys.stderr)
        return BAD_INPUT
    return 0


def _calibrate(parsed: argparse.Namespace) -> int:
    from baselines.benchmark import calibrate, calibration_report

    try:
        content = calibrate.main(parsed.out, parsed.jobs)
    except OSError as error:
        print(f"follow: {parsed.out} cannot be written ({error.strerror}); name another with --out", file=sys.stderr)
        return BAD_INPUT
    print(calibration_report.summary(content))
    print(f"\nThe calibration is {parsed.out}.")
    return 0


def _speed(parsed: argparse.Namespace) -> int:
    from baselines import speed

    costs = speed.speed(quick=parsed.quick)
    print(speed.table(costs))
    if parsed.out is not None:
        parsed.out.write_text(speed.document(costs), encoding="utf-8")
    return 0


class _Parser(argparse.ArgumentParser):
    """A parser whose complaint is one sentence, without the usage before it."""

    def error(self, message: str) -> NoReturn:
        self.exit(BAD_INPUT, f"{self.prog}: {message}; `{self.prog} --help` tells more.\n")


_Commands: TypeAlias = "argparse._SubParsersAction[_Parser]"


def _parser() -> argparse.ArgumentParser:
    parser = _Parser(
        prog="follow", description="Person following for mobile robots: reproduce, watch, track, calibrate, speed."
    )
    commands = parser.add_subparsers(metavar="COMMAND", required=True)
    _add_reproduce(commands)
    _add_watch(commands)
    _add_track(commands)
    _add_calibrate(commands)
    _add_speed(commands)
    return parser


def _add_reproduce(commands: _Commands) -> None:
    reproduce = commands.add_parser("reproduce", help="measure a published table again")
    tables = reproduce.add_subparsers(metavar="TABLE", required=True)
    table1 = tables.add_parser(
        "table1",
        help="Table 1 of the adaptive-Kalman paper: No filter, KF and AKF in two scenes",
        description="Play the episodes of Table 1 and of its two studies, and write tables, figures and raw episodes.",
    )
    table1.add_argument(
        "--episodes",
        type=_positive,
        metavar="N",
        help="episodes per cell (default: 100, and 20 where frames are rendered)",
    )
    _add_jobs(table1)
    table1.add_argument(
        "--perception", action="append", choices=PERCEPTIONS, help="may repeat (default: emulated and mask)"
    )
    table1.add_argument(
        "--out",
        type=Path,
        metavar="DIR",
        help="results folder (default: results/reproduced, with -N after --episodes N)",
    )
    table1.add_argument("--resume", action="store_true", help="go on with the episodes the folder already holds")
    table1.set_defaults(run=_reproduce)


def _add_watch(commands: _Commands) -> None:
    watch = commands.add_parser("watch", help="record a video of one episode")
    watch.add_argument("--estimator", choices=ESTIMATORS, default="akf", help="default: %(default)s")
    watch.add_argument("--perception", choices=PERCEPTIONS, default="mask", help="default: %(default)s")
    watch.add_argument("--scene", choices=SCENES, default="corridor", help="default: %(default)s")
    watch.add_argument("--seed", type=_natural, default=0, metavar="S", help="default: %(default)s")
    watch.add_argument(
        "--video", type=_output_file, default=Path("watch.mp4"), metavar="FILE", help="default: %(default)s"
    )
    watch.set_defaults(run=_watch)


def _add_track(commands: _Commands) -> None:
    track = commands.add_parser(
        "track",
        help="track a person in recorded colour and depth pictures",
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
    track.set_defaults(run=_track)


def _add_calibrate(commands: _Commands) -> None:
    calibrate = commands.add_parser("calibrate", help="measure the sensor's shape and fit its scale again")
    shipped = Path(__file__).parent / "calibration.json"
    calibrate.add_argument(
        "--out",
        type=_output_file,
        default=str(shipped),
        metavar="FILE",
        help="default: the shipped file",
    )
    _add_jobs(calibrate)
    calibrate.set_defaults(run=_calibrate)


def _add_speed(commands: _Commands) -> None:
    speed = commands.add_parser("speed", help="measure steps, resets and frames on this machine")
    speed.add_argument("--quick", action="store_true", help="take a tenth of the samples")
    speed.add_argument("--out", type=_output_file, metavar="FILE", help="also write the figures as JSON")
    speed.set_defaults(run=_speed)


def _add_jobs(command: argparse.ArgumentParser) -> None:
    command.add_argument(
        "--jobs", type=_positive, default=os.cpu_count() or 1, metavar="J", help="processes (default: one per CPU)"
    )


def _positive(text: str) -> int:
    return _whole(text, least=1)


def _natural(text: str) -> int:
    return _whole(text, least=0)


def _pixel(text: str) -> tuple[float, float]:
    try:
        u, v = map(float, text.split(","))
    except ValueError:
        u = v = math.nan
    if not (math.isfinite(u) and math.isfinite(v)):
        raise argparse.ArgumentTypeError(f"{text!r} is no picture point; expected two numbers such as 160,120")
    return u, v


def _whole(text: str, least: int) -> int:
    try:
        value = int(text)
    except ValueError:
        value = least - 1
    if value < least:
        raise argparse.ArgumentTypeError(f"{text!r} is not a whole number of at least {least}")
    return value


def _output_file(text: str) -> Path:
    path = Path(text)
    if path.is_dir() or not path.parent.is_dir() or not os.access(path if path.exists() else path.parent, os.W_OK):
        raise argparse.ArgumentTypeError(f"{text!r} cannot be written; name a file in an existing, writable folder")
    return path


if __name__ == "__main__":
    sys.exit(main())
