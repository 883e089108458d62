"""Who sees: from an RGB-D picture to a person, a (bearing, distance) measurement and an estimate of it.

Works on any RGB-D stream, simulated or recorded; knows neither the simulator nor who drives. The public names below are
lent by the modules that hold them.
"""

import importlib
from typing import Any

_PUBLIC = {
    "ESTIMATORS": "tracker.estimators.base",
    "Estimate": "tracker.estimators.base",
    "NoiseModel": "tracker.estimators.base",
    "NoFilter": "tracker.estimators.none",
    "KalmanFilter": "tracker.estimators.kf",
    "AdaptiveKalmanFilter": "tracker.estimators.akf",
    "AugmentedKalmanFilter": "tracker.estimators.akf_cv",
    "PersonTracker": "tracker.person_tracker",
    "TrackerSettings": "tracker.person_tracker",
    "PersonDetector": "tracker.detection.detector",
    "Recording": "tracker.recording",
}


def __getattr__(name: str) -> Any:
    """Return a public name, importing its module when it is first asked for."""
    if name not in _PUBLIC:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(importlib.import_module(_PUBLIC[name]), name)


def __dir__() -> list[str]:
    return sorted({*globals(), *_PUBLIC})
