"""`Policy`: anything that drives, by the signature of Stable-Baselines3's `predict`."""

from __future__ import annotations

from typing import Any, Protocol, runtime_checkable

import numpy as np

from tracker.estimators.base import Estimate, Pair


class Policy(Protocol):
    """Anything that drives: the signature of Stable-Baselines3's `predict`."""

    def predict(
        self,
        observation: Any,
        state: Any = None,
        episode_start: np.ndarray | None = None,
        deterministic: bool = True,
    ) -> tuple[np.ndarray, Any]:
        """Return the action (2,) or (n, 2) in [-1, 1] and the state to hand back with the next observation."""


@runtime_checkable
class Belief(Protocol):
    """A policy's state that tells what it believes: then its estimates are measured too, by eq. (35) of paper B.

    Attributes:
        measurement: latest measurement (bearing rad, distance m), or None when the last step had none.
        estimate: latest estimate, or None while nothing was ever measured.
    """

    measurement: Pair | None
    estimate: Estimate | None
