"""What a second process adds: frames of two at once over frames of one, beside a loop that only computes."""

from __future__ import annotations

import multiprocessing
import signal
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from multiprocessing.connection import Connection
from statistics import fmean
from types import TracebackType

import numba

from baselines.speed import frames

LOOP = 200_000
"""Turns of the loop in one call."""


@dataclass(frozen=True)
class Rates:
    """Calls a second, means of all runs.

    What else the machine does slows each process now and then. It meets two processes twice as often as one: medians
    of few runs would leave it out for one and keep it for two, means of many count it alike.

    Attributes:
        one, two: Of one process (each of the two in turn), and of two together, by the clock on the wall.
        cpu_one, cpu_two: The same a second of processor time: what other programs take does not count.
    """

    one: float
    cpu_one: float
    two: float
    cpu_two: float

    @property
    def gain(self) -> float:
        """Work of two processes over that of one."""
        return self.two / self.one

    @property
    def cpu_gain(self) -> float:
        """The same if each process had a processor of its own for all the time."""
        return self.cpu_two / self.cpu_one


@dataclass(frozen=True)
class Gain:
    """Work of one and of two processes.

    Attributes:
        renderer: Name of the renderer.
        width, height: Size of the picture, px.
        frames: Rates of the renderer.
        loop: Rates of the loop that only computes, in the same run: what this machine has to give.
    """

    renderer: str
    width: int
    height: int
    frames: Rates
    loop: Rates


def measure_gains(names: Sequence[str], sizes: Sequence[tuple[int, int]], rounds: int, seconds: float) -> list[Gain]:
    """Measure every renderer at every size (width, height) in px: means of `rounds` runs of `seconds` each, in turn."""
    gains = []
    with _Pair() as pair:
        for width, height in sizes:
            for name in names:
                pair.load(name, width, height)
                taken: dict[str, list[tuple[float, ...]]] = {"frames": [], "loop": []}
                for k in range(rounds):
                    for work, rates in taken.items():
                        rates.append((*pair.rates(work, [k % 2], seconds), *pair.rates(work, [0, 1], seconds)))
                means = {work: Rates(*map(fmean, zip(*rates, strict=True))) for work, rates in taken.items()}
                gains.append(Gain(name, width, height, **means))
    return gains


class _Pair:
    """Two processes that wait for orders."""

    def __enter__(self) -> _Pair:
        context = multiprocessing.get_context("spawn")
        self._connections: list[Connection] = []
        self._processes = []
        for _ in range(2):
            ours, theirs = context.Pipe()
            process = context.Process(target=_serve, args=(theirs,), daemon=True)
            process.start()
            theirs.close()
            self._connections.append(ours)
            self._processes.append(process)
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        for connection in self._connections:
            connection.close()
        for process in self._processes:
            process.join()

    def load(self, name: str, width: int, height: int) -> None:
        """Let both make and warm up a renderer."""
        self._ask([0, 1], (name, width, height))

    def rates(self, work: str, processes: list[int], seconds: float) -> tuple[float, float]:
        """Return the calls a second, by wall and processor, of these processes together."""
        walls, cpus = zip(*self._ask(processes, (work, seconds)), strict=True)
        return sum(walls), sum(cpus)

    def _ask(self, processes: list[int], order: tuple) -> list[tuple[float, float]]:
        asked = [self._connections[k] for k in processes]
        for connection in asked:
            connection.send(order)
        return [connection.recv() for connection in asked]


def _serve(connection: Connection) -> None:
    """Follow orders until the connection ends: (renderer, width, height) is loaded, (work, seconds) is done."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    renderer = None
    works: dict[str, Callable[[], object]] = {"loop": lambda: _loop(LOOP)}
    while True:
        try:
            work, *numbers = connection.recv()
        except EOFError:
            break
        if work in works:
            connection.send(_rates(works[work], *numbers))
            continue
        if renderer is not None:
            renderer.close()
        renderer = frames.make(work, *numbers)
        works["frames"] = frames.drawing(renderer, "rigid" if work == frames.PEER else "skinned")
        for operation in works.values():
            operation()
        connection.send((0.0, 0.0))
    if renderer is not None:
        renderer.close()


def _rates(operation: Callable[[], object], seconds: float) -> tuple[float, float]:
    calls, began, cpu_began = 0, time.perf_counter(), time.process_time()
    while True:
        operation()
        calls += 1
        passed = time.perf_counter() - began
        if passed >= seconds:
            return calls / passed, calls / (time.process_time() - cpu_began)


@numba.njit(cache=True)
def _loop(turns):  # type: ignore[no-untyped-def] # numba finds the types
    """Compute without touching memory: a chain of integer steps (Marsaglia's xorshift) that cannot be left out."""
    state = numba.uint64(88172645463325252)
    for _ in range(turns):
        state ^= state << numba.uint64(13)
        state ^= state >> numba.uint64(7)
        state ^= state << numba.uint64(17)
    return state
