"""The simulated robot against the differential-drive equations, integrated independently here."""

import math

import numpy as np
import pytest

from follow_env.config import RobotConfig
from follow_env.world.bullet import World
from follow_env.world.clock import PHYSICS_HZ
from follow_env.world.robots.diff_drive import DiffDrive, advance
from follow_env.world.scene import Material, Scene

PLAIN = Scene("plain", (), Material((0.5, 0.5, 0.5)), (), 0.3, (-50.0, 50.0, -50.0, 50.0))
FAR_AWAY = (30.0, 30.0, 0.0)
CONTROL_HZ = 30
SUBSTEPS = PHYSICS_HZ // CONTROL_HZ
ROBOT_MASS = 9.6
WHEEL_INERTIA = 0.02
MOTIONS = {
    "straight": (0.85, 0.0),
    "arc": (0.85, 1.0),
    "spin": (0.0, 1.0),
    "right turn": (0.6, -1.5),
    "limits": (1.2, 2.0),
    "backwards": (-0.5, 0.5),
}


@pytest.fixture(scope="module")
def world():
    world = World(PLAIN, RobotConfig())
    yield world
    world.close()


def drive(world, twist, seconds, start=(0.0, 0.0, 0.0)):
    """Command a twist from rest; return poses (n, 3) with unwrapped yaw and odometry twists (n, 2)."""
    world.reset(start, FAR_AWAY)
    poses, odometry = [], []
    for _ in range(round(seconds * CONTROL_HZ)):
        odometry.append(world.step(*world.drive.wheels(*twist), SUBSTEPS))
        poses.append(world.robot_pose())
    poses = np.array(poses)
    poses[:, 2] = np.unwrap(poses[:, 2])
    return poses, np.array(odometry)


def expected(twist, seconds, config):
    """Integrate the equations: command scaled and slew-limited at the control rate, first-order wheels, exact arcs."""
    half, tau = 0.5 * config.track_width, config.wheel_time_constant
    goal = np.array([twist[0] - twist[1] * half, twist[0] + twist[1] * half])
    goal *= min(1.0, config.max_wheel_speed / max(np.abs(goal).max(), 1e-12))
    command, rims = np.zeros(2), np.zeros(2)
    x = y = yaw = 0.0
    fine = 1.0 / (CONTROL_HZ * 200)
    poses = []
    for _ in range(round(seconds * CONTROL_HZ)):
        most = config.max_wheel_acceleration / CONTROL_HZ
        command = command + np.clip(goal - command, -most, most)
        for _ in range(200):
            following = command + (rims - command) * math.exp(-fine / tau)
            left, right = 0.5 * (rims + following)
            v, turn = 0.5 * (left + right), (right - left) / config.track_width * fine
            if abs(turn) > 1e-12:
                radius = v * fine / turn
                x += radius * (math.sin(yaw + turn) - math.sin(yaw))
                y -= radius * (math.cos(yaw + turn) - math.cos(yaw))
            else:
                x, y = x + v * fine * math.cos(yaw), y + v * fine * math.sin(yaw)
            yaw += turn
            rims = following
        poses.append((x, y, yaw))
    return np.array(poses)


def path_length(poses):
    return float(np.sqrt((np.diff(poses[:, :2], axis=0) ** 2).sum(axis=1)).sum())


@pytest.mark.parametrize("twist", MOTIONS.values(), ids=MOTIONS)
def test_the_robot_moves_as_the_equations_say_from_rest(world, twist):
    """At every step of 2 s; a straight line and a pivot have no relative measure, so 2 mm and 1 mrad are allowed."""
    poses, _ = drive(world, twist, 2.0)
    wanted = expected(twist, 2.0, world.config)
    error = np.sqrt(((poses - wanted)[:, :2] ** 2).sum(axis=1))
    assert error.max() < 0.005 * path_length(wanted) + 0.002
    assert np.abs(poses[:, 2] - wanted[:, 2]).max() < 0.005 * abs(wanted[-1, 2]) + 0.001


@pytest.mark.parametrize("twist", MOTIONS.values(), ids=MOTIONS)
def test_at_steady_speed_the_robot_drives_the_exact_arc(world, twist):
    poses, _ = drive(world, twist, 4.0)
    half_way = poses[2 * CONTROL_HZ - 1]
    end = advance(tuple(half_way), twist[0], twist[1], 2.0)
    length, angle = abs(twist[0]) * 2.0, abs(twist[1]) * 2.0
    assert math.hypot(poses[-1, 0] - end[0], poses[-1, 1] - end[1]) < 0.005 * length + 0.002
    assert abs(poses[-1, 2] - end[2]) < 0.005 * angle + 0.001


@pytest.mark.parametrize("twist", MOTIONS.values(), ids=MOTIONS)
def test_wheels_do_not_slip(world, twist):
    """Dead reckoning from the wheels' angles arrives where the robot is: less than 1 % of the way and of the turn."""
    poses, odometry = drive(world, twist, 4.0)
    reckoned = (0.0, 0.0, 0.0)
    for v, omega in odometry:
        reckoned = advance(reckoned, v, omega, 1.0 / CONTROL_HZ)
    away = math.hypot(reckoned[0] - poses[-1, 0], reckoned[1] - poses[-1, 1])
    assert away < 0.01 * path_length(poses) + 0.002
    assert abs(reckoned[2] - poses[-1, 2]) < 0.01 * abs(poses[-1, 2]) + 0.001


def test_the_motion_does_not_depend_on_where_it_starts(world):
    from_origin, _ = drive(world, (0.85, 1.0), 2.0)
    x, y, yaw = 7.0, -4.0, 2.5
    elsewhere, _ = drive(world, (0.85, 1.0), 2.0, (x, y, yaw))
    cosine, sine = math.cos(yaw), math.sin(yaw)
    moved = np.stack(
        (
            x + cosine * from_origin[:, 0] - sine * from_origin[:, 1],
            y + sine * from_origin[:, 0] + cosine * from_origin[:, 1],
            yaw + from_origin[:, 2],
        ),
        axis=1,
    )
    assert np.abs(elsewhere - moved).max() < 0.003


@pytest.mark.parametrize(("twist", "turns"), [((0.5, 1.0), 1.0), ((0.5, -1.0), -1.0)], ids=["left", "right"])
def test_a_positive_yaw_rate_turns_left_with_the_right_wheel_faster(world, twist, turns):
    """REP-103: x forward, y left, yaw counter-clockwise (paper B, eqs. (33)-(34) with the sign of omega turned)."""
    left, right = world.drive.wheels(*twist)
    assert (right - left) * turns == pytest.approx(0.30)
    poses, odometry = drive(world, twist, 1.0)
    assert poses[-1, 0] > 0.1
    assert poses[-1, 1] * turns > 0.05
    assert poses[-1, 2] * turns > 0.5
    assert odometry[-1, 1] * turns > 0.9


def test_wheels_and_twist_are_inverse():
    rng = np.random.default_rng(0)
    for _ in range(100):
        robot = DiffDrive(RobotConfig(track_width=float(rng.uniform(0.1, 0.8))))
        v, omega, left, right = (float(value) for value in rng.uniform(-2.0, 2.0, 4))
        assert robot.twist(*robot.wheels(v, omega)) == pytest.approx((v, omega))
        assert robot.wheels(*robot.twist(left, right)) == pytest.approx((left, right))


def test_speeds_beyond_the_limit_are_scaled_with_the_curvature_kept():
    robot = DiffDrive(RobotConfig())
    rng = np.random.default_rng(1)
    for _ in range(100):
        v, omega = float(rng.uniform(1.6, 4.0) * rng.choice((-1.0, 1.0))), float(rng.uniform(-6.0, 6.0))
        left, right = robot.limit(*robot.wheels(v, omega), (0.0, 0.0), dt=100.0)
        slower = robot.twist(left, right)
        assert max(abs(left), abs(right)) == pytest.approx(1.5)
        assert slower[1] / slower[0] == pytest.approx(omega / v)
        assert slower[0] * v > 0.0


def test_speeds_within_the_limits_pass_unchanged():
    robot = DiffDrive(RobotConfig())
    assert robot.limit(1.4, -1.4, (1.4, -1.35), dt=1.0 / CONTROL_HZ) == (1.4, -1.4)


def test_the_wheel_command_never_changes_faster_than_the_limit(world):
    rng = np.random.default_rng(2)
    world.reset((0.0, 0.0, 0.0), FAR_AWAY)
    last, fastest = np.zeros(2), 0.0
    for _ in range(150):
        world.step(*rng.uniform(-3.0, 3.0, 2).tolist(), SUBSTEPS)
        command = np.array(world.wheel_command)
        fastest = max(fastest, float(np.abs(command - last).max()) * CONTROL_HZ)
        assert np.abs(command).max() <= 1.5 + 1e-12
        last = command
    assert fastest == pytest.approx(2.0), "the limit is never reached, so this test proves nothing"


def test_the_robot_respects_speed_and_acceleration_limits(world):
    """Full speed both ways in turn; the wheels follow their command, so neither limit is passed by more than 1 %."""
    world.reset((0.0, 0.0, 0.0), FAR_AWAY)
    speeds = []
    for wanted in (9.0, -9.0):
        speeds += [world.step(wanted, wanted, SUBSTEPS)[0] for _ in range(60)]
    speeds = np.array(speeds)
    assert 1.49 < np.abs(speeds).max() < 1.515
    assert 1.9 < np.abs(np.diff(speeds)).max() * CONTROL_HZ < 2.02


@pytest.mark.parametrize("iterations", [0, 2.0, True])
def test_an_impossible_count_of_solver_iterations_is_one_clear_error(iterations):
    with pytest.raises(ValueError, match=rf"solver_iterations is {iterations}; expected a whole number from 1"):
        World(PLAIN, RobotConfig(), solver_iterations=iterations)


@pytest.mark.parametrize("torque", [0.1, 0.2])
def test_a_weak_motor_accelerates_as_its_torque_allows(torque):
    """Newton: two wheels push the mass and their own inertia, a = (2 T / r) / (m + 2 I / r^2)."""
    config = RobotConfig(max_wheel_torque=torque)
    world = World(PLAIN, config)
    _, odometry = drive(world, (1.2, 0.0), 2.0)
    world.close()
    radius = config.wheel_radius
    acceleration = 2.0 * torque / radius / (ROBOT_MASS + 2.0 * WHEEL_INERTIA / radius**2)
    assert (odometry[-1, 0] - odometry[29, 0]) / 1.0 == pytest.approx(acceleration, rel=0.03)
    assert odometry[-1, 0] < 0.8, "the speed limit ends the acceleration, so this test proves nothing"


def test_a_parked_robot_creeps_by_less_than_a_millimeter_per_second(world):
    """Few solver iterations leave a residue of the contact forces; a whole episode of it must not matter."""
    poses, odometry = drive(world, (0.0, 0.0), 14.0, (1.0, -2.0, 0.7))
    assert np.abs(poses - (1.0, -2.0, 0.7)).max() < 0.014
    assert np.abs(odometry).max() < 1e-3


@pytest.mark.parametrize("twist", [(0.7, 0.0), (0.7, 0.4), (0.0, -1.2)])
def test_advance_is_the_limit_of_small_steps(twist):
    x = y = yaw = 0.0
    for _ in range(20000):
        x, y, yaw = x + twist[0] * 1e-4 * math.cos(yaw), y + twist[0] * 1e-4 * math.sin(yaw), yaw + twist[1] * 1e-4
    assert advance((0.0, 0.0, 0.0), *twist, 2.0) == pytest.approx((x, y, yaw), abs=2e-4)
