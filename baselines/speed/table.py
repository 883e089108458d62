"""A report as text: tables for people, JSON for programs."""

from __future__ import annotations

import dataclasses
import importlib.metadata
import json

from baselines.benchmark.markdown import markdown_table
from baselines.benchmark.provenance import machine, packages
from baselines.speed import Report
from baselines.speed.batch import BatchRate
from baselines.speed.frames import FrameCost
from baselines.speed.pair import Gain
from baselines.speed.solver import SolverCost
from baselines.speed.stepping import StepCost
from baselines.speed.timing import Cost
from follow_env.world.bullet import SOLVER_ITERATIONS

TIMES = ("median (ms)", "fastest (ms)", "CPU median (ms)", "CPU fastest (ms)")


def table(report: Report) -> str:
    """Return the report as Markdown; ratios are between medians of the same run."""
    missing = [f"- {name}: not available: {sentence}" for name, sentence in report.unavailable.items()]
    sections = [
        ("Frames of one process", [_frames(report.frames), *missing]),
        ("Frames of two processes, and what a loop that only computes gains from the second", [_gains(report.gains)]),
        ("Steps and resets", [_steps(report.steps)]),
        ("Many worlds at once", [_batches(report.batches)]),
        ("Iterations of the contact solver, against the differential-drive equations", [_solver(report.solver)]),
    ]
    return "\n\n".join(f"## {title}\n\n" + "\n\n".join(parts) for title, parts in sections)


def document(report: Report) -> str:
    """Return the report in SI units with machine and versions as JSON."""
    versions = {**packages(), "numba": importlib.metadata.version("numba")}
    content = {**dataclasses.asdict(report), "machine": machine(), "packages": versions}
    return json.dumps(content, indent=1, allow_nan=False) + "\n"


def _frames(costs: list[FrameCost]) -> str:
    header = ("renderer", "person", "picture", *TIMES, "frames/s", "TinyRenderer takes", "of CPU")
    rows = [
        (
            *(c.renderer, c.person, f"{c.width}x{c.height}", *_times(c.cost), _rate(c.cost)),
            *(f"{c.peer_cost.median / c.cost.median:.1f} x", f"{c.peer_cost.cpu_median / c.cost.cpu_median:.1f} x"),
        )
        for c in costs
    ]
    return markdown_table(header, rows, left=3)


def _gains(gains: list[Gain]) -> str:
    header = ("renderer", "picture", "frames/s of one", "of two", "gain", "loop's gain", "share", "share by CPU time")
    rows = [
        (
            *(g.renderer, f"{g.width}x{g.height}", f"{g.frames.one:,.1f}", f"{g.frames.two:,.1f}"),
            *(f"{g.frames.gain:.2f} x", f"{g.loop.gain:.2f} x", f"{100.0 * g.frames.gain / g.loop.gain:.0f} %"),
            f"{100.0 * g.frames.cpu_gain / g.loop.cpu_gain:.0f} %",
        )
        for g in gains
    ]
    return markdown_table(header, rows, left=2)


def _steps(costs: list[StepCost]) -> str:
    header = ("scene", "what", *TIMES, "mean (ms)", "per second", "bare physics", "of CPU")
    rows = [
        (
            *(c.scene, c.what, *_times(c.cost), f"{1e3 * c.cost.mean:.3f}", _rate(c.cost)),
            *(f"{c.cost.median / c.bare_cost.median:.2f} x", f"{c.cost.cpu_median / c.bare_cost.cpu_median:.2f} x"),
        )
        for c in costs
    ]
    return markdown_table(header, rows, left=2)


def _batches(rates: list[BatchRate]) -> str:
    header = ("what", "worlds", "steps/s (median)", "steps/s (fastest)", "of CartPole's")
    rows = [
        (
            *(r.what, f"{r.worlds:,}", f"{r.median:,.0f}", f"{r.fastest:,.0f}"),
            "–" if r.peer is None else f"{r.median / r.peer:.2f} x",
        )
        for r in rates
    ]
    return markdown_table(header, rows, left=1)


def _solver(costs: list[SolverCost]) -> str:
    (chosen,) = (c.cost for c in costs if c.iterations == SOLVER_ITERATIONS)
    header = ("iterations", "position (mm)", "heading (mrad)", "creep in 14 s (mm)", *TIMES, "over the default")
    rows = [
        (
            f"{c.iterations}{' (default)' if c.cost is chosen else ''}",
            *(f"{1e3 * error:.2f}" for error in (c.position_error, c.heading_error, c.creep)),
            *(*_times(c.cost), f"{c.cost.cpu_median / chosen.cpu_median:.2f} x"),
        )
        for c in costs
    ]
    return markdown_table(header, rows, left=1)


def _times(cost: Cost) -> list[str]:
    return [f"{1e3 * value:.3f}" for value in (cost.median, cost.fastest, cost.cpu_median, cost.cpu_fastest)]


def _rate(cost: Cost) -> str:
    return f"{1.0 / cost.median:,.0f}"
