"""The pictures that the detector learns from: the same for the same seed, and with true boxes."""

import dataclasses
import math
from collections import Counter

import cv2
import numpy as np
import pytest

from baselines.learned.detector.augment import disturb, draw_backdrop
from baselines.learned.detector.data import CAMERA, DataConfig, SampleSource, without_augmentation
from baselines.learned.detector.preview import sheet
from baselines.learned.detector.random_people import HARD_POSTURES, draw_posture
from baselines.learned.detector.random_scenes import DRAWN_SCENES, draw_room, draw_scene
from follow_env.camera.pinhole import CameraPose
from follow_env.world.people.walker import POSTURES
from tracker.boxes import iou

SOURCE = SampleSource(7)
SAMPLES = [SOURCE.sample(number) for number in range(24)]


def test_a_sample_depends_on_its_seed_and_number_only() -> None:
    other = SampleSource(7)
    for number in (17, 3, 18):
        again = other.sample(number)
        for name in ("rgb", "ids", "boxes", "difficult"):
            np.testing.assert_array_equal(getattr(again, name), getattr(SAMPLES[number], name))
    assert any((SampleSource(8).sample(3).rgb != SAMPLES[3].rgb).ravel())


def test_boxes_are_tight_around_each_persons_pixels() -> None:
    people = 0
    for sample in SAMPLES:
        seen = [k for k in range(1, 9) if (sample.ids == k).any()]
        assert len(seen) == len(sample.boxes) == len(sample.difficult)
        for id, box in zip(seen, 300.0 * sample.boxes, strict=True):
            rows, columns = np.nonzero(sample.ids == id)
            tight = (columns.min(), rows.min(), columns.max() + 1, rows.max() + 1)
            np.testing.assert_allclose(box, tight, atol=1e-3)
            people += 1
    assert people > 20


def test_people_of_whom_little_is_seen_are_difficult() -> None:
    config = SOURCE.config
    for sample in SAMPLES:
        ids = [k for k in range(1, 9) if (sample.ids == k).any()]
        for id, difficult in zip(ids, sample.difficult, strict=True):
            assert difficult or (sample.ids == id).sum() >= config.min_pixels
    strict = SampleSource(7, dataclasses.replace(config, min_share=1.01))
    assert all(strict.sample(number).difficult.all() for number in range(4))


def test_pairs_are_close_and_hide_each_other_by_every_degree() -> None:
    config = dataclasses.replace(without_augmentation(DataConfig()), people=1, empty_share=0.0)
    pairs, alone = (SampleSource(7, dataclasses.replace(config, pair_share=share)) for share in (1.0, 0.0))
    assert max(len(alone.sample(number).boxes) for number in range(16)) == 1
    gaps, overlaps, alike = [], [], 0
    for number in range(64):
        boxes = pairs.sample(number).boxes
        _, people = pairs._draw_people(np.random.default_rng((7, 1, number)))
        if len(people) == 2:
            first, second = people
            gaps.append(math.dist(first.pose[:2], second.pose[:2]))
            alike += np.array_equal(first.mesh.colors, second.mesh.colors)
        if len(boxes) == 2:
            overlaps.append(iou(boxes[:1], boxes[1:]).item())
    assert len(gaps) > 40
    assert 0.3 <= min(gaps) < 0.5
    assert 0.8 < max(gaps) < 1.1
    assert 0.3 < alike / len(gaps) < 0.7
    assert np.histogram(overlaps, (0.0, 0.1, 0.3, 0.5, 1.0))[0].min() >= 3


def test_every_posture_is_shown_and_the_hard_ones_more_often() -> None:
    rng = np.random.default_rng(0)
    drawn = Counter(draw_posture(rng) for _ in range(3000))
    usual = (drawn["walk"] + drawn["stand"]) / 2
    assert set(drawn) == set(POSTURES)
    assert set(HARD_POSTURES) < set(POSTURES)
    for posture, times in HARD_POSTURES.items():
        assert drawn[posture] / usual == pytest.approx(times, rel=0.2)


def test_what_is_shown_varies() -> None:
    boxes = np.concatenate([sample.boxes for sample in SAMPLES])
    heights = boxes[:, 3] - boxes[:, 1]
    truncated = (boxes <= 0.0) | (boxes >= 1.0)
    assert heights.min() < 0.45
    assert heights.max() > 0.9
    assert 0.2 < truncated.any(axis=1).mean() < 1.0
    assert {len(sample.boxes) for sample in SAMPLES} >= {0, 1, 2}


def test_an_inclined_picture_shows_what_a_turned_camera_would() -> None:
    """A turn about the vertical by homography against one that is rendered: the ids agree but for silhouettes."""
    source = SampleSource(3)
    source.sample(0)
    rng = np.random.default_rng(0)
    for number in range(8):
        pose, people = source._draw_people(np.random.default_rng(number))
        if people:
            break
    yaw, wide = 0.06, math.tan(math.radians(50.0) / 2)
    scale = 2.0 / 300.0
    crop = np.array([[wide * scale, 0.0, -wide], [0.0, 0.75 * wide * scale, -0.75 * wide], [0.0, 0.0, 1.0]])
    c, s = math.cos(yaw), math.sin(yaw)
    turn = np.array([[c, 0.0, -s], [0.0, 1.0, 0.0], [s, 0.0, c]])  # to the left
    straight = source._renderer.render(pose, people)
    turned = source._renderer.render(CameraPose(pose.x, pose.y, pose.z, pose.yaw + yaw), people)
    warped = source._warp(straight.ids, turn @ crop, cv2.INTER_NEAREST, cv2.BORDER_CONSTANT)
    direct = source._warp(turned.ids, crop, cv2.INTER_NEAREST, cv2.BORDER_CONSTANT)
    assert (direct > 0).sum() > 500
    assert (warped != direct).mean() < 0.01
    gray = np.full((300, 300, 3), 128, np.uint8)
    depth = source._sensed(straight.depth, gray, turn @ crop, rng)
    same = source._sensed(turned.depth, gray, crop, rng)
    both = (depth > 0) & (same > 0) & (np.abs(depth - same) < 0.3)
    assert both.mean() > 0.5
    assert np.abs(np.median((depth - same)[both])) < 0.01


def test_depth_is_made_only_where_asked_for() -> None:
    sample = SampleSource(7, DataConfig(depth=True)).sample(2)
    assert SAMPLES[2].depth is None
    assert sample.depth.dtype == np.float32
    assert sample.depth.shape == (300, 300)
    assert ((sample.depth == 0.0) | ((sample.depth >= 0.5) & (sample.depth <= 8.0))).all()


def test_a_level_camera_crops_nothing() -> None:
    source = SampleSource(0, without_augmentation(DataConfig()))
    window = source._draw_window(np.random.default_rng(0))
    half = abs(window[0] @ (300.0, 0.0, 1.0))
    assert math.radians(53.0) <= 2 * math.atan(half) <= math.radians(63.0)
    assert window[2].tolist() == [0.0, 0.0, 1.0]


def test_rooms_of_chance_have_room_for_people() -> None:
    rng = np.random.default_rng(0)
    for _ in range(20):
        scene = draw_room(rng)
        x0, x1, y0, y1 = scene.bounds
        spots = np.column_stack([rng.uniform(x0, x1, 60), rng.uniform(y0, y1, 60)])
        assert sum(scene.clearance(spot[None]) > 0.2 for spot in spots) > 10
    assert {draw_scene(np.random.default_rng(k)).name for k in range(30)} == {*DRAWN_SCENES, "room"}


def test_disturbance_keeps_the_form_of_a_picture_and_repeats() -> None:
    picture = draw_backdrop((300, 300), np.random.default_rng(0))
    results = [disturb(picture.copy(), np.random.default_rng(k)) for k in (1, 1, 2)]
    assert all(r.shape == picture.shape and r.dtype == np.uint8 for r in results)
    np.testing.assert_array_equal(results[0], results[1])
    assert (results[0] != results[2]).any()


def test_the_sheet_shows_as_many_pictures_as_asked_for() -> None:
    assert sheet(SOURCE, 2, 3).shape == (300, 600, 3)


@pytest.mark.parametrize(
    "settings", [{"people": 0}, {"nearest": 3.0, "farthest": 2.0}, {"zoom": 0.5}, {"pair_share": 1.1}]
)
def test_impossible_settings_are_refused(settings: dict[str, float]) -> None:
    with pytest.raises(ValueError, match="expected"):
        DataConfig(**settings)


def test_the_rendered_picture_has_room_for_the_wanted_one() -> None:
    assert math.tan(math.radians(CAMERA.hfov_deg) / 2) > 1.2 * math.tan(math.radians(63.0) / 2)
