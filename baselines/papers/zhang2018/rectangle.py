"""Paper A's first experiment (Figures 15 and 16): a subject follows a rectangle in five postures before the camera.

**Which plane.** The paper shows the paths "projected to the camera's XY coordinate plane", and Z beside them. Were this
the picture's plane, the subject would have to rise by 1.4 or 2 m before the camera, which a volunteer on the ground
cannot, nor anybody in a cabin of 2.4 m; and the text tests "various distance relative to the robot". In the paper's
robot frame the XY plane is the floor's (section 2.1.2: X_b, Y_b parallel to X_w, Y_w, yaw about Z_b). So the rectangle
lies on the floor here: 1.4 m across the line of sight, 2 m along it.

**Which point.** The truth is the middle of the body, which follows the rectangle exactly: of a walker the pelvis' axis,
of a held posture the middle between its foremost and hindmost, left- and rightmost points; in height that between its
lowest and highest. The tracker measures something else: the middle of the visible box at the depth of the *front
surface* (mean of the six smallest samples). The mean of the difference in depth is reported as the surface offset, and
the deviation both with it and without it. It is no constant: a body that turns is not equally deep on all sides.

**Which postures.** Those that one can keep while walking on the ground; the paper had to leave out the headstand. All
but "walk" are held rigidly while the subject moves. The subject walks in its heading at 0.4 m/s without slowing at the
corners, the hardest case for a model of constant velocity.

**Detections removed.** The same pictures are tracked once more with five consecutive detections removed in the middle
of a side and around a corner (`GAPS`), as in the blue ellipses of Figure 16(a).
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from itertools import groupby
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from baselines.benchmark.files import Value
from baselines.papers.dong2018.figures import picture
from baselines.papers.zhang2018.stage import CAMERA, PERIOD, SETTINGS, Picture, Watch, stage
from follow_env.registry import choose
from follow_env.world.people.bodies import SUITS, load_body
from follow_env.world.people.walker import Walker
from tracker.boxes import Detection
from tracker.person_tracker import Detector, Track

if TYPE_CHECKING:
    from matplotlib.axes import Axes

Row = dict[str, Value]

POSTURES = ("walk", "crouch", "bent", "sideways", "arms_raised")
"""The five postures, of `follow_env.world.people.walker.POSTURES`."""
RUNS = ("all", "gaps")
"""All detections, and the same with those of `GAPS` removed."""
CORNERS = ((2.4, 0.7), (4.4, 0.7), (4.4, -0.7), (2.4, -0.7))
"""Of the reference path, (forward, left) of the camera, m; walked in this order and closed."""
GAPS: dict[str, float] = {"side": 1.0, "corner": 3.4}
"""Where on the path the middle of a gap lies, m walked: in the middle of the first side, at the third corner."""
GAP_FRAMES = 5
"""Processed frames in a row whose detections are removed."""
SPEED, ACCELERATION, STANDING = 0.4, 0.8, 1.0
"""Of the subject, m/s and m/s²; it stands so long before and after, s."""
BOUND = 0.20
"""The paper's: the reconstruction deviates no more from the reference path, m."""

COLUMNS = (
    *("perception", "posture", "run", "frame", "time", "gap", "state", "detections"),
    *("truth_x", "truth_y", "truth_z", "measured_x", "measured_y", "measured_z"),
    *("estimated_x", "estimated_y", "estimated_z"),
)
"""Of the rows: a processed frame each; frames of the 30 Hz stream, s, m in the camera's place (x forward, y left, z
up); `gap` names the removed detection's; empty where there is nothing."""


@dataclass(frozen=True)
class Walk:
    """One subject's way around the rectangle: rows with `COLUMNS`, those of each of `RUNS` in turn."""

    rows: list[Row]


def play(posture: str, detector: Detector | None = None) -> Walk:
    """Walk around the rectangle once; the same posture and detections give the same rows.

    Args:
        posture: One of `POSTURES`.
        detector: Finds the people; None for perfect boxes, so that the tracker's errors stand alone.

    Raises:
        ValueError: If there is no such posture.
    """
    choose("posture", posture, POSTURES)
    perception = "mask" if detector is None else "detector"
    walker = Walker(load_body("man", SUITS["blue"], "high"))
    ahead, left = _middle(walker, posture)
    noise = np.random.default_rng((0, POSTURES.index(posture)))
    watches = {run: Watch() for run in RUNS}
    rows: dict[str, list[Row]] = {run: [] for run in RUNS}
    gaps = {name: _frame_at(station) for name, station in GAPS.items()}
    for frame in range(_frame_at(_length()) + round(STANDING / PERIOD) + 1):
        time = frame * PERIOD
        walked, speed = _traveled(time)
        x, y, heading = _on_path(walked)
        cosine, sine = math.cos(heading), math.sin(heading)
        pelvis_x = CAMERA.x + x - cosine * ahead + sine * left
        pelvis_y = CAMERA.y + y - sine * ahead - cosine * left
        person = walker.place(pelvis_x, pelvis_y, heading, walked, speed, posture)
        heights = person.vertices[:, 2]
        truth = (x, y, 0.5 * (float(heights.min()) + float(heights.max())) - CAMERA.z)
        shown = stage().take([person], int(noise.integers(1 << 63)))
        found = _detections(shown, detector)
        for run, watch in watches.items():
            gap = _gap(frame, gaps) if run == "gaps" else None
            kept = [] if gap is not None else found
            track = watch.see(shown, kept)
            rows[run].append(_row(perception, posture, run, frame, gap, len(kept), truth, track))
    return Walk([row for run in RUNS for row in rows[run]])


def table(rows: Sequence[Mapping[str, Value]]) -> str:
    """Return two markdown tables: deviations of measured and estimated positions, and the gaps.

    Args:
        rows: Of any number of walks.
    """
    lines = [
        "| boxes | posture | position | frames | tracked | surface offset | rms depth / left / up / 3-D "
        "| max depth / left / up / 3-D | from the path, max | without the offset | within 20 cm |",
        "|---|---|---|---|---|---|---|---|---|---|---|",
    ]
    for walk in _walks(rows, "all"):
        tracked = sum(row["measured_x"] is not None for row in walk) / max(len(_since_confirmed(walk)), 1)
        for name in ("measured", "estimated"):
            known = [row for row in walk if row[f"{name}_x"] is not None]
            head = f"| {walk[0]['perception']} | {walk[0]['posture']} | {name} | {len(known)} | {100 * tracked:.1f} % |"
            lines.append(head + (_deviations(known, name) if known else " | | | | | no |"))
    lines += [
        "",
        "Lengths in cm. Truth: the middle of the body; the surface offset is the mean difference in depth, as the "
        "tracker measures the front surface. Deviation from the reference path in the floor's plane; the "
        f"paper's bound is {100 * BOUND:.0f} cm.",
        "",
        f"| boxes | posture | {GAP_FRAMES} detections removed | frames coasted | greatest deviation while coasting "
        "| resumed |",
        "|---|---|---|---|---|---|",
    ]
    for walk in _walks(rows, "gaps"):
        offset = _offset([row for row in walk if row["measured_x"] is not None], "measured")
        lines += [_gap_line(walk, name, offset) for name in GAPS]
    lines += ["", "Deviation in 3-D of the prediction from the truth, in cm, the surface offset taken off."]
    return "\n".join(lines) + "\n"


def draw(rows: Sequence[Mapping[str, Value]], path: Path) -> None:
    """Draw Figure 16: left the paths on the floor plan, right the depth over time; a row per posture, one for the gaps.

    Args:
        rows: Of walks with one detector.
        path: The picture; its folder exists.
    """
    shown = [*_walks(rows, "all"), *_walks(rows, "gaps")[:1]]
    with picture(path, width=8.0, height=2.5 * len(shown) + 0.5) as figure:
        panels = figure.subplots(len(shown), 2, squeeze=False, width_ratios=(1.0, 1.25))
        for walk, (plan, depth) in zip(shown, panels, strict=True):
            _draw_plan(plan, walk)
            _draw_depth(depth, walk)
            title = str(walk[0]["posture"]).replace("_", " ")
            plan.set_title(
                title if walk[0]["run"] == "all" else f"{title}, {GAP_FRAMES} detections removed twice", loc="left"
            )
        panels[-1][0].set_xlabel("to the right of the camera (m)")
        panels[-1][1].set_xlabel("time (s)")
        handles, labels = panels[-1][1].get_legend_handles_labels()
        figure.legend(handles, labels, loc="outside lower center", ncols=len(labels))


def _middle(walker: Walker, posture: str) -> tuple[float, float]:
    """Return how far ahead and to the left of the pelvis' axis the middle of the body is, m."""
    if posture == "walk":
        return 0.0, 0.0
    plan = walker.place(0.0, 0.0, 0.0, 0.0, 0.0, posture).vertices[:, :2]
    ahead, left = 0.5 * (plan.min(axis=0) + plan.max(axis=0))
    return float(ahead), float(left)


def _traveled(time: float) -> tuple[float, float]:
    """Return the meters walked and the speed: stand, accelerate, walk, brake, stand."""
    length = _length()
    ramp = SPEED / ACCELERATION
    cruise = length / SPEED - ramp
    time -= STANDING
    if time <= 0.0:
        return 0.0, 0.0
    if time < ramp:
        return 0.5 * ACCELERATION * time * time, ACCELERATION * time
    if time < ramp + cruise:
        return SPEED * (time - 0.5 * ramp), SPEED
    left = max(2.0 * ramp + cruise - time, 0.0)
    return length - 0.5 * ACCELERATION * left * left, ACCELERATION * left


def _length() -> float:
    return math.fsum(math.dist(a, b) for a, b in _sides())


def _sides() -> list[tuple[tuple[float, float], tuple[float, float]]]:
    return [(CORNERS[k], CORNERS[(k + 1) % len(CORNERS)]) for k in range(len(CORNERS))]


def _frame_at(walked: float) -> int:
    """Return the first processed frame at which so much has been walked."""
    frame = 0
    while _traveled(frame * PERIOD)[0] < walked - 1e-9:
        frame += 1
    return frame


def _on_path(walked: float) -> tuple[float, float, float]:
    """Return (forward, left) on the rectangle and the heading, rad, which turns within 0.15 m around a corner."""
    turn = 0.15
    for start, end in _sides():
        side = math.dist(start, end)
        if walked <= side or end == CORNERS[0]:
            break
        walked -= side
    along = walked / side
    heading = math.atan2(end[1] - start[1], end[0] - start[0])
    quarter = -0.5 * math.pi
    if walked < turn and start != CORNERS[0]:
        heading -= 0.5 * quarter * (1.0 - walked / turn)
    if side - walked < turn and end != CORNERS[0]:
        heading += 0.5 * quarter * (1.0 - (side - walked) / turn)
    return start[0] + along * (end[0] - start[0]), start[1] + along * (end[1] - start[1]), heading


def _detections(shown: Picture, detector: Detector | None) -> Sequence[Detection]:
    return shown.perfect_detections() if detector is None else detector.detect(shown.rgb, shown.depth)


def _gap(frame: int, gaps: Mapping[str, int]) -> str | None:
    return next((name for name, middle in gaps.items() if abs(frame - middle) <= GAP_FRAMES // 2), None)


def _row(
    perception: str,
    posture: str,
    run: str,
    frame: int,
    gap: str | None,
    detections: int,
    truth: tuple[float, float, float],
    track: Track,
) -> Row:
    row: Row = {
        "perception": perception,
        "posture": posture,
        "run": run,
        "frame": frame * SETTINGS.every,
        "time": frame * PERIOD,
        "gap": gap,
        "state": track.state,
        "detections": detections,
    }
    for name, place in (("truth", truth), ("measured", track.measurement), ("estimated", track.position)):
        for axis, value in zip("xyz", place or (None,) * 3, strict=True):
            row[f"{name}_{axis}"] = value
    return row


def _walks(rows: Iterable[Mapping[str, Value]], run: str) -> list[list[Mapping[str, Value]]]:
    """Return the rows of a run, walk by walk."""
    chosen = (row for row in rows if row["run"] == run)
    return [list(walk) for _, walk in groupby(chosen, key=lambda row: (row["perception"], row["posture"]))]


def _since_confirmed(walk: Sequence[Mapping[str, Value]]) -> Sequence[Mapping[str, Value]]:
    first = next((k for k, row in enumerate(walk) if row["estimated_x"] is not None), len(walk))
    return walk[first:]


def _deviations(known: Sequence[Mapping[str, Value]], name: str) -> str:
    """Return the table's cells about the rows that have a position."""
    errors = [_error(row, name) for row in known]
    axes = [*zip(*errors, strict=True), [math.hypot(*error) for error in errors]]
    offset = _offset(known, name)
    raw, corrected = (max(_from_path(row, name, taken) for row in known) for taken in (0.0, offset))
    within = "yes" if raw <= BOUND else "without the offset" if corrected <= BOUND else "no"
    rms = " / ".join(f"{100 * math.sqrt(math.fsum(e * e for e in axis) / len(axis)):.1f}" for axis in axes)
    largest = " / ".join(f"{100 * max(map(abs, axis)):.1f}" for axis in axes)
    return f" {100 * offset:+.1f} | {rms} | {largest} | {100 * raw:.1f} | {100 * corrected:.1f} | {within} |"


def _gap_line(walk: Sequence[Mapping[str, Value]], gap: str, offset: float) -> str:
    """Return the table's row about a gap: from its first frame until the next measurement."""
    head = f"| {walk[0]['perception']} | {walk[0]['posture']} | {gap} |"
    first = next(k for k, row in enumerate(walk) if row["gap"] == gap)
    again = next((k for k in range(first, len(walk)) if walk[k]["measured_x"] is not None), None)
    coasted = [row for row in walk[first:again] if row["estimated_x"] is not None]
    if not coasted:
        return f"{head} 0 | | no |"
    largest = max(math.hypot(x - offset, y, z) for x, y, z in (_error(row, "estimated") for row in coasted))
    return f"{head} {len(coasted)} | {100 * largest:.1f} | {'no' if again is None else 'yes'} |"


def _place(row: Mapping[str, Value], name: str) -> tuple[float, float, float]:
    x, y, z = (float(str(row[f"{name}_{axis}"])) for axis in "xyz")
    return x, y, z


def _error(row: Mapping[str, Value], name: str) -> tuple[float, float, float]:
    (x, y, z), (tx, ty, tz) = _place(row, name), _place(row, "truth")
    return x - tx, y - ty, z - tz


def _offset(known: Sequence[Mapping[str, Value]], name: str) -> float:
    """Return the mean error in depth, m; 0 of no rows."""
    return math.fsum(_error(row, name)[0] for row in known) / max(len(known), 1)


def _from_path(row: Mapping[str, Value], name: str, offset: float) -> float:
    """Return the distance of a position, its depth less an offset, from the nearest point of the rectangle, m."""
    x, y, _ = _place(row, name)
    nearest = math.inf
    for (ax, ay), (bx, by) in _sides():
        dx, dy = bx - ax, by - ay
        along = ((x - offset - ax) * dx + (y - ay) * dy) / (dx * dx + dy * dy)
        along = min(max(along, 0.0), 1.0)
        nearest = min(nearest, math.hypot(x - offset - ax - along * dx, y - ay - along * dy))
    return nearest


_BLACK, _GREEN, _VERMILION, _GRAY = "#000000", "#009E73", "#D55E00", "#b3b3b3"


def _draw_plan(axes: Axes, walk: Sequence[Mapping[str, Value]]) -> None:
    closed = [*CORNERS, CORNERS[0]]
    axes.plot([-y for _, y in closed], [x for x, _ in closed], color=_BLACK, linewidth=1.2)
    for name, color, marker in (("measured", _GREEN, "o"), ("estimated", _VERMILION, "x")):
        places = [_place(row, name) for row in walk if row[f"{name}_x"] is not None]
        axes.plot([-y for _, y, _ in places], [x for x, _, _ in places], marker, color=color, markersize=2.5)
    axes.set_aspect("equal")
    axes.set_ylabel("depth (m)")


def _draw_depth(axes: Axes, walk: Sequence[Mapping[str, Value]]) -> None:
    for name in dict.fromkeys(row["gap"] for row in walk if row["gap"] is not None):
        times = [float(str(row["time"])) for row in walk if row["gap"] == name]
        axes.axvspan(times[0] - 0.5 * PERIOD, times[-1] + 0.5 * PERIOD, color=_GRAY, alpha=0.5, linewidth=0.0)
    lines = (
        ("truth", "reference path", _BLACK, "-", ""),
        ("measured", "measured", _GREEN, "", "o"),
        ("estimated", "estimated or predicted", _VERMILION, "", "x"),
    )
    for name, label, color, dashes, marker in lines:
        known = [row for row in walk if row[f"{name}_x"] is not None]
        times, depths = [float(str(row["time"])) for row in known], [_place(row, name)[0] for row in known]
        axes.plot(
            times, depths, color=color, linestyle=dashes, marker=marker, markersize=2.5, linewidth=1.2, label=label
        )
    axes.set_ylabel("depth (m)")
