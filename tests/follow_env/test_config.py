"""Settings: what is wrong is said in one sentence, and what is right survives JSON."""

import dataclasses
import json
import math

import gymnasium
import numpy as np
import pytest

import follow_env
from follow_env.config import CameraConfig, EnvConfig, RobotConfig
from follow_env.registry import choose
from follow_env.sensors import (
    HARSH_SENSOR,
    IDEAL_SENSOR,
    SENSORS,
    BoxConfig,
    ColorConfig,
    DepthConfig,
    FrameConfig,
    MeasurementConfig,
    SensorConfig,
    sensor_config,
)
from follow_env.settings import build

CONFIGS = (
    *(RobotConfig, CameraConfig, DepthConfig, ColorConfig, FrameConfig, BoxConfig, MeasurementConfig),
    SensorConfig,
)


def refusal(error, call, *arguments, **keywords):
    """The message with which the call is refused, checked to be one clear sentence."""
    with pytest.raises(error) as raised:
        call(*arguments, **keywords)
    message = str(raised.value)
    assert "\n" not in message
    assert len(message) > 20
    return message


def run(**settings):
    """Make an environment with the settings and use it for a moment."""
    env = gymnasium.make(follow_env.IDS["corridor"], **settings).unwrapped
    try:
        env.reset(seed=0)
        env.step(np.array((0.3, 0.1), np.float32))
    finally:
        env.close()


@pytest.mark.parametrize("config", CONFIGS)
def test_settings_are_frozen_and_documented(config):
    settings = config()
    field = dataclasses.fields(config)[0].name
    with pytest.raises(dataclasses.FrozenInstanceError):
        setattr(settings, field, 0.0)
    for field in dataclasses.fields(config):
        assert field.name in config.__doc__, f"{config.__name__}.{field.name} is not in the docstring"
    assert hash(settings) == hash(config())


@pytest.mark.parametrize("config", CONFIGS)
def test_settings_survive_json(config):
    settings = config()
    again = build("settings", config(), json.loads(json.dumps(dataclasses.asdict(settings))))
    assert again == settings
    for name, value in dataclasses.asdict(again).items():
        assert type(value) is type(getattr(dataclasses.replace(settings), name)) or isinstance(value, dict), name


def test_changed_nested_settings_survive_json():
    wanted = {
        "depth": {"axial_noise": 2.0, "edge_band": 2},
        "box": {"min_pixels": 5},
        "measurement": {"miss_share": 0.3},
    }
    sensor = sensor_config(wanted)
    assert sensor.depth == DepthConfig(axial_noise=2.0, edge_band=2)
    assert sensor.box == BoxConfig(min_pixels=5)
    assert sensor.measurement == MeasurementConfig(miss_share=0.3)
    assert sensor_config(json.loads(json.dumps(dataclasses.asdict(sensor)))) == sensor


@pytest.mark.parametrize("name", SENSORS)
def test_named_sensors_survive_json(name):
    assert sensor_config(json.loads(json.dumps(dataclasses.asdict(SENSORS.get(name))))) == SENSORS.get(name)
    assert sensor_config(name) is SENSORS.get(name)


def test_the_default_of_a_mapping_is_the_default_sensor():
    assert sensor_config({}) == SensorConfig()
    assert sensor_config(IDEAL_SENSOR) is IDEAL_SENSOR


def test_a_mapping_may_start_from_a_preset():
    harsher = sensor_config({"preset": "xtion_harsh", "color": {"blur": 3.0}})
    assert harsher == dataclasses.replace(HARSH_SENSOR, color=dataclasses.replace(HARSH_SENSOR.color, blur=3.0))
    assert sensor_config({"preset": "ideal"}) == IDEAL_SENSOR


def test_whole_numbers_may_come_as_floats_and_floats_as_whole_numbers():
    camera = build("camera", CameraConfig(), {"width": 320.0, "far": 20})
    assert (camera.width, camera.far) == (320, 20.0)
    assert type(camera.width) is int
    assert type(camera.far) is float


def test_numbers_from_numpy_are_numbers():
    camera = build("camera", CameraConfig(), {"width": np.int64(320), "hfov_deg": np.float32(60.0)})
    assert (camera.width, camera.hfov_deg) == (320, 60.0)


@pytest.mark.parametrize(
    ("settings", "words"),
    [
        ({"scene": "coridor"}, ("'coridor'", "'corridor'", "did you mean 'corridor'")),
        ({"obs": "mesurement"}, ("'mesurement'", "did you mean 'measurement'")),
        ({"action": "wheel"}, ("'wheel'", "did you mean 'wheels'")),
        ({"route": "strait"}, ("'strait'", "did you mean 'straight'")),
        ({"sensor": "xtoin"}, ("'xtoin'", "did you mean 'xtion'")),
        ({"renderer": "tinny"}, ("'tinny'", "did you mean 'tiny'")),
        ({"person": "wman"}, ("'wman'", "did you mean 'woman'")),
        ({"outfit": "bleu"}, ("'bleu'", "did you mean 'blue'")),
        ({"camera": {"widht": 40}}, ("'widht'", "did you mean 'width'")),
        ({"robot": {"track_widt": 0.4}}, ("'track_widt'", "did you mean 'track_width'")),
        ({"sensor": {"measurment": {}}}, ("'measurment'", "did you mean 'measurement'")),
        ({"sensor": {"measurement": {"mis_share": 0.1}}}, ("'mis_share'", "did you mean 'miss_share'")),
        ({"sensor": {"preset": "ideel"}}, ("'ideel'", "did you mean 'ideal'")),
        ({"sensor": {"color": {"blurr": 1.0}}}, ("'blurr'", "did you mean 'blur'")),
        ({"sensor": {"depth": {"axial_nose": 1.0}}}, ("'axial_nose'", "did you mean 'axial_noise'")),
    ],
    ids=lambda value: str(value) if isinstance(value, dict) else "",
)
def test_an_unknown_name_is_named_with_the_nearest(settings, words):
    message = refusal(ValueError, run, **settings)
    for word in (*words, "expected one of"):
        assert word in message


def test_a_name_like_no_other_is_refused_without_a_guess():
    message = refusal(ValueError, choose, "scene", "zzz", ("corridor", "indoor"))
    assert "did you mean" not in message
    assert "'corridor', 'indoor'" in message


@pytest.mark.parametrize(
    ("settings", "value"),
    [
        ({"camera": 5}, "5"),
        ({"robot": "fast"}, "'fast'"),
        ({"sensor": 3}, "3"),
        ({"sensor": {"depth": 3}}, "3"),
        ({"camera": {"width": "160"}}, "'160'"),
        ({"camera": {"width": True}}, "True"),
        ({"camera": {"width": 160.5}}, "160.5"),
        ({"camera": {"width": 0}}, "0"),
        ({"camera": {"height": -3}}, "-3"),
        ({"camera": {"width": 100000}}, "100000"),
        ({"camera": {"width": math.inf}}, "inf"),
        ({"camera": {"hfov_deg": 0.0}}, "0.0"),
        ({"camera": {"hfov_deg": 180.0}}, "180.0"),
        ({"camera": {"hfov_deg": math.nan}}, "nan"),
        ({"camera": {"near": 0.0}}, "0.0"),
        ({"camera": {"near": 5.0, "far": 4.0}}, "5.0, 4.0"),
        ({"camera": {"far": math.inf}}, "inf"),
        ({"robot": {"track_width": 0.0}}, "0.0"),
        ({"robot": {"track_width": -0.3}}, "-0.3"),
        ({"robot": {"wheel_radius": 0.0}}, "0.0"),
        ({"robot": {"wheel_radius": math.inf}}, "inf"),
        ({"robot": {"wheel_time_constant": 0.0}}, "0.0"),
        ({"robot": {"wheel_time_constant": -1.0}}, "-1.0"),
        ({"robot": {"max_speed": math.inf}}, "inf"),
        ({"robot": {"max_speed": -1.0}}, "-1.0"),
        ({"robot": {"max_yaw_rate": math.nan}}, "nan"),
        ({"robot": {"max_wheel_speed": -1.5}}, "-1.5"),
        ({"robot": {"max_wheel_acceleration": -1.0}}, "-1.0"),
        ({"robot": {"max_wheel_torque": -1.0}}, "-1.0"),
        ({"robot": {"hull_radius": -0.1}}, "-0.1"),
        ({"robot": {"camera_height": None}}, "None"),
        ({"sensor": {"depth": {"axial_noise": -1.0}}}, "-1.0"),
        ({"sensor": {"depth": {"axial_noise": math.inf}}}, "inf"),
        ({"sensor": {"depth": {"baseline": 0.0}}}, "0.0"),
        ({"sensor": {"depth": {"disparity_step": -0.1}}}, "-0.1"),
        ({"sensor": {"depth": {"edge_band": -1}}}, "-1"),
        ({"sensor": {"depth": {"min_range": 5.0, "max_range": 1.0}}}, "5.0"),
        ({"sensor": {"depth": {"lateral_noise": -0.1}}}, "-0.1"),
        ({"sensor": {"depth": {"edge_holes": 0.7, "edge_flying": 0.4}}}, "0.7, 0.4"),
        ({"sensor": {"depth": {"shadow": 1.1}}}, "1.1"),
        ({"sensor": {"depth": {"dark_dropout": -0.1}}}, "-0.1"),
        ({"sensor": {"depth": {"dark_level": 0.0}}}, "0.0"),
        ({"sensor": {"depth": {"grazing_deg": 90.0}}}, "90.0"),
        ({"sensor": {"depth": {"grazing_dropout": 2.0}}}, "2.0"),
        ({"sensor": {"color": {"read_noise": -1.0}}}, "-1.0"),
        ({"sensor": {"color": {"shot_noise": math.inf}}}, "inf"),
        ({"sensor": {"color": {"blur": 51.0}}}, "51.0"),
        ({"sensor": {"color": {"gain": -0.5}}}, "-0.5"),
        ({"sensor": {"frames": {"drop_share": 1.0}}}, "1.0"),
        ({"sensor": {"box": {"center_jitter": -0.1}}}, "-0.1"),
        ({"sensor": {"box": {"size_jitter": math.inf}}}, "inf"),
        ({"sensor": {"box": {"correlation_s": -0.1}}}, "-0.1"),
        ({"sensor": {"measurement": {"miss_share": 1.0}}}, "1.0"),
        ({"sensor": {"measurement": {"miss_share": -0.1}}}, "-0.1"),
        ({"sensor": {"measurement": {"outlier_share": 1.5}}}, "1.5"),
        ({"sensor": {"measurement": {"outlier_duration_s": -1.0}}}, "-1.0"),
        ({"sensor": {"measurement": {"outlier_low": 3.0, "outlier_high": 1.0}}}, "3.0"),
        ({"sensor": {"measurement": {"bearing_noise": -0.1}}}, "-0.1"),
        ({"sensor": {"measurement": {"distance_noise": math.inf}}}, "inf"),
        ({"sensor": {"measurement": {"distance_bias": math.inf}}}, "inf"),
        ({"sensor": {"measurement": {"bearing_bias": math.nan}}}, "nan"),
        ({"sensor": {"measurement": {"distance_correlation_s": -0.4}}}, "-0.4"),
        ({"control_hz": 7}, "7"),
        ({"control_hz": 0}, "0"),
        ({"control_hz": -30}, "-30"),
        ({"control_hz": 30.5}, "30.5"),
        ({"control_hz": "30"}, "'30'"),
        ({"latency_s": 0.01}, "0.01"),
        ({"latency_s": -1.0}, "-1.0"),
        ({"latency_s": math.nan}, "nan"),
        ({"latency_s": math.inf}, "inf"),
        ({"obs": None}, "None"),
        ({"route": ["paper"]}, "['paper']"),
    ],
    ids=lambda value: str(value) if isinstance(value, dict) else "",
)
def test_a_bad_value_is_named_with_what_was_expected(settings, value):
    """Refused when the environment is made, before anything runs with it."""
    message = refusal(ValueError, gymnasium.make, follow_env.IDS["corridor"], **settings)
    assert value in message
    assert "expected" in message


@pytest.mark.parametrize("latency", ["0.1", None])
def test_a_latency_that_is_no_number_is_a_clear_error(latency):
    message = refusal((ValueError, TypeError), gymnasium.make, follow_env.IDS["corridor"], latency_s=latency)
    assert repr(latency) in message
    assert "latency_s" in message


def test_an_unknown_keyword_is_named():
    message = refusal(ValueError, gymnasium.make, follow_env.IDS["corridor"], latncy_s=0.1)
    assert "did you mean 'latency_s'" in message


def test_every_setting_is_offered_when_one_is_unknown():
    message = refusal(ValueError, gymnasium.make, follow_env.IDS["corridor"], zzz=0.1)
    for field in dataclasses.fields(EnvConfig):
        assert repr(field.name) in message


@pytest.mark.filterwarnings("ignore:.*is not in the possible render_modes.*")  # Gymnasium's, before ours
def test_an_unknown_render_mode_names_the_nearest():
    message = refusal(ValueError, gymnasium.make, follow_env.IDS["corridor"], render_mode="rgb_aray")
    assert "did you mean 'rgb_array'" in message


@pytest.mark.parametrize("rate", [1, 10, 15, 20, 24, 30, 40, 60, 80, 120, 240])
def test_every_rate_that_divides_the_physics_rate_is_accepted(rate):
    run(control_hz=rate, latency_s=2.0 / rate)
