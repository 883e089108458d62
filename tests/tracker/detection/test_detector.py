"""`PersonDetector` and its weights on disk: what it reports lies in the picture, repeats, and fits the network."""

import dataclasses
from pathlib import Path

import numpy as np
import pytest
import torch
from safetensors.torch import save_file

from tracker.boxes import iou
from tracker.detection.detector import AGREEMENT, PersonDetector, network_input, read
from tracker.detection.networks import NETS, make_network
from tracker.detection.priors import PAPER_LAYERS, encode, match, prior_boxes, to_corners
from tracker.detection.weights import save_weights

PRIORS = prior_boxes(PAPER_LAYERS)
PICTURE = np.random.default_rng(0).integers(0, 256, (240, 320, 3), dtype=np.uint8)


@pytest.fixture(scope="module")
def weights(tmp_path_factory: pytest.TempPathFactory) -> Path:
    torch.manual_seed(1)
    path = tmp_path_factory.mktemp("weights") / "light.safetensors"
    save_weights(make_network("light"), path)
    return path


def test_what_is_reported_lies_in_the_picture_and_repeats(weights: Path) -> None:
    detector = PersonDetector("light", weights)
    found = detector.detect(PICTURE, confidence=0.3)
    assert found == PersonDetector("light", weights).detect(PICTURE, confidence=0.3)
    boxes = np.array([d.box for d in found])
    scores = [d.score for d in found]
    assert len(found) > 1
    assert boxes.min() >= 0.0
    assert (boxes[:, [0, 2]] <= 320.0).all()
    assert (boxes[:, [1, 3]] <= 240.0).all()
    assert scores == sorted(scores, reverse=True)
    assert all(type(value) is float for value in (*found[0].box, found[0].score))
    overlaps = iou(boxes, boxes) - np.eye(len(boxes))
    assert overlaps.max() <= AGREEMENT


def test_outputs_that_say_the_truth_are_read_as_the_truth() -> None:
    people = np.array([[0.1, 0.2, 0.35, 0.9], [0.6, 0.1, 0.8, 1.0]])
    said = match(people, np.array([False, False]), PRIORS)
    logits = np.stack([np.zeros(len(PRIORS)), np.where(said.labels == 1, 4.0, -4.0)], axis=1)
    found = read(logits, said.offsets, PRIORS, (640, 480), 0.5)
    boxes = np.array(sorted(d.box for d in found))
    np.testing.assert_allclose(boxes, people * (640, 480, 640, 480), atol=0.1)
    assert found[0].score == pytest.approx(1.0 / (1.0 + np.exp(-4.0)))


def test_boxes_beyond_the_edge_are_cut() -> None:
    box = np.array([[-0.3, 0.2, 0.2, 1.4]])
    offsets = np.zeros((len(PRIORS), 4))
    best = int(iou(box, to_corners(PRIORS)).argmax())
    offsets[best] = encode(box, PRIORS[best : best + 1])
    logits = np.full((len(PRIORS), 2), (9.0, -9.0))
    logits[best] = -9.0, 9.0
    (found,) = read(logits, offsets, PRIORS, (300, 300), 0.5)
    np.testing.assert_allclose(found.box, (0.0, 60.0, 60.0, 300.0), atol=1e-3)


def test_boxes_beside_the_picture_are_nobody() -> None:
    box = np.array([[-0.4, 0.2, -0.01, 0.8]])
    logits, offsets = np.full((len(PRIORS), 2), (9.0, -9.0)), np.zeros((len(PRIORS), 4))
    offsets[0], logits[0] = encode(box, PRIORS[:1]), (-9.0, 9.0)
    with np.errstate(all="raise"):
        assert read(logits, offsets, PRIORS, (300, 300), 0.5) == []


def test_the_input_is_squashed_and_depth_becomes_a_fourth_color() -> None:
    depth = np.full((240, 320), 4.0, np.float32)
    depth[:, :160] = 0.0
    squashed = network_input(PICTURE, depth)
    assert squashed.shape == (300, 300, 4)
    assert squashed[0, 0, 3] == 0
    assert squashed[0, 299, 3] == 127  # 4 of 8 m
    assert network_input(np.full((480, 640, 3), 9, np.uint8), None).tolist() == [[[9, 9, 9]] * 300] * 300


def test_weights_survive_the_disk(weights: Path) -> None:
    torch.manual_seed(1)
    kept, loaded = make_network("light").state_dict(), PersonDetector("light", weights).network.state_dict()
    assert kept.keys() == loaded.keys()
    for name, tensor in kept.items():
        torch.testing.assert_close(loaded[name], tensor, rtol=1e-3, atol=1e-6)
    assert weights.stat().st_size < 2.5e6


def test_weights_of_another_net_are_refused(weights: Path) -> None:
    with pytest.raises(ValueError, match=r"weights of the net 'light', .* expected weights of the net 'light_ssd'"):
        PersonDetector("light_ssd", weights)


def test_weights_of_another_make_are_refused(weights: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    changed = dataclasses.replace(NETS["light"], shared=False)
    monkeypatch.setitem(NETS, "light", changed)
    with pytest.raises(ValueError, match=r"make .* expected weights of the net 'light', make .* train again"):
        PersonDetector("light", weights)


def test_foreign_tensors_are_refused(tmp_path: Path) -> None:
    save_file({"kernel": torch.zeros(3)}, tmp_path / "foreign.safetensors")
    with pytest.raises(ValueError, match="holds nothing of ours; expected weights of the net 'light'"):
        PersonDetector("light", tmp_path / "foreign.safetensors")


def test_a_file_without_weights_is_refused(tmp_path: Path) -> None:
    (tmp_path / "notes.txt").write_text("no weights here")
    with pytest.raises(ValueError, match="holds no weights"):
        PersonDetector("light", tmp_path / "notes.txt")
    with pytest.raises(FileNotFoundError, match="follow detector train"):
        PersonDetector("light", tmp_path / "nothing.safetensors")
    with pytest.raises(FileNotFoundError, match="no weights are shipped for the net 'paper'"):
        PersonDetector("paper")


def test_pictures_of_another_form_are_refused(weights: Path, tmp_path: Path) -> None:
    with pytest.raises(ValueError, match=r"expected uint8 of shape \(H, W, 3\)"):
        PersonDetector("light", weights).detect(PICTURE / 255.0)
    save_weights(make_network("light_depth"), tmp_path / "depth.safetensors")
    detector = PersonDetector("light_depth", tmp_path / "depth.safetensors")
    with pytest.raises(ValueError, match="needs one of the picture's"):
        detector.detect(PICTURE)
    assert isinstance(detector.detect(PICTURE, np.ones((240, 320), np.float32)), list)
