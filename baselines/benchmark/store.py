"""The store of finished episodes: an SQLite file in which an episode is one transaction.

A run that is killed at any point keeps every episode that was finished, and none is counted twice: cell and seed are
the primary key. The rollback journal with full synchronization also survives a power cut, works on network folders,
and lets several processes write to one store.
"""

from __future__ import annotations

import sqlite3
import zlib
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Protocol, TypeVar

from baselines.benchmark.executors.processes import Keyed
from baselines.benchmark.player import Episode

FILE_NAME = "episodes.sqlite"
_APPLICATION = 0x666F6C77  # "folw": tells our files from other programs' databases
_SCHEMA = """
CREATE TABLE configuration (sha256 TEXT NOT NULL);
CREATE TABLE episode (
    cell TEXT NOT NULL,
    seed INTEGER NOT NULL,
    row TEXT NOT NULL,
    curve BLOB NOT NULL,
    timing TEXT NOT NULL,
    checksum INTEGER NOT NULL,
    PRIMARY KEY (cell, seed)
);
"""
_EPISODES_AS_BYTES = """
SELECT CAST(cell AS BLOB), seed, CAST(row AS BLOB), curve, CAST(timing AS BLOB), checksum FROM episode
"""
_LOCK_PATIENCE = 60.0
_Packed = TypeVar("_Packed", bound="Packable")


class Packable(Protocol):
    """A result that the store can keep: three parts, of which any may be empty."""

    def pack(self) -> tuple[str, bytes, str]:
        """Row, curve and timing."""

    @classmethod
    def unpack(cls: type[_Packed], row: str, curve: bytes, timing: str) -> _Packed:
        """The result of which these are the parts, exactly as it was packed."""


class InputError(ValueError):
    """What the user asked for cannot be done; the message is one sentence with the remedy."""


class Store:
    """Finished episodes of one configuration in one folder; a context manager that closes the file.

    Args:
        folder: Existing folder that holds the file, or will.
        configuration: Hash of the settings that made the episodes.

    Raises:
        InputError: If the file is damaged, is not such a store, cannot be written, or holds episodes of another
            configuration. It is left as it was.
    """

    def __init__(self, folder: Path, configuration: str) -> None:
        self._path = folder / FILE_NAME
        with self._explained():
            self._connection = sqlite3.connect(self._path, timeout=_LOCK_PATIENCE, isolation_level=None)
        try:
            with self._explained():
                self._check()
                self._prepare(configuration)
        except BaseException:
            self._connection.close()
            raise

    def __enter__(self) -> Store:
        return self

    def __exit__(self, *_: object) -> None:
        self._connection.close()

    def __len__(self) -> int:
        """Number of finished episodes."""
        with self._explained():
            return int(self._connection.execute("SELECT count(*) FROM episode").fetchone()[0])

    def finished(self) -> set[tuple[str, int]]:
        """Cell keys and seeds of the finished episodes."""
        with self._explained():
            return set(self._connection.execute("SELECT cell, seed FROM episode"))

    def add(self, cell: Keyed, seed: int, episode: Packable) -> None:
        """Keep an episode, in a transaction of its own; one that is there already stays as it is.

        Raises:
            InputError: If the file cannot be written.
        """
        row, curve, timing = episode.pack()
        checksum = _sum(cell.key.encode(), seed, row.encode(), curve, timing.encode())
        with self._explained():
            self._connection.execute(
                "INSERT OR IGNORE INTO episode VALUES (?, ?, ?, ?, ?, ?)",
                (cell.key, seed, row, curve, timing, checksum),
            )

    def episode(self, cell: Keyed, seed: int) -> Episode:
        """The finished episode of a cell and seed, exactly as it was added; a KeyError if it is not there."""
        return self.result(cell, seed, Episode)

    def result(self, cell: Keyed, seed: int, kind: type[_Packed]) -> _Packed:
        """The finished result of a kind, exactly as it was added.

        Raises:
            KeyError: If it is not there.
        """
        with self._explained():
            found = self._connection.execute(
                "SELECT row, curve, timing FROM episode WHERE cell = ? AND seed = ?", (cell.key, seed)
            ).fetchone()
        if found is None:
            raise KeyError(f"no episode of {cell.key} with seed {seed}")
        return kind.unpack(*found)

    def _check(self) -> None:
        """Refuse a file that is damaged or another program's, before anything is written to it and any work is done."""
        with self._transaction("BEGIN"):
            problems = [text for (text,) in self._connection.execute("PRAGMA integrity_check(1)")]
            if problems != ["ok"]:
                raise self._damaged(problems[0])
            if self._is_ours():
                for *values, checksum in self._connection.execute(_EPISODES_AS_BYTES):
                    if _sum(*values) != checksum:
                        raise self._damaged("an episode has changed since it was written")
            elif self._connection.execute("SELECT count(*) FROM sqlite_master").fetchone()[0]:
                raise InputError(
                    f"{self._path} is a database of another program; it was left as it is: "
                    "choose another folder with --out."
                )

    def _prepare(self, configuration: str) -> None:
        """Create what is missing, compare the configuration, and see that the file can be written."""
        self._connection.execute("PRAGMA synchronous = FULL")
        with self._transaction("BEGIN IMMEDIATE"):
            if not self._is_ours():
                for statement in filter(str.strip, _SCHEMA.split(";")):
                    self._connection.execute(statement)
                self._connection.execute("INSERT INTO configuration VALUES (?)", (configuration,))
                self._connection.execute(f"PRAGMA application_id = {_APPLICATION}")
            found = self._connection.execute("SELECT sha256 FROM configuration").fetchone()
            if found is None:
                raise self._damaged("its configuration is missing")
            (stored,) = found
            if stored != configuration and len(self):
                raise InputError(
                    f"{self._path.parent} holds {len(self)} episodes of another configuration or version of the code "
                    f"({stored[:12]}, this one is {configuration[:12]}): choose another folder with --out."
                )
            self._connection.execute("UPDATE configuration SET sha256 = ?", (configuration,))

    @contextmanager
    def _transaction(self, begin: str) -> Iterator[None]:
        self._connection.execute(begin)
        try:
            yield
        except BaseException:
            if self._connection.in_transaction:  # SQLite itself rolls back when the disk is full
                self._connection.execute("ROLLBACK")
            raise
        self._connection.execute("COMMIT")

    def _is_ours(self) -> bool:
        return bool(self._connection.execute("PRAGMA application_id").fetchone()[0] == _APPLICATION)

    @contextmanager
    def _explained(self) -> Iterator[None]:
        """Turn SQLite's errors into sentences with a remedy."""
        try:
            yield
        except sqlite3.OperationalError as error:
            raise InputError(
                f"{self._path} cannot be used ({error}): make the folder writable and its disk free, "
                "or choose another with --out."
            ) from error
        except sqlite3.DatabaseError as error:
            raise self._damaged(str(error)) from error

    def _damaged(self, what: str) -> InputError:
        return InputError(
            f"{self._path} is damaged ({' '.join(what.split())}); it was left as it is: "
            "put back an intact copy, or choose another folder with --out."
        )


def _sum(cell: bytes, seed: int, row: bytes, curve: bytes, timing: bytes) -> int:
    return zlib.crc32(b"\n".join((cell, str(seed).encode(), row, timing, curve)))
