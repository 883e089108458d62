"""What the contact solver's iterations buy: motion as the differential-drive equations say, and what they cost."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import partial

from baselines.speed.timing import Cost, measure
from follow_env.config import RobotConfig
from follow_env.world.bullet import SOLVER_ITERATIONS, World
from follow_env.world.clock import PHYSICS_HZ
from follow_env.world.robots.diff_drive import DiffDrive, advance
from follow_env.world.scene import Material, Scene
from follow_env.world.scenes import make_scene

ITERATIONS = (5, 10, 20, 50)
MOTIONS = ((0.85, 0.0), (0.85, 1.0), (0.0, 1.0), (0.6, -1.5), (1.2, 2.0), (-0.5, 0.5))
"""Twists (v in m/s, omega in rad/s) that are driven from rest."""
PERIODS, SUBSTEPS, FINE = 60, 8, 100
"""Control periods of a motion, physics steps and steps of the equations in each."""
FAR_AWAY = (30.0, 30.0, 0.0)

EMPTY = Scene("empty", (), Material((0.5, 0.5, 0.5)), (), 0.3, (-50.0, 50.0, -50.0, 50.0))


@dataclass(frozen=True)
class SolverCost:
    """Accuracy and cost of the physics.

    Attributes:
        iterations: Of the contact solver.
        position_error: Largest distance from where the equations say, over the motions' 2 s, m.
        heading_error: The same of the heading, rad.
        creep: How far the robot moves in 14 s of standing still, m.
        cost: Of 8 physics steps in the indoor scene while driving a circle, s.
    """

    iterations: int
    position_error: float
    heading_error: float
    creep: float
    cost: Cost


def measure_solver(count: int) -> list[SolverCost]:
    """Return a row for each of `ITERATIONS`; the times are those of `count` calls."""
    indoor = make_scene("indoor")
    circling = {n: circling_world(indoor, n) for n in ITERATIONS}
    costs = measure({str(n): partial(world.simulate, SUBSTEPS) for n, world in circling.items()}, count)
    for world in circling.values():
        world.close()
    rows = []
    for n in ITERATIONS:
        world = World(EMPTY, RobotConfig(), n)
        away, turned = zip(*(_errors(world, twist) for twist in MOTIONS), strict=True)
        rows.append(SolverCost(n, max(away), max(turned), _creep(world), costs[str(n)]))
        world.close()
    return rows


def circling_world(scene: Scene, solver_iterations: int = SOLVER_ITERATIONS) -> World:
    """Return a world in which the robot drives a circle of 1 m across, so that it never runs into anything."""
    world = World(scene, RobotConfig(), solver_iterations)
    world.reset((0.0, -0.5, 0.0), (8.0, 0.0, 0.0))
    world.step(*world.drive.wheels(0.4, 0.8), PHYSICS_HZ)
    return world


def _errors(world: World, twist: tuple[float, float]) -> tuple[float, float]:
    """Return the largest error of position (m) and heading (rad) of a motion from rest."""
    world.reset((0.0, 0.0, 0.0), FAR_AWAY)
    away = turned = 0.0
    for x, y, yaw in _equations(world.drive, twist):
        world.step(*world.drive.wheels(*twist), SUBSTEPS)
        pose = world.robot_pose()
        away = max(away, math.dist(pose[:2], (x, y)))
        turned = max(turned, abs(math.remainder(pose[2] - yaw, math.tau)))
    return away, turned


def _equations(drive: DiffDrive, twist: tuple[float, float]) -> list[tuple[float, float, float]]:
    """Integrate limits, first-order wheels and arcs (paper B, eqs. (33)-(34)); the pose after each period."""
    period = SUBSTEPS / PHYSICS_HZ
    keep = math.exp(-period / FINE / drive.config.wheel_time_constant)
    pose, command, rims, poses = (0.0, 0.0, 0.0), (0.0, 0.0), (0.0, 0.0), []
    for _ in range(PERIODS):
        command = drive.limit(*drive.wheels(*twist), command, period)
        for _ in range(FINE):
            new = (command[0] + (rims[0] - command[0]) * keep, command[1] + (rims[1] - command[1]) * keep)
            v, omega = drive.twist(0.5 * (rims[0] + new[0]), 0.5 * (rims[1] + new[1]))
            pose, rims = advance(pose, v, omega, period / FINE), new
        poses.append(pose)
    return poses


def _creep(world: World) -> float:
    world.reset((0.0, 0.0, 0.0), FAR_AWAY)
    for _ in range(14 * PHYSICS_HZ // SUBSTEPS):
        world.step(0.0, 0.0, SUBSTEPS)
    return math.dist(world.robot_pose()[:2], (0.0, 0.0))
