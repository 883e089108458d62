"""`follow bench followers`: every follower on the same seeds in two scenes and at four walking speeds."""

from __future__ import annotations

import dataclasses
import hashlib
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from baselines.benchmark import provenance
from baselines.benchmark.build import UNBIASED, cell_of
from baselines.benchmark.cells import SCENES, Cell
from baselines.benchmark.files import Value, write_csv, write_text
from baselines.benchmark.markdown import markdown_table
from baselines.benchmark.metrics import episode as metrics
from baselines.benchmark.metrics.episode import Row
from baselines.benchmark.player import EpisodeFunction
from baselines.benchmark.run import Played, rows, run
from baselines.benchmark.statistics import Score
from baselines.benchmark.store import Store
from baselines.followers.agents import shipped, weights_file
from follow_env.world.motion.profile import PAPER_SPEED

EPISODES = 100
WALKING_SPEEDS = (0.5, 0.7, 1.1)
"""The other speeds, m/s; the robot's limit is 1.2 m/s."""
SPEED_EPISODES = 20
"""At most so many for each of them."""
SPEED_SCENE = "corridor"
RANKED_TRAININGS = 5
"""An algorithm trained from fewer seeds is shown, but nothing is claimed of its rank."""
REFERENCE = "AKF + PI"
SCORES = {
    "success": ("success", False),
    "angle_tracking_rmse_rad": ("angle_tracking_rmse_rad", True),
    "distance_tracking_rmse_m": ("distance_tracking_rmse_m", True),
    "collided": ("collided", False),
    "lost": ("lost", False),
    "loss_count": ("loss_count", False),
    "in_band_share": ("in_band_share", False),
    "rms_jerk_m_s3": ("rms_jerk_m_s3", True),
    "rms_angular_jerk_rad_s3": ("rms_angular_jerk_rad_s3", True),
}
"""Score -> column of the episode's row, and whether it is pooled as a root mean square."""
COMPARED = ("success", "angle_tracking_rmse_rad", "distance_tracking_rmse_m")
COLUMNS = (
    *("scene", "walking_speed", "policy", "trainings", "episodes"),
    *(f"{name}{end}" for name in SCORES for end in ("", "_low", "_high")),
    *(f"{name}_minus_reference{end}" for name in COMPARED for end in ("", "_low", "_high")),
)
_DIGITS = 6


def cells(agents: Sequence[str]) -> list[Cell]:
    """Cells of the suite: followers with PI, floors, ceiling and the agents, in both scenes."""
    policies = ("akf", UNBIASED, "kf", "none", "parked", "random", "oracle", *agents)
    return [cell_of(policy, scene) for scene in SCENES for policy in policies]


def speed_cells(agents: Sequence[str]) -> list[Cell]:
    """Cells at other walking speeds: followers with PI, the ceiling and the agents, in one scene."""
    cells = [cell_of(policy, SPEED_SCENE) for policy in ("akf", UNBIASED, "none", "oracle", *agents)]
    return [dataclasses.replace(cell, walking_speed=speed) for speed in WALKING_SPEEDS for cell in cells]


def bench(
    episodes: int, calibration: Mapping[str, Any], episode: EpisodeFunction, out: Path, jobs: int, resume: bool
) -> str:
    """Play the suite and write `followers.md`, `followers.csv` and the raw episodes; see `running.run` for errors.

    Args:
        episodes: Per cell, and at most `SPEED_EPISODES` at other walking speeds.
        calibration: Content of the calibration, part of the configuration's hash.
        episode: Plays one cell and seed.
        out: Results folder.
        jobs: Number of processes; the results do not depend on it.
        resume: Whether to go on with what the folder holds.
    """
    agents = shipped()
    studies = {"followers": cells(agents), "walking_speeds": speed_cells(agents)}
    counts = {"followers": episodes, "walking_speeds": min(episodes, SPEED_EPISODES)}
    plan = {cell: range(counts[name]) for name, group in studies.items() for cell in group}
    weights = {name: hashlib.sha256(weights_file(name).read_bytes()).hexdigest() for name in agents}
    settings = {**provenance.settings(calibration), "benchmark": "followers", "agents": weights}
    digest = provenance.run_digest(settings)
    config = provenance.text(
        settings, digest, studies, {name: list(range(count)) for name, count in counts.items()}, out, jobs
    )
    tasks = [(cell, seed) for cell, seeds in plan.items() for seed in seeds]

    def write(store: Store) -> tuple[str, Played]:
        played = {cell: [store.episode(cell, seed) for seed in seeds] for cell, seeds in plan.items()}
        speeds = [cell.walking_speed or PAPER_SPEED for cell, seeds in plan.items() for _ in seeds]
        walked = [{"walking_speed": speed, **row} for speed, row in zip(speeds, rows(played), strict=True)]
        write_csv(out / "episodes.csv", ("walking_speed", *metrics.COLUMNS), walked)
        found = records({cell: [one.row for one in group] for cell, group in played.items()})
        write_csv(out / "followers.csv", COLUMNS, found, _DIGITS)
        text = report(found)
        write_text(out / "followers.md", text)
        return text, played

    return run(tasks, digest, config, episode, write, out, jobs, resume)


def records(played: Mapping[Cell, Sequence[Row]]) -> list[dict[str, Value]]:
    """One record of `COLUMNS` for each scene, speed and policy; the trainings of one recipe make one policy.

    Args:
        played: Episode rows of each cell in the order of their seeds.
    """
    groups: dict[tuple[str, float, str], list[Sequence[Row]]] = {}
    for cell, group in played.items():
        ended = [
            {**row, "collided": int(row["ended"] == "collision"), "lost": int(row["ended"] == "lost")} for row in group
        ]
        groups.setdefault((cell.scene, cell.walking_speed or PAPER_SPEED, policy_name(cell)), []).append(ended)
    scores = {
        key: {name: Score.of(trainings, *how) for name, how in SCORES.items()} for key, trainings in groups.items()
    }
    found = []
    for (scene, speed, policy), trainings in groups.items():
        record: dict[str, Value] = {
            "scene": scene,
            "walking_speed": speed,
            "policy": policy,
            "trainings": len(trainings) if _learned(policy) else None,
            "episodes": len(trainings[0]),
        }
        for name, score in scores[scene, speed, policy].items():
            record[name] = score.value
            record[f"{name}_low"], record[f"{name}_high"] = score.interval or (None, None)
        for name in COMPARED:
            difference = scores[scene, speed, policy][name].minus(scores[scene, speed, REFERENCE][name])
            is_reference = policy == REFERENCE
            low, high = difference.interval or (None, None)
            for end, value in (("", difference.value), ("_low", low), ("_high", high)):
                record[f"{name}_minus_reference{end}"] = None if is_reference else value
        found.append(record)
    return found


def policy_name(cell: Cell) -> str:
    """What drives in a cell, as tables name it; the seed of an agent's training is left out."""
    if cell.controller == "pi":
        return f"{'no filter' if cell.estimator == 'none' else cell.estimator.upper()} + PI"
    if cell.controller == UNBIASED:
        return f"{REFERENCE}, bias removed"
    return cell.controller.rpartition("-")[0] or cell.controller


def report(found: Sequence[Mapping[str, Value]]) -> str:
    """Return the table as Markdown that also reads well on a terminal."""
    usual = [record for record in found if record["walking_speed"] == PAPER_SPEED]
    header = ["scene", "policy", "success", "angle RMSE (rad)", "distance RMSE (cm)", "minus AKF + PI (cm)"]
    header += ["lost", "collided", "losses", "jerk (m/s³)", "trainings"]
    lines = []
    for record in usual:
        lines.append(
            [
                str(record["scene"]),
                str(record["policy"]),
                f"{_number(record, 'success'):.0%}",
                _interval(record, "angle_tracking_rmse_rad", 1.0, 3),
                _interval(record, "distance_tracking_rmse_m", 100.0, 1),
                _interval(record, "distance_tracking_rmse_m_minus_reference", 100.0, 1),
                *(f"{_number(record, name):.0%}" for name in ("lost", "collided")),
                f"{_number(record, 'loss_count'):.2f}",
                f"{_number(record, 'rms_jerk_m_s3'):.1f}",
                "–" if record["trainings"] is None else str(record["trainings"]),
            ]
        )
    biased = (
        "The sensor has a constant bias (the surface is nearer than the body's axis). A learned policy is rewarded on "
        "the truth and takes it off;\nthe paper's follower does not. *Bias removed*: the reference with the known bias "
        "taken off each measurement."
    )
    few = sorted(
        {str(r["policy"]) for r in found if r["trainings"] is not None and int(str(r["trainings"])) < RANKED_TRAININGS}
    )
    parts = [
        "# Followers",
        f"{usual[0]['episodes']} episodes per cell on the same seeds, in PyBullet. Angle and distance RMSE are "
        "tracking errors: the person's true bearing and\ndistance against the set point (0 rad, 1.5 m), pooled over "
        "all steps. 95 % bootstrap intervals over episodes and trainings;\nlearned policies: interquartile mean over "
        "the trainings (the mean of fewer than four). Losses: times per episode that the person left the view.",
        markdown_table(header, lines, left=2),
        biased,
    ]
    if few:
        parts.append(
            f"Trained from fewer than {RANKED_TRAININGS} seeds, so nothing is claimed of the rank of: {', '.join(few)}."
        )
    return "\n\n".join(parts + _speed_parts(found)) + "\n"


def _speed_parts(found: Sequence[Mapping[str, Value]]) -> list[str]:
    """Return the paragraphs about other walking speeds, if any were played."""
    at = {(record["policy"], record["walking_speed"]): record for record in found if record["scene"] == SPEED_SCENE}
    speeds = sorted({float(str(speed)) for _, speed in at})
    if len(speeds) == 1:
        return []
    policies = dict.fromkeys(policy for policy, speed in at if speed != PAPER_SPEED)
    lines = [[str(policy), *(_at_speed(at[policy, speed]) for speed in speeds)] for policy in policies]
    most = max(int(str(record["episodes"])) for (_, speed), record in at.items() if speed != PAPER_SPEED)
    return [
        "## Walking speeds",
        f"Distance RMSE (cm) in the {SPEED_SCENE} when the person walks slower or faster, {most} episodes each (at "
        f"{PAPER_SPEED:.2f} m/s those above),\nand the success where it is not 100 %. The robot's limit is 1.2 m/s; "
        "ppo_pixels was trained at one speed.",
        markdown_table(["policy", *(f"{speed:.2f} m/s" for speed in speeds)], lines, left=1),
    ]


def _at_speed(record: Mapping[str, Value]) -> str:
    success = _number(record, "success")
    return _interval(record, "distance_tracking_rmse_m", 100.0, 1) + ("" if success == 1.0 else f", {success:.0%}")


def _learned(policy: str) -> bool:
    return "PI" not in policy and policy not in ("parked", "random", "oracle")


def _number(record: Mapping[str, Value], name: str) -> float:
    return float(str(record[name]))


def _interval(record: Mapping[str, Value], name: str, scale: float, digits: int) -> str:
    ends = [record[name + end] for end in ("", "_low", "_high")]
    value, *interval = [f"{scale * float(str(end)):.{digits}f}" for end in ends if end is not None] or ["–"]
    return f"{value} ({' to '.join(interval)})" if interval else value
