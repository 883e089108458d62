"""`follow track` on a recording: written from the simulator, read back as if nobody had simulated it."""

import csv
import json

import cv2
import numpy as np
import pytest

from baselines.cli import main as cli
from baselines.viewing.track import COLUMNS, track
from follow_env.envs.follow import FollowEnv
from tracker.boxes import Detection
from tracker.recording import Recording

FRAMES = 60


class ByPicture:
    """A detector that knows the person's box of each picture of the recording."""

    def __init__(self, boxes):
        self.boxes = boxes

    def detect(self, rgb, depth):
        box = self.boxes[rgb.tobytes()]
        return [] if box is None else [Detection(box, 0.75)]


@pytest.fixture(scope="module")
def filmed(tmp_path_factory):
    """A person walks away from a standing robot for two seconds: (folder, detector, true (distance, bearing))."""
    folder = tmp_path_factory.mktemp("walk")
    for name in ("color", "depth"):
        (folder / name).mkdir()
    env = FollowEnv(obs="rgbd", camera={"width": 160, "height": 120})
    observation, info = env.reset(seed=1)
    boxes, truth = {}, []
    for frame in range(FRAMES):
        assert env.observed is not None
        boxes[observation["rgb"].tobytes()] = env.observed.person_box()
        truth.append((info["distance"], info["bearing"]))
        cv2.imwrite(str(folder / f"color/{frame:04d}.png"), observation["rgb"][:, :, ::-1])
        cv2.imwrite(str(folder / f"depth/{frame:04d}.png"), (1000.0 * observation["depth"]).round().astype(np.uint16))
        observation, *_, info = env.step(np.zeros(2))
    camera = {"width": 160, "height": 120, "cx": env.camera.cx, "cy": env.camera.cy, "fps": 30}
    mounting = {"forward": env.config.robot.camera_forward, "height": env.config.robot.camera_height}
    camera |= {"fx": env.camera.focal, "fy": env.camera.focal, "mounting": mounting}
    (folder / "camera.json").write_text(json.dumps(camera), encoding="utf-8")
    env.close()
    return folder, ByPicture(boxes), truth


def copied(folder, to):
    for file in folder.rglob("*.*"):
        (to / file.relative_to(folder)).parent.mkdir(parents=True, exist_ok=True)
        (to / file.relative_to(folder)).write_bytes(file.read_bytes())
    return to


def rows_of(out):
    with open(out / "tracks.csv", newline="", encoding="utf-8") as file:
        return list(csv.DictReader(file))


def test_the_person_is_tracked_where_it_walked(filmed, tmp_path):
    folder, detector, truth = filmed

    summary = track(Recording.open(folder), tmp_path / "out", detector)

    rows = rows_of(tmp_path / "out")
    assert tuple(rows[0]) == COLUMNS
    assert [row["state"] for row in rows] == ["confirming"] * 12 + ["tracking"] * 48
    assert [int(row["measured"]) for row in rows[12:]] == [1, 0, 0] * 16
    for row, (distance, bearing) in zip(rows[12:], truth[12:], strict=True):
        assert float(row["distance"]) == pytest.approx(distance - 0.1, abs=0.1)  # the front lies before the axis
        assert float(row["bearing"]) == pytest.approx(bearing, abs=0.03)
    assert float(rows[-1]["vx"]) == pytest.approx(0.86, abs=0.25)
    assert "60 frames, 0 skipped: 12 confirming, 48 tracking; 1 confirmed, not stopped" in summary


def test_the_other_files_agree_with_the_table(filmed, tmp_path):
    folder, detector, _ = filmed
    track(Recording.open(folder), tmp_path, detector)
    rows = rows_of(tmp_path)

    mot = [line.split(",") for line in (tmp_path / "tracks.txt").read_text(encoding="utf-8").splitlines()]
    measured = [row for row in rows if row["measured"] == "1"]
    assert [int(line[0]) - 1 for line in mot] == [int(row["frame"]) for row in measured]
    for line, row in zip(mot, measured, strict=True):
        left, top, width, height = map(float, line[2:6])
        assert [left, top, left + width, top + height] == [float(row[k]) for k in ("u0", "v0", "u1", "v1")]
        assert (line[1], float(line[6])) == ("1", 0.75)
    video = cv2.VideoCapture(str(tmp_path / "video.mp4"))
    assert video.get(cv2.CAP_PROP_FRAME_COUNT) == FRAMES
    assert video.get(cv2.CAP_PROP_FPS) == 30
    assert json.loads((tmp_path / "config.json").read_text(encoding="utf-8"))["tracker"]["every"] == 3


def test_a_corrupt_frame_is_reported_and_the_rest_is_tracked(filmed, tmp_path):
    folder, detector, _ = filmed
    spoilt = copied(folder, tmp_path / "spoilt")
    file = spoilt / "color" / "0030.png"
    file.write_bytes(file.read_bytes()[:500])
    reports = []

    summary = track(Recording.open(spoilt), tmp_path / "out", detector, report=reports.append)

    assert len(reports) == 1
    assert reports[0].startswith("frame 30 is skipped:")
    assert "0030.png is not a whole picture (500 bytes)" in reports[0]
    states = [row["state"] for row in rows_of(tmp_path / "out")]
    assert states[27:36] == ["tracking"] * 3 + ["coasting"] * 3 + ["tracking"] * 3
    assert "60 frames, 1 skipped" in summary


def test_a_recording_without_one_readable_frame_is_an_error(filmed, tmp_path):
    folder, detector, _ = filmed
    spoilt = copied(folder, tmp_path / "spoilt")
    for file in (spoilt / "depth").iterdir():
        file.write_bytes(file.read_bytes()[:100])

    with pytest.raises(ValueError, match=r"none of the 60 frames of .* can be read"):
        track(Recording.open(spoilt), tmp_path / "out", detector, report=lambda line: None)


def test_the_named_person_or_nobody(filmed, tmp_path):
    folder, detector, _ = filmed
    summary = track(Recording.open(folder), tmp_path, detector, target=(1.0, 1.0))
    assert "60 searching; 0 confirmed" in summary


@pytest.mark.parametrize(
    ("spoil", "sentence"),
    [
        (
            lambda f: (f / "camera.json").unlink(),
            "camera.json are missing; expected a JSON file with width, height, fx",
        ),
        (lambda f: [file.unlink() for file in (f / "depth").iterdir()], "depth holds no picture; expected 16-bit PNG"),
    ],
)
def test_bad_recordings_end_with_one_sentence_and_exit_code_2(filmed, tmp_path, capsys, spoil, sentence):
    spoilt = copied(filmed[0], tmp_path / "spoilt")
    spoil(spoilt)

    code = cli.main(["track", str(spoilt), "--out", str(tmp_path / "out")])

    error = capsys.readouterr().err
    assert code == 2
    assert sentence in error
    assert error.startswith("follow: ")
    assert error.count("\n") == 1
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize("point", ["1", "a,b", "1,2,3", "nan,1"])
def test_a_target_that_is_no_point(point, capsys, tmp_path):
    with pytest.raises(SystemExit) as ended:
        cli.main(["track", str(tmp_path), "--target", point])
    assert ended.value.code == 2
    assert "is no picture point; expected two numbers such as 160,120" in capsys.readouterr().err
