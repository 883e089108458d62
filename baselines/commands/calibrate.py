"""`follow calibrate`: measure the sensor's shape and fit its scale again."""

from __future__ import annotations

import argparse
from pathlib import Path

from baselines.commands.arguments import Commands, add_jobs, output_file
from baselines.commands.exits import CommandError


def add(commands: Commands) -> None:
    """Add the command to ``follow``."""
    calibrate = commands.add_parser("calibrate", help="measure the sensor's shape and fit its scale again")
    shipped = Path(__file__).parents[1] / "calibration.json"
    calibrate.add_argument(
        "--out",
        type=output_file,
        default=str(shipped),
        metavar="FILE",
        help="default: the shipped file",
    )
    add_jobs(calibrate)
    calibrate.set_defaults(run=_run)


def _run(parsed: argparse.Namespace) -> None:
    from baselines.benchmark import calibrate, calibration_report

    try:
        content = calibrate.main(parsed.out, parsed.jobs)
    except OSError as error:
        raise CommandError(f"{parsed.out} cannot be written ({error.strerror}); name another with --out") from error
    print(calibration_report.summary(content))
    print(f"\nThe calibration is {parsed.out}.")
