"""What the commands' parsers share: the types of their arguments, and the arguments that several of them take."""

from __future__ import annotations

import argparse
import os
from pathlib import Path
from typing import TYPE_CHECKING, TypeAlias

if TYPE_CHECKING:
    from baselines.benchmark.trial import Trial

Commands: TypeAlias = "argparse._SubParsersAction[argparse.ArgumentParser]"


def add_jobs(command: argparse.ArgumentParser) -> None:
    """Let the command take a number of processes."""
    command.add_argument(
        "--jobs", type=positive, default=os.cpu_count() or 1, metavar="J", help="processes (default: one per CPU)"
    )


def add_seed(command: argparse.ArgumentParser) -> None:
    """Let the command take a seed."""
    command.add_argument("--seed", type=natural, default=0, metavar="S", help="default: %(default)s")


def add_trial(command: argparse.ArgumentParser) -> None:
    """Let the command take any follower in any scenario; see `trial_of`."""
    command.add_argument("--follower", metavar="SPEC", help="any follower, as in `follow bench`, in a suite's scenario")
    command.add_argument("--suite", default="paper", metavar="SUITE", help="of --follower (default: %(default)s)")
    command.add_argument("--scenario", metavar="NAME", help="of the suite (default: its first)")


def trial_of(parsed: argparse.Namespace) -> Trial | None:
    """Return what `add_trial` asked for, or None without --follower; a ValueError says what is wrong with it."""
    if parsed.follower is None:
        return None
    from baselines.benchmark.suite import find_suite
    from baselines.benchmark.trial import Trial
    from baselines.followers.spec import FollowerSpec

    suite = find_suite(parsed.suite)
    scenario = suite.scenarios[0] if parsed.scenario is None else suite.only([parsed.scenario]).scenarios[0]
    return Trial(suite.name, scenario, FollowerSpec.parse(parsed.follower))


def positive(text: str) -> int:
    """A whole number of at least one; like all the types here it raises ``argparse.ArgumentTypeError``."""
    return _whole(text, least=1)


def natural(text: str) -> int:
    """A whole number of at least zero."""
    return _whole(text, least=0)


def output_file(text: str) -> Path:
    """A file that can be written."""
    path = Path(text)
    if path.is_dir() or not path.parent.is_dir() or not os.access(path if path.exists() else path.parent, os.W_OK):
        raise argparse.ArgumentTypeError(f"{text!r} cannot be written; name a file in an existing, writable folder")
    return path


def _whole(text: str, least: int) -> int:
    try:
        value = int(text)
    except ValueError:
        value = least - 1
    if value < least:
        raise argparse.ArgumentTypeError(f"{text!r} is not a whole number of at least {least}")
    return value
