"""The walker's routes: paper B's rule, and a path that is the integral of its own velocity."""

import functools
import itertools
import math

import numpy as np
import pytest

from follow_env.config import EnvConfig
from follow_env.world.motion.base import make_motion
from follow_env.world.motion.profile import PAPER_SPEED
from follow_env.world.motion.routes import (
    CLEARANCE,
    TABLE_STEP,
    Route,
    Turn,
)
from follow_env.world.scene import Box
from follow_env.world.scenes import make_scene

SEEDS = 200
START = (1.5, 0.1, 0.0)


@functools.cache
def paper_routes(scene):
    """The routes of 200 seeds from start places across the free lane, as the environment draws them."""
    place = make_scene(scene)
    routes = []
    for seed in range(SEEDS):
        rng = np.random.default_rng(seed)
        side = float(rng.uniform(-1.0, 1.0)) * place.start_width
        routes.append(make_motion("paper", place, (1.5, side, 0.0), rng))
    return routes


def distance_to_obstacles(scene, points):
    """Least distance (n,) of each point to anything solid that begins below 2 m, from the corners of its outline."""
    least = np.full(len(points), np.inf)
    for part in scene.primitives:
        height = part.size[2] if isinstance(part, Box) else part.height
        if not part.solid or part.center[2] - height / 2 >= 2.0:
            continue
        offset = points - np.array(part.center[:2])
        if isinstance(part, Box):
            turned = np.array([[math.cos(part.yaw), -math.sin(part.yaw)], [math.sin(part.yaw), math.cos(part.yaw)]])
            beyond = np.maximum(np.abs(offset @ turned) - np.array(part.size[:2]) / 2, 0.0)
            gap = np.hypot(beyond[:, 0], beyond[:, 1])
        else:
            gap = np.maximum(np.hypot(offset[:, 0], offset[:, 1]) - part.radius, 0.0)
        least = np.minimum(least, gap)
    return least


@pytest.mark.parametrize("scene", ["corridor", "indoor"])
def test_every_paper_route_obeys_the_papers_rule(scene):
    for seed, route in enumerate(paper_routes(scene)):
        assert (route.distance, route.duration) == (12.0, 14.0), seed
        assert len(route.turns) in (1, 2), seed
        for turn in route.turns:
            assert math.radians(20.0) <= abs(turn.angle) <= math.radians(50.0), (seed, turn)
            assert 0.8 <= turn.duration <= 1.6, (seed, turn)
            assert turn.start > 0.0, (seed, turn)
            assert turn.start + turn.duration < route.duration, (seed, turn)
        for before, after in itertools.pairwise(route.turns):
            assert before.start + before.duration <= after.start, (seed, "turns overlap")


@pytest.mark.parametrize("scene", ["corridor", "indoor"])
def test_the_heading_stays_within_50_degrees_of_the_start(scene):
    times = np.linspace(0.0, 14.0, 281)
    for seed, route in enumerate(paper_routes(scene)):
        headings = np.array([route.heading(float(t)) for t in times])
        assert np.abs(headings - route.start[2]).max() <= math.radians(50.0) + 1e-12, seed


@pytest.mark.parametrize("scene", ["corridor", "indoor"])
def test_routes_keep_their_distance_from_everything_solid(scene):
    """Sampled every centimeter of the way; the stated clearance may be missed by a centimeter between the samples."""
    place = make_scene(scene)
    for seed, route in enumerate(paper_routes(scene)):
        points = np.array([route.pose(float(t))[:2] for t in np.linspace(0.0, 14.0, 1401)])
        assert distance_to_obstacles(place, points).min() >= CLEARANCE - 0.01, seed
        x0, x1, y0, y1 = place.bounds
        assert (points[:, 0] > x0).all(), seed
        assert (points[:, 0] < x1).all(), seed
        assert (np.abs(points[:, 1] - (y0 + y1) / 2) < (y1 - y0) / 2).all(), seed


@pytest.mark.parametrize("scene", ["corridor", "indoor"])
def test_clearance_agrees_with_an_independent_computation(scene):
    place = make_scene(scene)
    x0, x1, y0, y1 = place.bounds
    points = np.random.default_rng(3).uniform((x0, y0), (x1, y1), (500, 2))
    wanted = distance_to_obstacles(place, points)
    found = [place.clearance(point[None, :]) for point in points]
    assert found == pytest.approx(wanted.tolist(), abs=1e-9)
    assert place.clearance(points) == pytest.approx(wanted.min(), abs=1e-9)


@pytest.mark.parametrize("scene", ["corridor", "indoor"])
def test_is_clear_decides_as_the_clearance_does(scene):
    """Inside, outside and across the bounds, with thresholds from just above 0 to beyond a cell of the table."""
    place, rng = make_scene(scene), np.random.default_rng(6)
    x0, x1, y0, y1 = place.bounds
    answers = []
    for _ in range(2000):
        points = rng.uniform((x0 - 0.5, y0 - 0.5), (x1 + 0.5, y1 + 0.5)) + rng.normal(0.0, 0.3, (4, 2))
        least = float(rng.uniform(0.02, 0.7))
        answers.append(place.is_clear(points, least))
        assert answers[-1] == (place.clearance(points) >= least), (points, least)
    assert 0.1 < np.mean(answers) < 0.9


@pytest.mark.parametrize("scene", ["corridor", "indoor"])
def test_seeds_give_many_different_routes_of_every_kind(scene):
    routes = paper_routes(scene)
    ends = np.array([route.pose(14.0)[:2] for route in routes])
    apart = np.sqrt(((ends[:, None] - ends[None, :]) ** 2).sum(axis=2)) + np.eye(SEEDS)
    assert apart.min() > 0.0
    assert np.ptp(ends[:, 1]) > 0.8
    turned = [sum(turn.angle for turn in route.turns) for route in routes]
    for share in (
        np.mean([len(route.turns) == 1 for route in routes]),
        np.mean([len(route.turns) == 2 for route in routes]),
        np.mean([angle > 0.0 for angle in turned]),
        np.mean([angle < 0.0 for angle in turned]),
    ):
        assert share > 0.05


@pytest.mark.parametrize("scene", ["corridor", "indoor"])
def test_the_same_seed_gives_the_same_route(scene):
    place = make_scene(scene)
    for seed in range(5):
        one, two = (make_motion("paper", place, START, np.random.default_rng(seed)) for _ in range(2))
        assert one.turns == two.turns
        assert [one.pose(t) for t in (3.21, 7.77, 14.0)] == [two.pose(t) for t in (3.21, 7.77, 14.0)]


@pytest.mark.parametrize("scene", ["corridor", "indoor"])
def test_position_is_the_integral_of_velocity(scene):
    """Integrated on a grid of 1 ms that shares no node spacing with the table: better than 0.1 mm everywhere."""
    times = np.arange(0.0, 14.0 + 5e-4, 1e-3)
    for route in paper_routes(scene)[:12]:
        velocity = np.array([route.velocity(float(t)) for t in times])
        steps = 0.5e-3 * (velocity[1:] + velocity[:-1])
        path = np.array(route.start[:2]) + np.vstack((np.zeros(2), np.cumsum(steps, axis=0)))
        found = np.array([route.pose(float(t))[:2] for t in times])
        assert np.abs(found - path).max() < 1e-4
        assert np.sqrt((steps**2).sum(axis=1)).sum() == pytest.approx(12.0, abs=1e-4)


def test_distance_walked_is_the_integral_of_speed():
    for route in (*paper_routes("indoor")[:3], Route(START, 5.0, 4.0, 2.0), Route(START, 3.0, 7.33, 0.4)):
        times = np.linspace(0.0, route.duration, 20001)
        speed = np.array([route.speed(float(t)) for t in times])
        walked = np.concatenate(([0.0], np.cumsum((speed[1:] + speed[:-1]) / 2 * (times[1] - times[0]))))
        assert np.abs([route.walked(float(t)) for t in times] - walked).max() < 1e-5
        assert route.walked(route.duration) == pytest.approx(route.distance, abs=1e-12)


def test_position_velocity_and_heading_are_continuous():
    """Also across the nodes of the table, where one Hermite piece takes over from the next."""
    tiny = 1e-6
    for route in paper_routes("indoor")[:12]:
        nodes = [k * TABLE_STEP for k in range(1, round(14.0 / TABLE_STEP))]
        edges = [edge for turn in route.turns for edge in (turn.start, turn.start + turn.duration)]
        for t in (*nodes, *edges, 1.0, 13.0):
            before, after = np.array(route.pose(t - tiny)), np.array(route.pose(t + tiny))
            assert np.abs(after - before).max() < 1e-5, t
            slope = (after - before)[:2] / (2.0 * tiny)
            assert slope == pytest.approx(np.array(route.velocity(t)), abs=5e-3), t
            assert route.velocity(t + tiny) == pytest.approx(route.velocity(t - tiny), abs=1e-4), t


@pytest.mark.parametrize("name", ["paper", "straight", "standing"])
def test_a_route_starts_and_stops_at_rest_where_it_should(name):
    route = make_motion(name, make_scene("indoor"), START, np.random.default_rng(4))
    assert route.pose(0.0) == START
    assert route.velocity(0.0) == (0.0, 0.0)
    assert route.velocity(route.duration) == pytest.approx((0.0, 0.0), abs=1e-12)
    assert route.speed(0.0) == route.speed(route.duration) == 0.0
    assert route.pose(route.duration + 3.0) == pytest.approx(route.pose(route.duration))
    assert route.speed(route.duration + 3.0) == 0.0
    assert route.walked(route.duration + 3.0) == pytest.approx(route.distance)


def test_acceleration_on_starting_and_stopping_is_that_of_a_person():
    """Raised-cosine ramps of 1 s to 12/13 m/s: the peak is pi / 2 times the mean."""
    route = paper_routes("corridor")[0]
    speed = np.array([route.speed(t) for t in np.linspace(0.0, 14.0, 14001)])
    assert speed.max() == pytest.approx(12.0 / 13.0)
    assert np.abs(np.diff(speed)).max() * 1000.0 == pytest.approx(math.pi / 2.0 * 12.0 / 13.0, rel=1e-3)


def test_a_straight_walk_and_standing_still():
    rng, place = np.random.default_rng(5), make_scene("corridor")
    straight = make_motion("straight", place, (1.0, 0.2, 0.3), rng)
    assert straight.pose(14.0) == pytest.approx((1.0 + 12.0 * math.cos(0.3), 0.2 + 12.0 * math.sin(0.3), 0.3))
    standing = make_motion("standing", place, (1.0, 0.2, 0.3), rng)
    assert [standing.pose(t) for t in (0.0, 5.0, 14.0)] == [(1.0, 0.2, 0.3)] * 3


def test_a_turn_changes_the_heading_by_its_angle_and_to_the_left_when_positive():
    route = Route((0.0, 0.0, 0.0), turns=(Turn(5.0, 1.0, math.radians(30.0)),))
    assert route.heading(5.0) == 0.0
    assert route.heading(5.5) == pytest.approx(math.radians(15.0))
    assert route.heading(6.0) == pytest.approx(math.radians(30.0))
    assert route.pose(14.0)[1] > 2.0


@pytest.mark.parametrize(
    "wrong",
    [{"distance": -1.0}, {"distance": math.nan}, {"duration": 1.0}, {"ramp": 0.0}, {"duration": math.nan}],
    ids=str,
)
def test_an_impossible_route_is_one_clear_error(wrong):
    (value,) = wrong.values()
    with pytest.raises(ValueError, match=r"expected distance >= 0 and duration >= 2 ramp > 0") as raised:
        Route((0.0, 0.0, 0.0), **wrong)
    assert repr(value) in str(raised.value)


def test_a_scene_without_room_is_said_to_have_none():
    place = make_scene("corridor")
    with pytest.raises(ValueError, match=r"no route .* fits the scene 'corridor'"):
        make_motion("paper", place, (17.0, 0.0, 0.0), np.random.default_rng(0))


def test_an_unknown_route_names_the_nearest():
    with pytest.raises(ValueError, match=r"'papr'.*did you mean 'paper'"):
        make_motion("papr", make_scene("corridor"), START, np.random.default_rng(0))


@pytest.mark.parametrize("speed", [0.2, 0.5, 1.1, 2.0])
def test_another_walking_speed_walks_the_same_path(speed):
    """At t times the stretch the person is where the paper's is at t; the way walked and the cruise agree with that."""
    scene = make_scene("indoor")
    for seed in range(5):
        usual, other = (
            make_motion("paper", scene, (0.0, 0.1, 0.0), np.random.default_rng(seed), v) for v in (PAPER_SPEED, speed)
        )
        stretch = (12.0 / 13.0) / speed
        assert other.duration == pytest.approx(14.0 * stretch)
        assert other.speed(other.duration / 2.0) == pytest.approx(speed)
        for share in np.linspace(0.0, 1.0, 57):
            t = 14.0 * float(share)
            assert other.pose(stretch * t) == pytest.approx(usual.pose(t), abs=3e-4)
            assert other.walked(stretch * t) == pytest.approx(usual.walked(t))
            assert other.velocity(stretch * t) == pytest.approx([v / stretch for v in usual.velocity(t)], abs=1e-9)


def test_who_stands_has_no_speed_and_the_papers_speed_changes_nothing():
    scene, start = make_scene("corridor"), (1.0, 0.2, 0.3)
    standing = make_motion("standing", scene, start, np.random.default_rng(0), 0.5)
    assert standing.duration == 14.0
    assert standing.pose(9.0) == start
    straight = Route(start)
    assert straight.at_speed(PAPER_SPEED) is straight


@pytest.mark.parametrize("speed", [0.1, 2.1, -1.0, float("nan"), "fast"])
def test_an_impossible_walking_speed_is_refused(speed):
    with pytest.raises(ValueError, match=r"walking_speed is .*; expected a number >= 0.2 and <= 2 \(m/s\)"):
        EnvConfig(walking_speed=speed)
