"""`follow watch` writes a video and a contact sheet that can be read back."""

import re

import cv2
import numpy as np
import pytest

from baselines.benchmark.cells import Cell
from baselines.viewing.watch import watch
from follow_env.camera import PinholeCamera
from follow_env.camera.opengl.renderer import OpenGLRenderer
from follow_env.config import CameraConfig
from follow_env.envs.follow import FollowEnv
from follow_env.world.scenes import make_scene

CELL = Cell("emulated", "corridor", "akf")


def test_the_video_and_the_sheet_can_be_read_back(tmp_path):
    summary = watch(CELL, seed=0, video=tmp_path / "episode.mp4", camera=(40, 30))

    video = cv2.VideoCapture(str(tmp_path / "episode.mp4"))
    assert video.get(cv2.CAP_PROP_FRAME_COUNT) == 421
    assert video.get(cv2.CAP_PROP_FPS) == 30
    assert (video.get(cv2.CAP_PROP_FRAME_WIDTH), video.get(cv2.CAP_PROP_FRAME_HEIGHT)) == (960, 720)
    sheet = cv2.imread(str(tmp_path / "episode.png"))
    assert sheet.shape == (1080, 1440, 3)
    assert len({sheet[y, x].tobytes() for y in range(0, 1080, 40) for x in range(0, 1440, 40)}) > 50
    assert "421 frames, 14.0 s" in summary


def test_a_missing_folder_is_one_sentence(tmp_path):
    with pytest.raises(ValueError, match="does not exist"):
        watch(CELL, 0, tmp_path / "nowhere" / "episode.mp4")


@pytest.fixture
def short(monkeypatch):
    """Episodes of ten pictures."""
    step = FollowEnv.step

    def cut(env, action):
        *result, truncated, info = step(env, action)
        return *result, truncated or info["time"] > 0.29, info

    monkeypatch.setattr(FollowEnv, "step", cut)


def frames(path):
    video, images = cv2.VideoCapture(str(path)), []
    while (picture := video.read())[0]:
        images.append(picture[1][:, :, ::-1].astype(float))
    return np.array(images)


def test_the_robots_view_alone_in_any_size(tmp_path, short):
    """The video shows what the robot's camera sees, finer, and the episode is that of the dashboard."""
    summary = watch(CELL, 0, tmp_path / "view.mp4", size=(400, 300))
    board = watch(CELL, 0, tmp_path / "board.mp4")
    assert summary.splitlines()[0] == board.splitlines()[0]
    shown = frames(tmp_path / "view.mp4")
    assert shown.shape == (10, 300, 400, 3)
    assert cv2.imread(str(tmp_path / "view.png")).shape == (1080, 1440, 3)
    env = FollowEnv(scene="corridor", camera={"width": 400, "height": 300})
    env.reset(seed=0)
    assert np.abs(shown[0] - env.frame().rgb).mean() < 6.0
    env.close()
    assert np.abs(shown[0] - shown[-1]).mean() > 0.2


def test_the_view_with_shadows(tmp_path, short):
    try:
        OpenGLRenderer(make_scene("corridor"), PinholeCamera(CameraConfig())).close()
    except ValueError as error:
        if not re.search("found no OpenGL|needs moderngl", str(error)):
            raise
        pytest.skip(str(error))
    for shadows in (False, True):
        watch(CELL, 0, tmp_path / f"{shadows}.mp4", renderer="opengl", size=(160, 120), shadows=shadows)
    bright, dark = frames(tmp_path / "False.mp4"), frames(tmp_path / "True.mp4")
    assert bright.shape == dark.shape == (10, 120, 160, 3)
    assert bright.mean() - dark.mean() > 0.1


@pytest.mark.parametrize(
    ("settings", "sentence"),
    [
        ({"shadows": True, "size": (160, 120)}, "--shadows needs --renderer opengl"),
        ({"shadows": True, "renderer": "opengl"}, "--shadows needs --renderer opengl and --size"),
        ({"size": (161, 120)}, "--size is 161x120; expected even"),
        ({"size": (0, 120)}, "camera width is 0"),
        ({"renderer": "rasta"}, "did you mean 'raster'"),
    ],
)
def test_what_cannot_be_drawn_is_one_sentence(tmp_path, settings, sentence):
    with pytest.raises(ValueError, match=sentence):
        watch(CELL, 0, tmp_path / "episode.mp4", **settings)
