"""Stands in for `follow_env.config.EnvConfig`, `follow_env.domain.Domain` and motions until those are there."""

import dataclasses
import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from follow_env.config import CameraConfig, RobotConfig, SensorConfig, build, sensor_config
from follow_env.envs.observations import OBSERVATIONS
from follow_env.envs.task import TaskConfig
from follow_env.registry import choose
from follow_env.world.clock import PHYSICS_HZ
from follow_env.world.motion.routes import PAPER_SPEED, check_walking_speed, make_route
from follow_env.world.people.bodies import BODIES, OUTFITS
from follow_env.world.scene import Scene

_SENSOR, _CAMERA, _ROBOT, _TASK = SensorConfig(), CameraConfig(), RobotConfig(), TaskConfig()


@dataclass(frozen=True)
class EnvConfig:
    """Settings of an environment."""

    scene: Any = "corridor"
    obs: str = "measurement"
    action: str = "twist"
    route: Any = "paper"
    sensor: SensorConfig = _SENSOR
    camera: CameraConfig = _CAMERA
    robot: RobotConfig = _ROBOT
    renderer: str = "raster"
    light: str = "normal"
    control_hz: int = 30
    latency_s: float = 0.0
    person: str = "man"
    outfit: str = "blue"
    walking_speed: float = PAPER_SPEED
    engine: str = "bullet"
    task: TaskConfig = _TASK

    @classmethod
    def of(cls, settings: Mapping[str, Any]) -> "EnvConfig":
        """Return the settings of a mapping; a ValueError names what is wrong."""
        values = dict(settings)
        for name in values:
            choose("FollowEnv setting", name, [field.name for field in dataclasses.fields(cls)])
        for name, base in (("camera", CameraConfig()), ("robot", RobotConfig()), ("task", TaskConfig())):
            if not dataclasses.is_dataclass(values.get(name)):
                values[name] = build(name, base, values.get(name))
        if "sensor" in values:
            values["sensor"] = sensor_config(values["sensor"])
        config = cls(**values)
        choose("obs", config.obs, OBSERVATIONS)
        choose("action", config.action, ("twist", "wheels"))
        choose("person", config.person, BODIES)
        choose("outfit", config.outfit, OUTFITS)
        check_walking_speed(config.walking_speed)
        if type(config.control_hz) is not int or config.control_hz <= 0 or PHYSICS_HZ % config.control_hz:
            raise ValueError(f"control_hz is {config.control_hz!r}; expected a whole number that divides {PHYSICS_HZ}")
        if config.latency_s < 0.0 or abs(config.delay * config.dt - config.latency_s) > 1e-6:
            raise ValueError(f"latency_s is {config.latency_s!r}; expected a multiple >= 0 of {config.dt:.4f} s")
        return config

    @property
    def dt(self) -> float:
        """Control period, s."""
        return 1.0 / self.control_hz

    @property
    def substeps(self) -> int:
        """Physics steps in a control period."""
        return PHYSICS_HZ // self.control_hz

    @property
    def delay(self) -> int:
        """Control steps of latency."""
        return round(self.latency_s * self.control_hz)


@dataclass(frozen=True)
class Domain:
    """One configuration."""

    nominal: EnvConfig
    is_fixed: bool = True

    @classmethod
    def of(cls, config: Any, **settings: Any) -> Any:
        """Return the domain of a configuration, a mapping, a domain, or settings."""
        if hasattr(config, "sample"):
            if settings:
                raise ValueError(f"a domain and the settings {', '.join(settings)} are given; put them into the domain")
            return config
        if dataclasses.is_dataclass(config):
            base = {field.name: getattr(config, field.name) for field in dataclasses.fields(config)}
        else:
            base = dict(config or {})
        return cls(EnvConfig.of({**base, **settings}))

    def sample(self, rng: np.random.Generator) -> EnvConfig:
        """Return the configuration of an episode."""
        return self.nominal


def make_motion(
    route: Any, scene: Scene, start: tuple[float, float, float], rng: np.random.Generator, speed: float
) -> Any:
    """Return the motion that a route setting asks for."""
    return route(scene, start, rng, speed) if callable(route) else make_route(route, scene, start, rng, speed)


def motion_table(motion: Any, dt: float) -> np.ndarray:
    """Return `TABLE_COLUMNS` of a motion at times 0, dt, ... until its end, (rows, 5)."""
    times = [k * dt for k in range(math.ceil(motion.duration / dt) + 1)]
    return np.array([(*motion.pose(t), motion.speed(t), motion.walked(t)) for t in times])
