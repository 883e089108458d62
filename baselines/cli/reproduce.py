"""`follow reproduce`: measure published tables again."""

from __future__ import annotations

import argparse
from pathlib import Path

from baselines.benchmark.cells import PERCEPTIONS
from baselines.cli.arguments import Commands, add_jobs, positive
from baselines.cli.exits import FAILED, CommandError, bad_input, detecting, keeping, need, playing


def add(commands: Commands) -> None:
    """Add the command to ``follow``."""
    reproduce = commands.add_parser("reproduce", help="measure published tables again")
    tables = reproduce.add_subparsers(metavar="TABLE", required=True)
    table1 = tables.add_parser(
        "table1",
        help="Table 1 of the adaptive-Kalman paper: No filter, KF and AKF in two scenes",
        description="Play the episodes of Table 1 and of its two studies, and write tables, figures and raw episodes.",
    )
    table1.add_argument(
        "--episodes",
        type=positive,
        metavar="N",
        help="episodes per cell (default: 100, and 20 where frames are rendered)",
    )
    add_jobs(table1)
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
    table1.set_defaults(run=_table1)
    astronaut = tables.add_parser(
        "astronaut",
        help="the astronaut-tracking paper: Tables 2 and 3, and both tracking experiments",
        description="Play the paper's experiments in the cabin, and write tables, raw rows and pictures.",
    )
    astronaut.add_argument(
        "--experiment",
        action="append",
        choices=("table2", "table3", "rectangle", "lookalike"),
        help="may repeat (default: all)",
    )
    astronaut.add_argument(
        "--episodes",
        type=positive,
        metavar="N",
        help="for a quick look: of the look-alikes (default: 200); fewer also cut the frames of Table 2 to N/200 "
        "and those timed to N; the five walks are always whole",
    )
    astronaut.add_argument(
        "--weights",
        action="append",
        default=[],
        type=_weights,
        metavar="NET=FILE",
        help="of the net light or light_ssd; may repeat (default: the shipped ones)",
    )
    add_jobs(astronaut)
    astronaut.add_argument(
        "--out", type=Path, metavar="DIR", default=Path("results", "astronaut-reproduced"), help="default: %(default)s"
    )
    astronaut.add_argument("--resume", action="store_true", help="go on with what the folder already holds")
    astronaut.set_defaults(run=_astronaut)


def _table1(parsed: argparse.Namespace) -> None:
    from baselines.benchmark.build import detector_identity
    from baselines.benchmark.provenance import Plan
    from baselines.followers import calibration
    from baselines.papers.dong2018.reproduce import reproduce

    out = parsed.out or Path("results", "reproduced" if parsed.episodes is None else f"reproduced-{parsed.episodes}")
    need("matplotlib", "bench", "the figures of this run")
    plan = Plan.of(parsed.perception or ["emulated", "mask"], parsed.episodes, list(calibration.family()))
    settings = dict(calibration.settings())
    if "detector" in plan.episodes:
        with detecting():
            settings["detector"] = detector_identity()
    with playing(out) as player, bad_input(ValueError):
        text = reproduce(plan, settings, player, out, parsed.jobs, parsed.resume)
    print(text)
    print(f"Tables, raw episodes and figures are in {out}.")


def _astronaut(parsed: argparse.Namespace) -> None:
    try:
        from baselines.papers.zhang2018 import table3
        from baselines.papers.zhang2018.experiments import EXPERIMENTS
        from baselines.papers.zhang2018.nets import Nets
        from baselines.papers.zhang2018.reproduce import reproduce
    except ModuleNotFoundError as error:
        raise CommandError(f"{error.name} is missing; `pip install follow-env[learn]` brings it", FAILED) from error

    need("matplotlib", "bench", "the figures of this run")

    def speeds(done: str, out: Path) -> None:
        repeats = min(parsed.episodes or table3.REPEATS, table3.REPEATS)
        table3.write(table3.measure_speeds(nets, repeats), done, out)

    wanted = parsed.experiment or [*EXPERIMENTS, "table3"]
    with keeping(parsed.out), bad_input(ValueError, FileNotFoundError):
        nets = Nets(dict(parsed.weights))
        text = reproduce(
            [name for name in EXPERIMENTS if name in wanted],
            parsed.episodes,
            nets,
            nets.digests(),
            speeds if "table3" in wanted else None,
            parsed.out,
            parsed.jobs,
            parsed.resume,
        )
    print(text)
    print(f"Tables, raw rows and pictures are in {parsed.out}.")


def _weights(text: str) -> tuple[str, Path]:
    net, equals, file = text.partition("=")
    if not (net and equals and file):
        raise argparse.ArgumentTypeError(f"{text!r} names no file; expected NET=FILE, as light=weights.safetensors")
    return net, Path(file)
