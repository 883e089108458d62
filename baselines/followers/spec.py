"""`FollowerSpec`: who drives, as data that a file, a hash and another process can carry."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Literal

Kind = Literal["classical", "learned", "reference", "own"]


@dataclass(frozen=True)
class FollowerSpec:
    """Perception, estimator, controller and recovery, or a policy in their place.

    Each part is a component: a registered name, `"module:object"`, a mapping `{"name": ..., **settings}`, or an object.

    Attributes:
        perception: where the measurement comes from.
        estimator: what filters it.
        controller: what drives by the estimate.
        recovery: what drives while the person is lost; None stands still.
        policy: replaces the four parts: a registered policy, a shipped agent, an agent's or SB3's file, or an object
            with `predict`.
        label: how tables name it; by default made from the parts.
        kind: what it is, as tables group it; nobody reads this out of the label.
    """

    perception: Any = "emulated"
    estimator: Any = "akf"
    controller: Any = "pi"
    recovery: Any = None
    policy: Any = None
    label: str = ""
    kind: Kind = "classical"
