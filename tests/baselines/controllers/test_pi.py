"""The PI follower against linear control theory, with python-control as the independent word."""

import math

import control
import numpy as np
import pytest

from baselines.controllers.pi import PIController

DT = 1.0 / 30.0


def proportional_integral(kp, ki):
    return control.tf([kp, ki], [1.0, 0.0])


INTEGRATOR = control.tf([1.0], [1.0, 0.0])


def follow(controller, steps, dt, target_speed=0.0, distance=2.5, speed_limit=math.inf):
    """Return the distances while the robot follows a target walking straight ahead, and the commanded speeds."""
    distances, speeds = [distance], []
    for _ in range(steps):
        v, _ = controller.command(0.0, distance, dt)
        speeds.append(v)
        distance += (target_speed - min(max(v, -speed_limit), speed_limit)) * dt
        distances.append(distance)
    return np.array(distances), np.array(speeds)


def test_the_papers_gains_make_a_distance_loop_of_one_radian_per_second_and_half_damping():
    """Probe the controller for its gains, close the loop around 1/s and read natural frequency and damping."""
    controller = PIController.from_paper()
    dt = 1e-6
    kp = controller.command(0.0, 2.5, dt)[0]  # the first integral contribution is 1e-6
    ki = (controller.command(0.0, 2.5, dt)[0] - kp) / dt
    loop = proportional_integral(kp, ki) * INTEGRATOR
    frequency, damping, _ = control.damp(control.feedback(loop, 1), doprint=False)
    assert frequency == pytest.approx([1.0, 1.0], rel=1e-3)
    assert damping == pytest.approx([0.5, 0.5], rel=1e-3)
    gain_margin, phase_margin, _, crossover = control.margin(loop)
    assert gain_margin == math.inf
    # |L| = 1 where w^4 = w^2 + 1, so w^2 is the golden ratio; the phase left there is atan w.
    assert crossover == pytest.approx(math.sqrt((1.0 + math.sqrt(5.0)) / 2.0), rel=1e-3)
    assert phase_margin == pytest.approx(math.degrees(math.atan(crossover)), rel=1e-3)


def test_the_papers_bearing_loop_is_all_but_proportional():
    controller = PIController.from_paper()
    dt = 1e-6
    kp = controller.command(1.0, 1.5, dt)[1]
    ki = (controller.command(1.0, 1.5, dt)[1] - kp) / dt
    assert kp == pytest.approx(0.7505, abs=5e-5)
    assert ki == pytest.approx(5.2e-4, abs=5e-6)
    poles = control.feedback(proportional_integral(kp, ki) * INTEGRATOR, 1).poles()
    assert np.all(np.isreal(poles))
    assert np.all(poles.real < 0.0)


def test_sampled_loop_equals_its_transfer_function():
    """kp + ki dt z/(z-1) before the plant dt/(z-1): the response to a step of the set-point error, sample by sample."""
    kp, ki, steps = 0.8, 0.6, 300
    z = control.tf([1.0, 0.0], [1.0], DT)
    compensator = kp + ki * DT * z / (z - 1)
    sensitivity = control.minreal(control.feedback(1, compensator * DT / (z - 1)), verbose=False)
    times = np.arange(steps + 1) * DT
    _, expected = control.forced_response(sensitivity, times, np.ones(steps + 1))
    controller = PIController(kp=(0.0, kp), ki=(0.0, ki), integral_limit=None)
    distances, _ = follow(controller, steps, DT)
    assert distances - 1.5 == pytest.approx(expected, abs=1e-9)


def test_sampled_loop_tends_to_the_continuous_one():
    times = np.linspace(0.0, 10.0, 10_001)
    loop = proportional_integral(1.0, 1.0) * INTEGRATOR
    _, expected = control.step_response(control.feedback(1, loop), times)
    distances, _ = follow(PIController.from_paper(), 10_000, 0.001)
    assert distances - 1.5 == pytest.approx(expected, abs=2e-3)


def test_a_steady_walk_is_followed_without_error():
    distances, speeds = follow(PIController.from_paper(), 900, DT, target_speed=0.857, distance=1.5)
    assert distances[-1] == pytest.approx(1.5, abs=1e-3)
    assert speeds[-1] == pytest.approx(0.857, abs=1e-3)


def test_proportional_gain_alone_leaves_an_error():
    distances, _ = follow(PIController(kp=(0.0, 1.0), ki=(0.0, 0.0)), 900, DT, target_speed=0.857, distance=1.5)
    assert distances[-1] - 1.5 == pytest.approx(0.857, abs=1e-3)


@pytest.mark.parametrize(
    ("bearing", "distance", "turns", "drives"),
    [(0.2, 1.5, 1, 0), (-0.2, 1.5, -1, 0), (0.0, 2.0, 0, 1), (0.0, 1.0, 0, -1)],
)
def test_the_robot_turns_and_drives_toward_the_set_point(bearing, distance, turns, drives):
    v, omega = PIController.from_paper().command(bearing, distance, DT)
    assert (np.sign(omega), np.sign(v)) == (turns, drives)


def test_the_axes_do_not_mix():
    """Equation (32) read diagonally: a bearing error never changes v, a distance error never omega."""
    rng = np.random.default_rng(0)
    both, turning, driving = (PIController((0.7, 1.1), (0.2, 0.9)) for _ in range(3))
    for bearing, distance in zip(rng.normal(0.0, 0.3, 100), rng.normal(1.6, 0.4, 100), strict=True):
        v, omega = both.command(bearing, distance, DT)
        assert omega == turning.command(bearing, 1.5, DT)[1]
        assert v == driving.command(0.0, distance, DT)[0]


def test_the_set_point_asks_for_rest():
    assert PIController((1.0, 1.0), (1.0, 1.0), set_point=(0.1, 2.0)).command(0.1, 2.0, DT) == (0.0, 0.0)


def test_the_integral_stays_within_its_limit_and_lets_go_at_once():
    limit = (0.3, 0.7)
    controller = PIController(kp=(0.0, 0.0), ki=(1.0, 1.0), integral_limit=limit)
    for _ in range(1000):
        v, omega = controller.command(1.0, 4.0, DT)
    assert (v, omega) == (limit[1], limit[0])
    v, omega = controller.command(-1.0, -1.0, DT)
    assert v == pytest.approx(limit[1] - 2.5 * DT)
    assert omega == pytest.approx(limit[0] - DT)
    for _ in range(1000):
        v, omega = controller.command(-1.0, -4.0, DT)
    assert (v, omega) == (-limit[1], -limit[0])


def test_the_limit_prevents_wind_up_against_a_slow_robot():
    """From 4 m too far at 0.5 m/s at most, the plain integrator runs into the person and the clamped one does not."""
    plain = PIController.from_paper()
    clamped = PIController(kp=(0.7505, 1.0), ki=(5.2e-4, 1.0), integral_limit=(0.5, 0.5))
    closest = [follow(c, 1800, DT, distance=5.5, speed_limit=0.5)[0].min() for c in (plain, clamped)]
    assert closest[0] < 0.0
    assert closest[1] > 1.0


def test_reset_forgets_the_errors():
    controller = PIController.from_paper()
    first = controller.command(0.2, 2.0, DT)
    assert controller.command(0.2, 2.0, DT) != first
    controller.reset()
    assert controller.command(0.2, 2.0, DT) == first


@pytest.mark.parametrize("bad", [math.nan, math.inf])
def test_a_target_that_is_not_finite_is_refused_and_leaves_no_trace(bad):
    controller = PIController.from_paper()
    for target in ((bad, 1.5), (0.0, bad)):
        with pytest.raises(ValueError, match="target"):
            controller.command(*target, DT)
    assert controller.command(0.0, 1.5, DT) == (0.0, 0.0)


@pytest.mark.parametrize("dt", [0.0, -DT, math.nan, math.inf])
def test_time_must_advance(dt):
    with pytest.raises(ValueError, match="dt"):
        PIController.from_paper().command(0.0, 1.5, dt)


@pytest.mark.parametrize(
    ("settings", "named"),
    [
        ({"kp": (-1.0, 1.0)}, "kp"),
        ({"ki": (1.0, math.nan)}, "ki"),
        ({"set_point": (math.inf, 1.5)}, "set_point"),
        ({"integral_limit": (0.0, 1.0)}, "integral_limit"),
    ],
)
def test_impossible_settings_are_refused(settings, named):
    with pytest.raises(ValueError, match=named):
        PIController(**{"kp": (1.0, 1.0), "ki": (1.0, 1.0), **settings})
