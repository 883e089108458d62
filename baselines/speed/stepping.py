"""Steps and resets of the environment, beside bare physics steps of the same world in the same run."""

from __future__ import annotations

import itertools
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from baselines.followers.build import make_follower
from baselines.speed.timing import Cost, measure
from follow_env.envs.follow import FollowEnv
from follow_env.world.bullet import World

BARE = "8 bare physics steps"
SPEED = 0.48
"""Of the robot where nobody decides, m/s."""


@dataclass(frozen=True)
class StepCost:
    """Cost of a step or reset.

    Attributes:
        scene: Name of the scene.
        what: What was called.
        cost: Of a call, s.
        bare_cost: Of the physics steps alone in the same run, s.
    """

    scene: str
    what: str
    cost: Cost
    bare_cost: Cost


def measure_steps(scene: str, steps: int, resets: int) -> list[StepCost]:
    """Return what steps and resets cost in a scene, `steps` and `resets` single ones of each kind."""
    envs = {
        "step, obs=measurement": FollowEnv(scene=scene),
        "step, obs=measurement, with AKF + PI": FollowEnv(scene=scene),
        "step, obs=rgbd 320x240": FollowEnv(scene=scene, obs="rgbd", camera={"width": 320, "height": 240}),
        "step, obs=rgbd_uint8 84x84": FollowEnv(scene=scene, obs="rgbd_uint8", camera={"width": 84, "height": 84}),
    }
    first = next(iter(envs.values()))
    world = World(first.scene, first.config.robot)
    operations: dict[str, Callable[[], object]] = {BARE: _roll(world)}
    for what, env in envs.items():
        operations[what] = _follow(env, scene) if "AKF" in what else _drive(env)
    costs = measure(operations, steps)
    costs |= measure({"reset": first.reset}, resets)
    world.close()
    for env in envs.values():
        env.close()
    return [StepCost(scene, what, cost, costs[BARE]) for what, cost in costs.items()]


def _roll(world: World) -> Callable[[], object]:
    """Return a function that takes 8 physics steps straight ahead, from the start again before anything is hit."""
    calls = itertools.cycle(range(300))

    def step() -> None:
        if next(calls) == 0:
            world.reset((0.0, 0.0, 0.0), (8.0, 0.0, 0.0))
            world.step(SPEED, SPEED, 240)
        world.simulate(8)

    return step


def _drive(env: FollowEnv) -> Callable[[], object]:
    """Return a function that takes one step with a constant action, whatever happens."""
    env.reset(seed=0)
    action = np.array((SPEED / env.config.robot.max_speed, 0.0), np.float32)

    def step() -> None:
        _, _, terminated, truncated, _ = env.step(action)
        if terminated or truncated:
            env.reset()

    return step


def _follow(env: FollowEnv, scene: str) -> Callable[[], object]:
    """Return a function that lets paper B's follower decide and takes one step."""
    policy, state = make_follower("akf", scene=scene), None
    observation, _ = env.reset(seed=0)

    def step() -> None:
        nonlocal observation, state
        action, state = policy.predict(observation, state)
        observation, _, terminated, truncated, _ = env.step(action)
        if terminated or truncated:
            observation, _ = env.reset()
            state = None

    return step
