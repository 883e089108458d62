"""Reading a folder of color and depth pictures: what comes back is what was written, and what is wrong is said."""

import json

import cv2
import numpy as np
import pytest

from follow_env.geometry import CAMERA_FRAME, CameraMount
from tracker.recording import Recording, UnreadableFrame

CAMERA = {"width": 32, "height": 24, "fx": 30.0, "fy": 31.0, "cx": 16.0, "cy": 12.0, "fps": 30}


def write(folder, color_names, depth_names, camera=CAMERA, color="color"):
    """Write noise; return the pictures as (rgb, depth in units) by index."""
    rng = np.random.default_rng(0)
    (folder / color).mkdir(parents=True)
    (folder / "depth").mkdir()
    rgb = [rng.integers(0, 256, (24, 32, 3), np.uint8) for _ in color_names]
    depth = [rng.integers(0, 60000, (24, 32), np.uint16) for _ in depth_names]
    for name, picture in zip(color_names, rgb, strict=True):
        assert cv2.imwrite(str(folder / color / name), picture[:, :, ::-1])
    for name, picture in zip(depth_names, depth, strict=True):
        assert cv2.imwrite(str(folder / "depth" / name), picture)
    (folder / "camera.json").write_text(json.dumps(camera), encoding="utf-8")
    return rgb, depth


def test_what_is_read_is_what_was_written(tmp_path):
    names = ["0000.png", "0001.png", "0002.png"]
    camera = {**CAMERA, "depth_scale": 0.0002, "mounting": {"forward": 0.1, "height": 1.0}}
    rgb, depth = write(tmp_path, names, names, camera, color="rgb")

    recording = Recording.open(tmp_path)

    assert (recording.rate, recording.mount) == (30.0, CameraMount(0.1, 1.0))
    assert (recording.intrinsics.fy, recording.intrinsics.width) == (31.0, 32)
    assert len(recording.frames) == 3
    for index in range(3):
        color, meters = recording.read(index)
        assert np.array_equal(color, rgb[index])
        assert meters.dtype == np.float32
        assert meters == pytest.approx(depth[index] * 0.0002, rel=1e-6)


def test_millimeters_and_the_origin_are_the_defaults(tmp_path):
    _, depth = write(tmp_path, ["a.jpg"], ["a.png"])

    recording = Recording.open(tmp_path)

    assert recording.mount == CAMERA_FRAME
    assert recording.read(0)[1] == pytest.approx(depth[0] / 1000.0, rel=1e-6)


def stems(recording):
    return [(color.stem, depth.stem) for color, depth in recording.frames]


def test_pairs_by_name_keep_a_frame_whose_depth_is_missing(tmp_path):
    write(tmp_path, ["1.png", "2.png", "3.png"], ["1.png", "3.png"])

    recording = Recording.open(tmp_path)

    assert stems(recording) == [("1", "1"), ("2", "2"), ("3", "3")]
    with pytest.raises(UnreadableFrame, match=r"2\.png cannot be read \(No such file"):
        recording.read(1)


def test_pairs_by_time_are_the_nearest_within_half_a_period(tmp_path):
    write(
        tmp_path,
        ["100.000.png", "100.033.png", "100.067.png", "100.100.png"],
        ["100.002.png", "100.030.png", "100.110.png"],
    )

    pairs = stems(Recording.open(tmp_path))

    assert pairs == [("100.000", "100.002"), ("100.033", "100.030"), ("100.100", "100.110")]


def test_pairs_by_order(tmp_path):
    write(tmp_path, ["c1.png", "c2.png"], ["d1.png", "d2.png"])
    assert stems(Recording.open(tmp_path)) == [("c1", "d1"), ("c2", "d2")]


def test_pictures_that_make_no_pairs(tmp_path):
    write(tmp_path, ["c1.png", "c2.png"], ["d1.png"])
    with pytest.raises(ValueError, match="2 color and 1 depth pictures make no pairs"):
        Recording.open(tmp_path)


@pytest.mark.parametrize("suffix", ["png", "jpg"])
@pytest.mark.parametrize("part", [0.0, 0.3, 0.6, 0.99])
def test_a_truncated_picture_is_unreadable_and_the_others_are_not(tmp_path, suffix, part):
    names = [f"{i}.{suffix}" for i in range(3)]
    write(tmp_path, names, ["0.png", "1.png", "2.png"])
    damaged = tmp_path / "color" / names[1]
    data = damaged.read_bytes()
    damaged.write_bytes(data[: int(part * len(data))])
    recording = Recording.open(tmp_path)

    with pytest.raises(UnreadableFrame, match="is not a whole picture"):
        recording.read(1)
    recording.read(0)
    recording.read(2)


def rewrite(folder, name, shape, dtype=np.uint16):
    cv2.imwrite(str(folder / name), np.zeros(shape, dtype))


@pytest.mark.parametrize(
    ("spoil", "sentence"),
    [
        (lambda f: rewrite(f, "depth/0.png", (12, 16)), r"0\.png is 32x24 but .*0\.png is 16x12; expected depth regis"),
        (lambda f: rewrite(f, "depth/0.png", (24, 32), np.uint8), "is not a 16-bit gray picture"),
        (
            lambda f: (rewrite(f, "depth/0.png", (12, 16)), rewrite(f, "color/0.png", (12, 16, 3), np.uint8)),
            r"is 16x12 but camera\.json is for 32x24",
        ),
        (lambda f: (f / "camera.json").unlink(), r"intrinsics .*camera\.json are missing; expected a JSON file"),
        (lambda f: (f / "camera.json").write_text("{"), "cannot be read as JSON"),
        (lambda f: (f / "camera.json").write_text("[1]"), "holds list; expected an object"),
        (
            lambda f: (f / "camera.json").write_text(json.dumps({**CAMERA, "fx": None})),
            r"fx of camera\.json is missing",
        ),
        (
            lambda f: (f / "camera.json").write_text(json.dumps({**CAMERA, "fps": -1})),
            "fps of .* -1; expected a positive",
        ),
        (lambda f: (f / "camera.json").write_text(json.dumps({**CAMERA, "width": 3.5})), "expected whole pixels"),
        (lambda f: (f / "camera.json").write_text(json.dumps({**CAMERA, "mounting": {"up": 1}})), "mounting of"),
        (lambda f: (f / "color/0.png").unlink(), "color holds no picture; expected PNG or JPEG files"),
        (lambda f: (f / "color/0.png").unlink() or (f / "color").rmdir(), "holds no folders color"),
    ],
)
def test_bad_recordings_are_one_sentence(tmp_path, spoil, sentence):
    write(tmp_path, ["0.png"], ["0.png"])
    spoil(tmp_path)
    with pytest.raises(ValueError, match=sentence) as caught:
        Recording.open(tmp_path).read(0)
    assert not isinstance(caught.value, UnreadableFrame)


def test_a_source_that_is_no_folder(tmp_path):
    with pytest.raises(ValueError, match="is not a folder; name one with"):
        Recording.open(tmp_path / "nowhere")
