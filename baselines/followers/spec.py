"""`FollowerSpec`: who drives, as data that a file, a hash and another process can carry."""

from __future__ import annotations

import dataclasses
import json
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

from follow_env.registry import choose

Kind = Literal["classical", "learned", "reference", "own"]
_PARTS = ("perception", "estimator", "controller", "recovery")


@dataclass(frozen=True)
class FollowerSpec:
    """Perception, estimator, controller and recovery, or a policy in their place.

    Each part is a component: a registered name, `"module:object"`, a mapping `{"name": ..., **settings}`, or an object.

    Attributes:
        perception: where the measurement comes from.
        estimator: what filters it.
        controller: what drives by the estimate.
        recovery: what drives while the person is lost; None is the perception's own: `detector` looks, as its tracker
            asks for it, the others leave it to the estimate.
        policy: replaces the four parts: a registered policy, a shipped agent, an agent's or SB3's file, the folder of a
            training, `"module:object"`, or an object with `predict`.
        observation: environment mode that a policy of one's own reads; parts know theirs.
        noise: `NoiseModel` entries that replace what the sensor's settings give.
        label: how tables name it; by default made from the parts.
        kind: what it is, as tables group it; nobody reads this out of the label. `parse` fills it in from the parts.
    """

    perception: Any = "emulated"
    estimator: Any = "akf"
    controller: Any = "pi"
    recovery: Any = None
    policy: Any = None
    observation: str | None = None
    noise: Any = None
    label: str = ""
    kind: Kind = "classical"

    @classmethod
    def parse(cls, value: Any) -> FollowerSpec:
        """Return the specification that a text, a mapping or an object stands for.

        A text is `[PERCEPTION/]ESTIMATOR[+CONTROLLER]` (`"akf"`, `"mask/kf+pi"`, `"emulated/my_lab:ekf+my_lab:lqr"`), a
        registered policy (`"parked"`), a shipped agent (`"ppo-0"`), a file or a folder with an agent, or
        `"module:object"`.

        Raises:
            ValueError: for a text that names nothing; the nearest is named.
        """
        if isinstance(value, FollowerSpec):
            return value
        if isinstance(value, Mapping):
            for key in value:
                choose("follower setting", key, [field.name for field in dataclasses.fields(cls)])
            return cls(**{"kind": _kind_of(value), **value})
        if not isinstance(value, str | Path):
            if not hasattr(value, "predict"):
                raise ValueError(f"follower is {value!r}; expected a text, a mapping, or an object with `predict`")
            return cls(policy=value, kind="own", label=type(value).__name__)
        return _parse_text(str(value))

    @property
    def name(self) -> str:
        """What tables call it."""
        if self.label:
            return self.label
        if self.policy is not None:
            return _short(self.policy)
        parts = f"{_short(self.estimator)} + {_short(self.controller)}"
        parts = parts if self.perception == "emulated" else f"{_short(self.perception)}, {parts}"
        return parts if self.recovery is None else f"{parts}, recovery {_short(self.recovery)}"

    def to_json(self) -> dict[str, Any]:
        """Return the specification as plain data; `parse` makes it again.

        Raises:
            ValueError: for a part given as an object, which JSON cannot carry; give `"module:object"`.
        """
        data = {field.name: getattr(self, field.name) for field in dataclasses.fields(self)}
        try:
            made: dict[str, Any] = json.loads(json.dumps(data))
        except TypeError as error:
            raise ValueError(
                f"the follower {self.name!r} has a part that JSON cannot carry ({error}); expected names, mappings or "
                "'module:object'"
            ) from error
        return made


def _kind_of(parts: Mapping[str, Any]) -> Kind:
    """Return what a follower of these parts is, where nobody says it."""
    from baselines.followers.references import POLICIES

    policy = parts.get("policy")
    if isinstance(policy, Mapping):
        return "reference" if policy.get("name") in POLICIES else "own"
    if policy is not None:
        return FollowerSpec.parse(policy).kind
    names = [part.get("name") if isinstance(part, Mapping) else part for part in map(parts.get, _PARTS)]
    return (
        "own" if any(name is not None and (not isinstance(name, str) or ":" in name) for name in names) else "classical"
    )


def _short(part: Any) -> str:
    if isinstance(part, Mapping):
        settings = ", ".join(f"{key}={value}" for key, value in part.items() if key != "name")
        return f"{_short(part['name'])}({settings})" if settings else _short(part["name"])
    if isinstance(part, str):
        text = part.rpartition(":")[2] if ":" in part else part
        return Path(text).stem if "/" in text else text
    return str(getattr(part, "__name__", type(part).__name__))


def _parse_text(text: str) -> FollowerSpec:
    from baselines.controllers import CONTROLLERS
    from baselines.followers.agents import shipped
    from baselines.followers.perception import PERCEPTIONS
    from baselines.followers.references import POLICIES
    from tracker.estimators.base import ESTIMATORS

    if text.lstrip().startswith("{"):
        try:
            return FollowerSpec.parse(json.loads(text))
        except json.JSONDecodeError as error:
            raise ValueError(f"follower {text!r} is no JSON ({error}); expected a mapping of parts") from error
    if text in POLICIES:
        return FollowerSpec(policy=text, kind="reference")
    if text in shipped():
        return FollowerSpec(policy=text, kind="learned")
    if Path(text).exists():
        return FollowerSpec(policy=text, kind="learned", label=Path(text).resolve().stem)
    if text.startswith((".", "/", "~")) or text.endswith((".zip", ".safetensors")):
        raise ValueError(
            f"follower {text!r} is no file or folder; expected an agent's file, or one that `follow train` wrote"
        )
    perception, _, rest = text.rpartition("/")
    estimator, _, controller = rest.partition("+")
    parts = {"perception": perception or "emulated", "estimator": estimator, "controller": controller or "pi"}
    if ":" in text and not perception and "+" not in text:
        return FollowerSpec(policy=text, kind="own")
    known = {"perception": PERCEPTIONS.names(), "estimator": ESTIMATORS.names(), "controller": CONTROLLERS.names()}
    if not (perception or controller):
        choose("follower", estimator, (*known["estimator"], *POLICIES, *shipped()))
    for what, part in parts.items():
        if ":" not in part:
            choose(what, part, known[what])
    return FollowerSpec(**parts, kind="own" if ":" in text else "classical")
