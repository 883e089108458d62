"""The batch against `FollowEnv`: the same episodes step by step, the same collisions and sight, the same chances."""

import math

import numpy as np
import pytest
from scipy import optimize, stats

from follow_env import IDS
from follow_env.config import RobotConfig
from follow_env.envs.batch import FollowVectorEnv
from follow_env.envs.follow import FollowEnv
from follow_env.sensors import MeasurementConfig
from follow_env.world.bullet import World
from follow_env.world.kinematic.drive import roll
from follow_env.world.kinematic.world import KinematicWorld
from follow_env.world.motion.base import make_motion
from follow_env.world.motion.routes import Route, Turn
from follow_env.world.scene import footprint
from follow_env.world.scenes import make_scene

BAD_SENSOR = {"measurement": {"outlier_share": 0.2, "miss_share": 0.1}}
SCENE = pytest.mark.parametrize("scene", IDS)


def chase(info):
    """Return the twist, as shares of the robot's limits, that follows the truth."""
    return np.clip(((info["distance"] - 0.6) / 1.2, 0.6 * info["bearing"]), -1.0, 1.0)


def chase_by_wheels(info):
    """Return the wheels' speeds, as shares of their limit, for that twist."""
    v, omega = chase(info) * (1.2, 2.0)
    return np.array((v - 0.15 * omega, v + 0.15 * omega)) / 1.5


@SCENE
@pytest.mark.parametrize(
    ("settings", "policy"),
    [
        ({"obs": "measurement", "latency_s": 0.1}, chase),
        ({"obs": "state", "action": "wheels"}, chase_by_wheels),
        ({"obs": "measurement", "walking_speed": 1.1}, chase),
    ],
)
def test_the_same_episodes_come_out_step_by_step(scene, settings, policy):
    """Routes, errors, delays, rewards, endings and every entry of info; the robot within centimeters."""
    settings = {"scene": scene, "sensor": BAD_SENSOR, **settings}
    seeds = [0, 7]
    batch = FollowVectorEnv(len(seeds), **settings)
    observations, infos = batch.reset_as_single(seeds)
    singles = [FollowEnv(**settings) for _ in seeds]
    starts = [single.reset(seed=seed) for single, seed in zip(singles, seeds, strict=True)]
    assert [o.tolist() for o, _ in starts] == observations.tolist()
    last = [info for _, info in starts]
    valid = steps = 0
    truncated = np.zeros(len(seeds), bool)
    while not truncated.all():
        steps += 1
        observations, rewards, terminated, truncated, infos = batch.step(actions := np.array([policy(i) for i in last]))
        for i, single in enumerate(singles):
            observation, reward, *ends, last[i] = single.step(actions[i])
            valid += observation[2] == 1.0
            assert observation == pytest.approx(observations[i], abs=0.04)
            assert reward == pytest.approx(rewards[i], abs=0.03)
            assert ends == [terminated[i], truncated[i]]
            for key, value in last[i].items():
                if key == "rewards":
                    assert value == pytest.approx({name: infos[key][name][i] for name in value}, abs=0.03)
                elif key == "collision_with":
                    assert infos[key][i] == value
                else:
                    tolerance = 1e-4 if key.startswith("person") else 0.04
                    assert np.abs(np.asarray(infos[key][i], float) - np.asarray(value, float)).max() < tolerance, key
    assert steps == math.ceil(singles[0].motion.duration * 30.0 - 1e-9)
    assert settings["obs"] == "state" or 0.5 < valid / (2 * steps) < 0.95
    batch.close()
    for single in singles:
        single.close()


@SCENE
@pytest.mark.parametrize("speed", [12.0 / 13.0, 1.4])
def test_a_route_drawn_by_the_batch_is_walked_as_the_route_of_these_turns(scene, speed):
    """Simpson's rule from step to step against the interpolated table of `Route`: within 0.1 mm."""
    batch = FollowVectorEnv(20, scene=scene, obs="state", walking_speed=speed, autoreset_mode="Disabled")
    _, info = batch.reset(seed=4, options={"robot_pose": (-2.0, 0.0, 0.0)})
    starts, duration = info["person_pose"], 14.0 * (12.0 / 13.0) / speed
    turns = [
        tuple(
            Turn(*(float(world[f"turn_{name}"][k]) for name in ("start", "duration", "angle")))
            for k in range(world["turns"])
        )
        for world in batch._worlds
    ]
    ramp = duration / 14.0
    routes = [Route(tuple(start), 12.0, duration, ramp, t) for start, t in zip(starts, turns, strict=True)]
    assert {len(t) for t in turns} == {1, 2}
    for step in range(1, math.ceil(duration * 30.0 - 1e-9)):
        *_, terminated, truncated, info = batch.step(np.zeros((20, 2)))
        assert not (terminated | truncated).any()
        if step % 7 == 0:
            wanted = [route.pose(step / 30.0) for route in routes]
            assert np.abs(info["person_pose"] - wanted).max() < 1e-4
            assert info["person_velocity"] == pytest.approx(
                np.array([route.velocity(step / 30.0) for route in routes]), abs=1e-9
            )
    batch.close()


@SCENE
def test_half_the_walking_speed_takes_twice_the_time(scene):
    """The routes that the batch draws itself: the same places, every second step."""
    usual, slow = (
        FollowVectorEnv(50, scene=scene, obs="state", walking_speed=12.0 / 13.0 / stretch) for stretch in (1, 2)
    )
    away = {"robot_pose": (-2.0, 0.0, 0.0)}
    usual.reset(seed=4, options=away)
    slow.reset(seed=4, options=away)
    for _ in range(419):
        *_, terminated, truncated, info = usual.step(np.zeros((50, 2)))
        slow.step(np.zeros((50, 2)))
        *_, slow_truncated, slow_info = slow.step(np.zeros((50, 2)))
        assert not (terminated | truncated | slow_truncated).any()
        assert slow_info["person_pose"] == pytest.approx(info["person_pose"], abs=1e-4)
        assert 2.0 * slow_info["person_velocity"] == pytest.approx(info["person_velocity"], abs=1e-6)
    usual.close()
    slow.close()


@SCENE
def test_touch_and_sight_are_those_of_pybullet(scene):
    """At random poses beside obstacles; Bullet's own rounding decides differently within half a millimeter."""
    rng, place = np.random.default_rng(0), make_scene(scene)
    physics, mine = World(place, RobotConfig()), KinematicWorld(place, RobotConfig())
    obstacles = place.obstacles()
    far, agree, touched, hidden = (90.0, 90.0, 0.0), [], 0, 0
    for _ in range(800):
        obstacle = footprint(obstacles[rng.integers(len(obstacles))])
        across = rng.uniform(-0.3, 0.3, 2) + rng.choice((-1.0, 1.0), 2) * obstacle[2:4]
        x, y = obstacle[0] + across[0] * rng.uniform(), obstacle[1] + across[1]
        yaw, length = rng.uniform(-3.1, 3.1), rng.uniform(0.3, 3.0)
        for world in (physics, mine):
            world.reset((x, y, yaw), far)
            world.simulate(1)
        wanted = physics.collision()
        touched += wanted == "wall"
        agree.append(mine.collision() == wanted)
        eye, point = (x, y, 1.0), (x + length * math.cos(yaw), y + length * math.sin(yaw), 1.2)
        physics.reset(far, (80.0, 80.0, 0.0))
        wanted = physics.line_of_sight(eye, point)
        hidden += not wanted
        agree.append(mine.line_of_sight(eye, point) == wanted)
    assert np.mean(agree) > 0.99
    assert min(touched, hidden) > 80
    physics.close()


def test_bumping_into_the_person_is_that_of_pybullet():
    rng = np.random.default_rng(0)
    physics, mine = (kind(make_scene("corridor"), RobotConfig()) for kind in (World, KinematicWorld))
    agree, touched = [], 0
    for _ in range(600):
        yaw, around, away = rng.uniform(-3.1, 3.1), rng.uniform(-3.1, 3.1), rng.uniform(0.25, 0.5)
        for world in (physics, mine):
            world.reset((2.0, 0.0, yaw), (2.0 + away * math.cos(around), away * math.sin(around), 0.0))
            world.simulate(1)
        touched += physics.collision() == "person"
        agree.append(mine.collision() == physics.collision())
    assert np.mean(agree) > 0.99
    assert 200 < touched < 500
    physics.close()


@SCENE
def test_routes_and_starts_have_the_same_chances(scene):
    """Kolmogorov-Smirnov: where the robot starts and where, and in which direction, the person ends."""
    place, count = make_scene(scene), 250
    x, y, yaw = place.start
    ends = []
    for seed in range(count):
        rng = np.random.default_rng(seed)
        shift = y + float(rng.uniform(-1.0, 1.0)) * place.start_width
        route = make_motion("paper", place, (x + 1.5, shift, yaw), rng)
        ends.append((shift, *route.pose(7.0), *route.pose(14.0)))
    batch = FollowVectorEnv(1000, scene=scene, obs="state")
    _, info = batch.reset(seed=0)
    mine = [info["robot_pose"][:, 1]]
    batch.reset(seed=0, options={"robot_pose": (-2.0, 0.0, 0.0)})
    for step in range(1, 421):
        *_, terminated, _, info = batch.step(np.zeros((1000, 2)))
        assert not terminated.any()
        if step in (210, 420):
            mine += list(info["person_pose"].T)
    for wanted, got in zip(np.array(ends).T, mine, strict=True):
        assert stats.ks_2samp(wanted.round(3), got.round(3)).pvalue > 0.005
    batch.close()


def test_measurement_errors_have_the_same_chances():
    """Kolmogorov-Smirnov on the errors of standing scenes, taken a second apart, with outliers and misses."""
    settings = {"route": "standing", "sensor": BAD_SENSOR}
    single, batch = FollowEnv(**settings), FollowVectorEnv(300, **settings)
    stop, wanted, got = np.zeros(2), [], []
    for seed in range(12):
        single.reset(seed=seed)
        for step in range(419):
            observation, _, _, _, info = single.step(stop)
            if step % 30 == 0:
                wanted.append((observation[2], observation[0] - info["bearing"], observation[1] - info["distance"]))
    batch.reset(seed=0)
    runs = []
    for step in range(61):
        observations, *_, info = batch.step(np.zeros((300, 2)))
        runs.append(np.where(observations[:, 2] == 1, observations[:, 0] - info["bearing"], np.nan))
        if step % 30 == 0:
            got.append(
                np.stack(
                    (observations[:, 2], observations[:, 0] - info["bearing"], observations[:, 1] - info["distance"]), 1
                )
            )
    wanted, got = np.array(wanted), np.concatenate(got)
    share, other = wanted[:, 0].mean(), got[:, 0].mean()
    assert abs(share - other) < 4.0 * math.sqrt(0.09 * (1 / len(wanted) + 1 / len(got)))
    for column in (1, 2):
        assert stats.ks_2samp(wanted[wanted[:, 0] == 1, column], got[got[:, 0] == 1, column]).pvalue > 0.005
    for steps in (1, 8, 30):
        before, after = np.array(runs)[:-steps].ravel(), np.array(runs)[steps:].ravel()
        both = np.isfinite(before + after)
        expected = math.exp(-steps / 30.0 / MeasurementConfig().bearing_correlation_s)
        assert np.corrcoef(before[both], after[both])[0, 1] == pytest.approx(expected, abs=0.06)
    single.close()
    batch.close()


SMALL = {"width": 40, "height": 30}


@SCENE
@pytest.mark.parametrize("obs", ["rgbd", "rgbd_uint8"])
def test_the_same_pictures_come_out(scene, obs):
    """With an exact sensor, pixel by pixel at the start, and nearly everywhere while the robots are a little apart."""
    settings = {"scene": scene, "obs": obs, "camera": SMALL, "sensor": "ideal", "outfit": "red", "latency_s": 1 / 15}
    batch, single = FollowVectorEnv(3, threads=2, **settings), FollowEnv(**settings)
    observations, infos = batch.reset_as_single([0, 1, 2])
    assert batch.observation_space.contains(observations)
    wanted, info = single.reset(seed=1)
    for step in range(40):
        depth = observations["depth"][1] if obs == "rgbd" else infos["depth"][1]
        true_depth = wanted["depth"] if obs == "rgbd" else info["depth"]
        rgb = (observations["rgb"] if obs == "rgbd" else observations)[1].astype(int)
        true_rgb = (wanted["rgb"] if obs == "rgbd" else wanted).astype(int)
        if step == 0:
            assert (depth == true_depth).all()
            assert (rgb == true_rgb).all()
        assert np.mean(np.abs(depth - true_depth) > 0.05) < 0.02
        assert np.mean(np.abs(rgb - true_rgb) > 20) < 0.03
        action = chase(info)
        wanted, _, _, _, info = single.step(action)
        observations, _, _, _, infos = batch.step(np.tile(action, (3, 1)))
        if obs == "rgbd":
            assert observations["twist"][1] == pytest.approx(wanted["twist"], abs=0.02)
    batch.close()
    single.close()


@pytest.mark.parametrize("tau", [0.06, 0.15])
@pytest.mark.parametrize("rims", [(0.8, 0.8), (-0.3, 0.3)], ids=["straight", "spin"])
def test_the_wheels_answer_a_step_with_the_time_constant_of_the_settings(tau, rims):
    """Identification: the time constant with which the model fits PyBullet's odometry best."""
    world = World(make_scene("corridor"), RobotConfig(wheel_time_constant=tau))
    world.reset((0.0, 0.0, 0.0), (9.0, 0.0, 0.0))
    odometry, commands = [], []
    for _ in range(30):
        odometry.append(world.step(*rims, 8))
        commands.append(world.wheel_command)
    world.close()

    def misfit(guess):
        left = right = total = 0.0
        for command, (v, omega) in zip(commands, odometry, strict=True):
            *_, left, right, my_v, my_omega = roll(
                0.0, 0.0, 0.0, 1.0, 0.0, left, right, *command, math.exp(-1 / 240 / guess), 8, 0.3
            )
            total += (v - my_v) ** 2 + (0.15 * (omega - my_omega)) ** 2
        return total

    fit = optimize.minimize_scalar(misfit, bounds=(0.02, 0.4), method="bounded")
    assert fit.x == pytest.approx(tau, rel=0.03)
    assert math.sqrt(fit.fun / 30) < 0.003
