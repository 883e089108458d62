"""`SB3Policy`: a Stable-Baselines3 zip as a follower; it needs the extra `learn`."""

from __future__ import annotations

import json
import zipfile
from pathlib import Path
from typing import Any

import numpy as np

from follow_env.registry import choose

ALGORITHMS = ("PPO", "SAC", "A2C", "TD3", "DDPG", "RecurrentPPO", "TQC")
"""Classes of Stable-Baselines3 and sb3-contrib that have continuous actions."""


class SB3Policy:
    """A model that `model.save` wrote, driven in one process without its training environment.

    Args:
        path: the zip.
        algorithm: class of the model; by default told from what the zip says of its policy.

    Raises:
        ValueError: if the file is no model of Stable-Baselines3.
        ImportError: without the extra `learn`.
    """

    def __init__(self, path: str | Path, algorithm: str | None = None) -> None:
        name = choose("algorithm", algorithm, ALGORITHMS) if algorithm else _algorithm_of(Path(path))
        self.name = Path(path).stem
        self._model = _load(name, Path(path))

    @property
    def observation_space(self) -> Any:
        """What the model was trained on."""
        return self._model.observation_space

    @property
    def observation(self) -> str | None:
        """The environment's observation mode that it reads; None for eight numbers, which two modes have."""
        settings = self.observation_settings
        return settings["obs"] if "camera" in settings else None

    @property
    def observation_settings(self) -> dict[str, Any]:
        """Settings of an environment whose observations it reads, told from its observation space.

        Eight numbers are taken for `measurement`: a model of `state` needs `observation="state"` in its specification.
        """
        space = self.observation_space
        shape = space["depth"].shape if hasattr(space, "keys") and "depth" in space.keys() else space.shape  # noqa: SIM118
        if shape is not None and len(shape) == 2:
            mode = "rgbd_box" if "box" in space.keys() else "rgbd"  # noqa: SIM118 (not a mapping)
            return {"obs": mode, "camera": {"height": shape[0], "width": shape[1]}}
        if shape is not None and len(shape) == 3:
            height, width = shape[1:] if shape[0] == 4 else shape[:2]  # SB3 puts the channels first
            return {"obs": "rgbd_uint8", "camera": {"height": height, "width": width}}
        return {"obs": "measurement"}

    def predict(
        self,
        observation: Any,
        state: Any = None,
        episode_start: np.ndarray | None = None,
        deterministic: bool = True,
    ) -> tuple[np.ndarray, Any]:
        """Return (action, state) of the model."""
        action, state = self._model.predict(observation, state, episode_start, deterministic)
        return np.asarray(action), state


def _algorithm_of(path: Path) -> str:
    try:
        with zipfile.ZipFile(path) as archive:
            data = json.loads(archive.read("data"))
    except (OSError, KeyError, ValueError, zipfile.BadZipFile) as error:
        raise ValueError(
            f"{path} is no model of Stable-Baselines3 ({error}); expected what model.save wrote"
        ) from error
    if "recurrent" in str(data.get("policy_class", {}).get("__module__", "")):
        return "RecurrentPPO"
    if "top_quantiles_to_drop_per_net" in data:
        return "TQC"
    if "ent_coef_optimizer" in data or "target_entropy" in data:
        return "SAC"
    if "clip_range" in data:
        return "PPO"
    if "policy_delay" in data:
        return "TD3" if data["policy_delay"] > 1 else "DDPG"
    return "A2C"


def _load(name: str, path: Path) -> Any:
    try:
        import stable_baselines3

        package: Any = stable_baselines3
        if name in ("RecurrentPPO", "TQC"):
            import sb3_contrib

            package = sb3_contrib
    except ImportError as error:
        raise ImportError(
            f"{path.name} is a model of Stable-Baselines3, which is not installed; run `pip install follow-env[learn]`"
        ) from error
    return getattr(package, name).load(path, device="cpu")
