"""`follow speed`: what a step, a reset and a frame cost here, each beside a peer measured in the same run."""

from __future__ import annotations

import json
import statistics
import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from baselines.benchmark.configuration import machine, packages
from baselines.benchmark.report import markdown_table
from baselines.policy import make_follower
from follow_env import IDS
from follow_env.camera import CameraPose, PinholeCamera, Renderer, make_renderer
from follow_env.config import CameraConfig
from follow_env.env import FollowEnv
from follow_env.person.bodies import load_body
from follow_env.person.walker import Walker
from follow_env.physics import World
from follow_env.scenes import make_scene

FRAME_SIZES = ((84, 84), (160, 120), (320, 240), (640, 480))
REPEATS = 7


@dataclass(frozen=True)
class Cost:
    """Cost of one operation: median and fastest of the repeats in s, and the name of the peer it is set beside."""

    name: str
    median: float
    fastest: float
    peer: str | None = None


def speed(quick: bool = False) -> list[Cost]:
    """Measure everything once; `quick` takes a tenth of the samples."""
    count = 30 if quick else 300
    costs = []
    for scene in IDS:
        costs += _stepping(scene, count)
    for width, height in FRAME_SIZES:
        costs += _frames(width, height, count)
    costs.append(_pixel_step(count))
    return costs


def table(costs: list[Cost]) -> str:
    """Return the costs as a Markdown table with rates and ratios to the peers."""
    medians = {cost.name: cost.median for cost in costs}
    rows = [
        [
            cost.name,
            f"{1e3 * cost.median:.3f}",
            f"{1e3 * cost.fastest:.3f}",
            f"{1.0 / cost.median:,.0f}",
            f"{cost.median / medians[cost.peer]:.2f} x {cost.peer}" if cost.peer else "–",
        ]
        for cost in costs
    ]
    return markdown_table(["what", "median (ms)", "fastest (ms)", "per second", "beside"], rows, left=1)


def document(costs: list[Cost]) -> str:
    """Return the costs with machine and versions as JSON."""
    content: dict[str, Any] = {
        "seconds": {cost.name: {"median": cost.median, "fastest": cost.fastest} for cost in costs},
        "machine": machine(),
        "packages": packages(),
    }
    return json.dumps(content, indent=1) + "\n"


def _stepping(scene: str, count: int) -> list[Cost]:
    """Control steps of the environment beside bare physics steps in the same world, policy steps and resets."""
    env, policy = FollowEnv(scene), make_follower("akf", scene=scene)
    observation, _ = env.reset(seed=0)
    state = None

    def drive() -> None:
        nonlocal observation, state
        action, state = policy.predict(observation, state)
        observation, _, terminated, truncated, _ = env.step(action)
        if terminated or truncated:
            observation, _ = env.reset()
            state = None

    waiting, memory = observation, None

    def decide() -> None:
        nonlocal memory
        _, memory = policy.predict(waiting, memory)

    action = np.array((0.4, 0.0), np.float32)

    def step() -> None:
        _, _, terminated, truncated, _ = env.step(action)
        if terminated or truncated:
            env.reset()

    world = World(env.scene, env.robot_config)
    world.reset((0.0, 0.0, 0.0), (8.0, 0.0, 0.0))
    world.step(0.4, 0.4, 240)
    bare = f"{scene}: 8 bare physics steps"
    costs = [
        _time(f"{scene}: environment step, obs=measurement", step, count, bare),
        _time(f"{scene}: environment step and AKF + PI", drive, count, bare),
        _time(bare, lambda: world.simulate(8), count),
        _time(f"{scene}: AKF + PI alone", decide, count, bare),
        _time(f"{scene}: reset", env.reset, max(count // 6, 2)),
    ]
    env.close()
    world.close()
    return costs


def _frames(width: int, height: int, count: int) -> list[Cost]:
    """Frames of the same room and the same person by each renderer, the person's mesh included."""
    scene, camera = make_scene("indoor"), PinholeCamera(CameraConfig(width=width, height=height))
    walker, eye, costs = Walker(load_body()), CameraPose(0.1, 0.0, 1.0, 0.0), []
    peer = f"indoor: frame {width}x{height}, tiny"
    for name in ("tiny", "raster"):
        renderer = make_renderer(name, scene, camera)

        def render(renderer: Renderer = renderer) -> None:
            renderer.render(eye, (walker.place(1.6, 0.0, 0.0, 0.7, 0.9),))

        few = max(count // 15, 2) if name == "tiny" else count
        costs.append(_time(f"indoor: frame {width}x{height}, {name}", render, few, None if name == "tiny" else peer))
        renderer.close()
    return costs


def _pixel_step(count: int) -> Cost:
    env = FollowEnv("indoor", obs="rgbd")
    env.reset(seed=0)
    action = np.array((0.4, 0.0), np.float32)

    def step() -> None:
        _, _, terminated, truncated, _ = env.step(action)
        if terminated or truncated:
            env.reset()

    size = f"{env.camera.width}x{env.camera.height}"
    cost = _time(f"indoor: environment step, obs=rgbd {size}", step, count)
    env.close()
    return cost


def _time(name: str, operation: Callable[[], object], count: int, peer: str | None = None) -> Cost:
    """Time `count` calls, `REPEATS` times after a warm-up; return median and fastest per call."""
    for _ in range(max(count // 10, 1)):
        operation()
    samples = []
    for _ in range(REPEATS):
        began = time.perf_counter()
        for _ in range(count):
            operation()
        samples.append((time.perf_counter() - began) / count)
    return Cost(name, statistics.median(samples), min(samples), peer)
