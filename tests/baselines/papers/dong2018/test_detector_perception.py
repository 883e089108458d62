"""The `detector` rung in closed loop, with a detector that knows nothing but the color of the person's shirt."""

import csv
import dataclasses
import importlib
import math
from pathlib import Path

import cv2
import numpy as np
import pytest

from baselines.benchmark import build as assembly
from baselines.benchmark.cells import Cell, table1_cells
from baselines.benchmark.metrics import tracking
from baselines.benchmark.metrics.tracking import TrackingMetrics
from baselines.benchmark.player import Player
from baselines.benchmark.provenance import Plan
from baselines.cli import main as cli
from baselines.followers import build
from baselines.followers.build import make_follower
from baselines.followers.recovery import LOOK_RATE
from baselines.papers.dong2018 import calibrate, figures
from baselines.papers.dong2018.calibrate import DT, error_statistics
from baselines.papers.dong2018.calibrate_detector import tracked_errors
from baselines.papers.dong2018.reproduce import reproduce
from baselines.viewing import watch
from follow_env.camera.measurement import MeasurementModel
from follow_env.config import CameraConfig, RobotConfig
from follow_env.envs.dashboard import Dashboard
from follow_env.envs.follow import FollowEnv
from follow_env.sensors import MeasurementConfig
from tracker.boxes import Detection
from tracker.detection.detector import GRID, PersonDetector
from tracker.detection.networks import make_network
from tracker.detection.weights import save_weights
from tracker.estimators.base import NoiseModel
from tracker.person_tracker import Track

NOISE = NoiseModel((3.5e-4, 1.7e-4), (8e-4, 2.4e-3), (9e-2, 2.3e-1))
CELL = Cell("detector", "corridor", "akf")
SMALL = {"width": 160, "height": 120}


class SeesBlue:
    """Finds the largest blue patch, the shirt of the environments' default outfit; `blind` makes it find nothing."""

    blind = False

    def detect(self, rgb, depth):
        red, green, blue = rgb.astype(int).transpose(2, 0, 1)
        patches = (blue > np.maximum(red, green) + 25).astype(np.uint8)
        _, _, stats, _ = cv2.connectedComponentsWithStats(patches)
        left, top, width, height, area = max(stats[1:].tolist(), key=lambda row: row[4], default=(0, 0, 0, 0, 0))
        if self.blind or area < 40:
            return []
        return [Detection((float(left), float(top), float(left + width), float(top + height)), 0.9)]


@pytest.fixture
def rung(monkeypatch):
    """The rung with this detector and noise in place of the shipped ones."""
    detector = SeesBlue()
    monkeypatch.setattr(assembly, "shipped_detector", lambda: detector)
    monkeypatch.setattr(assembly, "noise_model", lambda *_: NOISE)
    return detector


@pytest.fixture
def short(monkeypatch):
    """Episodes of a few seconds: of four, or as many as its entry says."""
    step, seconds = FollowEnv.step, [4.0]

    def cut(env, action):
        *result, truncated, info = step(env, action)
        return *result, truncated or info["time"] > seconds[0] - 0.01, info

    monkeypatch.setattr(FollowEnv, "step", cut)
    return seconds


def test_it_has_the_cells_and_episodes_of_mask():
    plan = Plan.of(["detector", "mask"], None, [])
    assert [cell.perception for cell in plan.table] == ["mask"] * 8 + ["detector"] * 8
    assert plan.episodes == {"mask": 20, "detector": 20}
    assert CELL.key == "detector/corridor/akf/pi/q1.0/a0.05/six_smallest"
    mask = dataclasses.replace(CELL, perception="mask")
    assert assembly.environment_kwargs(CELL) == {**assembly.environment_kwargs(mask), "obs": "rgbd"}


def test_an_episode_is_scored_at_every_step_with_an_estimate(rung, short):
    player = Player()
    first = player(CELL, 3)
    player(dataclasses.replace(CELL, estimator="none"), 4)
    again = player(CELL, 3)
    player.close()
    row = first.row
    assert row == again.row
    assert first.curve.tobytes() == again.curve.tobytes()
    assert row["steps"] == 121
    assert row["estimate_steps"] == 121 - 12  # confirmed in the fifth of the processed frames 0, 3, ..., 12
    assert row["processed_frames"] == 41
    assert row["measured_steps"] == pytest.approx(37, abs=2)
    assert row["accepted_share"] == row["measured_steps"] / 41
    assert row["measurement_share"] == row["measured_steps"] / 121
    assert (row["confirmations"], row["false_confirmations"], row["stops"], row["tracked_at_end"]) == (1, 0, 0, 1)
    assert 0.0 < row["measured_distance_rmse_m"] < 0.2
    assert abs(row["measured_angle_bias_rad"]) <= row["measured_angle_rmse_rad"] < 0.05


@pytest.mark.parametrize(("seed", "start"), [(2, 90), (5, 210)])
def test_at_a_stop_of_the_tracker_the_robot_halts_looks_finds_the_person_and_goes_on(seed, start):
    """The detector sees nobody for two seconds while the person walks on."""
    detector, robot = SeesBlue(), RobotConfig()
    env = FollowEnv(scene="corridor", obs="rgbd", camera=SMALL)
    follower = make_follower("akf", "detector", camera=CameraConfig(**SMALL), detector=detector)
    observation, info = env.reset(seed=seed)
    state, ended, steps = None, False, []
    while not ended:
        detector.blind = start <= len(steps) < start + 60
        action, state = follower.predict(observation, state)
        steps.append((action.tolist(), state.track, state.bearing, info))
        observation, _, terminated, ended, info = env.step(action)
        assert not terminated
    env.close()
    actions, tracks, bearings, infos = zip(*steps, strict=True)
    alarm = [track.alarm for track in tracks].index(True)
    found = [track.confirmations for track in tracks].index(2)
    assert start + 27 <= alarm <= start + 30
    assert start + 60 <= found < start + 150
    assert all(v == 0.0 for v, _ in actions[alarm:found])
    assert actions[alarm][1] * robot.max_yaw_rate == pytest.approx(math.copysign(LOOK_RATE, bearings[alarm - 1]))
    assert all(abs(seen["twist"][0]) < 0.02 for seen in infos[alarm + 24 : found])
    assert tracks[-1].state == "tracking"
    assert max(v for (v, _), _, _, _ in steps[found:]) * robot.max_speed > 0.5
    assert info["distance"] < infos[found]["distance"]


@pytest.mark.parametrize("yaw", [0.1, -0.1])
def test_a_robot_that_looks_comes_back_to_a_person_whom_only_the_detector_missed(yaw):
    """A person stands ahead; the detector fails until the robot has turned away, and the robot sweeps back in time."""
    detector = SeesBlue()
    env = FollowEnv(scene="corridor", obs="rgbd", camera=SMALL)
    follower = make_follower("akf", "detector", camera=CameraConfig(**SMALL), detector=detector)
    observation, info = env.reset(seed=2, options={"route": "standing", "robot_pose": (0.0, 0.0, yaw)})
    state, visible = None, []
    for k in range(330):
        detector.blind = 15 <= k < 110
        action, state = follower.predict(observation, state)
        visible.append(info["visible"])
        observation, _, terminated, _, info = env.step(action)
        assert not terminated
    env.close()
    assert not all(visible[:150])
    assert state.track.state == "tracking"
    assert (state.track.confirmations, state.looked) == (2, 0.0)


def track(state="tracking", position=(1.5, 0.0, 0.0), measured=False, confirmations=1, processed=True):
    return Track(
        state, position, None, position if measured else None, None, None, None, None, 0, 0.0, confirmations, processed
    )


def test_what_the_tracker_did_is_counted():
    metrics = TrackingMetrics()
    person = {"bearing": 0.2, "distance": 1.5}
    there, elsewhere = (1.4, 1.5 * math.tan(0.2), 0.0), (3.0, -1.0, 0.0)
    tracks = [
        track("confirming", None, confirmations=0),
        track(position=there, measured=True),
        track(position=there, processed=False),
        track("lost", None),
        track("searching", None),
        track(position=elsewhere, measured=True, confirmations=2),
    ]
    for k, one in enumerate(tracks):
        metrics.record({**person, "time": 0.1 * k}, one)
    row = metrics.columns()
    assert (row["confirmations"], row["false_confirmations"], row["stops"], row["tracked_at_end"]) == (2, 1, 1, 0)
    assert (row["processed_frames"], row["accepted_share"], row["measured_steps"]) == (5, 0.4, 2)
    assert (row["untracked_s"], row["wrong_target_s"]) == pytest.approx((0.2, 0.1))
    assert row["measured_distance_bias_m"] == pytest.approx((-0.1 + 1.5) / 2)
    assert row["measured_distance_rmse_m"] == pytest.approx(math.sqrt((0.1**2 + 1.5**2) / 2))
    assert TrackingMetrics().columns() == {}


def records(path):
    with path.open(encoding="utf-8", newline="") as file:
        return list(csv.DictReader(file))


def test_the_cost_of_the_detector_is_what_the_raw_rows_say(tmp_path, monkeypatch):
    monkeypatch.syspath_prepend(Path(__file__).parents[2])
    synthetic = importlib.import_module("synthetic")
    metrics = TrackingMetrics()
    metrics.record({"time": 0.0, "bearing": 0.0, "distance": 1.5}, track(measured=True))

    def episode(cell, seed):
        if cell.perception == "mask":
            return synthetic.episode(cell, seed)
        worse = synthetic.episode(dataclasses.replace(cell, perception="mask", sensor="grid_mean"), seed)
        return dataclasses.replace(worse, row=worse.row | {"perception": "detector"} | metrics.columns())

    monkeypatch.setattr(figures, "draw_curves", lambda *_: [])
    monkeypatch.setattr(figures, "draw_sensors", lambda *_: None)
    plan = dataclasses.replace(Plan.of(["mask", "detector"], 4, []), episodes={"mask": 4, "detector": 3})
    text = reproduce(plan, synthetic.CALIBRATION, episode, tmp_path / "out", 1, False)

    out = tmp_path / "out"
    rows, costs, tracked = (records(out / f"{n}.csv") for n in ("episodes", "detector_cost", "tracking_episodes"))
    assert len(costs) == 2 * 2 * 4
    for line in costs:
        unit, scale = {"angle": ("rad", 1.0), "distance": ("m", 100.0)}[line["quantity"]]
        rmse = {}
        for perception in ("mask", "detector"):
            chosen = [
                row
                for row in rows
                if (row["perception"], row["scene"], row["estimator"]) == (perception, line["scene"], line["estimator"])
                and int(row["seed"]) < 3
            ]
            weights = [float(row["estimate_steps"]) for row in chosen]
            squares = [float(row[f"{line['quantity']}_rmse_{unit}"]) ** 2 for row in chosen]
            rmse[perception] = scale * math.sqrt(np.average(squares, weights=weights))
        difference = rmse["detector"] - rmse["mask"]
        assert line["episodes"] == "3"
        assert float(line["difference"]) == pytest.approx(difference, abs=2e-5 * rmse["mask"])
        assert float(line["difference_low"]) <= float(line["difference"]) <= float(line["difference_high"])
    assert len(tracked) == 2 * 4 * 3
    titles = ("## Perception `detector`", "## The tracker behind", "## What the detector costs")
    assert [line for line in text.splitlines() if line.startswith(titles)][1:] == [
        "## The tracker behind `detector`",
        "## What the detector costs in error",
    ]


def test_the_follower_is_told_the_noise_between_measurements_at_any_control_rate(monkeypatch):
    """Ten measurements a second: what Q adds between two of them does not depend on the steps it is spread over."""
    told = []
    monkeypatch.setattr(build, "noise_model", lambda *_: NOISE)
    monkeypatch.setattr(build, "make_estimator", lambda _, noise, alpha: told.append(noise.process))
    monkeypatch.setattr(build, "_tracker_factory", lambda *_: None)
    for control_hz, steps in ((30, 3), (60, 6), (20, 2)):
        make_follower("akf", "detector", control_hz=control_hz)
        assert told.pop() == pytest.approx([3 * q / steps for q in NOISE.process])


def test_the_detectors_errors_are_measured_as_they_are(short):
    errors = tracked_errors(SeesBlue(), "corridor", calibrate.FIRST_SEED)
    assert len(errors) == 40 - 4  # the last picture of an episode is not driven by
    found = np.array([error for error in errors if error is not None])
    assert len(found) >= 35
    assert np.abs(found[:, 0]).max() < 0.1
    assert -0.2 < found[:, 1].mean() < 0.0  # the shirt lies before the axis


def test_a_series_at_ten_hertz_has_the_correlation_time_of_the_one_it_was_taken_from():
    config = MeasurementConfig(bearing_noise=0.02, bearing_correlation_s=0.27, distance_noise=0.05)
    model, rng = MeasurementModel(config, DT), np.random.default_rng(3)
    series = [model.measure(0.0, 1.0 if k % 2 else 2.0, True, rng) for k in range(60_000)]
    samples = [
        (bearing, distance - (1.0 if k % 2 else 2.0), 1.0 + (k % 2 == 0))
        for k, (bearing, distance) in enumerate(series)
    ]
    thinned = error_statistics([samples[::3]], 3.0 * DT)
    assert thinned["bearing"]["correlation_s"] == pytest.approx(0.27, rel=0.1)
    assert thinned["bearing"]["spread"] == pytest.approx(0.02, rel=0.05)


def test_rare_measurements_need_the_larger_q(monkeypatch):
    monkeypatch.setattr(calibrate, "RULE_EPISODES", 1)
    clean = MeasurementConfig(bearing_noise=0.004, bearing_correlation_s=0.0, distance_noise=0.004, distance_bias=0.0)
    env = FollowEnv(scene="corridor", sensor={"measurement": dataclasses.asdict(clean)})
    motion = {"bearing_rad_s": 0.49, "distance_m_s": 1.02, "bearing_rad_s2": 0.95, "distance_m_s2": 1.5}
    noise = calibrate.noise_by_rule("corridor", clean, motion, every=3)
    assert noise["process"][1] >= 3.0 * (calibrate.WALKING_SPEED * DT) ** 2
    assert max(*noise["inflated_shares"], *noise["acceleration_inflated_shares"]) < 2.0 * calibrate.ALPHA
    smaller = NoiseModel(noise["measurement"], tuple(q / 9.0 for q in noise["process"]), noise["acceleration"])
    assert calibrate._inflated_shares(env, "akf", smaller, 3)[1] > 2.0 * calibrate.ALPHA
    env.close()


def test_the_video_shows_the_trackers_box_and_state(rung, short, monkeypatch, tmp_path):
    shown = []
    update = Dashboard.update

    def record(board, info, frame, box=None, estimate=None):
        shown.append((board.title, box))
        update(board, info, frame, box, estimate)

    monkeypatch.setattr(Dashboard, "update", record)
    short[0] = 1.5
    watch.watch(CELL, 3, tmp_path / "episode.mp4")
    titles, boxes = zip(*shown, strict=True)
    assert titles[:12] == ("corridor, detector, akf + PI: confirming",) * 12
    assert titles[13] == "corridor, detector, akf + PI: tracking"
    assert boxes[0] == boxes[1] == boxes[2]  # the picture is looked at every third frame
    assert len(set(boxes)) > 5


def test_boxes_lie_on_a_grid_that_hides_the_last_bits_of_a_convolution(tmp_path):
    save_weights(make_network("light"), tmp_path / "light.safetensors")
    picture = np.random.default_rng(0).integers(0, 256, (240, 320, 3), dtype=np.uint8)
    found = PersonDetector("light", tmp_path / "light.safetensors").detect(picture, confidence=0.05)
    assert found
    assert all((value / GRID).is_integer() for detection in found for value in detection.box)


@pytest.mark.parametrize("command", [["reproduce", "table1"], ["watch"], ["calibrate", "--detector"]])
def test_missing_weights_are_one_sentence_before_anything_is_played(command, tmp_path, monkeypatch, capsys):
    monkeypatch.setattr("tracker.detection.detector.SHIPPED", tmp_path)
    assembly.shipped_detector.cache_clear()
    monkeypatch.setattr(assembly, "noise_model", lambda *_: NOISE)
    monkeypatch.setattr(FollowEnv, "reset", None)
    place = {"reproduce": ["--out", "out"], "watch": ["--video", "out.mp4"], "calibrate": ["--out", "out.json"]}
    monkeypatch.chdir(tmp_path)
    perception = [] if command[0] == "calibrate" else ["--perception", "detector"]
    assert cli.main([*command, *perception, *place[command[0]]]) == 2
    error = capsys.readouterr().err
    assert error.startswith("follow: no weights are shipped for the net 'light'; make some with `follow detector train")
    assert error.count("\n") == 1
    assert list(tmp_path.iterdir()) == []


def test_a_calibration_of_other_weights_is_refused(tmp_path, monkeypatch, capsys):
    (tmp_path / "light.safetensors").write_bytes(b"new weights")
    monkeypatch.setattr("tracker.detection.detector.SHIPPED", tmp_path)
    monkeypatch.setattr(assembly, "detector_settings", lambda: {"how": {"weights_sha256": "that of older ones"}})
    assert cli.main(["reproduce", "table1", "--perception", "detector", "--out", str(tmp_path / "out")]) == 2
    assert "calibration of the detector is that of other weights" in capsys.readouterr().err
    assert not (tmp_path / "out").exists()


def test_rows_of_other_rungs_have_no_tracking_columns():
    player = Player()
    row = player(Cell("emulated", "corridor", "none"), 0).row
    player.close()
    assert not set(tracking.COLUMNS[4:]) & set(row)
    assert len({cell.key for cell in table1_cells(["mask", "detector"])}) == 16
