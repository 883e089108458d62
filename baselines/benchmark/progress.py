"""How far long work has come: a bar on a terminal, a plain line for every tenth elsewhere."""

from __future__ import annotations

import importlib.util
import sys
from collections.abc import Iterable, Iterator
from typing import TypeVar

Item = TypeVar("Item")

_LINES = 10


def progress(items: Iterable[Item], total: int, done: int = 0, unit: str = "episode") -> Iterator[Item]:
    """Pass the items through and tell on stderr how many there have been.

    Args:
        items: Finished pieces of work, as they come.
        total: Number of pieces of the whole work.
        done: Number that was finished before.
        unit: What a piece is called.
    """
    if sys.stderr.isatty() and importlib.util.find_spec("tqdm"):
        from tqdm import tqdm

        yield from tqdm(items, total=total, initial=done, unit=unit, dynamic_ncols=True, smoothing=0.05)
        return
    told = done * _LINES // total
    print(f"{done} of {total} {unit}s", file=sys.stderr, flush=True)
    for count, item in enumerate(items, start=done + 1):
        yield item
        if count * _LINES // total > told:
            told = count * _LINES // total
            print(f"{count} of {total} {unit}s", file=sys.stderr, flush=True)
