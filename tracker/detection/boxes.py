"""`Detection`: a box around a person and how sure the detector is of it."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Detection:
    """One detected person.

    Attributes:
        box: (u0, v0, u1, v1) left, top, right, bottom in px.
        score: Confidence in [0, 1].
    """

    box: tuple[float, float, float, float]
    score: float
