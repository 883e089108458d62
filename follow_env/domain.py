"""`Domain`: settings of which any may be a distribution, drawn anew for every episode.

A distribution stands where its value would stand, as an object or as plain data: `Uniform(0.5, 1.1)` or
`{"uniform": [0.5, 1.1]}`, `LogUniform(0.01, 0.1)` or `{"log_uniform": [0.01, 0.1]}`, `Choice("blue", "red")` or
`{"choice": ["blue", "red"]}`.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np

from follow_env.config import EnvConfig


class Distribution(Protocol):
    """A random setting."""

    @property
    def nominal(self) -> Any:
        """The value that stands for the others where only one can."""

    def sample(self, rng: np.random.Generator) -> Any:
        """Draw a value."""

    def to_json(self) -> dict[str, Any]:
        """Return the distribution as plain data."""


@dataclass(frozen=True)
class Uniform:
    """A number between two, each as likely as the other."""

    low: float
    high: float

    def __post_init__(self) -> None:
        _check_range("uniform", self.low, self.high, -math.inf)

    @property
    def nominal(self) -> float:
        """The middle."""
        return 0.5 * (self.low + self.high)

    def sample(self, rng: np.random.Generator) -> float:
        """Draw a number."""
        return float(rng.uniform(self.low, self.high))

    def to_json(self) -> dict[str, Any]:
        """Return the distribution as plain data."""
        return {"uniform": [self.low, self.high]}


@dataclass(frozen=True)
class LogUniform:
    """A number above 0 whose logarithm is uniform: each doubling as likely as the other."""

    low: float
    high: float

    def __post_init__(self) -> None:
        _check_range("log_uniform", self.low, self.high, 0.0)

    @property
    def nominal(self) -> float:
        """The geometric mean."""
        return math.sqrt(self.low * self.high)

    def sample(self, rng: np.random.Generator) -> float:
        """Draw a number."""
        return self.low * math.exp(float(rng.random()) * math.log(self.high / self.low))

    def to_json(self) -> dict[str, Any]:
        """Return the distribution as plain data."""
        return {"log_uniform": [self.low, self.high]}


class Choice:
    """One of several values, each as likely as the other."""

    def __init__(self, *values: Any) -> None:
        if not values:
            raise ValueError("a choice of nothing was given; expected at least one value")
        self.values = values

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Choice) and self.values == other.values

    def __hash__(self) -> int:
        return hash(("choice", len(self.values)))

    def __repr__(self) -> str:
        return f"Choice({', '.join(map(repr, self.values))})"

    @property
    def nominal(self) -> Any:
        """The first."""
        return self.values[0]

    def sample(self, rng: np.random.Generator) -> Any:
        """Draw a value."""
        return self.values[int(rng.integers(len(self.values)))]

    def to_json(self) -> dict[str, Any]:
        """Return the distribution as plain data."""
        return {"choice": list(self.values)}


_KINDS: dict[str, Callable[..., Distribution]] = {"uniform": Uniform, "log_uniform": LogUniform, "choice": Choice}


class Domain:
    """Settings of an environment, fixed or drawn.

    Args:
        settings: as `EnvConfig.of` takes them; any value, nested ones too, may be a distribution.
        base: what they change; by default an environment as it comes.

    Attributes:
        nominal: the settings with each distribution's nominal value.
        is_fixed: whether nothing is drawn.

    Raises:
        ValueError: for unknown settings, or nominal values that cannot be.
    """

    def __init__(self, settings: Mapping[str, Any] | None = None, base: EnvConfig | None = None) -> None:
        self._base = base or EnvConfig()
        self._settings: dict[str, Any] = {name: _parsed(value) for name, value in (settings or {}).items()}
        self._paths = tuple(sorted(_paths(self._settings, ())))
        self.nominal = EnvConfig.of(self._base, **_replaced(self._settings, lambda random: random.nominal))
        self.is_fixed = not self._paths

    @classmethod
    def of(cls, config: Any = None, **settings: Any) -> Domain:
        """Return the domain of a configuration, a mapping or another domain, with settings replaced.

        A domain of one's own, an object with `nominal`, `is_fixed` and `sample(rng)`, comes back as it is.
        """
        if hasattr(config, "sample") and not isinstance(config, Domain):
            if settings:
                raise ValueError(f"a domain and the settings {', '.join(settings)} are given; put them into the domain")
            return config
        if isinstance(config, Domain):
            return cls({**config._settings, **settings}, config._base) if settings else config
        if isinstance(config, EnvConfig):
            return cls(settings, config)
        if config is not None and not isinstance(config, Mapping):
            raise ValueError(
                f"config is {config!r}; expected an EnvConfig, a Domain, or a mapping of settings; a single "
                "setting goes by its name, as in FollowEnv(scene='corridor')"
            )
        return cls({**(config or {}), **settings})

    def sample(self, rng: np.random.Generator) -> EnvConfig:
        """Return the settings of an episode; the draws are made in the order of the settings' names."""
        if self.is_fixed:
            return self.nominal
        drawn = {path: _at(self._settings, path).sample(rng) for path in self._paths}
        return EnvConfig.of(self._base, **_filled(self._settings, (), drawn))

    def to_json(self) -> dict[str, Any]:
        """Return the settings as plain data, distributions included."""
        return {**self.nominal.to_json(), **_replaced(self._settings, lambda random: random.to_json())}


def _check_range(kind: str, low: Any, high: Any, above: float) -> None:
    numbers = all(isinstance(v, int | float) and not isinstance(v, bool) and math.isfinite(v) for v in (low, high))
    if not numbers or not above < low <= high:
        floor = "" if above == -math.inf else f"{above:g} < "
        raise ValueError(f"{kind} is [{low!r}, {high!r}]; expected finite numbers {floor}low <= high")


def is_distribution(value: Any) -> bool:
    """Whether a setting is drawn."""
    return hasattr(value, "sample") and hasattr(value, "nominal")


def _parsed(value: Any) -> Any:
    """Return a setting with plain data of distributions made into objects."""
    if not isinstance(value, Mapping):
        return value
    if len(value) == 1 and (kind := next(iter(value))) in _KINDS:
        numbers = value[kind]
        if not isinstance(numbers, list | tuple) or (kind != "choice" and len(numbers) != 2):
            raise ValueError(f"{kind} is {numbers!r}; expected a list of {'values' if kind == 'choice' else 'two'}")
        return _KINDS[kind](*numbers)
    return {key: _parsed(part) for key, part in value.items()}


def _paths(value: Any, path: tuple[str, ...]) -> list[tuple[str, ...]]:
    if is_distribution(value):
        return [path]
    if isinstance(value, Mapping):
        return [found for key, part in value.items() for found in _paths(part, (*path, str(key)))]
    return []


def _at(value: Any, path: tuple[str, ...]) -> Any:
    for key in path:
        value = value[key]
    return value


def _filled(value: Any, path: tuple[str, ...], drawn: Mapping[tuple[str, ...], Any]) -> Any:
    if path in drawn:
        return drawn[path]
    if isinstance(value, Mapping):
        return {key: _filled(part, (*path, str(key)), drawn) for key, part in value.items()}
    return value


def _replaced(value: Any, change: Callable[[Any], Any]) -> Any:
    if is_distribution(value):
        return change(value)
    if isinstance(value, Mapping):
        return {key: _replaced(part, change) for key, part in value.items()}
    return value
