"""The arrow keys lead the person; the window is a stand-in, for pygame is no dependency."""

import sys
import types

import numpy as np
import pytest

from baselines.cli.main import main
from baselines.viewing.lead import FAST, TURNING, command_of
from follow_env.world.motion.profile import PAPER_SPEED


@pytest.mark.parametrize(
    ("held", "command"),
    [
        ((False, False, False, False), (0.0, 0.0)),
        ((True, False, False, False), (PAPER_SPEED, 0.0)),
        ((True, True, False, True), (FAST, TURNING)),
        ((False, False, True, False), (0.0, -TURNING)),
        ((True, True, True, False), (PAPER_SPEED, 0.0)),
    ],
)
def test_keys_are_commands(held, command):
    assert command_of(*held) == command


@pytest.fixture
def window(monkeypatch):
    """A window in which somebody holds the up key for four seconds and then leaves by Escape."""
    shown, keys = (
        [],
        {name: number for number, name in enumerate(("K_UP", "K_LEFT", "K_RIGHT", "K_LSHIFT", "K_RSHIFT"))},
    )

    def events():
        return [types.SimpleNamespace(type="down", key="escape")] if len(shown) > 120 else []

    surface = types.SimpleNamespace(blit=lambda picture, place: shown.append(picture))
    pygame = types.SimpleNamespace(
        **keys,
        K_ESCAPE="escape",
        QUIT="quit",
        KEYDOWN="down",
        display=types.SimpleNamespace(
            init=lambda: None, set_mode=lambda size: surface, flip=lambda: None, get_surface=lambda: surface
        ),
        surfarray=types.SimpleNamespace(make_surface=np.array),
        event=types.SimpleNamespace(get=events, pump=lambda: None),
        key=types.SimpleNamespace(get_pressed=lambda: [True, False, False, False, False]),
        time=types.SimpleNamespace(Clock=lambda: types.SimpleNamespace(tick=lambda rate: None), wait=lambda ms: None),
    )
    monkeypatch.setitem(sys.modules, "pygame", pygame)
    return shown


def test_a_person_is_led_until_escape(window, capsys):
    assert main(["watch", "--lead", "--follower", "akf"]) == 0
    said = capsys.readouterr().out
    assert "4.0 s, the person walked 3." in said
    assert len(window) == 121


def test_somebody_has_to_follow(capsys):
    assert main(["watch", "--lead"]) == 2
    assert "--lead needs somebody who follows" in capsys.readouterr().err
