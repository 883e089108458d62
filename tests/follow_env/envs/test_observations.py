"""What is observed and shown: latency, the person's box, pictures for robots and for people."""

import math
import sys

import gymnasium
import numpy as np
import pytest

from follow_env import IDS

CORRIDOR, INDOOR = IDS["corridor"], IDS["indoor"]
STOP = np.zeros(2, np.float32)


def test_the_state_observation_is_the_truth(make, chase):
    env = make(INDOOR, obs="state")
    observation, info = env.reset(seed=5)
    last = (0.0, 0.0)
    for _ in range(200):
        yaw = info["robot_pose"][2]
        relative = complex(*info["person_velocity"]) * complex(math.cos(yaw), -math.sin(yaw))
        wanted = (info["bearing"], info["distance"], relative.real, relative.imag, *info["twist"], *last)
        assert observation == pytest.approx(np.array(wanted), abs=1e-6)
        last = chase(info)
        observation, *_, info = env.step(last)


@pytest.mark.parametrize("obs", ["measurement", "rgbd_box", "rgbd_uint8"])
@pytest.mark.parametrize("steps", [1, 4])
def test_latency_delays_what_is_seen_by_exactly_so_many_steps(make, equal, episode, obs, steps):
    """Against a twin without latency that drives the same way; odometry and the last action are not delayed.

    Before anything is old enough there is no measurement and no box, and the first frame stands.
    """
    latency = steps / 30.0
    now, late = make(INDOOR, obs=obs), make(INDOOR, obs=obs, latency_s=latency)
    one, two = episode(now, 3, steps=25), episode(late, 3, steps=25)
    for k, (delayed, prompt) in enumerate(zip(two, one, strict=True)):
        past = one[max(k - steps, 0)][0]
        seen, current = delayed[0], prompt[0]
        if obs == "measurement":
            assert equal(seen[:3], past[:3] if k >= steps else np.zeros(3, np.float32)), k
            assert equal(seen[4:], current[4:]), k
        elif obs == "rgbd_uint8":
            assert equal(seen, past), k
            assert equal(delayed[-1]["depth"], one[max(k - steps, 0)][-1]["depth"]), k
            assert delayed[-1]["frame_time"] == one[max(k - steps, 0)][-1]["time"], k
        else:
            box = past["box"] if k >= steps else np.zeros(4, np.float32)
            assert equal({**seen, "twist": None}, {**past, "twist": None, "box": box}), k
            assert equal(seen["twist"], current["twist"]), k
        late_seen = {"depth": None, "frame_time": None}
        assert equal({**delayed[-1], **late_seen}, {**prompt[-1], **late_seen}), "the truth is never delayed"


@pytest.mark.parametrize("latency", [0.0, 0.1])
def test_a_dropped_frame_is_the_one_before_and_says_so(make, equal, episode, latency):
    """Against a twin that drops none; the picture that stands has its own time, and no box comes with it."""
    settings = {"obs": "rgbd_box", "latency_s": latency}
    whole, lossy = (make(INDOOR, sensor={"frames": {"drop_share": p}}, **settings) for p in (0.0, 0.4))
    one, two = episode(whole, 3), episode(lossy, 3)
    delay, taken, dropped = round(latency * 30.0), 0, []
    for k, (prompt, late) in enumerate(zip(one, two, strict=True)):
        seen, info = late[0], late[-1]
        shown = round(info["frame_time"] * 30.0)
        fresh = shown == k - delay
        if k > delay:
            assert shown == (k - delay if fresh else taken), "the frame before"
            dropped.append(not fresh)
        taken = shown
        source = one[shown + delay][0]
        assert equal({**seen, "twist": None, "box": None}, {**source, "twist": None, "box": None})
        assert equal(seen["twist"], prompt[0]["twist"])
        assert equal(seen["box"], prompt[0]["box"] if fresh else np.zeros(4, np.float32))
        assert info["time"] == prompt[-1]["time"]
    assert len(dropped) > 400
    assert np.mean(dropped) == pytest.approx(0.4, abs=4.0 * math.sqrt(0.24 / len(dropped)))


def test_one_seed_meets_the_same_errors_in_every_picture_mode(make, equal, episode):
    """Also with drops, and whether a box is computed or not: the picture decides over no random number."""
    records = {
        obs: episode(make(INDOOR, obs=obs, sensor="xtion_harsh"), 3, steps=30)
        for obs in ("rgbd", "rgbd_box", "rgbd_uint8")
    }
    for plain, boxed, packed in zip(*records.values(), strict=True):
        assert equal(plain[0], {key: boxed[0][key] for key in plain[0]})
        assert equal(np.ascontiguousarray(packed[0][:, :, :3]), plain[0]["rgb"])
        assert equal(packed[-1]["depth"], plain[0]["depth"])
        assert plain[-1]["frame_time"] == boxed[-1]["frame_time"] == packed[-1]["frame_time"]


def test_the_age_of_a_measurement_is_the_time_since_it_was_taken(make, episode):
    """With latency and misses: a valid one is as old as the latency; before the first, the age is the episode's."""
    latency = 0.1
    env = make(latency_s=latency, sensor={"measurement": {"miss_share": 0.5}}, route="standing")
    twin = make(sensor={"measurement": {"miss_share": 0.5}}, route="standing")
    for seed in range(4):
        late, prompt = (episode(e, seed, policy=lambda info: STOP, steps=60) for e in (env, twin))
        taken = 0
        for k, (delayed, _) in enumerate(zip(late, prompt, strict=True)):
            valid = k >= 3 and bool(prompt[k - 3][0][2])
            taken = k - 3 if valid else taken
            assert delayed[0][2] == valid
            assert delayed[0][3] == pytest.approx((k - taken) / 30.0, abs=1e-6), (seed, k)


def test_the_box_is_the_persons_box_with_the_stated_jitter(make):
    """Around the tight box of the mask; center and size err by their shares of width and height."""
    env = make(INDOOR, obs="rgbd_box", route="standing", sensor={"box": {"correlation_s": 0.0}})
    observation, _ = env.reset(seed=0, options={"robot_pose": (-2.5, 0.0, 0.0)})
    tight = np.array(env.frame().person_box())
    size = tight[2:] - tight[:2]
    errors = []
    for _ in range(400):
        box = observation["box"].astype(float)
        errors.append(((box[:2] + box[2:] - tight[:2] - tight[2:]) / 2 / size, (box[2:] - box[:2]) / size - 1.0))
        observation, *_ = env.step(STOP)
    assert np.array(env.frame().person_box()) == pytest.approx(tight, abs=1.0)
    errors = np.array(errors).reshape(-1, 4)
    assert errors.std(axis=0) == pytest.approx((0.03, 0.03, 0.04, 0.04), rel=0.15)
    assert errors.mean(axis=0) == pytest.approx((0.0,) * 4, abs=0.01)


def test_without_a_person_in_view_the_box_is_zero(make):
    env = make(obs="rgbd_box", route="standing")
    observation, _ = env.reset(seed=0, options={"robot_pose": (0.0, 0.0, math.pi)})
    assert observation["box"].tolist() == [0.0] * 4


def test_rgbd_uint8_is_the_same_picture_in_bytes(make, equal):
    """Nearer is brighter, 255 (1 - z / 8 m); no reading and beyond 8 m are 0; info keeps the metric depth."""
    whole, packed = make(obs="rgbd"), make(obs="rgbd_uint8")
    (one, _), (two, info) = whole.reset(seed=1), packed.reset(seed=1)
    assert equal(np.ascontiguousarray(two[:, :, :3]), one["rgb"])
    assert equal(info["depth"], one["depth"])
    depth = one["depth"].astype(float)
    wanted = np.where((depth > 0.0) & (depth < 8.0), 255.0 * (1.0 - depth / 8.0), 0.0)
    assert np.abs(two[:, :, 3] - wanted).max() <= 1.0
    assert (depth == 0.0).any()


def test_scribbling_on_a_picture_does_not_come_back_when_the_next_is_dropped(make, equal):
    env, twin = (make(obs="rgbd", sensor={"frames": {"drop_share": 0.7}}) for _ in range(2))
    (mine, _), (other, _) = env.reset(seed=1), twin.reset(seed=1)
    for _ in range(20):
        assert equal(mine, other)
        mine["rgb"].fill(0), mine["depth"].fill(0)
        mine, other = env.step(STOP)[0], twin.step(STOP)[0]


def test_rgbd_tuple_is_what_the_robot_sees(make, equal):
    env = make(obs="rgbd", sensor="ideal", render_mode="rgbd_tuple")
    observation, _ = env.reset(seed=0)
    for _ in range(3):
        rgb, depth = env.render()
        assert equal(rgb, observation["rgb"])
        assert equal(depth, observation["depth"])
        observation, *_ = env.step(np.array((0.5, 0.2)))


def test_rgb_array_is_a_dashboard_that_changes(make, chase):
    env = make(INDOOR, render_mode="rgb_array")
    _, info = env.reset(seed=0)
    pictures = []
    for _ in range(3):
        pictures.append(env.render())
        for _ in range(10):
            *_, info = env.step(chase(info))
    for picture in pictures:
        assert picture.dtype == np.uint8
        assert picture.shape == (720, 960, 3)
        assert picture.std() > 20.0
    assert (pictures[0] != pictures[1]).any()
    assert (pictures[1] != pictures[2]).any()


def test_looking_does_not_disturb(make, equal, chase, episode):
    """The same episode with every render mode, and with `frame` called or not."""
    wanted = episode(make(obs="rgbd_box"), seed=4, steps=8)
    for mode in ("rgb_array", "rgbd_tuple"):
        env = make(obs="rgbd_box", render_mode=mode)

        def look(info, env=env):
            env.render()
            env.frame()
            return chase(info)

        assert equal(episode(env, seed=4, policy=look, steps=8), wanted), mode


def test_human_without_pygame_says_what_is_missing(monkeypatch):
    monkeypatch.setitem(sys.modules, "pygame", None)
    with pytest.raises((ValueError, ImportError, gymnasium.error.DependencyNotInstalled)) as raised:
        gymnasium.make(CORRIDOR, render_mode="human")
    message = str(raised.value)
    assert "\n" not in message
    for word in ("'human'", "pygame", "pip install", "'rgb_array'"):
        assert word in message


def test_human_shows_every_step(make, window):
    env = make(render_mode="human")
    env.reset(seed=0)
    for _ in range(4):
        env.step(np.array((0.5, 0.0)))
    assert len(window) == 5
    assert all(picture.shape == (960, 720, 3) for picture in window)
