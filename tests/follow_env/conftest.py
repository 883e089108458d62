"""What the tests of the environments share: making them, playing episodes, comparing what came back."""

import math
import sys
import types

import gymnasium
import numpy as np
import pytest

import follow_env


@pytest.fixture
def make():
    """Make environments without wrappers and with a small camera, closed when the test ends."""
    made = []

    def one(id_=follow_env.IDS["corridor"], **settings):
        env = gymnasium.make(id_, **{"camera": {"width": 48, "height": 36}, **settings}).unwrapped
        made.append(env)
        return env

    yield one
    for env in made:
        env.close()


@pytest.fixture(scope="session")
def chase():
    """An action that follows the person by the truth in `info`, disturbed by `noise`."""

    def action(info, noise=(0.0, 0.0)):
        yaw = info["robot_pose"][2]
        ahead = info["person_velocity"][0] * math.cos(yaw) + info["person_velocity"][1] * math.sin(yaw)
        twist = np.array(((info["distance"] - 1.5 + ahead) / 1.2, 0.75 * info["bearing"]))
        return np.clip(twist + noise, -1.0, 1.0).astype(np.float32)

    return action


@pytest.fixture(scope="session")
def episode(chase):
    """Play an episode and return everything that the environment returned, the reset first."""

    def play(env, seed=None, options=None, policy=chase, steps=10**6):
        observation, info = env.reset(seed=seed, options=options)
        record = [(observation, info)]
        for _ in range(steps):
            record.append(env.step(policy(info)))
            *_, terminated, truncated, info = record[-1]
            if terminated or truncated:
                break
        return record

    return play


@pytest.fixture(scope="session")
def equal():
    """Whether two nested values agree in structure, type, shape and every bit."""

    def same(one, two):
        if type(one) is not type(two):
            return False
        if isinstance(one, dict):
            return one.keys() == two.keys() and all(same(one[key], two[key]) for key in one)
        if isinstance(one, list | tuple):
            return len(one) == len(two) and all(same(a, b) for a, b in zip(one, two, strict=True))
        if isinstance(one, np.ndarray):
            return one.dtype == two.dtype and one.shape == two.shape and one.tobytes() == two.tobytes()
        return one == two

    return same


@pytest.fixture
def window(monkeypatch):
    """A stand-in for pygame (not a dependency): the list of the pictures that a window would have shown."""
    shown = []
    surface = types.SimpleNamespace(blit=lambda picture, place: shown.append(picture))
    pygame = types.SimpleNamespace(
        display=types.SimpleNamespace(
            init=lambda: None, get_surface=lambda: surface, set_mode=lambda size: surface, flip=lambda: None
        ),
        surfarray=types.SimpleNamespace(make_surface=np.copy),
        event=types.SimpleNamespace(pump=lambda: None),
        time=types.SimpleNamespace(Clock=lambda: types.SimpleNamespace(tick=lambda rate: None)),
    )
    monkeypatch.setitem(sys.modules, "pygame", pygame)
    return shown
