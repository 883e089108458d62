"""`follow bench`: compare followers on the same seeds."""

from __future__ import annotations

import argparse
from pathlib import Path

from baselines.cli.arguments import Commands, add_jobs, natural, positive
from baselines.cli.exits import bad_input, detecting, keeping, playing


def add(commands: Commands) -> None:
    """Add the command to ``follow``."""
    bench = commands.add_parser("bench", help="compare followers on the same seeds")
    bench.add_argument(
        "suite",
        metavar="SUITE",
        help="`follow list suites`, module:object, or followers: from parked to learned",
    )
    bench.add_argument(
        "--follower",
        action="append",
        metavar="SPEC",
        help="[PERCEPTION/]ESTIMATOR[+CONTROLLER], an agent's name, file or folder, an SB3 zip, module:object; "
        "again for each; the first is the reference (default: akf)",
    )
    bench.add_argument("--scenario", action="append", metavar="NAME", help="only this one; again for each")
    bench.add_argument("--metric", action="append", metavar="NAME", help="`follow list metrics`; module:object")
    bench.add_argument("--episodes", type=positive, metavar="N", help="episodes per cell (default: 100 or 10)")
    bench.add_argument("--first-seed", type=natural, default=0, metavar="S", help="default: %(default)s")
    bench.add_argument("--engine", metavar="NAME", help="bullet or kinematic (default: bullet)")
    add_jobs(bench)
    bench.add_argument("--out", type=Path, metavar="DIR", help="results folder (default: results/SUITE)")
    bench.add_argument("--resume", action="store_true", help="go on with the episodes the folder already holds")
    bench.set_defaults(run=_run)


def _run(parsed: argparse.Namespace) -> None:
    out = parsed.out or Path("results", parsed.suite.rpartition(":")[2])
    print(_all_followers(parsed, out) if parsed.suite == "followers" else _suite(parsed, out))
    print(f"Table and raw episodes are in {out}.")


def _all_followers(parsed: argparse.Namespace, out: Path) -> str:
    from baselines.followers import calibration
    from baselines.suites.followers import EPISODES, bench

    with playing(out) as player, bad_input(ValueError):
        return bench(parsed.episodes or EPISODES, calibration.settings(), player, out, parsed.jobs, parsed.resume)


def _suite(parsed: argparse.Namespace, out: Path) -> str:
    from baselines.benchmark.evaluate import EPISODES, claim, evaluate, write
    from baselines.benchmark.provenance import trace_digest
    from baselines.benchmark.suite import find_suite

    episodes, changes = parsed.episodes or EPISODES, {} if parsed.engine is None else {"engine": parsed.engine}
    with keeping(out), detecting(), bad_input(ValueError, ImportError):
        suite = find_suite(parsed.suite)
        if parsed.scenario:
            suite = suite.only(parsed.scenario)
        code = trace_digest()
        result = evaluate(
            parsed.follower or ["akf"],
            suite,
            episodes,
            parsed.first_seed,
            parsed.jobs,
            claim(out, parsed.resume, code),
            **changes,
        )
        how = {"episodes": episodes, "first_seed": parsed.first_seed, "changes": changes, "code": code}
        return write(result, out, parsed.metric, how)
