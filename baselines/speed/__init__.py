"""`follow speed`: what frames, steps, resets, batches and the physics cost here, each beside a peer of the same run."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from baselines.speed.batch import BatchRate, measure_batches
from baselines.speed.frames import FrameCost, measure_frames
from baselines.speed.pair import Gain, measure_gains
from baselines.speed.solver import SolverCost, measure_solver
from baselines.speed.stepping import StepCost, measure_steps
from follow_env import IDS


@dataclass(frozen=True)
class Effort:
    """How much is measured.

    Attributes:
        frames: Single frames of each renderer and size.
        steps: Single steps of each kind.
        resets: Single resets of each scene.
        rounds: Times that one and two processes are let run.
        seconds: Time of one such run, s.
        sizes: Pictures (width, height), px.
        batches: Numbers of worlds that are stepped at once.
    """

    frames: int = 200
    steps: int = 1000
    resets: int = 200
    rounds: int = 12
    seconds: float = 0.2
    sizes: tuple[tuple[int, int], ...] = ((640, 480), (320, 240), (160, 120), (84, 84))
    batches: tuple[int, ...] = (1, 64, 1024, 4096, 65536)


FULL = Effort()
QUICK = Effort(frames=20, steps=100, resets=20, rounds=3, seconds=0.1, batches=(1, 64, 4096))


@dataclass(frozen=True)
class Report:
    """Everything that was measured.

    Attributes:
        unavailable: Why a renderer cannot draw here, by its name.
        frames: Frames in one process.
        gains: Frames in one and in two processes.
        steps: Steps and resets.
        solver: The physics with few and many solver iterations.
        batches: Many worlds at once.
    """

    unavailable: dict[str, str]
    frames: list[FrameCost]
    gains: list[Gain]
    steps: list[StepCost]
    solver: list[SolverCost]
    batches: list[BatchRate]


def speed(effort: Effort = FULL, tell: Callable[[str], object] = lambda what: None) -> Report:
    """Measure everything once.

    Args:
        effort: How much.
        tell: Is told what comes next.
    """
    tell("physics")
    solver = measure_solver(effort.steps)
    steps: list[StepCost] = []
    for scene in IDS:
        tell(f"steps and resets, {scene}")
        steps += measure_steps(scene, effort.steps, effort.resets)
    frames: list[FrameCost] = []
    unavailable: dict[str, str] = {}
    for width, height in effort.sizes:
        tell(f"frames of {width}x{height}")
        costs, unavailable = measure_frames(width, height, effort.frames)
        frames += costs
    tell("two processes")
    gains = measure_gains(list(dict.fromkeys(c.renderer for c in frames)), effort.sizes, effort.rounds, effort.seconds)
    tell("many worlds at once")
    batches = measure_batches(effort.batches, effort.rounds, effort.seconds)
    return Report(unavailable, frames, gains, steps, solver, batches)
