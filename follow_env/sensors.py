"""Errors of the RGB-D sensor: frozen, typed, JSON-able, with units and bounds; presets by name."""

import math
from collections.abc import Mapping
from typing import Annotated, Any

from follow_env.registry import Registry
from follow_env.settings import Bounds, Real, Whole, build, settings


@settings("sensor.depth")
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

    axial_noise: Annotated[Real, Bounds("", ge=0.0, le=100.0)] = 1.0
    lateral_noise: Annotated[Real, Bounds("px", ge=0.0, le=100.0)] = 0.8
    disparity_step: Annotated[Real, Bounds("px", ge=0.0, le=100.0)] = 0.125
    baseline: Annotated[Real, Bounds("m", gt=0.0, le=10.0)] = 0.075
    min_range: Annotated[Real, Bounds("m", ge=0.0, le=1000.0)] = 0.5
    max_range: Annotated[Real, Bounds("m", gt=0.0)] = 8.0
    edge_band: Annotated[Whole, Bounds("px", ge=0, le=64)] = 1
    edge_jump: Annotated[Real, Bounds("", ge=0.0, le=1000.0)] = 0.15
    edge_holes: Annotated[Real, Bounds("", ge=0.0, le=1.0)] = 0.5
    edge_flying: Annotated[Real, Bounds("", ge=0.0, le=1.0)] = 0.1
    shadow: Annotated[Real, Bounds("", ge=0.0, le=1.0)] = 1.0
    dark_level: Annotated[Real, Bounds("gray levels", gt=0.0, le=255.0)] = 40.0
    dark_dropout: Annotated[Real, Bounds("", ge=0.0, le=1.0)] = 0.5
    grazing_deg: Annotated[Real, Bounds("deg", ge=0.0, lt=90.0)] = 75.0
    grazing_dropout: Annotated[Real, Bounds("", ge=0.0, le=1.0)] = 1.0

    def __post_init__(self) -> None:
        if self.edge_holes + self.edge_flying > 1.0:
            raise ValueError(
                f"depth edge_holes, edge_flying are {self.edge_holes!r}, {self.edge_flying!r}; expected a sum up to 1"
            )
        if not self.min_range < self.max_range:
            raise ValueError(
                f"depth min_range, max_range are {self.min_range!r}, {self.max_range!r}; expected min_range < max_range"
            )


@settings("sensor.color")
class ColorConfig:
    """Errors of the color camera, applied to the rendered picture.

    The defaults are those of a small webcam sensor in a lit room: stated, not measured.

    Attributes:
        read_noise: standard deviation of the noise in the dark, gray levels.
        shot_noise: standard deviation of the noise that grows with the root of the light, gray levels at level 1.
        blur: standard deviation of the Gaussian blur, px at 640 px width.
        gain: exposure; what exceeds 255 is cut.
    """

    read_noise: Annotated[Real, Bounds("gray levels", ge=0.0, le=255.0)] = 1.0
    shot_noise: Annotated[Real, Bounds("gray levels", ge=0.0, le=255.0)] = 0.12
    blur: Annotated[Real, Bounds("px", ge=0.0, le=50.0)] = 0.6
    gain: Annotated[Real, Bounds("", ge=0.0, le=1000.0)] = 1.0


@settings("sensor.frames")
class FrameConfig:
    """Loss of whole frames on the way from the camera.

    Attributes:
        drop_share: share of the frames that never arrive, in [0, 1); the first of an episode always does.
    """

    drop_share: Annotated[Real, Bounds("", ge=0.0, lt=1.0)] = 0.0


@settings("sensor.box")
class BoxConfig:
    """Jitter of the person's bounding box around the tight box of the visible pixels.

    Attributes:
        center_jitter: standard deviation of the center's error, as a share of the box's width and height.
        size_jitter: standard deviation of the relative error of width and height.
        correlation_s: time constant of the errors (first-order Gauss-Markov), s; 0 = independent from frame to frame.
        min_pixels: fewer visible pixels than this are not detected.
    """

    center_jitter: Annotated[Real, Bounds("", ge=0.0, le=10.0)] = 0.03
    size_jitter: Annotated[Real, Bounds("", ge=0.0, le=10.0)] = 0.04
    correlation_s: Annotated[Real, Bounds("s", ge=0.0, le=1000.0)] = 0.1
    min_pixels: Annotated[Whole, Bounds("px", ge=0, le=10**9)] = 20


@settings("sensor.measurement")
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

    bearing_bias: Annotated[Real, Bounds("rad", ge=-math.pi, le=math.pi)] = 0.0
    bearing_noise: Annotated[Real, Bounds("rad", ge=0.0, le=math.pi)] = 0.019
    bearing_correlation_s: Annotated[Real, Bounds("s", ge=0.0, le=1000.0)] = 0.27
    distance_bias: Annotated[Real, Bounds("m", ge=-100.0, le=100.0)] = -0.09
    distance_noise: Annotated[Real, Bounds("m", ge=0.0, le=100.0)] = 0.013
    distance_correlation_s: Annotated[Real, Bounds("s", ge=0.0, le=1000.0)] = 0.2
    outlier_share: Annotated[Real, Bounds("", ge=0.0, lt=1.0)] = 0.0
    outlier_duration_s: Annotated[Real, Bounds("s", ge=0.0, le=1000.0)] = 0.1
    outlier_low: Annotated[Real, Bounds("m", ge=-1000.0, le=1000.0)] = 1.0
    outlier_high: Annotated[Real, Bounds("m", ge=-1000.0, le=1000.0)] = 3.0
    miss_share: Annotated[Real, Bounds("", ge=0.0, lt=1.0)] = 0.0

    def __post_init__(self) -> None:
        if not self.outlier_low <= self.outlier_high:
            raise ValueError(
                f"measurement outlier_low, outlier_high are {self.outlier_low!r}, {self.outlier_high!r}; "
                "expected low <= high"
            )


@settings("sensor")
class SensorConfig:
    """All sensor errors.

    `depth`, `color`, `frames` and `box` act on rendered frames, `measurement` on the `measurement` observation.
    """

    depth: DepthConfig = DepthConfig()
    color: ColorConfig = ColorConfig()
    frames: FrameConfig = FrameConfig()
    box: BoxConfig = BoxConfig()
    measurement: MeasurementConfig = MeasurementConfig()


XTION_SENSOR = SensorConfig()
"""An Asus Xtion Pro."""
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
SENSORS: Registry[SensorConfig] = Registry("sensor")
"""Named sensors."""
SENSORS.register("xtion")(XTION_SENSOR)
SENSORS.register("xtion_harsh")(HARSH_SENSOR)
SENSORS.register("ideal")(IDEAL_SENSOR)


def sensor_config(value: str | Mapping[str, Any] | SensorConfig, base: SensorConfig = XTION_SENSOR) -> SensorConfig:
    """Return the sensor that `value` names, or one with the settings of a mapping replaced.

    A mapping changes `base`, or the sensor that its entry `preset` names.
    """
    if isinstance(value, SensorConfig):
        return value
    if isinstance(value, str):
        return SENSORS.get(value)
    if isinstance(value, Mapping) and "preset" in value:
        changes = {key: setting for key, setting in value.items() if key != "preset"}
        return build("sensor", SENSORS.get(value["preset"]), changes)
    return build("sensor", base, value)
