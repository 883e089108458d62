"""The life cycle of the tracker on a simple simulated geometry: flat people before a flat wall, seen by a pinhole."""

import dataclasses
import itertools
import math

import numpy as np
import pytest

from follow_env.geometry import XTION_PRO, CameraMount, project
from tracker.association import GATE
from tracker.boxes import Detection
from tracker.person_filter import arc, moved
from tracker.person_tracker import PersonTracker, TrackerSettings

CAMERA = XTION_PRO.scaled(160, 120)
MOUNT = CameraMount(forward=0.1, height=1.0)
WALL = 6.0
TEN_HZ = TrackerSettings(rate=10.0, every=1)


def picture(*people):
    """Return (rgb, depth, detections) of people at (x, y) in the robot frame, 0.5 m wide and 1.75 m tall.

    A detection is the box of what is visible of somebody, if that is at least 40 % of what would be alone; detections
    are in the order of `people`.
    """
    depth = np.full((CAMERA.height, CAMERA.width), WALL, np.float32)
    owner = np.full(depth.shape, -1)
    alone = {}
    for index in sorted(range(len(people)), key=lambda i: -people[i][0]):
        x, y = people[index]
        u0, v0 = project((-y - 0.25, -1.75, x), CAMERA, MOUNT)
        u1, v1 = project((-y + 0.25, 0.0, x), CAMERA, MOUNT)
        rows = slice(max(round(v0), 0), max(round(v1), 0))
        columns = slice(max(round(u0), 0), max(round(u1), 0))
        depth[rows, columns] = x - MOUNT.forward
        owner[rows, columns] = index
        alone[index] = int((owner == index).sum())
    found = []
    for index in range(len(people)):
        rows, columns = np.nonzero(owner == index)
        if alone[index] and len(rows) >= 0.4 * alone[index]:
            box = (columns.min(), rows.min(), columns.max() + 1, rows.max() + 1)
            found.append(Detection(tuple(map(float, box)), 0.9))
    return np.zeros((*depth.shape, 3), np.uint8), depth, found


class Scripted:
    """A detector that reports what it is told."""

    def __init__(self):
        self.next, self.calls = [], 0

    def detect(self, rgb, depth):
        self.calls += 1
        return self.next


class Show:
    """A tracker with its scripted detector: shows pictures and takes back tracks."""

    def __init__(self, settings=TEN_HZ):
        self.detector = Scripted()
        self.tracker = PersonTracker(self.detector, CAMERA, MOUNT, settings)

    def __call__(self, *people, twist=(0.0, 0.0), seen=True):
        rgb, depth, found = picture(*people)
        self.detector.next = found if seen else []
        return self.tracker.update(rgb, depth, twist)

    def confirmed(self, *people, frames=5):
        for _ in range(frames):
            track = self(*people)
        assert track.state == "tracking"
        return track


RATES = pytest.mark.parametrize(("rate", "every"), [(10.0, 1), (30.0, 3), (30.0, 1), (20.0, 2)])


@RATES
def test_a_person_is_confirmed_after_half_a_second_of_processed_frames(rate, every):
    show = Show(TrackerSettings(rate, every))

    states = [show((2.0, 0.0)).state for _ in range(30)]

    needed = round(0.5 * rate / every)
    first = (needed - 1) * every
    assert set(states[:first]) == {"confirming"}
    assert set(states[first:]) == {"tracking"}


def test_a_miss_restarts_the_confirmation():
    show = Show()

    states = [show((2.0, 0.0), seen=i != 3).state for i in range(10)]

    assert states == ["confirming"] * 3 + ["searching"] + ["confirming"] * 4 + ["tracking"] * 2


def test_another_person_elsewhere_restarts_the_confirmation():
    show = Show()

    states = [show((2.0, 0.0) if i < 3 else (2.6, 0.6)).state for i in range(9)]

    assert states == ["confirming"] * 7 + ["tracking"] * 2


@RATES
def test_it_stops_one_second_after_the_last_measurement_and_not_a_frame_earlier(rate, every):
    show = Show(TrackerSettings(rate, every))
    for _ in range(round(rate)):
        last = show((2.0, 0.0))
    since = round(last.age * rate)
    assert last.state == "tracking"

    tracks = [show(seen=False) for _ in range(2 * round(rate))]

    stopped = [track.alarm for track in tracks]
    assert (stopped.index(True) + 1 + since) / rate == pytest.approx(1.0)
    assert all(stopped[stopped.index(True) :])
    at_stop = tracks[stopped.index(True)]
    assert at_stop.failures == round(rate / every)
    assert (at_stop.position, at_stop.velocity, at_stop.box) == (None, None, None)


def test_nine_failures_are_bridged_and_the_tenth_stops():
    show = Show()
    show.confirmed((2.0, 0.0))
    nine = [show((2.0, 0.0), seen=False).state for _ in range(9)]
    again = show((2.0, 0.0))
    ten = [show((2.0, 0.0), seen=False).state for _ in range(10)]

    assert nine == ["coasting"] * 9
    assert (again.state, again.failures, again.age) == ("tracking", 0, 0.0)
    assert ten == ["coasting"] * 9 + ["lost"]


def test_after_the_alarm_nobody_is_tracked_until_confirmed_again():
    show = Show()
    show.confirmed((2.0, 0.0))
    for _ in range(10):
        show(seen=False)
    calls = show.detector.calls

    assert {show((2.0, 0.0)).state for _ in range(20)} == {"lost"}
    assert show.detector.calls == calls

    show.tracker.confirm()
    assert [show((2.0, 0.0)).state for _ in range(5)] == ["confirming"] * 4 + ["tracking"]
    assert show((2.0, 0.0)).confirmations == 2


@pytest.mark.parametrize(
    ("start", "velocity"), [((2.2, 0.0), (0.9, 0.0)), ((2.4, -0.7), (0.0, 0.6)), ((4.5, 1.0), (-0.5, -0.4))]
)
def test_gaps_of_five_frames_are_bridged_while_the_person_walks(start, velocity):
    show = Show()
    states = []
    for k in range(24):
        person = (start[0] + 0.1 * k * velocity[0], start[1] + 0.1 * k * velocity[1])
        track = show(person, seen=not 10 <= k < 15)
        states.append(track.state)
    assert states[4:10] == ["tracking"] * 6
    assert states[10:15] == ["coasting"] * 5
    assert set(states[15:]) == {"tracking"}
    assert track.distance == pytest.approx(person[0], abs=0.03)
    assert track.bearing == pytest.approx(math.atan2(person[1], person[0]), abs=0.03)
    assert track.velocity[:2] == pytest.approx(velocity, abs=0.1)


def test_an_occlusion_by_a_look_alike_stops_the_tracker_and_the_look_alike_is_never_adopted():
    """Experiment 2: somebody comes close, then steps between the camera and the target and stays there."""
    show = Show()
    show.confirmed((2.4, 0.0))
    hidden = None
    for k in range(60):
        other = (1.6, max(1.0 - 0.06 * k, 0.0))
        _, _, visible = picture((2.4, 0.0), other)
        track = show((2.4, 0.0), other)
        if track.measurement is not None:
            assert track.measurement[0] == pytest.approx(2.4, abs=0.05)
        if hidden is None and len(visible) == 1:
            hidden = k
        if track.alarm:
            break
    assert track.alarm
    assert k - hidden + 1 == 10
    assert track.gate_distance is None


@pytest.mark.parametrize(
    ("name", "path", "least"),
    [
        ("comes to the target's side", lambda k: (2.35, max(1.5 - 0.06 * k, 0.35)), 40),
        ("passes behind", lambda k: (2.9, 1.2 - 0.06 * k), 40),
        ("passes in front, hiding the target", lambda k: (1.8, 1.2 - 0.06 * k), 15),
    ],
)
def test_a_look_alike_close_by_is_never_taken_for_the_target(name, path, least):
    show = Show()
    show.confirmed((2.4, 0.0))
    tracks = [show((2.4, 0.0), path(k)) for k in range(40)]

    taken = [track.measurement for track in tracks if track.measurement is not None]
    assert len(taken) >= least
    assert all(x == pytest.approx(2.4, abs=0.01) and abs(y) < 0.25 for x, y, _ in taken)


@pytest.mark.parametrize("depth", [1.7, 3.0])
@pytest.mark.parametrize("lone", ["of both", "of the other one"])
def test_when_two_cross_a_lone_detection_never_takes_the_tracker_along(depth, lone):
    """While the other one passes before or behind the target, one box is reported: that around both, or the other's.

    What is accepted then lies on the target, who is 0.5 m wide.
    """
    show, taken = Show(), []
    show.confirmed((2.4, 0.0), (depth, 1.1))
    for k in range(45):
        rgb, picture_depth, found = picture((2.4, 0.0), (depth, 1.1 - 0.05 * k))
        if abs(1.1 - 0.05 * k) < 0.55:
            *_, (alone,) = picture((depth, 1.1 - 0.05 * k))
            boxes = np.array([detection.box for detection in found])
            around = (*boxes[:, :2].min(axis=0), *boxes[:, 2:].max(axis=0))
            found = [alone if lone == "of the other one" else Detection(tuple(map(float, around)), 0.9)]
        show.detector.next = found
        track = show.tracker.update(rgb, picture_depth)
        if track.measurement is not None:
            taken.append(track.measurement)
        if track.alarm:
            break

    assert len(taken) >= 10
    assert all(x == pytest.approx(2.4, abs=0.01) and abs(y) <= 0.25 for x, y, _ in taken)


@pytest.mark.parametrize("seed", range(5))
def test_a_third_box_between_two_people_is_nobody(seed):
    """The target's own box jitters, as a detector's do, while that between the two keeps its shape."""
    show, rng = Show(), np.random.default_rng(seed)
    show.confirmed((2.4, 0.0), (2.4, 0.6))
    for _ in range(30):
        rgb, depth, (mine, other) = picture((2.4, 0.0), (2.4, 0.6))
        u0, v0, u1, v1 = np.array(mine.box) + rng.uniform(-4.0, 4.0, 4)
        half_way = tuple((a + b) / 2.0 for a, b in zip(mine.box, other.box, strict=True))
        show.detector.next = [Detection(half_way, 0.95), Detection((u0, v0, u1, v1), 0.9), other]
        track = show.tracker.update(rgb, depth)
        assert abs(track.position[1]) < 0.1
    assert track.state == "tracking"


def test_in_company_a_place_that_is_not_plausible_is_not_taken_though_inside_the_gate():
    """A quarter of a meter to the other's side in one frame; alone, and as printed, it is taken."""
    taken = {}
    for company, others in (("apart", [(2.4, 0.9)]), ("printed", [(2.4, 0.9)]), ("apart", [])):
        show = Show(dataclasses.replace(TEN_HZ, company=company))
        show.confirmed((2.4, 0.0), *others, frames=30)
        track = show((2.4, 0.25), *others)
        assert track.gate_distance < GATE
        taken[company, len(others)] = track.measurement is not None
    assert taken == {("apart", 1): False, ("printed", 1): True, ("apart", 0): True}


def test_a_neighbors_arm_before_the_person_does_not_move_it():
    """Both are detected; the arm is 0.2 m nearer and lies under a column of the samples."""
    moved_by = {}
    for company in ("apart", "printed"):
        show = Show(dataclasses.replace(TEN_HZ, company=company))
        before = show.confirmed((2.4, 0.0), (2.4, 0.6), frames=30).position
        rgb, depth, (mine, other) = picture((2.4, 0.0), (2.4, 0.6))
        u0, v0, u1, v1 = mine.box
        arm = math.ceil(u0 + 0.25 * (u1 - u0))
        depth[int(v0) : int(v1), int(u0) : arm] -= 0.2
        show.detector.next = [mine, Detection((*other.box[:2], float(arm), other.box[3]), 0.9)]
        moved_by[company] = before[0] - show.tracker.update(rgb, depth).measurement[0]
    assert moved_by["apart"] == pytest.approx(0.0, abs=0.01)
    assert moved_by["printed"] > 0.1


@pytest.mark.parametrize("seed", range(3))
def test_with_one_person_company_makes_no_difference(seed):
    tracks = []
    for company in ("apart", "printed"):
        show, rng = Show(dataclasses.replace(TEN_HZ, company=company)), np.random.default_rng(seed)
        person, tracks_ = np.array((2.4, 0.0)), []
        for _ in range(80):
            person += rng.normal(0.0, 0.03, 2)
            rgb, depth, found = picture(tuple(person))
            depth[rng.random(depth.shape) < 0.3] = 0.0
            show.detector.next = [Detection(tuple(np.array(d.box) + rng.uniform(-6.0, 6.0, 4)), 0.9) for d in found]
            show.detector.next *= rng.random() < 0.9
            tracks_.append(show.tracker.update(rgb, depth))
        tracks.append(tracks_)
    assert tracks[0] == tracks[1]
    assert {"tracking", "coasting"} <= {track.state for track in tracks[0]}


def test_side_by_side_inside_the_gate_the_box_decides():
    show = Show()
    show.confirmed((2.4, 0.0))
    rgb, depth, (mine,) = picture((2.4, 0.0))
    u0, v0, u1, v1 = mine.box
    narrow = Detection((u0 + 8.0, v0 + 40.0, u1 - 3.0, v1), 0.99)

    show.detector.next = [narrow, mine]
    track = show.tracker.update(rgb, depth)

    assert track.box == mine.box
    assert track.score == 0.0


def test_odometry_keeps_the_gate_on_a_person_while_the_robot_turns_unseeing():
    """In the body frame a standing person seems to fly sideways, and the prediction leaves the gate."""
    found = {}
    for frame in ("odom", "body"):
        show = Show(dataclasses.replace(TEN_HZ, frame=frame))
        person, twist = (2.5, 0.7), (0.3, 0.5)
        show.confirmed(person)
        for k in range(8):
            person = moved((*person, 0.0), arc(twist, 0.1))[:2]
            track = show(person, twist=twist, seen=k == 7)
        found[frame] = track.state
        if frame == "odom":
            assert track.gate_distance < 0.05
            assert track.velocity[:2] == pytest.approx((0.0, 0.0), abs=0.1)
    assert found == {"odom": "tracking", "body": "coasting"}


def test_a_person_is_confirmed_while_the_robot_turns():
    show, person, twist = Show(), (2.2, 0.5), (0.2, 0.8)
    for _ in range(6):
        person = moved((*person, 0.0), arc(twist, 0.1))[:2]
        track = show(person, twist=twist)
    assert track.state == "tracking"
    assert track.velocity == pytest.approx((0.0, 0.0, 0.0), abs=0.15)


def test_between_processed_frames_the_track_is_the_prediction_and_the_detector_rests():
    show = Show(TrackerSettings(rate=30.0, every=3))
    twist, dt, before = (0.4, 0.3), 1.0 / 30.0, None
    for k in range(60):
        track = show((2.0 + 0.3 * k * dt, 0.0), twist=twist)
        if k > 20 and k % 3:
            carried = tuple(p + dt * v for p, v in zip(before.position, before.velocity, strict=True))
            assert track.position == pytest.approx(moved(carried, arc(twist, dt)), abs=1e-12)
            assert track.measurement is None
            assert track.age == pytest.approx(k % 3 * dt)
            assert track.box == before.box
        before = track
    assert show.detector.calls == 20


def test_the_position_is_that_of_the_person_in_the_robot_frame():
    show = Show()
    track = show.confirmed((2.5, 0.6))
    x, y, z = track.position
    assert (x, y) == pytest.approx((2.5, 0.6), abs=0.02)
    assert z == pytest.approx(0.86, abs=0.05)  # middle of the visible part, heights 0 to 1.75 m
    assert track.bearing > 0.0
    assert track.distance == x


def test_the_largest_most_central_person_is_confirmed_unless_one_is_named():
    people = [(2.0, 0.75), (2.4, 0.05), (4.0, -1.2)]
    _, _, boxes = picture(*people)
    assert len(boxes) == 3
    u0, v0, u1, v1 = boxes[2].box
    for target, chosen in [
        (None, 1),
        (((u0 + u1) / 2, (v0 + v1) / 2), 2),
        (boxes[0].box, 0),
        ((u0 - 1.0, v0 - 1.0, u1 + 1.0, v1), 2),
    ]:
        show = Show()
        show.tracker.confirm(target)
        assert show.confirmed(*people).box == boxes[chosen].box

    show = Show()
    show.tracker.confirm((1.0, 1.0))
    assert {show(*people).state for _ in range(10)} == {"searching"}


@pytest.mark.parametrize("nothing", [0.0, math.nan])
def test_a_depth_without_readings_is_no_measurement(nothing):
    show = Show()
    show.confirmed((2.0, 0.0))
    rgb, depth, show.detector.next = picture((2.0, 0.0))

    track = show.tracker.update(rgb, np.full_like(depth, nothing))

    assert (track.state, track.measurement, track.failures) == ("coasting", None, 1)
    assert all(map(math.isfinite, track.position))
    assert show((2.0, 0.0)).state == "tracking"


def test_a_skipped_frame_counts_as_one_without_the_person():
    show = Show()
    show.confirmed((2.0, 0.0))
    states = [show.tracker.skip().state for _ in range(10)]
    assert states == ["coasting"] * 9 + ["lost"]


def random_stream(seed, frames=120):
    """Yield (picture, twist): people who wander, vanish and jump, false detections, depth that drops out."""
    rng = np.random.default_rng(seed)
    people = [np.array((rng.uniform(1.5, 3.0), rng.uniform(-0.6, 0.6))) for _ in range(3)]
    gone = np.zeros(3, int)
    for _ in range(frames):
        twist = (float(rng.uniform(-0.3, 0.6)), float(rng.uniform(-0.6, 0.6)))
        for i, person in enumerate(people):
            person += rng.normal(0.0, 0.04, 2) + (rng.normal(0.0, 0.6, 2) if rng.random() < 0.02 else 0.0)
            person[0] = min(max(person[0], 0.9), 5.0)
            gone[i] = gone[i] - 1 if gone[i] > 0 else int(rng.random() < 0.03) * int(rng.integers(1, 14))
        rgb, depth, found = picture(*(tuple(p) for p, g in zip(people, gone, strict=True) if not g))
        if rng.random() < 0.1:
            u, v = rng.uniform(0, 140), rng.uniform(0, 100)
            found.append(Detection((u, v, u + rng.uniform(2, 60), v + rng.uniform(2, 60)), 0.6))
        depth[rng.random(depth.shape) < rng.choice([0.0, 0.3, 0.95])] = rng.choice([0.0, math.nan])
        yield (rgb, depth, found), twist


def inside(part, box):
    return box[0] <= part[0] < part[2] <= box[2] and box[1] <= part[1] < part[3] <= box[3]


@pytest.mark.parametrize("seed", range(8))
def test_what_must_hold_on_any_stream(seed):
    detector = Scripted()
    tracker = PersonTracker(detector, CAMERA, MOUNT, TEN_HZ)
    states, before = [], None
    for (rgb, depth, detector.next), twist in random_stream(seed):
        track = tracker.update(rgb, depth, twist)
        tracked = before is not None and before.position is not None
        if track.measurement is not None and tracked:
            carried = tuple(p + 0.1 * v for p, v in zip(before.position, before.velocity, strict=True))
            prediction = moved(carried, arc(twist, 0.1))
            assert math.dist(track.measurement, prediction) <= GATE + 1e-12
            assert track.gate_distance == pytest.approx(math.dist(track.measurement, prediction))
            assert any(inside(track.box, d.box) for d in detector.next)
        assert (track.position is not None) == (track.state in ("tracking", "coasting"))
        assert track.position is None or all(map(math.isfinite, (*track.position, *track.velocity)))
        assert (track.measurement is not None) == (track.state == "tracking")
        states.append(track.state)
        if track.alarm:
            tracker.confirm()
        before = track
    runs = [(state, len(list(group))) for state, group in itertools.groupby(states)]
    for (state, length), (following, _) in itertools.pairwise(runs):
        if following == "tracking":
            assert state == "coasting" or (state == "confirming" and length >= 4)
        if state == "coasting":
            assert length <= 9
            assert (following == "lost") == (length == 9) or following == "tracking"
        assert following != "lost" or state == "coasting"
    assert {"tracking", "coasting"} <= set(states)


def test_the_same_stream_gives_the_same_tracks_and_trackers_share_nothing():
    def tracks(extra):
        detectors = [Scripted() for _ in range(1 + extra)]
        trackers = [PersonTracker(d, CAMERA, MOUNT, TEN_HZ) for d in detectors]
        out = []
        for (rgb, depth, found), twist in random_stream(1, 40):
            for detector in detectors[1:]:
                detector.next = []
            detectors[0].next = found
            first, *_ = [tracker.update(rgb, depth, twist) for tracker in trackers]
            out.append(first)
        return out

    assert tracks(0) == tracks(1)


def test_bad_input_is_one_sentence():
    show = Show()
    rgb, depth, _ = picture((2.0, 0.0))
    with pytest.raises(ValueError, match=r"color has shape \(120, 150, 3\) and depth \(120, 160\)"):
        show.tracker.update(rgb[:, :150], depth)
    with pytest.raises(ValueError, match=r"intrinsics are of 160x120; use intrinsics.scaled\(80, 60\)"):
        show.tracker.update(rgb[::2, ::2], depth[::2, ::2])
    with pytest.raises(TypeError, match="uint16; expected floating point meters"):
        show.tracker.update(rgb, (1000 * depth).astype(np.uint16))
    with pytest.raises(ValueError, match="twist"):
        show.tracker.update(rgb, depth, (math.nan, 0.0))
    with pytest.raises(TypeError, match=r"intrinsics are None, expected follow_env.geometry.Intrinsics"):
        PersonTracker(Scripted(), None)
    with pytest.raises(ValueError, match="expected finite pixels: a point"):
        show.tracker.confirm((1.0, 2.0, 3.0))
    with pytest.raises(ValueError, match="every is 0"):
        TrackerSettings(every=0)
    with pytest.raises(ValueError, match="frame is 'world'"):
        TrackerSettings(frame="world")
    with pytest.raises(ValueError, match="company is 'none'"):
        TrackerSettings(company="none")


def test_streams_of_any_rate_are_processed_about_ten_times_a_second():
    assert [TrackerSettings.for_rate(rate).every for rate in (5.0, 10.0, 15.0, 30.0, 60.0)] == [1, 1, 2, 3, 6]
