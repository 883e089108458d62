"""Motions of one's own: a path with stops, a table, a person who is led; and their way into the environments."""

import math
import pickle

import numpy as np
import pytest

from follow_env.config import EnvConfig
from follow_env.envs.batch import FollowVectorEnv
from follow_env.envs.follow import FollowEnv
from follow_env.world.motion.base import MOTIONS, make_motion
from follow_env.world.motion.path import Path
from follow_env.world.motion.table import TableMotion
from follow_env.world.scenes import make_scene

U_TURN = {"name": "path", "points": [[4.0, 0.0], [4.0, 1.0], [0.5, 1.0]], "stops": [[2.0, 1.5]], "radius": 0.5}
SQUARE = [[3.0, 0.0], [3.0, 2.0], [0.0, 2.0]]


def times(motion, count=4001):
    return np.linspace(0.0, motion.duration, count)


@pytest.mark.parametrize("radius", [0.2, 0.7])
@pytest.mark.parametrize("start", [(0.0, 0.0, 0.0), (1.0, -2.0, 2.5)])
def test_a_path_is_the_integral_of_its_velocity(start, radius):
    path = Path(start, SQUARE, 0.9, [(1.0, 2.0), (4.0, 0.5)], radius)
    t = times(path)
    velocity = np.array([path.velocity(s) for s in t])
    place = np.array([path.pose(s)[:2] for s in t])
    step = t[1] - t[0]
    walked = place[0] + np.concatenate((np.zeros((1, 2)), np.cumsum(0.5 * step * (velocity[1:] + velocity[:-1]), 0)))
    assert np.abs(walked - place).max() < 1e-4
    assert path.walked(path.duration) == pytest.approx(path.distance)
    assert np.hypot(*velocity.T) == pytest.approx([path.speed(s) for s in t])


def test_a_path_ends_at_its_last_point_and_is_as_long_as_geometry_says():
    path = Path((0.0, 0.0, 0.0), SQUARE, radius=0.5)
    assert path.pose(path.duration) == pytest.approx((0.0, 2.0, math.pi))
    assert path.distance == pytest.approx(3.0 + 2.0 + 3.0 - 2 * (2 * 0.5) + 2 * (0.5 * math.pi / 2))


def test_a_stop_is_where_and_as_long_as_it_was_asked_for():
    path = Path((0.0, 0.0, 0.0), [[6.0, 0.0]], 1.0, [(2.0, 3.0)])
    standing = [s for s in times(path) if path.speed(s) < 1e-9]
    inside = [s for s in standing if 0.5 < s < path.duration - 0.5]
    assert inside[-1] - inside[0] == pytest.approx(3.0, abs=0.01)
    assert {round(path.walked(s), 6) for s in inside} == {2.0}
    assert path.duration == pytest.approx(2.0 + 1.0 + 3.0 + 4.0 + 1.0)


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"points": []}, "at least one"),
        ({"points": [[1.0, 0.0], [1.0, 0.3]]}, "leave no room"),
        ({"stops": [[90.0, 1.0]]}, "on the way"),
        ({"stops": [[2.0, -1.0]]}, "times >= 0"),
        ({"radios": 0.3}, "radios"),
    ],
)
def test_an_impossible_path_is_one_clear_error_when_the_environment_is_made(changes, words):
    with pytest.raises(ValueError, match=words):
        FollowEnv(route={**U_TURN, **changes})


def test_a_route_into_a_wall_is_refused():
    with pytest.raises(ValueError, match=r"passes .* m from something solid in the scene 'corridor'"):
        FollowEnv(route={"name": "path", "points": [[4.0, 0.0], [4.0, 5.0]]})


def test_a_u_turn_with_a_stop_is_the_same_in_the_batch():
    """The same poses to a millimeter at every step, from plain data, in both engines of the single environment."""
    batch = FollowVectorEnv(2, route=U_TURN, autoreset_mode="Disabled", walking_speed=0.8)
    singles = [FollowEnv(route=U_TURN, walking_speed=0.8, engine=engine) for engine in ("bullet", "kinematic")]
    _, infos = batch.reset_as_single([3, 3])
    latest = [single.reset(seed=3)[1] for single in singles]
    steps, apart = 0, 0.0
    while True:
        for info in latest:
            apart = max(apart, np.abs(infos["person_pose"][0] - info["person_pose"]).max())
        # turn on the spot after the person, so that nobody is run into or lost
        action = np.array((0.0, np.clip(2.0 * latest[0]["bearing"], -1.0, 1.0)))
        latest = [single.step(action)[4] for single in singles]
        _, _, terminated, truncated, infos = batch.step(np.tile(action, (2, 1)))
        steps += 1
        if truncated[0] or terminated[0]:
            break
    assert apart < 1e-3
    assert truncated[0]
    assert steps == math.ceil(singles[0].motion.duration * 30.0 - 1e-9)
    assert abs(latest[0]["person_pose"][2]) == pytest.approx(math.pi)


def test_a_table_is_walked_through_its_places():
    t, x, y = [0.0, 1.0, 2.5, 4.0], [0.0, 1.0, 1.0, 1.0], [0.0, 0.0, 0.0, 1.5]
    motion = TableMotion((2.0, 1.0, math.pi / 2), t, x, y)
    for s, a, b in zip(t, x, y, strict=True):
        assert motion.pose(s)[:2] == pytest.approx((2.0 - b, 1.0 + a))
    assert motion.pose(0.5)[2] == pytest.approx(math.pi / 2)
    assert motion.pose(1.7)[2] == pytest.approx(math.pi / 2), "who stands keeps the heading"
    assert motion.pose(3.0)[2] == pytest.approx(math.pi)
    assert [motion.speed(s) for s in (0.5, 1.7, 3.0)] == pytest.approx([1.0, 0.0, 1.0])
    assert motion.walked(4.0) == pytest.approx(2.5)


@pytest.mark.parametrize("wrong", [{"t": [0.0, 0.0]}, {"t": [1.0, 2.0]}, {"t": [0.0, 1.0, 2.0]}, {"t": []}])
def test_a_table_that_is_none_is_refused(wrong):
    with pytest.raises(ValueError, match=r"expected at least two rows of each, with times that rise from 0"):
        FollowEnv(route={"name": "table", "t": [0.0, 1.0], "x": [0.0, 1.0], "y": [0.0, 0.0], **wrong})


def test_a_led_person_walks_as_commanded_and_stops_at_walls():
    env = FollowEnv(route={"name": "commanded", "duration": 30.0}, engine="kinematic")
    _, info = env.reset(seed=0)
    x = info["person_pose"][0]
    env.command_person(1.2, 0.0)
    for _ in range(60):
        *_, info = env.step(np.zeros(2))
    ramp = 1.2 / 1.5
    assert info["person_pose"][0] - x == pytest.approx(1.2 * 2.0 - 0.5 * 1.2 * ramp, abs=0.03)
    assert info["person_velocity"] == pytest.approx((1.2, 0.0))
    env.command_person(0.8, 1.0)
    truncated = False
    while not truncated:
        *_, terminated, truncated, info = env.step(np.array((0.0, np.clip(2.0 * info["bearing"], -1.0, 1.0))))
        assert env.scene.clearance(info["person_pose"][None, :2]) >= 0.25
        if terminated:
            break
    assert env.motion.walked(env.time) > 2.0


@pytest.mark.parametrize("command", [(-0.1, 0.0), (9.0, 0.0), (1.0, 9.0), (math.nan, 0.0)])
def test_an_impossible_command_is_refused(command):
    env = FollowEnv(route="commanded", engine="kinematic")
    env.reset(seed=0)
    with pytest.raises(ValueError, match=r"the person's command is .*; expected m/s from 0 to 2.0"):
        env.command_person(*command)


def test_who_walks_alone_takes_no_commands():
    env = FollowEnv(engine="kinematic")
    env.reset(seed=0)
    with pytest.raises(ValueError, match=r"route 'paper'; expected route='commanded'"):
        env.command_person(1.0, 0.0)


@pytest.mark.parametrize("count", [0, 1, 3])
def test_the_papers_route_has_as_many_turns_as_wanted(count):
    scene, rng = make_scene("corridor"), np.random.default_rng(2)
    route = make_motion({"name": "paper", "turns": count}, scene, (1.5, 0.0, 0.0), rng)
    assert len(route.turns) == count
    sizes = [abs(turn.angle) for turn in route.turns]
    assert all(math.radians(20.0) <= size <= math.radians(50.0) for size in sizes)


@pytest.mark.parametrize(
    "wrong", [{"turns": 7}, {"turns": -1}, {"turns": 1.5}, {"largest_turn_deg": 10.0}, {"slowest_turn": 9.0}]
)
def test_impossible_turns_are_refused(wrong):
    with pytest.raises(ValueError, match="expected"):
        FollowEnv(route={"name": "paper", **wrong})


def walk(scene, start, rng, speed):
    """A route of one's own, as a function of a module."""
    return Path(start, [[3.0 + float(rng.uniform(0.0, 1.0)), 0.0]], speed)


def test_a_route_of_ones_own_is_a_function_a_name_of_a_module_or_a_motion(monkeypatch):
    import sys

    monkeypatch.setitem(sys.modules, "my_routes", sys.modules[__name__])
    made = [FollowEnv(route=route, engine="kinematic") for route in (walk, "my_routes:walk")]
    ends = []
    for env in made:
        env.reset(seed=1)
        ends.append(env.motion.pose(env.motion.duration))
    assert ends[0] == ends[1]
    fixed = FollowEnv(route=Path((1.5, 0.0, 0.0), [[4.0, 0.0]]), engine="kinematic")
    fixed.reset(seed=1)
    assert fixed.motion.pose(0.0) == (1.5, 0.0, 0.0)


def test_plain_data_travels_to_other_processes():
    config = EnvConfig(route=U_TURN)
    assert pickle.loads(pickle.dumps(config)) == config
    assert EnvConfig.of(config.to_json()) == config
    with pytest.raises(ValueError, match=r"route is an object, .* which JSON cannot carry"):
        EnvConfig(route=walk).to_json()


def test_every_registered_route_says_what_it_is():
    assert {"paper", "straight", "standing", "path", "table", "commanded"} <= {*MOTIONS}
    for name in MOTIONS:
        assert MOTIONS.get(name).__doc__
