"""Settings: frozen pydantic dataclasses whose fields declare type, unit and bounds, and one sentence for what is wrong.

`@settings("robot")` makes such a class. A number is declared as `Annotated[Real, Bounds("m", gt=0.0, le=5.0)]`.
"""

from __future__ import annotations

import dataclasses
import math
import numbers
from collections.abc import Callable, Mapping
from typing import Annotated, Any, TypeVar, get_type_hints

import annotated_types
import numpy as np
import pydantic
import pydantic.dataclasses
from pydantic import BeforeValidator, ConfigDict
from typing_extensions import dataclass_transform

from follow_env.registry import choose

T = TypeVar("T")


def _number(value: Any) -> Any:
    """Refuse what is no number (text, truth values, NaN), turn NumPy's scalars into Python's."""
    if isinstance(value, np.generic):
        value = value.item()
    if isinstance(value, bool) or not isinstance(value, numbers.Real) or value != value:
        raise ValueError("no number")
    return value


Real = Annotated[float, BeforeValidator(_number)]
"""A number that is neither NaN nor text nor a truth value; bounds decide whether it may be infinite."""
Whole = Annotated[int, BeforeValidator(_number)]
"""A whole number; 320.0 is one."""


@dataclasses.dataclass(frozen=True)
class Bounds(annotated_types.GroupedMetadata):
    """Unit and physical bounds of a number, as pydantic and the error messages read them.

    Attributes:
        unit: as in the documentation; empty for a plain number.
        gt: lower bound that is not reached.
        ge: lower bound.
        lt: upper bound that is not reached.
        le: upper bound.
    """

    unit: str = ""
    gt: float | None = None
    ge: float | None = None
    lt: float | None = None
    le: float | None = None

    def __iter__(self) -> Any:
        """Give each bound as `annotated_types` has it."""
        made = (
            (annotated_types.Gt, self.gt),
            (annotated_types.Ge, self.ge),
            (annotated_types.Lt, self.lt),
            (annotated_types.Le, self.le),
        )
        return iter([kind(bound) for kind, bound in made if bound is not None])

    def __str__(self) -> str:
        signs = ((">", self.gt), (">=", self.ge), ("<", self.lt), ("<=", self.le))
        return " and ".join(f"{sign} {bound:g}" for sign, bound in signs if bound is not None) + (
            f" ({self.unit})" if self.unit else ""
        )


@dataclass_transform(frozen_default=True, field_specifiers=(dataclasses.field,))
def settings(what: str) -> Callable[[type[T]], type[T]]:
    """Return the decorator that makes a class of settings; `what` names it in error messages.

    Raises (the class, when it is made):
        TypeError: for a keyword that is no setting: Python's wording, and the nearest setting.
        ValueError: for a value of the wrong type or outside its bounds: the value, what was expected.
    """

    def make(cls: type[T]) -> type[T]:
        config = ConfigDict(arbitrary_types_allowed=True)
        made: Any = pydantic.dataclasses.dataclass(frozen=True, config=config)(cls)
        validated = made.__init__
        names = [field.name for field in dataclasses.fields(made)]

        def initialize(self: Any, *args: Any, **kwargs: Any) -> None:
            for name in kwargs:
                if name not in names:
                    choose(f"{what} setting", name, names)
            try:
                validated(self, *args, **kwargs)
            except pydantic.ValidationError as error:
                raise ValueError(_sentence(what, made, error)) from None

        made.__init__ = initialize
        made.settings_name = what
        return made

    return make


def _sentence(what: str, cls: Any, error: pydantic.ValidationError) -> str:
    """Return what is wrong with the first wrong value in one sentence."""
    found = error.errors()[0]
    cause = found.get("ctx", {}).get("error")
    name = str(found["loc"][0]) if found["loc"] else ""
    bounds = bounds_of(cls).get(name)
    if bounds is None or found["type"] == "missing":
        if isinstance(cause, ValueError):
            return str(cause)
        kind = get_type_hints(cls).get(name)
        wanted = "a name, as text" if kind is str else f"{getattr(kind, '__name__', kind)}"
        return f"{what} {name} is {_shown(found['input'])}; expected {wanted}"
    whole = "a whole number" if _is_whole(cls, name) else "a number"
    return f"{what} {name} is {_shown(found['input'])}; expected {whole} {bounds}".rstrip()


def _shown(value: Any) -> str:
    """Return the value as text; whole numbers of thousands of digits are cut."""
    try:
        text = repr(value)
    except ValueError:  # Python refuses to write out an integer of more than 4300 digits
        return f"a whole number of {int(math.log10(abs(value))) + 1} digits"
    return text if len(text) <= 80 else f"{text[:40]}... ({len(text)} characters)"


def bounds_of(cls: Any) -> dict[str, Bounds]:
    """Return the bounds of a settings class's numbers by field name."""
    hints = get_type_hints(cls, include_extras=True)
    found = {}
    for name, hint in hints.items():
        for part in getattr(hint, "__metadata__", ()):
            if isinstance(part, Bounds):
                found[name] = part
    return found


def _is_whole(cls: Any, name: str) -> bool:
    hint = get_type_hints(cls)[name]
    return hint is int


def build(what: str, base: T, data: Any) -> T:
    """Return `base` (a settings object) with the entries of a mapping replaced, nested settings included.

    An object of the same class takes the place of `base`, and None leaves it.

    Raises:
        ValueError: for an unknown key (names the nearest), or a value of the wrong type or outside its bounds.
    """
    if data is None:
        return base
    if isinstance(data, type(base)):
        return data
    if not isinstance(data, Mapping):
        raise ValueError(f"{what} is {data!r}; expected a mapping of settings, for example {{}}")
    changes: dict[str, Any] = {}
    for key, value in data.items():
        choose(f"{what} setting", key, [field.name for field in dataclasses.fields(base)])  # type: ignore[arg-type]
        default = getattr(base, key)
        nested = dataclasses.is_dataclass(default)
        changes[key] = build(f"{what}.{key}", default, value) if nested else value
    return dataclasses.replace(base, **changes)  # type: ignore[type-var]


def to_data(value: Any) -> Any:
    """Return settings as plain data: nested settings as dictionaries, everything else as it is."""
    if dataclasses.is_dataclass(value) and hasattr(value, "settings_name"):
        return {field.name: to_data(getattr(value, field.name)) for field in dataclasses.fields(value)}
    return dict(value) if isinstance(value, Mapping) else value
