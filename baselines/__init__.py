"""Who drives: policies, controllers, learned agents, the benchmark and the command line.

The public names below are lent by the modules that hold them.
"""

import importlib
from typing import Any

_PUBLIC = {
    "FollowerSpec": "baselines.followers.spec",
    "build_follower": "baselines.followers.build",
    "observation_settings": "baselines.followers.build",
    "load_agent": "baselines.followers.agents",
    "CONTROLLERS": "baselines.controllers",
    "PIController": "baselines.controllers.pi",
    "Scenario": "baselines.benchmark.trial",
    "Suite": "baselines.benchmark.suite",
    "Trace": "baselines.benchmark.trace",
    "rollout": "baselines.benchmark.rollout",
    "evaluate": "baselines.benchmark.evaluate",
    "compare": "baselines.benchmark.evaluate",
}


def __getattr__(name: str) -> Any:
    """Return a public name, importing its module when it is first asked for."""
    if name not in _PUBLIC:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(importlib.import_module(_PUBLIC[name]), name)


def __dir__() -> list[str]:
    return sorted({*globals(), *_PUBLIC})
