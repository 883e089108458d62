"""A Gymnasium environment in which a differential-drive robot with an RGB-D camera follows a walking person.

Importing this package registers the environment ids and does nothing else: engines, renderers and compiled code are
loaded when something is made. The public names below are lent by the modules that hold them.
"""

import importlib
from typing import Any

from gymnasium.envs.registration import register

__version__ = "0.2.0"

IDS = {"corridor": "follow_env/Corridor-v0", "indoor": "follow_env/Indoor-v0"}
"""Scene name -> environment id."""

for _scene, _id in IDS.items():
    register(
        _id,
        entry_point="follow_env.envs.follow:FollowEnv",
        vector_entry_point="follow_env.envs.batch:FollowVectorEnv",
        kwargs={"scene": _scene},
    )

_PUBLIC = {
    "FollowEnv": "follow_env.envs.follow",
    "FollowVectorEnv": "follow_env.envs.batch",
    "EnvConfig": "follow_env.config",
    "RobotConfig": "follow_env.config",
    "CameraConfig": "follow_env.config",
    "TaskConfig": "follow_env.config",
    "SensorConfig": "follow_env.sensors",
    "Domain": "follow_env.domain",
    "Uniform": "follow_env.domain",
    "LogUniform": "follow_env.domain",
    "Choice": "follow_env.domain",
    "Scene": "follow_env.world.scene",
    "SCENES": "follow_env.world.scenes",
    "MOTIONS": "follow_env.world.motion.base",
    "ROBOTS": "follow_env.world.robots",
}


def __getattr__(name: str) -> Any:
    """Return a public name, importing its module when it is first asked for."""
    if name not in _PUBLIC:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(importlib.import_module(_PUBLIC[name]), name)


def __dir__() -> list[str]:
    return sorted({*globals(), *_PUBLIC})
