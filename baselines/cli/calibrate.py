"""`follow calibrate`: measure the sensor's shape and fit its scale again."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

from baselines.cli.arguments import Commands, add_jobs, output_file
from baselines.cli.exits import CommandError, detecting

SHIPPED = Path(__file__).parents[1] / "followers"
"""Folder of the shipped calibrations."""


def add(commands: Commands) -> None:
    """Add the command to ``follow``."""
    calibrate = commands.add_parser("calibrate", help="measure the sensor's shape and fit its scale again")
    calibrate.add_argument("--out", type=output_file, metavar="FILE", help="default: the shipped file")
    calibrate.add_argument("--detector", action="store_true", help="measure the detector's noise instead")
    calibrate.add_argument(
        "--weights", type=Path, metavar="FILE", help="with --detector: of the light net (default: the shipped ones)"
    )
    add_jobs(calibrate)
    calibrate.set_defaults(run=_run)


def _run(parsed: argparse.Namespace) -> None:
    from baselines.papers.dong2018 import calibration_report

    out = parsed.out or SHIPPED / ("calibration_detector.json" if parsed.detector else "calibration.json")
    if parsed.weights is not None and not parsed.detector:
        raise CommandError("--weights are those of a detector; say --detector as well")
    try:
        if parsed.detector:
            text = calibration_report.detector_summary(_measure_detector(parsed.weights, out, parsed.jobs))
        else:
            from baselines.papers.dong2018 import calibrate

            text = calibration_report.summary(calibrate.main(out, parsed.jobs))
    except OSError as error:
        raise CommandError(f"{out} cannot be written ({error.strerror}); name another with --out") from error
    print(text)
    print(f"\nThe calibration is {out}.")


def _measure_detector(weights: Path | None, out: Path, jobs: int) -> dict[str, Any]:
    with detecting():
        from baselines.papers.dong2018 import calibrate_detector
        from tracker.detection.detector import PersonDetector, shipped_weights

        weights = weights or shipped_weights()
        PersonDetector(weights=weights)  # says what is wrong with a file before any work is done
        return calibrate_detector.main(weights, out, jobs)
