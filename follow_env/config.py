"""`EnvConfig`, the one record of an environment's settings: frozen, typed, JSON-able, with units and bounds.

The single environment, the batch, the followers and the benchmark read it. `EnvConfig.of` makes one from plain data
(what `gym.make`, a JSON file and another process carry) and names the nearest key when one is unknown.
"""

from __future__ import annotations

import dataclasses
import functools
import math
from collections.abc import Mapping
from typing import Annotated, Any

from follow_env.geometry import CameraMount, Intrinsics
from follow_env.registry import choose
from follow_env.sensors import SensorConfig, sensor_config
from follow_env.settings import Bounds, Real, Whole, build, settings, to_data
from follow_env.world import ENGINES
from follow_env.world.clock import PHYSICS_HZ
from follow_env.world.motion.profile import FASTEST, PAPER_SPEED, SLOWEST

OBSERVATIONS = ("measurement", "state", "rgbd", "rgbd_box", "rgbd_uint8")
ACTIONS = ("twist", "wheels")


@settings("robot.body")
class RobotBody:
    """Sizes and masses of the robot that the engines build: a box on two wheels and a caster, with a mast.

    Attributes:
        chassis_middle: middle of the box ahead of the axle, m.
        chassis_length, chassis_width, chassis_height: of the box, m.
        chassis_low: underside of the box above the floor, m.
        chassis_mass: kg.
        wheel_mass: of each wheel, kg.
        wheel_inertia: of each wheel with its geared motor's reflected inertia, about the axle, kg m^2; its reaction to
            a quick start must not tip the robot.
        caster_offset: of the caster ahead of the box's middle, m.
        caster_radius: m.
        caster_mass: kg.
        mast_offset: of the mast ahead of the box's middle, m.
        mast_radius, mast_height: of the mast, m.
        mast_rise: middle of the mast above the middle of the box, m.
        mast_mass: kg.
    """

    chassis_middle: Annotated[Real, Bounds("m", ge=-2.0, le=2.0)] = -0.05
    chassis_length: Annotated[Real, Bounds("m", gt=0.0, le=4.0)] = 0.30
    chassis_width: Annotated[Real, Bounds("m", gt=0.0, le=4.0)] = 0.22
    chassis_low: Annotated[Real, Bounds("m", gt=0.0, le=1.0)] = 0.05
    chassis_height: Annotated[Real, Bounds("m", gt=0.0, le=2.0)] = 0.10
    chassis_mass: Annotated[Real, Bounds("kg", gt=0.0, le=500.0)] = 8.0
    wheel_mass: Annotated[Real, Bounds("kg", gt=0.0, le=100.0)] = 0.5
    wheel_inertia: Annotated[Real, Bounds("kg m^2", gt=0.0, le=100.0)] = 0.02
    caster_offset: Annotated[Real, Bounds("m", ge=-2.0, le=2.0)] = -0.13
    caster_radius: Annotated[Real, Bounds("m", gt=0.0, le=1.0)] = 0.03
    caster_mass: Annotated[Real, Bounds("kg", gt=0.0, le=100.0)] = 0.2
    mast_offset: Annotated[Real, Bounds("m", ge=-2.0, le=2.0)] = -0.02
    mast_radius: Annotated[Real, Bounds("m", gt=0.0, le=1.0)] = 0.03
    mast_height: Annotated[Real, Bounds("m", gt=0.0, le=3.0)] = 0.80
    mast_rise: Annotated[Real, Bounds("m", ge=0.0, le=3.0)] = 0.46
    mast_mass: Annotated[Real, Bounds("kg", gt=0.0, le=100.0)] = 0.4

    @property
    def chassis_center(self) -> float:
        """Height of the box's middle, m."""
        return self.chassis_low + 0.5 * self.chassis_height


@settings("robot")
class RobotConfig:
    """The differential-drive robot of paper B (section 3): two driven front wheels, one rear caster.

    Attributes:
        track_width: distance d_r between the driven wheels, m.
        wheel_radius: m.
        max_speed: largest |v| an action can ask for, m/s.
        max_yaw_rate: largest |omega| an action can ask for, rad/s.
        max_wheel_speed: rim speed limit of each wheel, m/s.
        max_wheel_acceleration: limit on the change of the rim-speed command, m/s^2.
        wheel_time_constant: first-order response of the wheel servos, s.
        max_wheel_torque: N m.
        camera_forward: camera's optical center ahead of the axle, m (T_Z = -camera_forward in eq. (29)).
        camera_height: camera above the floor, m.
        hull_radius: radius of the circle around the axle midpoint that contains the chassis, m.
        body: sizes and masses.
    """

    track_width: Annotated[Real, Bounds("m", gt=0.0, le=5.0)] = 0.30
    wheel_radius: Annotated[Real, Bounds("m", gt=0.0, le=1.0)] = 0.0625
    max_speed: Annotated[Real, Bounds("m/s", gt=0.0, le=20.0)] = 1.2
    max_yaw_rate: Annotated[Real, Bounds("rad/s", gt=0.0, le=50.0)] = 2.0
    max_wheel_speed: Annotated[Real, Bounds("m/s", gt=0.0, le=20.0)] = 1.5
    max_wheel_acceleration: Annotated[Real, Bounds("m/s^2", gt=0.0, le=1000.0)] = 2.0
    wheel_time_constant: Annotated[Real, Bounds("s", gt=0.0, le=10.0)] = 0.06
    max_wheel_torque: Annotated[Real, Bounds("N m", gt=0.0, le=1000.0)] = 2.0
    camera_forward: Annotated[Real, Bounds("m", ge=-2.0, le=2.0)] = 0.10
    camera_height: Annotated[Real, Bounds("m", gt=0.0, le=3.0)] = 1.0
    hull_radius: Annotated[Real, Bounds("m", gt=0.0, le=2.0)] = 0.25
    body: RobotBody = RobotBody()

    @functools.cached_property
    def mount(self) -> CameraMount:
        """Where the camera sits on the robot."""
        return CameraMount(self.camera_forward, self.camera_height)


@settings("camera")
class CameraConfig:
    """A pinhole camera: an Asus Xtion Pro binned to a size that a software renderer can draw.

    Attributes:
        width, height: picture size, px.
        hfov_deg: horizontal field of view, degrees (paper B: 57.5).
        near, far: clipping distances of the renderer, m.
        supersample: 1, or 2 for colors averaged over 2 x 2 rays a pixel; depth and ids are those of a pixel's center.
    """

    width: Annotated[Whole, Bounds("px", ge=1, le=4096)] = 320
    height: Annotated[Whole, Bounds("px", ge=1, le=4096)] = 240
    hfov_deg: Annotated[Real, Bounds("deg", ge=1.0, le=170.0)] = 57.5
    near: Annotated[Real, Bounds("m", gt=0.0, le=1000.0)] = 0.1
    far: Annotated[Real, Bounds("m", gt=0.0, le=10_000.0)] = 30.0
    supersample: Annotated[Whole, Bounds("", ge=1, le=2)] = 1

    def __post_init__(self) -> None:
        if not self.near < self.far:
            raise ValueError(f"camera near, far are {self.near!r}, {self.far!r}; expected near < far in meters")

    @functools.cached_property
    def intrinsics(self) -> Intrinsics:
        """The pinhole of the pictures."""
        return Intrinsics.from_hfov(self.width, self.height, math.radians(self.hfov_deg))


@settings("task")
class TaskConfig:
    """What is asked of the robot, and what it is worth.

    Attributes:
        set_point: following distance that is rewarded, m (paper B, section 3); the bearing's set point is 0 rad.
        band_near, band_far: in band, the distance lies between these, m ...
        band_bearing: ... and |bearing| is at most this, rad.
        distance_weight, bearing_weight, visible_weight, smoothness_weight: largest value of each reward term.
        collision_cost: what a collision takes off.
        distance_scale, bearing_scale: errors at which half of a term is left, m and rad.
        lost_after: the episode ends when the person was out of view for longer than this, s.
        success_band_share: an episode succeeds without collision, in band for at least this share of its steps ...
        success_out_of_view: ... and with the person never out of view for longer than this, s.
    """

    set_point: Annotated[Real, Bounds("m", ge=0.3, le=10.0)] = 1.5
    band_near: Annotated[Real, Bounds("m", ge=0.0, le=20.0)] = 1.0
    band_far: Annotated[Real, Bounds("m", gt=0.0, le=20.0)] = 2.0
    band_bearing: Annotated[Real, Bounds("rad", gt=0.0, le=math.pi)] = math.radians(30.0)
    distance_weight: Annotated[Real, Bounds("", ge=0.0, le=1000.0)] = 0.4
    bearing_weight: Annotated[Real, Bounds("", ge=0.0, le=1000.0)] = 0.4
    visible_weight: Annotated[Real, Bounds("", ge=0.0, le=1000.0)] = 0.1
    smoothness_weight: Annotated[Real, Bounds("", ge=0.0, le=1000.0)] = 0.1
    collision_cost: Annotated[Real, Bounds("", ge=0.0, le=1_000_000.0)] = 1.0
    distance_scale: Annotated[Real, Bounds("m", gt=0.0, le=100.0)] = 0.5
    bearing_scale: Annotated[Real, Bounds("rad", gt=0.0, le=10.0)] = 0.35
    lost_after: Annotated[Real, Bounds("s", gt=0.0, le=1000.0)] = 5.0
    success_band_share: Annotated[Real, Bounds("", ge=0.0, le=1.0)] = 0.8
    success_out_of_view: Annotated[Real, Bounds("s", ge=0.0, le=1000.0)] = 1.0

    def __post_init__(self) -> None:
        if not self.band_near <= self.set_point <= self.band_far:
            raise ValueError(
                f"task band_near, set_point, band_far are {self.band_near!r}, {self.set_point!r}, {self.band_far!r}; "
                "expected near <= set_point <= far in meters"
            )


@settings("FollowEnv")
class EnvConfig:
    """All settings of an environment.

    Components (scene, route, sensor, robot, outfit) are registered names, mappings `{"name": ..., **settings}` where
    they have settings, `"module:object"`, or objects. What is given as an object is carried to other processes, but is
    not JSON-able: `to_json` refuses it in one sentence.

    Attributes:
        scene: a name (`follow list scenes`), or a `Scene`.
        obs: what the policy observes, one of `OBSERVATIONS`; see `FollowEnv`.
        action: `"twist"` or `"wheels"`.
        route: how the person moves: a name (`follow list routes`), a mapping with the motion's settings, a
            `Motion`, or a function (scene, start, generator, speed) -> `Motion`.
        sensor: errors of the sensors: a name, or a mapping of what differs from `"xtion"` or from its entry `preset`.
        camera: picture size and field of view.
        robot: the robot's size, limits and camera mount.
        renderer: who draws: `"raster"`, `"opengl"`, `"tiny"`, or another registered one.
        light: a name (`follow list lights`).
        control_hz: control and camera rate, Hz; divides 240.
        latency_s: age of what is observed, s; a multiple of the control period.
        person: body of the person (`follow list bodies`).
        outfit: what the person wears: a name (`follow list outfits`), or an `Outfit`.
        walking_speed: of the person between starting and stopping, m/s; a path stays, its times stretch.
        engine: `"bullet"` (PyBullet's physics) or `"kinematic"` (exact arcs, no PyBullet).
        task: set point, band, reward weights, ends and success.
    """

    scene: Any = "corridor"
    obs: str = "measurement"
    action: str = "twist"
    route: Any = "paper"
    sensor: SensorConfig = SensorConfig()
    camera: CameraConfig = CameraConfig()
    robot: RobotConfig = RobotConfig()
    renderer: str = "raster"
    light: str = "normal"
    control_hz: Annotated[Whole, Bounds("Hz", ge=1, le=PHYSICS_HZ)] = 30
    latency_s: Annotated[Real, Bounds("s", ge=0.0, le=10.0)] = 0.0
    person: str = "man"
    outfit: Any = "blue"
    walking_speed: Annotated[Real, Bounds("m/s", ge=SLOWEST, le=FASTEST)] = PAPER_SPEED
    engine: str = "bullet"
    task: TaskConfig = TaskConfig()

    def __post_init__(self) -> None:
        if PHYSICS_HZ % self.control_hz:
            raise ValueError(
                f"control_hz is {self.control_hz!r}; expected a whole number that divides the physics rate "
                f"{PHYSICS_HZ}, for example 30"
            )
        if abs(self.delay * self.dt - self.latency_s) > 1e-6:
            raise ValueError(
                f"latency_s is {self.latency_s!r}; expected a multiple >= 0 of the control period {self.dt:.4f} s"
            )
        choose("obs", self.obs, OBSERVATIONS)
        choose("action", self.action, ACTIONS)
        choose("engine", self.engine, ENGINES)
        choose_components(self)

    @classmethod
    def of(cls, values: EnvConfig | Mapping[str, Any] | None = None, **changes: Any) -> EnvConfig:
        """Return the settings of plain data; nested mappings change the defaults.

        Raises:
            ValueError: for an unknown setting (the nearest is named) or an impossible value, in one sentence.
        """
        base = values if isinstance(values, EnvConfig) else cls()
        if values is not None and not isinstance(values, EnvConfig | Mapping):
            raise ValueError(f"the environment's config is {values!r}; expected an EnvConfig or a mapping of settings")
        wanted = {**(values if isinstance(values, Mapping) else {}), **changes}
        if not wanted:
            return base
        made: dict[str, Any] = {}
        for name, value in wanted.items():
            choose("FollowEnv setting", name, [field.name for field in dataclasses.fields(cls)])
            default = getattr(base, name)
            if name == "sensor":
                made[name] = sensor_config(value, base.sensor)
            elif name == "robot" and isinstance(value, str | Mapping):
                made[name] = robot_config(value, base.robot)
            elif dataclasses.is_dataclass(default) and name in ("camera", "robot", "task"):
                made[name] = build(name, default, value)
            else:
                made[name] = value
        return dataclasses.replace(base, **made)

    def to_json(self) -> dict[str, Any]:
        """Return the settings as plain data; `EnvConfig.of` makes them again.

        Raises:
            ValueError: for a component given as an object, which JSON cannot carry; give `"module:object"`.
        """
        data = to_data(self)
        for name in ("scene", "route", "outfit"):
            if not isinstance(data[name], str | dict):
                raise ValueError(
                    f"{name} is an object, {type(data[name]).__name__}, which JSON cannot carry; expected a registered "
                    "name or 'module:object'"
                )
        return data

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

    @property
    def intrinsics(self) -> Intrinsics:
        """The pinhole of the pictures."""
        return self.camera.intrinsics

    @property
    def mount(self) -> CameraMount:
        """Where the camera sits on the robot."""
        return self.robot.mount


def robot_config(value: str | Mapping[str, Any], base: RobotConfig) -> RobotConfig:
    """Return the robot that `value` names, or `base` with the settings of a mapping replaced.

    A mapping changes `base`, or the robot that its entry `preset` names.
    """
    from follow_env.world.robots import ROBOTS

    if isinstance(value, str):
        if value not in ROBOTS and ":" not in value:
            choose("robot", value, ROBOTS.names())
        return ROBOTS.get(value)
    if "preset" in value:
        base = ROBOTS.get(value["preset"])
    return build("robot", base, {key: setting for key, setting in value.items() if key != "preset"})


def choose_components(config: EnvConfig) -> None:
    """Raise a ValueError that names the nearest for a component's name that nobody registered."""
    from follow_env.camera import RENDERERS
    from follow_env.world.people.bodies import BODIES, OUTFITS, Outfit

    for what, value, registry in (
        ("renderer", config.renderer, RENDERERS),
        ("person", config.person, BODIES),
        ("outfit", config.outfit, OUTFITS),
    ):
        if not isinstance(value, Outfit) and not (isinstance(value, str) and ":" in value):
            choose(what, value, registry)
