"""How a command ends before its time: the exit codes, and the error that carries one of them to `main`."""

from __future__ import annotations

import importlib.util
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from baselines.benchmark.player import Player

FAILED, BAD_INPUT, INTERRUPTED = 1, 2, 130
"""Exit codes: something broke, the input was bad, Ctrl-C."""


class CommandError(Exception):
    """Ends a command with a sentence for its user.

    Attributes:
        code: The exit code.
    """

    def __init__(self, sentence: str, code: int = BAD_INPUT) -> None:
        super().__init__(sentence)
        self.code = code


@contextmanager
def bad_input(*kinds: type[Exception]) -> Iterator[None]:
    """Let errors of these kinds end the command: their sentence tells what was wrong with the input."""
    try:
        yield
    except kinds as error:
        raise CommandError(str(error)) from error


@contextmanager
def detecting() -> Iterator[None]:
    """Let a detector that cannot be had end the command: PyTorch, its weights or their calibration are missing."""
    try:
        with bad_input(FileNotFoundError, ValueError):
            yield
    except ModuleNotFoundError as error:
        sentence = f"the detector needs {error.name}; install it with pip install 'follow-env[learn]'"
        raise CommandError(sentence) from error


def need(package: str, extra: str, purpose: str) -> None:
    """End the command before its work begins where an optional package is missing.

    Args:
        package: Name by which it is imported.
        extra: The extra of follow-env that brings it.
        purpose: What needs it, as the sentence begins: `"the figures of this run"`.
    """
    if importlib.util.find_spec(package) is None:
        raise CommandError(f"{purpose} need {package}; install it with pip install 'follow-env[{extra}]'", FAILED)


@contextmanager
def playing(out: Path) -> Iterator[Player]:
    """Lend a player for a run that keeps its episodes in ``out``; an episode that breaks ends the command."""
    from baselines.benchmark.player import Player

    player = Player()
    try:
        with keeping(out):
            yield player
    finally:
        player.close()


@contextmanager
def keeping(out: Path) -> Iterator[None]:
    """Let an episode that breaks end the command with a sentence that says what ``out`` still holds."""
    from baselines.benchmark.executors.processes import EpisodeError

    try:
        yield
    except EpisodeError as error:
        sentence = f"{error}\nWhat was finished is kept in {out}: --resume goes on with it."
        raise CommandError(sentence, FAILED) from error
