"""Every setting of the record, one after another, with everything that is no value of it."""

import dataclasses
import math

import numpy as np
import pytest

from follow_env.config import CameraConfig, EnvConfig, RobotBody, RobotConfig, TaskConfig
from follow_env.sensors import BoxConfig, ColorConfig, DepthConfig, FrameConfig, MeasurementConfig
from follow_env.settings import bounds_of, settings

RECORDS = (
    *(EnvConfig, RobotConfig, RobotBody, CameraConfig, TaskConfig),
    *(DepthConfig, ColorConfig, FrameConfig, BoxConfig, MeasurementConfig),
)
NUMBERS = [(record, name) for record in RECORDS for name in bounds_of(record)]
NO_NUMBERS = (math.nan, np.nan, "1", "fast", True, None, [1.0], {}, 1j, np.bool_(True), object(), np.array([1.0, 2.0]))


def test_every_number_has_bounds():
    for record in RECORDS:
        for field in dataclasses.fields(record):
            if isinstance(field.default, int | float):
                assert field.name in bounds_of(record), f"{record.__name__}.{field.name}"


@pytest.mark.parametrize(("record", "name"), NUMBERS, ids=lambda value: getattr(value, "__name__", value))
def test_what_is_no_number_is_refused_in_one_sentence(record, name):
    for value in NO_NUMBERS:
        with pytest.raises(ValueError, match=f"{name} is ") as raised:
            record(**{name: value})
        assert "expected" in str(raised.value)
        assert "\n" not in str(raised.value)


@pytest.mark.parametrize(("record", "name"), NUMBERS, ids=lambda value: getattr(value, "__name__", value))
def test_a_number_beyond_its_bounds_is_refused_and_one_within_is_kept(record, name):
    bounds, default = bounds_of(record)[name], getattr(record(), name)
    wrong = [-math.inf, -1e300, -(10**5000)]
    if bounds.le is not None or bounds.lt is not None:
        wrong += [math.inf, 1e300, 10**5000]
    if isinstance(default, int):
        wrong += [default + 0.5]
    for value in (*wrong, bounds.gt, bounds.lt):
        if value is not None:
            with pytest.raises(ValueError, match="expected") as raised:
                record(**{name: value})
            assert len(str(raised.value)) < 300
    for value in (default, np.float64(default), np.array(default)[()]):
        made = getattr(record(**{name: value}), name)
        assert made == default
        assert type(made) is type(default)


def test_the_sentence_names_setting_value_bounds_and_unit():
    with pytest.raises(ValueError, match="expected") as raised:
        RobotConfig(max_speed=-1.0)
    assert str(raised.value) == "robot max_speed is -1.0; expected a number > 0 and <= 20 (m/s)"


def test_an_unknown_setting_names_the_nearest():
    with pytest.raises(ValueError, match="did you mean 'max_speed'"):
        RobotConfig(max_sped=1.0)


def test_a_record_of_ones_own_is_made_alike():
    @settings("lab")
    class Lab:
        """A lab."""

        rooms: int = 3

    assert Lab(rooms=4).rooms == 4
    with pytest.raises(ValueError, match="lab rooms is 'x'"):
        Lab(rooms="x")
