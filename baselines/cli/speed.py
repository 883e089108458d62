"""`follow speed`: measure steps, resets and frames on this machine."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

from baselines.cli.arguments import Commands
from baselines.cli.exits import CommandError


def add(commands: Commands) -> None:
    """Add the command to ``follow``."""
    speed = commands.add_parser("speed", help="measure steps, resets and frames on this machine")
    speed.add_argument("--quick", action="store_true", help="take a tenth of the samples")
    speed.add_argument("--out", type=Path, metavar="DIR", help="also write speed.md and speed.json into this folder")
    speed.set_defaults(run=_run)


def _run(parsed: argparse.Namespace) -> None:
    from baselines import speed
    from baselines.speed.table import document, table

    if parsed.out is not None:
        try:
            parsed.out.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise CommandError(f"{parsed.out} cannot be made ({error.strerror}); name another --out") from error
    effort = speed.QUICK if parsed.quick else speed.FULL
    report = speed.speed(effort, lambda what: print(f"measuring: {what}", file=sys.stderr, flush=True))
    text = table(report)
    print(text)
    if parsed.out is not None:
        (parsed.out / "speed.md").write_text(text + "\n", encoding="utf-8")
        (parsed.out / "speed.json").write_text(document(report), encoding="utf-8")
