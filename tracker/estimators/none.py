"""Paper B's "No filter"."""

from __future__ import annotations

from tracker.estimators.base import (
    ESTIMATORS,
    MEASUREMENT,
    Action,
    Estimate,
    NoiseModel,
    Pair,
    checked_motion,
    finite_pair,
)


class NoFilter:
    """Paper B's "No filter": the estimate is the measurement.

    On a miss the last estimate stands, with action "miss". It is this estimator that holds it: a measurement itself is
    never held. Variances are reported as 0, since nothing is modelled.
    """

    __slots__ = ("_last",)

    def __init__(self) -> None:
        self._last: Pair | None = None

    def reset(self) -> None:
        """Forget the target."""
        self._last = None

    def predict(self, twist: Pair, dt: float) -> None:
        """Check the arguments; nothing is predicted."""
        checked_motion(twist, dt)

    def update(self, measurement: Pair | None) -> Estimate | None:
        """Return the measurement, or the last one on a miss."""
        if measurement is not None:
            self._last = finite_pair(MEASUREMENT, measurement)
        if self._last is None:
            return None
        action: Action = "miss" if measurement is None else "accept"
        return Estimate(*self._last, (0.0, 0.0), (0.0, 0.0), (0.0, 0.0), (1.0, 1.0), (action, action))


@ESTIMATORS.register("none")
def no_filter(noise: NoiseModel) -> NoFilter:
    """Return the estimator that filters nothing."""
    return NoFilter()
