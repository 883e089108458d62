"""What compiled functions share: plain functions they call, a digest of their sources, their announcement.

Scalar maths that both a Python class and a compiled loop need is written once, as a plain function of numbers beside
the thing it describes. Python calls it as it stands. `compilable` lets compiled code call it by its name.
"""

import sys
import zlib
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, ClassVar

from numba.core import event
from numba.extending import register_jitable

_COMPILABLE: set[Callable[..., Any]] = set()


def compilable(*functions: Callable[..., Any]) -> None:
    """Let compiled code call these plain functions by their names; they stay as they are for Python.

    Arguments that a function reads attributes of may be an object in Python and a record in compiled code.
    """
    for function in functions:
        if function not in _COMPILABLE:
            _COMPILABLE.add(function)
            register_jitable(nogil=True, error_model="numpy", forceinline=True)(function)


def digest(paths: Iterable[Path]) -> int:
    """Return a checksum of the sources of a compiled function.

    Numba's cache looks only at the file of the cached function itself. As a closure variable of it the checksum is part
    of its cache key: a change in any of the other files is noticed as well.
    """
    result = 0
    for path in sorted(paths):
        result = zlib.crc32(path.read_bytes(), result)
    return result


class _Announcer(event.Listener):
    """Says that `what` is being compiled, once in a process."""

    said: ClassVar[set[str]] = set()

    def __init__(self, what: str) -> None:
        self._what = what

    def on_start(self, event: Any) -> None:
        if self._what not in _Announcer.said:
            _Announcer.said.add(self._what)
            print(f"compiling {self._what}, once", file=sys.stderr, flush=True)

    def on_end(self, event: Any) -> None:
        """Nothing is said at the end."""


@contextmanager
def announced(what: str) -> Iterator[None]:
    """Say on stderr, once, if what runs inside has to be compiled because the cache is empty or stale."""
    with event.install_listener("numba:compile", _Announcer(what)):
        yield
