"""`Suite`: scenarios that belong together, and what is measured in them."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Any

from baselines.benchmark.trial import Scenario
from follow_env.registry import Registry

FOLLOWING = (
    *("success", "distance_tracking_rmse_m", "angle_tracking_rmse_rad", "rms_jerk_m_s3", "distance_tracking_bias_m"),
    *("lost", "collided", "min_surface_distance_m", "angle_rmse_rad", "distance_rmse_m", "episode_return"),
)
"""Metrics of a suite that names none."""


@dataclass(frozen=True)
class Suite:
    """Scenarios, each with a name of its own.

    Attributes:
        name: of the suite.
        scenarios: in the order of its tables.
        metrics: columns of its tables, names of `METRICS` or `"module:object"`.
        card: what it asks.

    Raises:
        ValueError: for no scenarios, or two of one name.
    """

    name: str
    scenarios: tuple[Scenario, ...]
    metrics: tuple[str, ...] = FOLLOWING
    card: str = ""

    def __post_init__(self) -> None:
        names = [scenario.name for scenario in self.scenarios]
        if not names or len(set(names)) < len(names):
            raise ValueError(f"the suite {self.name!r} has the scenarios {names}; expected at least one, names apart")

    def only(self, names: Iterable[str]) -> Suite:
        """Return the suite with some of its scenarios; a ValueError names the nearest to an unknown one."""
        from dataclasses import replace

        from follow_env.registry import choose

        known = {scenario.name: scenario for scenario in self.scenarios}
        return replace(self, scenarios=tuple(known[choose("scenario", name, known)] for name in names))


SUITES: Registry[Callable[[], Suite] | Suite] = Registry("suite", "baselines.suites")
"""Suites, or functions that make one."""


def find_suite(suite: Any) -> Suite:
    """Return a suite by its name, by `"module:object"`, or as it is."""
    found = suite if isinstance(suite, Suite) else SUITES.get(suite)
    made = found if isinstance(found, Suite) else found()
    if not isinstance(made, Suite):
        raise ValueError(f"suite {suite!r} is {type(made).__name__}; expected a Suite, or a function that returns one")
    return made
