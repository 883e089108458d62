"""Worker processes that play episodes: they cannot outlive their parent, and one that dies is noticed."""

from __future__ import annotations

import contextlib
import multiprocessing
import os
import signal
import threading
import traceback
from collections import deque
from collections.abc import Callable, Generator, Iterator, Sequence
from dataclasses import dataclass
from multiprocessing.connection import Connection, wait
from multiprocessing.process import BaseProcess
from typing import Protocol, TypeVar


class Keyed(Protocol):
    """What is played: a cell of a benchmark, a part of an experiment."""

    @property
    def key(self) -> str:
        """A stable name, the same in every process and version."""


Kind = TypeVar("Kind", bound=Keyed)
Result = TypeVar("Result")


class EpisodeError(RuntimeError):
    """An episode could not be played to its end; the message names it and holds the traceback."""


def play_all(
    episode: Callable[[Kind, int], Result], tasks: Sequence[tuple[Kind, int]], jobs: int
) -> Generator[tuple[tuple[Kind, int], Result], None, None]:
    """Play the tasks and yield each with its episode as soon as it is finished, in no particular order.

    Args:
        episode: Plays one task. With several jobs it must be picklable: a module's function, or an instance.
        tasks: What to play, with its seed; they are started in this order.
        jobs: Number of processes; 1 plays in this one.

    Raises:
        EpisodeError: If a task raises or its worker process dies.
    """
    if jobs == 1 or len(tasks) < 2:
        return _play_here(episode, tasks)
    return _play_in_workers(episode, tasks, min(jobs, len(tasks)))


def _play_here(
    episode: Callable[[Kind, int], Result], tasks: Sequence[tuple[Kind, int]]
) -> Generator[tuple[tuple[Kind, int], Result], None, None]:
    for task in tasks:
        try:
            result = episode(*task)
        except Exception as error:
            raise EpisodeError(f"{_name(task)} failed:\n{traceback.format_exc()}") from error
        yield task, result


def _play_in_workers(
    episode: Callable[[Kind, int], Result], tasks: Sequence[tuple[Kind, int]], jobs: int
) -> Generator[tuple[tuple[Kind, int], Result], None, None]:
    waiting = deque(tasks)
    playing: dict[Connection, tuple[Kind, int]] = {}
    processes: dict[Connection, BaseProcess] = {}
    try:
        for _ in range(jobs):
            connection, process = _start(episode)
            processes[connection] = process
            playing[connection] = waiting.popleft()
            _hand_over(connection, playing[connection])
        while playing:
            ready = set(wait(list(playing)))
            for connection in [connection for connection in playing if connection in ready]:
                task = playing.pop(connection)
                try:
                    result = connection.recv()
                except (EOFError, ConnectionResetError):
                    processes[connection].join()
                    code = processes[connection].exitcode
                    raise EpisodeError(f"the worker process that played {_name(task)} died with code {code}") from None
                if isinstance(result, _Failure):
                    raise EpisodeError(f"{_name(task)} failed:\n{result.traceback}")
                if waiting:
                    playing[connection] = waiting.popleft()
                    _hand_over(connection, playing[connection])
                yield task, result
    finally:
        for process in processes.values():
            process.terminate()
        for connection, process in processes.items():
            process.join()
            connection.close()


@dataclass(frozen=True)
class _Failure:
    """What a worker sends instead of an episode when the task raised."""

    traceback: str


def _start(episode: Callable[[Kind, int], Result]) -> tuple[Connection, BaseProcess]:
    context = multiprocessing.get_context("spawn")
    ours, theirs = context.Pipe()
    process = context.Process(target=_serve, args=(theirs, episode), daemon=True)
    with _interrupts_ignored():
        process.start()
    theirs.close()
    return ours, process


def _hand_over(connection: Connection, task: tuple[Keyed, int]) -> None:
    """Send a task; a worker that has died is noticed where its answer is awaited."""
    with contextlib.suppress(BrokenPipeError):
        connection.send(task)


@contextlib.contextmanager
def _interrupts_ignored() -> Iterator[None]:
    """A process started in here ignores Ctrl-C from its first instruction on: only the parent answers it."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    previous = signal.signal(signal.SIGINT, signal.SIG_IGN)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, previous)


def _serve(connection: Connection, episode: Callable[[Kind, int], Result]) -> None:
    """A worker's life: receive a task, send its episode, until it is terminated or the parent is gone."""
    threading.Thread(target=_exit_with_parent, daemon=True).start()
    while True:
        task = connection.recv()
        try:
            result: Result | _Failure = episode(*task)
        except Exception:
            result = _Failure(traceback.format_exc())
        connection.send(result)


def _exit_with_parent() -> None:
    parent = multiprocessing.parent_process()
    assert parent is not None
    wait([parent.sentinel])
    os._exit(1)


def _name(task: tuple[Keyed, int]) -> str:
    return f"the episode {task[0].key} with seed {task[1]}"
