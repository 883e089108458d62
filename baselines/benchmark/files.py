"""Writing results: a file is either the old one or the whole new one, and numbers are text in one way only."""

from __future__ import annotations

import csv
import io
import os
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path

Value = str | int | float | None


def write_bytes(path: Path, content: bytes) -> None:
    """Replace a file in one step, so that a run killed while writing leaves no half of one."""
    partial = path.with_name(f".{path.name}.{os.getpid()}")
    try:
        partial.write_bytes(content)
        partial.replace(path)
    finally:
        partial.unlink(missing_ok=True)


def write_text(path: Path, text: str) -> None:
    """Replace a text file in one step; UTF-8, line ends as given."""
    write_bytes(path, text.encode())


def write_csv(
    path: Path, columns: Sequence[str], records: Iterable[Mapping[str, Value]], digits: int | None = None
) -> None:
    """Write records as CSV with line feeds.

    Args:
        path: File to write or replace.
        columns: Columns in order; every record has each of them. None becomes an empty field.
        records: Rows in order.
        digits: Significant digits of floats; None writes the shortest text that reads back to the same float.
    """
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(columns)
    for record in records:
        writer.writerow([_field(record[column], digits) for column in columns])
    write_text(path, text.getvalue())


def _field(value: Value, digits: int | None) -> str:
    if value is None:
        return ""
    if not isinstance(value, float):
        return str(value)
    return repr(value) if digits is None else f"{value + 0.0:.{digits}g}"
