"""`follow reproduce`: measure a published table again."""

from __future__ import annotations

import argparse
from pathlib import Path

from baselines.benchmark.cells import PERCEPTIONS
from baselines.commands.arguments import Commands, add_jobs, positive
from baselines.commands.exits import bad_input, detecting, playing


def add(commands: Commands) -> None:
    """Add the command to ``follow``."""
    reproduce = commands.add_parser("reproduce", help="measure a published table again")
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
    table1.set_defaults(run=_run)


def _run(parsed: argparse.Namespace) -> None:
    from baselines import calibration
    from baselines.benchmark.assembly import detector_identity
    from baselines.benchmark.configuration import Plan
    from baselines.benchmark.reproduce import reproduce

    out = parsed.out or Path("results", "reproduced" if parsed.episodes is None else f"reproduced-{parsed.episodes}")
    plan = Plan.of(parsed.perception or ["emulated", "mask"], parsed.episodes, list(calibration.family()))
    settings = dict(calibration.settings())
    if "detector" in plan.episodes:
        with detecting():
            settings["detector"] = detector_identity()
    with playing(out) as player, bad_input(ValueError):
        text = reproduce(plan, settings, player, out, parsed.jobs, parsed.resume)
    print(text)
    print(f"Tables, raw episodes and figures are in {out}.")
