"""`told`: what plays, as plain data in which equal means that the same episode comes out."""

from __future__ import annotations

import hashlib
import importlib
import pickle
import sys
import sysconfig
import uuid
from collections.abc import Iterator, Mapping
from pathlib import Path
from types import ModuleType
from typing import Any

_OURS = tuple(Path(__file__).resolve().parents[2] / name for name in ("follow_env", "tracker", "baselines"))
_INSTALLED = tuple(Path(sysconfig.get_path(name)).resolve() for name in ("stdlib", "platstdlib", "purelib", "platlib"))
_PROCESS = uuid.uuid4().hex


def told(value: Any) -> Any:
    """Return a value as plain data.

    A `"module:object"`, a class, a function or an object brings the hash of its module's source, and of the modules
    that this one uses, as far as they are the user's; an object also that of its content. An object that cannot be
    pickled is the same as itself only, and in this process only.
    """
    if value is None or isinstance(value, bool | int | float):
        return value
    if isinstance(value, str):
        module = _module_of(value)
        return value if module is None else [value, _source(module)]
    if isinstance(value, Mapping):
        return {str(key): told(part) for key, part in value.items()}
    if isinstance(value, list | tuple):
        return [told(part) for part in value]
    kind = value if isinstance(getattr(value, "__qualname__", None), str) else type(value)
    try:
        content = hashlib.sha256(pickle.dumps(value)).hexdigest()
    except (pickle.PicklingError, TypeError, AttributeError):
        content = f"{_PROCESS} {id(value)}"
    return [f"{kind.__module__}:{kind.__qualname__}", content, _source(sys.modules.get(kind.__module__))]


def content(path: Path) -> str:
    """Return the hash of a file, or of every file below a folder."""
    files = [path] if path.is_file() else sorted(file for file in path.rglob("*") if file.is_file())
    whole = hashlib.sha256()
    for file in files:
        whole.update(file.relative_to(path).as_posix().encode() + b"\0")
        whole.update(hashlib.sha256(file.read_bytes()).digest())
    return whole.hexdigest()


def _module_of(text: str) -> ModuleType | None:
    name, colon, _ = text.partition(":")
    if not colon or not all(part.isidentifier() for part in name.split(".")):
        return None
    try:
        return importlib.import_module(name)
    except ImportError:
        return None


def _source(module: ModuleType | None) -> str:
    whole = hashlib.sha256()
    for file in sorted(set(_files(module, set()))):
        whole.update(hashlib.sha256(file.read_bytes()).digest())
    return whole.hexdigest()


def _files(module: ModuleType | None, seen: set[str]) -> Iterator[Path]:
    """Yield the files of a user's module and of those whose objects it holds; ours are in the hash of a run."""
    file = getattr(module, "__file__", None)
    if module is None or file is None or module.__name__ in seen:
        return
    seen.add(module.__name__)
    path = Path(file).resolve()
    if not path.is_file() or any(path.is_relative_to(folder) for folder in (*_OURS, *_INSTALLED)):
        return
    yield path
    for part in list(vars(module).values()):
        used = part if isinstance(part, ModuleType) else sys.modules.get(str(getattr(part, "__module__", None)))
        yield from _files(used, seen)
