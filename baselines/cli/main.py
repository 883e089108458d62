"""The command line: `follow`. Errors are one sentence on stderr; exit code 2 means that the input was bad."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from typing import NoReturn

from baselines.cli import bench, calibrate, detector, export, listing, reproduce, speed, track, train, watch
from baselines.cli.exits import BAD_INPUT, FAILED, INTERRUPTED, CommandError

__all__ = ["BAD_INPUT", "FAILED", "INTERRUPTED", "main"]


def main(arguments: Sequence[str] | None = None) -> int:
    """Run one command and return its exit code.

    Args:
        arguments: Words after ``follow``; None takes those of this process.
    """
    parsed = _parser().parse_args(arguments)
    try:
        parsed.run(parsed)
    except CommandError as error:
        print(f"follow: {error}", file=sys.stderr)
        return error.code
    except KeyboardInterrupt as interruption:
        print(f"\n{interruption.args[0] if interruption.args else 'interrupted'}", file=sys.stderr)
        return INTERRUPTED
    return 0


class _Parser(argparse.ArgumentParser):
    """A parser whose complaint is one sentence, without the usage before it."""

    def error(self, message: str) -> NoReturn:
        self.exit(BAD_INPUT, f"{self.prog}: {message}; `{self.prog} --help` tells more.\n")


class _Version(argparse.Action):
    """Print the installed version and end; the package is imported only when it is asked for."""

    def __init__(self, option_strings: Sequence[str], dest: str) -> None:
        super().__init__(option_strings, argparse.SUPPRESS, nargs=0, help="print the version")

    def __call__(self, parser: argparse.ArgumentParser, *_: object) -> NoReturn:
        from follow_env import __version__

        print(f"follow-env {__version__}")
        parser.exit()


def _parser() -> argparse.ArgumentParser:
    parser: argparse.ArgumentParser = _Parser(
        prog="follow",
        description="Measure how well a robot follows a person.",
    )
    parser.add_argument("--version", action=_Version)
    commands = parser.add_subparsers(metavar="COMMAND", required=True)
    for command in (reproduce, bench, listing, train, export, watch, track, calibrate, speed, detector):
        command.add(commands)
    return parser


if __name__ == "__main__":
    sys.exit(main())
