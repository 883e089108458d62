"""`follow watch` writes a video and a contact sheet that can be read back."""

import cv2
import pytest

from baselines.benchmark.cells import Cell
from baselines.watch import watch


def test_the_video_and_the_sheet_can_be_read_back(tmp_path):
    summary = watch(Cell("emulated", "corridor", "akf"), seed=0, video=tmp_path / "episode.mp4", camera=(40, 30))

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
        watch(Cell("emulated", "corridor", "akf"), 0, tmp_path / "nowhere" / "episode.mp4")
