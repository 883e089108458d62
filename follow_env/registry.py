"""`Registry`: components of one kind by name.

A component is an object, a registered name, `"module:object"`, or a mapping `{"name": ..., **settings}` that configures
one. A name is written once: where the component is registered. Own packages register theirs by an entry point of the
group `follow_env.components` whose name is `KIND.NAME`, for example `scene.lab = "my_lab.rooms:lab"`.
"""

from __future__ import annotations

import difflib
import importlib
import importlib.metadata
import pkgutil
from collections.abc import Callable, Iterable, Iterator, Mapping
from typing import Any, Generic, TypeVar

GROUP = "follow_env.components"
"""Entry-point group of components that other packages bring."""

T = TypeVar("T")


def choose(what: str, value: Any, names: Iterable[str]) -> str:
    """Return `value` if it is one of `names`; otherwise raise a ValueError that names the nearest."""
    names = list(names)
    if isinstance(value, str) and value in names:
        return value
    near = difflib.get_close_matches(str(value), names, n=1)
    hint = f"; did you mean {near[0]!r}?" if near else ""
    raise ValueError(f"{what} {value!r} is not known; expected one of {', '.join(map(repr, names))}{hint}")


def load(path: str) -> Any:
    """Return the object that `"module:object"` names (`object` may have dots).

    Raises:
        ValueError: if there is no such module or object in it.
    """
    module, _, attributes = path.partition(":")
    try:
        found: Any = importlib.import_module(module)
        for attribute in attributes.split("."):
            found = getattr(found, attribute)
    except ModuleNotFoundError as error:
        if error.name is None or not (module == error.name or module.startswith(error.name + ".")):
            raise  # the module is there, something that it imports is not
        raise ValueError(f"{path!r} names no module: {error.name!r} cannot be imported; check the spelling") from error
    except AttributeError as error:
        raise ValueError(f"{path!r} names no object: {error}; expected 'module:object'") from error
    return found


class Registry(Generic[T]):
    """Components of one kind.

    Args:
        kind: what they are, as error messages and entry points say it: `"scene"`.
        package: dotted name of the package in whose modules they are registered; it is imported when a name is asked
            for, not before. None if they are all registered where the registry is.

    A component is a callable that makes the object (a function, a class), or the object itself; `build` calls it with
    the settings of the specification and what the caller gives.
    """

    def __init__(self, kind: str, package: str | None = None) -> None:
        self.kind = kind
        self._package = package
        self._components: dict[str, T] = {}
        self._complete = package is None
        self._plugged: dict[str, importlib.metadata.EntryPoint] | None = None

    def register(self, name: str) -> Callable[[T], T]:
        """Return a decorator that registers a component; a name that is taken is a ValueError."""

        def add(component: T) -> T:
            taken = self._components.get(name)
            if taken is not None and getattr(taken, "__module__", None) != "__main__":
                raise ValueError(f"the {self.kind} {name!r} is registered already, as {taken!r}; choose another name")
            self._components[name] = component
            return component

        return add

    def names(self) -> tuple[str, ...]:
        """Return every name, those of other packages last."""
        self._import_all()
        return (*self._components, *(name for name in self._entry_points() if name not in self._components))

    def __contains__(self, name: object) -> bool:
        return isinstance(name, str) and name in self.names()

    def __iter__(self) -> Iterator[str]:
        return iter(self.names())

    def __len__(self) -> int:
        return len(self.names())

    def get(self, name: str) -> T:
        """Return the component that a name or `"module:object"` stands for; a ValueError names the nearest."""
        if isinstance(name, str) and ":" in name:
            return load(name)
        if name not in self._components:
            choose(self.kind, name, self.names())
        if name not in self._components:
            self._components[name] = self._entry_points()[name].load()
        return self._components[name]

    def build(self, spec: Any, *args: Any, **kwargs: Any) -> Any:
        """Return the object of a specification, made with `args`, the specification's settings and `kwargs`.

        An object that is neither a name nor a mapping comes back as it is.

        Raises:
            ValueError: for an unknown name, or settings that the component does not take; one sentence.
        """
        if not isinstance(spec, str | Mapping):
            return spec
        name, settings = self.parts(spec)
        component: Any = self.get(name)
        if not callable(component):
            if settings:
                raise ValueError(f"the {self.kind} {name!r} takes no settings, but got {', '.join(settings)}")
            return component
        try:
            return component(*args, **settings, **kwargs)
        except TypeError as error:
            if settings and "argument" in str(error):
                raise ValueError(f"the {self.kind} {name!r} cannot be made with {settings!r}: {error}") from error
            raise

    def parts(self, spec: str | Mapping[str, Any]) -> tuple[str, dict[str, Any]]:
        """Return name and settings of a specification."""
        if isinstance(spec, str):
            return spec, {}
        if not isinstance(spec.get("name"), str):
            raise ValueError(f"{self.kind} is {dict(spec)!r}; expected the entry 'name' beside its settings")
        return spec["name"], {key: value for key, value in spec.items() if key != "name"}

    def _import_all(self) -> None:
        if self._complete or self._package is None:
            return
        self._complete = True
        package = importlib.import_module(self._package)
        for module in sorted(pkgutil.iter_modules(package.__path__), key=lambda m: m.name):
            importlib.import_module(f"{self._package}.{module.name}")

    def _entry_points(self) -> dict[str, importlib.metadata.EntryPoint]:
        if self._plugged is None:
            prefix = f"{self.kind}."
            found = importlib.metadata.entry_points(group=GROUP)
            self._plugged = {e.name.removeprefix(prefix): e for e in found if e.name.startswith(prefix)}
        return self._plugged
