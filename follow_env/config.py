"""Settings of the environment: frozen, typed, JSON-able, with units.

Every setting is a frozen dataclass. `build` makes one from plain keyword data (what `gym.make` and a JSON file carry)
and names the nearest key when one is unknown.
"""

import dataclasses
import math
import numbers
from collections.abc import Iterable, Mapping
from typing import Any, TypeVar

from follow_env.registry import choose

T = TypeVar("T")


def _require(what: str, settings: Any, names: Iterable[str], above_zero: bool = False) -> None:
    """Raise a ValueError unless each of the settings is finite and >= 0, or > 0 if `above_zero`."""
    for name in names:
        value = getattr(settings, name)
        if not (math.isfinite(value) and (value > 0.0 if above_zero else value >= 0.0)):
            raise ValueError(f"{what} {name} is {value!r}; expected a finite value {'>' if above_zero else '>='} 0")


def _require_shares(what: str, settings: Any, names: Iterable[str]) -> None:
    """Raise a ValueError unless each of the settings is from 0 to 1."""
    for name in names:
        value = getattr(settings, name)
        if not 0.0 <= value <= 1.0:
            raise ValueError(f"{what} {name} is {value!r}; expected a share from 0 to 1")


def _require_share_below_one(what: str, settings: Any, names: Iterable[str]) -> None:
    """Raise a ValueError unless each of the settings is from 0 to below 1."""
    for name in names:
        value = getattr(settings, name)
        if not 0.0 <= value < 1.0:
            raise ValueError(f"{what} {name} is {value!r}; expected a share from 0 to below 1")


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
        camera_forward: camera's optical center ahead of the axle, m (T_Z = -camera_forward in eq. (29)).
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
            raise ValueError(f"robot camera_forward is {self.camera_forward!r}; expected finite meters")
        _require("robot", self, (f.name for f in dataclasses.fields(self) if f.name != "camera_forward"), True)


@dataclasses.dataclass(frozen=True)
class CameraConfig:
    """A pinhole camera: an Asus Xtion Pro binned to a size that a software renderer can draw.

    Attributes:
        width, height: picture size, px.
        hfov_deg: horizontal field of view, degrees (paper B: 57.5).
        near, far: clipping distances of the renderer, m.
        supersample: 1, or 2 for colors averaged over 2 x 2 rays a pixel; depth and ids are those of a pixel's center.
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
                f"camera near, far are {self.near!r}, {self.far!r}; expected 0 < near < far in meters, finite"
            )
        if self.supersample not in (1, 2):
            raise ValueError(f"camera supersample is {self.supersample!r}; expected 1 or 2")


@dataclasses.dataclass(frozen=True)
class DepthConfig:
    """Errors of a structured-light depth sensor (Xtion/Kinect), applied to the rendered depth.

    The formulas are in `camera.sensor.errors.RGBDSensor`. The defaults: noise as measured by Nguyen et al. (2012,
    Kinect) for surfaces that face the camera; eighths of a pixel of disparity, 75 mm and the loss of the projector's
    shadow as in Khoshelham and Elberink (2012, Kinect); 0.5 m because an Xtion returns nothing nearer, 8 m because it
    quantizes to 0.2 m there. The shares lost at edges, on dark and on grazing surfaces are stated, not measured.

    Attributes:
        axial_noise: scale on the axial noise 0.0012 + 0.0019 (z - 0.4)^2 m of Nguyen et al. (2012); 0 switches it off.
        lateral_noise: standard deviation on each axis of the place that a pixel's depth is taken from, px at 640 px
            width (Nguyen et al.: 0.8 when facing, 0.9 at 60 degrees).
        disparity_step: quantization of the disparity, px, at 640 px width (Xtion: 1/8); 0 switches it off.
        baseline: between projector and camera, m.
        min_range, max_range: depth outside is reported as 0 (no reading), m.
        edge_band: a pixel is at an edge if the depth within this distance (px of the picture) jumps by more than
            `edge_jump`.
        edge_jump: as a share of the depth, at least of 1 m.
        edge_holes: share of the pixels at an edge that read 0.
        edge_flying: share of the pixels at an edge that read a depth between foreground and background.
        shadow: share of the pixels lost where something hides the surface from the projector.
        dark_level: luminance below which readings get lost, gray levels.
        dark_dropout: share lost at luminance 0; falls linearly to 0 at `dark_level`.
        grazing_deg: angle between ray and surface normal above which readings get lost, degrees.
        grazing_dropout: share lost at 90 degrees; falls to 0 at `grazing_deg`, linearly in the cosine.
    """

    axial_noise: float = 1.0
    lateral_noise: float = 0.8
    disparity_step: float = 0.125
    baseline: float = 0.075
    min_range: float = 0.5
    max_range: float = 8.0
    edge_band: int = 1
    edge_jump: float = 0.15
    edge_holes: float = 0.5
    edge_flying: float = 0.1
    shadow: float = 1.0
    dark_level: float = 40.0
    dark_dropout: float = 0.5
    grazing_deg: float = 75.0
    grazing_dropout: float = 1.0

    def __post_init__(self) -> None:
        _require("depth", self, ("axial_noise", "lateral_noise", "disparity_step", "min_range"))
        _require("depth", self, ("edge_band", "edge_jump"))
        _require("depth", self, ("baseline", "dark_level"), above_zero=True)
        _require_shares("depth", self, ("edge_holes", "edge_flying", "shadow", "dark_dropout", "grazing_dropout"))
        if self.edge_holes + self.edge_flying > 1.0:
            raise ValueError(
                f"depth edge_holes, edge_flying are {self.edge_holes!r}, {self.edge_flying!r}; expected a sum up to 1"
            )
        if not 0.0 <= self.grazing_deg < 90.0:
            raise ValueError(f"depth grazing_deg is {self.grazing_deg!r}; expected degrees from 0 to below 90")
        if not self.min_range < self.max_range:
            raise ValueError(
                f"depth min_range, max_range are {self.min_range!r}, {self.max_range!r}; expected min_range < max_range"
            )


@dataclasses.dataclass(frozen=True)
class ColorConfig:
    """Errors of the color camera, applied to the rendered picture.

    The defaults are those of a small webcam sensor in a lit room: stated, not measured.

    Attributes:
        read_noise: standard deviation of the noise in the dark, gray levels.
        shot_noise: standard deviation of the noise that grows with the root of the light, gray levels at level 1.
        blur: standard deviation of the Gaussian blur, px at 640 px width.
        gain: exposure; what exceeds 255 is cut.
    """

    read_noise: float = 1.0
    shot_noise: float = 0.12
    blur: float = 0.6
    gain: float = 1.0

    def __post_init__(self) -> None:
        _require("color", self, (field.name for field in dataclasses.fields(self)))
        if self.blur > 50.0:
            raise ValueError(f"color blur is {self.blur!r}; expected up to 50 px")


@dataclasses.dataclass(frozen=True)
class FrameConfig:
    """Loss of whole frames on the way from the camera.

    Attributes:
        drop_share: share of the frames that never arrive, in [0, 1); the first of an episode always does.
    """

    drop_share: float = 0.0

    def __post_init__(self) -> None:
        _require_share_below_one("frames", self, ("drop_share",))


@dataclasses.dataclass(frozen=True)
class BoxConfig:
    """Jitter of the person's bounding box around the tight box of the visible pixels.

    Attributes:
        center_jitter: standard deviation of the center's error, as a share of the box's width and height.
        size_jitter: standard deviation of the relative error of width and height.
        correlation_s: time constant of the errors (first-order Gauss-Markov), s; 0 = independent from frame to frame.
        min_pixels: fewer visible pixels than this are not detected.
    """

    center_jitter: float = 0.03
    size_jitter: float = 0.04
    correlation_s: float = 0.1
    min_pixels: int = 20

    def __post_init__(self) -> None:
        _require("box", self, (field.name for field in dataclasses.fields(self)))


@dataclasses.dataclass(frozen=True)
class MeasurementConfig:
    """What a tracker would report, without rendering (`follow_env.camera.measurement`).

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
    bearing_noise: float = 0.019
    bearing_correlation_s: float = 0.27
    distance_bias: float = -0.09
    distance_noise: float = 0.013
    distance_correlation_s: float = 0.2
    outlier_share: float = 0.0
    outlier_duration_s: float = 0.1
    outlier_low: float = 1.0
    outlier_high: float = 3.0
    miss_share: float = 0.0

    def __post_init__(self) -> None:
        _require_share_below_one("measurement", self, ("outlier_share", "miss_share"))
        _require("measurement", self, ("bearing_noise", "distance_noise", "outlier_duration_s"))
        _require("measurement", self, ("bearing_correlation_s", "distance_correlation_s"))
        for name in ("bearing_bias", "distance_bias"):
            if not math.isfinite(getattr(self, name)):
                raise ValueError(f"measurement {name} is {getattr(self, name)!r}; expected a finite value")
        if not -math.inf < self.outlier_low <= self.outlier_high < math.inf:
            raise ValueError(
                f"measurement outlier_low, outlier_high are {self.outlier_low!r}, {self.outlier_high!r}; "
                "expected finite meters, low <= high"
            )


@dataclasses.dataclass(frozen=True)
class SensorConfig:
    """All sensor errors.

    `depth`, `color`, `frames` and `box` act on rendered frames, `measurement` on the `measurement` observation.
    """

    depth: DepthConfig = DepthConfig()
    color: ColorConfig = ColorConfig()
    frames: FrameConfig = FrameConfig()
    box: BoxConfig = BoxConfig()
    measurement: MeasurementConfig = MeasurementConfig()


IDEAL_SENSOR = SensorConfig(
    DepthConfig(
        axial_noise=0.0,
        lateral_noise=0.0,
        disparity_step=0.0,
        min_range=0.0,
        max_range=math.inf,
        edge_band=0,
        shadow=0.0,
        dark_dropout=0.0,
        grazing_dropout=0.0,
    ),
    ColorConfig(read_noise=0.0, shot_noise=0.0, blur=0.0),
    FrameConfig(),
    BoxConfig(center_jitter=0.0, size_jitter=0.0),
    MeasurementConfig(bearing_noise=0.0, distance_bias=0.0, distance_noise=0.0),
)
"""No errors at all."""
HARSH_SENSOR = SensorConfig(
    DepthConfig(
        axial_noise=2.0,
        lateral_noise=1.6,
        min_range=0.8,
        max_range=5.0,
        edge_band=2,
        edge_holes=0.6,
        edge_flying=0.3,
        dark_level=80.0,
        dark_dropout=0.9,
        grazing_deg=60.0,
    ),
    ColorConfig(read_noise=4.0, shot_noise=0.4, blur=2.0, gain=0.6),
    FrameConfig(drop_share=0.1),
    BoxConfig(center_jitter=0.06, size_jitter=0.08),
    MeasurementConfig(bearing_noise=0.024, distance_noise=0.03, outlier_share=0.05, miss_share=0.1),
)
"""A bad day: sunlight on the pattern, dim light for the colors, a busy bus. Stated, not measured: about twice the
noise, half the range, one frame in ten lost."""
SENSORS = {"xtion": SensorConfig(), "xtion_harsh": HARSH_SENSOR, "ideal": IDEAL_SENSOR}
"""Named sensors."""


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
    """Return the sensor that `value` names, or one with the settings of a mapping replaced.

    A mapping changes the default sensor, or the one that its entry `preset` names.
    """
    if isinstance(value, SensorConfig):
        return value
    if isinstance(value, str):
        return SENSORS[choose("sensor", value, SENSORS)]
    if isinstance(value, Mapping) and "preset" in value:
        changes = {key: setting for key, setting in value.items() if key != "preset"}
        return build("sensor", SENSORS[choose("sensor preset", value["preset"], SENSORS)], changes)
    return build("sensor", SensorConfig(), value)
