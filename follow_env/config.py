"""Settings of the environment: frozen, typed, JSON-able, with units.

Every setting is a frozen dataclass. `build` makes one from plain keyword data (what `gym.make` and a JSON file carry)
and names the nearest key when one is unknown.
"""

import dataclasses
import difflib
import math
import numbers
from collections.abc import Iterable, Mapping
from typing import Any, TypeVar

T = TypeVar("T")


def _require(what: str, settings: Any, names: Iterable[str], above_zero: bool = False) -> None:
    """Raise a ValueError unless each of the settings is finite and >= 0, or > 0 if `above_zero`."""
    for name in names:
        value = getattr(settings, name)
        if not (math.isfinite(value) and (value > 0.0 if above_zero else value >= 0.0)):
            raise ValueError(f"{what} {name} is {value!r}; expected a finite value {'>' if above_zero else '>='} 0")


@dataclasses.dataclass(frozen=True)
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
        camera_forward: camera's optical centre ahead of the axle, m (T_Z = -camera_forward in eq. (29)).
        camera_height: camera above the floor, m.
        hull_radius: radius of the circle around the axle midpoint that contains the chassis, m.
    """

    track_width: float = 0.30
    wheel_radius: float = 0.0625
    max_speed: float = 1.2
    max_yaw_rate: float = 2.0
    max_wheel_speed: float = 1.5
    max_wheel_acceleration: float = 2.0
    wheel_time_constant: float = 0.06
    max_wheel_torque: float = 2.0
    camera_forward: float = 0.10
    camera_height: float = 1.0
    hull_radius: float = 0.25

    def __post_init__(self) -> None:
        if not math.isfinite(self.camera_forward):
            raise ValueError(f"robot camera_forward is {self.camera_forward!r}; expected finite metres")
        _require("robot", self, (f.name for f in dataclasses.fields(self) if f.name != "camera_forward"), True)


@dataclasses.dataclass(frozen=True)
class CameraConfig:
    """A pinhole camera: an Asus Xtion Pro binned to a size that a software renderer can draw.

    Attributes:
        width, height: picture size, px.
        hfov_deg: horizontal field of view, degrees (paper B: 57.5).
        near, far: clipping distances of the renderer, m.
        supersample: 1, or 2 for colours averaged over 2 x 2 rays a pixel; depth and ids are those of a pixel's centre.
    """

    width: int = 320
    height: int = 240
    hfov_deg: float = 57.5
    near: float = 0.1
    far: float = 30.0
    supersample: int = 1

    def __post_init__(self) -> None:
        for name in ("width", "height"):
            value = getattr(self, name)
            if not isinstance(value, int) or not 1 <= value <= 4096:
                raise ValueError(f"camera {name} is {value!r}; expected a whole number of pixels from 1 to 4096")
        if not 1.0 <= self.hfov_deg <= 170.0:
            raise ValueError(f"camera hfov_deg is {self.hfov_deg!r}; expected degrees from 1 to 170")
        if not 0.0 < self.near < self.far < math.inf:
            raise ValueError(
                f"camera near, far are {self.near!r}, {self.far!r}; expected 0 < near < far in metres, finite"
            )
        if self.supersample not in (1, 2):
            raise ValueError(f"camera supersample is {self.supersample!r}; expected 1 or 2")


@dataclasses.dataclass(frozen=True)
class DepthConfig:
    """Errors of a structured-light depth sensor (Xtion/Kinect), applied to the rendered depth.

    Attributes:
        axial_noise: scale on the axial noise 0.0012 + 0.0019 (z - 0.4)^2 m of Nguyen et al. (2012); 0 switches it off.
        disparity_step: quantisation of the disparity, px, at 640 px width (Xtion: 1/8); 0 switches it off.
        baseline: between projector and camera, m.
        min_range, max_range: depth outside is reported as 0 (no reading), m.
        edge_band: pixels at which the depth jumps by more than `edge_jump` within this distance (px) read 0.
        edge_jump: as a share of the depth, at least of 1 m.
    """

    axial_noise: float = 1.0
    disparity_step: float = 0.125
    baseline: float = 0.075
    min_range: float = 0.5
    max_range: float = 8.0
    edge_band: int = 1
    edge_jump: float = 0.15

    def __post_init__(self) -> None:
        _require("depth", self, ("axial_noise", "disparity_step", "min_range", "edge_band", "edge_jump"))
        _require("depth", self, ("baseline",), above_zero=True)
        if not self.min_range < self.max_range:
            raise ValueError(
                f"depth min_range, max_range are {self.min_range!r}, {self.max_range!r}; expected min_range < max_range"
            )


@dataclasses.dataclass(frozen=True)
class BoxConfig:
    """Jitter of the person's bounding box around the tight box of the visible pixels.

    Attributes:
        centre_jitter: standard deviation of the centre's error, as a share of the box's width and height.
        size_jitter: standard deviation of the relative error of width and height.
        correlation_s: time constant of the errors (first-order Gauss-Markov), s; 0 = independent from frame to frame.
        min_pixels: fewer visible pixels than this are not detected.
    """

    centre_jitter: float = 0.03
    size_jitter: float = 0.04
    correlation_s: float = 0.1
    min_pixels: int = 20

    def __post_init__(self) -> None:
        _require("box", self, (field.name for field in dataclasses.fields(self)))


@dataclasses.dataclass(frozen=True)
class MeasurementConfig:
    """What a tracker would report, without rendering (`follow_env.measurement`).

    The defaults are what rendered frames give with paper A's depth rule (`follow calibrate`), rounded.

    Attributes:
        bearing_bias, distance_bias: constant errors, rad and m.
        bearing_noise, distance_noise: standard deviations of the regular errors, rad and m.
        bearing_correlation_s, distance_correlation_s: time constants of the regular errors, s; 0 = white.
        outlier_share: share of the steps in which the distance is an outlier, in [0, 1).
        outlier_duration_s: mean length of a run of outliers, s; 0 = single steps.
        outlier_low, outlier_high: the outlier's size is uniform between the two, m (positive = background).
        miss_share: share of the steps without a measurement although the person is visible, in [0, 1).
    """

    bearing_bias: float = 0.0
    bearing_noise: float = 0.012
    bearing_correlation_s: float = 0.1
    distance_bias: float = -0.105
    distance_noise: float = 0.01
    distance_correlation_s: float = 0.4
    outlier_share: float = 0.0
    outlier_duration_s: float = 0.1
    outlier_low: float = 1.0
    outlier_high: float = 3.0
    miss_share: float = 0.0

    def __post_init__(self) -> None:
        for name in ("outlier_share", "miss_share"):
            value = getattr(self, name)
            if not 0.0 <= value < 1.0:
                raise ValueError(f"measurement {name} is {value!r}; expected a share from 0 to below 1")
        _require("measurement", self, ("bearing_noise", "distance_noise", "outlier_duration_s"))
        _require("measurement", self, ("bearing_correlation_s", "distance_correlation_s"))
        for name in ("bearing_bias", "distance_bias"):
            if not math.isfinite(getattr(self, name)):
                raise ValueError(f"measurement {name} is {getattr(self, name)!r}; expected a finite value")
        if not -math.inf < self.outlier_low <= self.outlier_high < math.inf:
            raise ValueError(
                f"measurement outlier_low, outlier_high are {self.outlier_low!r}, {self.outlier_high!r}; "
                "expected finite metres, low <= high"
            )


@dataclasses.dataclass(frozen=True)
class SensorConfig:
    """All sensor errors: `depth` and `box` act on rendered frames, `measurement` on the `measurement` observation."""

    depth: DepthConfig = DepthConfig()
    box: BoxConfig = BoxConfig()
    measurement: MeasurementConfig = MeasurementConfig()


IDEAL_SENSOR = SensorConfig(
    DepthConfig(axial_noise=0.0, disparity_step=0.0, min_range=0.0, max_range=math.inf, edge_band=0),
    BoxConfig(centre_jitter=0.0, size_jitter=0.0),
    MeasurementConfig(bearing_noise=0.0, distance_bias=0.0, distance_noise=0.0),
)
SENSORS = {"xtion": SensorConfig(), "ideal": IDEAL_SENSOR}
"""Named sensors."""


def choose(what: str, value: Any, names: Iterable[str]) -> str:
    """Return `value` if it is one of `names`; otherwise raise a ValueError that names the nearest."""
    names = list(names)
    if value in names:
        return str(value)
    near = difflib.get_close_matches(str(value), names, n=1)
    hint = f"; did you mean {near[0]!r}?" if near else ""
    raise ValueError(f"{what} {value!r} is not known; expected one of {', '.join(map(repr, names))}{hint}")


def build(what: str, base: T, data: Mapping[str, Any] | None) -> T:
    """Return `base` (a settings dataclass) with the entries of `data` replaced, nested settings included.

    Raises:
        ValueError: for an unknown key (names the nearest) or a value of the wrong type or range.
    """
    if data is None:
        return base
    if not isinstance(data, Mapping):
        raise ValueError(f"{what} is {data!r}; expected a mapping of settings, for example {{}}")
    changes: dict[str, Any] = {}
    for key, value in data.items():
        choose(f"{what} setting", key, [field.name for field in dataclasses.fields(base)])  # type: ignore[arg-type]
        default = getattr(base, key)
        if dataclasses.is_dataclass(default):
            changes[key] = build(f"{what}.{key}", default, value)
            continue
        numeric = isinstance(value, numbers.Real) and not isinstance(value, bool) and not math.isnan(value)
        if not numeric or (isinstance(default, int) and (math.isinf(value) or value != int(value))):
            raise ValueError(f"{what}.{key} is {value!r}; expected a number like the default {default!r}")
        changes[key] = type(default)(value)
    return dataclasses.replace(base, **changes)  # type: ignore[type-var]


def sensor_config(value: str | Mapping[str, Any] | SensorConfig) -> SensorConfig:
    """Return the sensor that `value` names, or the default sensor with the settings of a mapping replaced."""
    if isinstance(value, SensorConfig):
        return value
    if isinstance(value, str):
        return SENSORS[choose("sensor", value, SENSORS)]
    return build("sensor", SensorConfig(), value)
