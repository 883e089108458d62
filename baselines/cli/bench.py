"""`follow bench`: compare followers on the same seeds."""

from __future__ import annotations

import argparse
from pathlib import Path

from baselines.cli.arguments import Commands, add_jobs, positive
from baselines.cli.exits import bad_input, playing


def add(commands: Commands) -> None:
    """Add the command to ``follow``."""
    bench = commands.add_parser("bench", help="compare followers on the same seeds")
    bench.add_argument("suite", choices=("followers",), metavar="SUITE", help="followers: from parked to learned")
    bench.add_argument("--episodes", type=positive, metavar="N", help="episodes per cell (default: 100)")
    add_jobs(bench)
    bench.add_argument("--out", type=Path, metavar="DIR", help="results folder (default: results/SUITE)")
    bench.add_argument("--resume", action="store_true", help="go on with the episodes the folder already holds")
    bench.set_defaults(run=_run)


def _run(parsed: argparse.Namespace) -> None:
    from baselines.followers import calibration
    from baselines.suites.followers import EPISODES, bench

    out = parsed.out or Path("results", parsed.suite)
    with playing(out) as player, bad_input(ValueError):
        text = bench(parsed.episodes or EPISODES, calibration.settings(), player, out, parsed.jobs, parsed.resume)
    print(text)
    print(f"Table and raw episodes are in {out}.")
