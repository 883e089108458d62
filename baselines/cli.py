"""The command line: `follow`. Errors are one sentence on stderr; exit code 2 means that the input was bad."""

from __future__ import annotations

import argparse
import functools
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


def _bench(parsed: argparse.Namespace) -> int:
    from baselines import calibration
    from baselines.benchmark.episodes import Player
    from baselines.benchmark.followers import EPISODES, bench
    from baselines.benchmark.pool import EpisodeError

    out = parsed.out or Path("results", parsed.suite)
    player = Player()
    try:
        text = bench(parsed.episodes or EPISODES, calibration.settings(), player, out, parsed.jobs, parsed.resume)
    except ValueError as error:
        print(f"follow: {error}", file=sys.stderr)
        return BAD_INPUT
    except EpisodeError as error:
        print(f"follow: {error}\nWhat was finished is kept in {out}: --resume goes on with it.", file=sys.stderr)
        return FAILED
    finally:
        player.close()
    print(text)
    print(f"Table and raw episodes are in {out}.")
    return 0


def _train(parsed: argparse.Namespace) -> int:
    import dataclasses

    from baselines.learned.recipes import RECIPES
    from baselines.learned.training import train

    recipe = RECIPES[parsed.recipe]
    out = parsed.out or Path("results", "learned", f"{parsed.recipe}-{parsed.seed}")
    try:
        if parsed.steps is not None:
            recipe = dataclasses.replace(recipe, steps=parsed.steps)
        weights = train(parsed.recipe, recipe, parsed.seed, out, parsed.resume)
    except ValueError as error:
        print(f"follow: {error}", file=sys.stderr)
        return BAD_INPUT
    except KeyboardInterrupt:
        raise KeyboardInterrupt(
            f"interrupted: the finished legs are kept in {out}; the same command with --resume goes on."
        ) from None
    print(f"The agent is {weights}.")
    return 0


def _export(parsed: argparse.Namespace) -> int:
    from baselines.benchmark.assembly import cell_of
    from baselines.learned.offline import export

    dataset_id = parsed.id or f"follow_env/{parsed.scene}/{parsed.policy}-v0"
    try:
        dataset = export(cell_of(parsed.policy, parsed.scene), range(parsed.episodes), dataset_id)
    except ValueError as error:
        print(f"follow: {error}", file=sys.stderr)
        return BAD_INPUT
    print(f"{dataset_id}: {dataset.total_episodes} episodes, {dataset.total_steps} steps in {dataset.spec.data_path}")
    return 0


def _watch(parsed: argparse.Namespace) -> int:
    from baselines.watch import watch

    try:
        cell = Cell(parsed.perception, parsed.scene, parsed.estimator)
        renderer, size, shadows = parsed.renderer, parsed.size, parsed.shadows
        print(watch(cell, parsed.seed, parsed.video, renderer=renderer, size=size, shadows=shadows))
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
    from baselines.speed.table import document, table

    if parsed.out is not None:
        try:
            parsed.out.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            print(f"follow: {parsed.out} cannot be made ({error.strerror}); name another --out", file=sys.stderr)
            return BAD_INPUT
    effort = speed.QUICK if parsed.quick else speed.FULL
    report = speed.speed(effort, lambda what: print(f"measuring: {what}", file=sys.stderr, flush=True))
    text = table(report)
    print(text)
    if parsed.out is not None:
        (parsed.out / "speed.md").write_text(text + "\n", encoding="utf-8")
        (parsed.out / "speed.json").write_text(document(report), encoding="utf-8")
    return 0


def _detector(parsed: argparse.Namespace) -> int:
    try:
        from tracker.detection import commands

        text = getattr(commands, parsed.action)(parsed)
    except ModuleNotFoundError as error:
        print(f"follow: {error.name} is missing; `pip install follow-env[learn]` brings it", file=sys.stderr)
        return FAILED
    except (ValueError, OSError) as error:
        print(f"follow: {error}", file=sys.stderr)
        return BAD_INPUT
    print(text)
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
    _add_bench(commands)
    _add_train(commands)
    _add_export(commands)
    _add_watch(commands)
    _add_track(commands)
    _add_calibrate(commands)
    _add_speed(commands)
    _add_detector(commands)
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


def _add_bench(commands: _Commands) -> None:
    bench = commands.add_parser("bench", help="compare followers on the same seeds")
    bench.add_argument("suite", choices=("followers",), metavar="SUITE", help="followers: from parked to learned")
    bench.add_argument("--episodes", type=_positive, metavar="N", help="episodes per cell (default: 100)")
    _add_jobs(bench)
    bench.add_argument("--out", type=Path, metavar="DIR", help="results folder (default: results/SUITE)")
    bench.add_argument("--resume", action="store_true", help="go on with the episodes the folder already holds")
    bench.set_defaults(run=_bench)


def _add_train(commands: _Commands) -> None:
    train = commands.add_parser("train", help="train a follower in the batch of worlds")
    train.add_argument(
        "recipe",
        choices=("ppo", "ppo_estimate", "ppo_pixels", "recurrent_ppo", "sac"),
        metavar="ALGO",
        help="%(choices)s",
    )
    train.add_argument("--steps", type=_positive, metavar="N", help="environment steps (default: the recipe's)")
    train.add_argument("--seed", type=_natural, default=0, metavar="S", help="default: %(default)s")
    train.add_argument("--out", type=Path, metavar="DIR", help="default: results/learned/ALGO-S")
    train.add_argument("--resume", action="store_true", help="go on after the last finished leg")
    train.set_defaults(run=_train)


def _add_export(commands: _Commands) -> None:
    export = commands.add_parser("export", help="store episodes as a Minari dataset, for offline learning")
    export.add_argument("--policy", default="akf", metavar="NAME", help="estimator, floor or agent (default: akf)")
    export.add_argument("--scene", choices=SCENES, default="corridor", help="default: %(default)s")
    export.add_argument("--episodes", type=_positive, default=100, metavar="N", help="seeds 0 to N-1; default: 100")
    export.add_argument("--id", metavar="ID", help="default: follow_env/SCENE/NAME-v0")
    export.set_defaults(run=_export)


def _add_watch(commands: _Commands) -> None:
    watch = commands.add_parser("watch", help="record a video of one episode")
    watch.add_argument("--estimator", choices=ESTIMATORS, default="akf", help="default: %(default)s")
    watch.add_argument("--perception", choices=PERCEPTIONS, default="mask", help="default: %(default)s")
    watch.add_argument("--scene", choices=SCENES, default="corridor", help="default: %(default)s")
    watch.add_argument("--seed", type=_natural, default=0, metavar="S", help="default: %(default)s")
    watch.add_argument(
        "--video", type=_output_file, default=Path("watch.mp4"), metavar="FILE", help="default: %(default)s"
    )
    watch.add_argument(
        "--renderer", default="raster", metavar="NAME", help="raster, opengl or tiny (default: %(default)s)"
    )
    watch.add_argument("--size", type=_size, metavar="WIDTHxHEIGHT", help="show the robot's view alone, in this size")
    watch.add_argument("--shadows", action="store_true", help="with --size and --renderer opengl: lamps cast shadows")
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
    speed.add_argument("--out", type=Path, metavar="DIR", help="also write speed.md and speed.json into this folder")
    speed.set_defaults(run=_speed)


def _add_detector(commands: _Commands) -> None:
    detector = commands.add_parser("detector", help="train the person detector, evaluate it, look at its pictures")
    actions = detector.add_subparsers(metavar="ACTION", required=True)
    train = actions.add_parser("train", help="train on pictures made from a seed, and keep the run in a folder")
    train.add_argument("--steps", type=_positive, default=2500, metavar="N", help="batches (default: %(default)s)")
    train.add_argument("--seed", type=_natural, default=0, metavar="S", help="default: %(default)s")
    train.add_argument("--start", type=Path, metavar="FILE", help="weights to start from instead of random ones")
    train.add_argument("--out", type=Path, metavar="DIR", help="folder of the run (default: results/detector-NET)")
    train.add_argument("--resume", action="store_true", help="go on with the run that the folder holds")
    _add_jobs(train)
    evaluate = actions.add_parser("evaluate", help="average precision, and the counts of paper A's Table 2")
    evaluate.add_argument("--weights", type=Path, metavar="FILE", help="of the net (default: the shipped ones)")
    evaluate.add_argument(
        "--pictures", type=_positive, default=500, metavar="N", help="held-out pictures (default: %(default)s)"
    )
    evaluate.add_argument(
        "--frames", type=_positive, metavar="N", help="of each sequence of Table 2 (default: as many as the paper's)"
    )
    for action in (train, evaluate):
        action.add_argument(
            "--net",
            choices=("light", "light_depth", "light_ssd", "paper", "ssd300"),
            default="light",
            help="default: %(default)s",
        )
    preview = actions.add_parser("preview", help="draw a sheet of training pictures with their boxes")
    preview.add_argument("--seed", type=_natural, default=0, metavar="S", help="default: %(default)s")
    preview.add_argument("--out", type=_output_file, default=Path("detector_preview.png"), metavar="FILE")
    for name, action in actions.choices.items():
        action.set_defaults(run=_detector, action=name)


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
        raise argparse.ArgumentTypeError(
            f"{text!r} is no picture point; expected two numbers such as 160,120"
        ) from None
    return u, v


def _whole(text: str, least: int) -> int:
    try:
        value = int(text)
    except ValueError:
        value = least - 1
    if value < least:
        raise argparse.ArgumentTypeError(f"{text!r} is not a whole number of at least {least}")
    return value


def _size(text: str) -> tuple[int, int]:
    width, _, height = text.partition("x")
    try:
        return _natural(width), _natural(height)
    except argparse.ArgumentTypeError:
        raise argparse.ArgumentTypeError(f"{text!r} is no size; expected WIDTHxHEIGHT, such as 1280x720") from None


def _output_file(text: str) -> Path:
    path = Path(text)
    if path.is_dir() or not path.parent.is_dir() or not os.access(path if path.exists() else path.parent, os.W_OK):
        raise argparse.ArgumentTypeError(f"{text!r} cannot be written; name a file in an existing, writable folder")
    return path


if __name__ == "__main__":
    sys.exit(main())
