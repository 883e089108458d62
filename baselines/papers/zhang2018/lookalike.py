"""Paper A's second experiment (Figures 17 and 18): a second person in the same clothes, and of the same body.

`script` says what happens in an episode: a close pass (Figure 17), then an occlusion (Figure 18).

**Right and wrong.** In a frame with an accepted measurement the tracker is wrong if the measured place on the floor is
nearer to the other person's body than to the target's, unless it is at the target's all the same (`TOUCH`): the two
brush past each other. It is at nobody's if it is far from both. A body is all of it: one that bends forward is measured
at its head, half a meter before its middle. Boxes would not tell: when the other one stands behind the target, both
true boxes lie in the same place of the picture. A switch is a wrong frame after a right one.

**Hidden.** The target is visible while at least half of its pixels are; the occlusion starts with the first processed
frame from which it stays hidden for longer than a second. A stop while it is visible is a false one; if the target is
nearly whole then, a person names it again, as the paper's alarm asks for.

**Two trackers** see the same detections: ours, which in company reads boxes only where they are at the target's depth,
and the paper's to the letter, which reads the depth of whoever steps before the target out of the target's box, follows
that depth inside the gate, and so adopts the other person. Ours reports boxes without what they show of others.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import groupby, pairwise
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from baselines.benchmark.files import Value
from baselines.benchmark.statistics import share_interval
from baselines.papers.dong2018.figures import picture
from baselines.papers.zhang2018.script import TARGET, Cast, draw_script
from baselines.papers.zhang2018.stage import CAMERA, PERIOD, PRINTED, SETTINGS, Picture, Watch, stage
from follow_env.world.people.mesh import Placed
from tracker.boxes import Detection
from tracker.metrics import overlap
from tracker.person_tracker import Detector, Track

if TYPE_CHECKING:
    from matplotlib.axes import Axes

Row = dict[str, Value]

HALF = 0.5
"""Least share of the target's pixels that must be visible; with less it is hidden."""
HIDDEN_TIME = SETTINGS.stop_time
"""For longer than this the target must stay hidden for an occlusion, s."""
TOUCH = 0.05
"""A measured place no farther than this from the target's body is at the target's, m: alone, 99 % are within 4 cm."""
NEAR = 0.30
"""A measured place farther than this from everybody's body is nobody's, m."""
WHOLE = 0.75
"""Least visible share of the target at which it is named again after a false stop."""

FILMED = 11
"""Seed of the episode that is drawn."""

COLUMNS = (
    *("perception", "seed", "suit", "body", "posture", "distance", "gap", "passes_behind", "step_in"),
    *("frames", "confirmed_time", "tracked_frames", "wrong_frames", "nobody_frames", "switches", "switches_hidden"),
    *("gate_rejections", "least_visible", "step_in_time", "occlusion_start", "stop_time"),
    *("false_stops", "seconds_visible"),
    *(
        "printed_wrong_frames",
        "printed_switches",
        "printed_switches_hidden",
        "printed_stop_time",
        "printed_false_stops",
    ),
)
"""Of a row. `distance` of the target, `gap` between the two when close and `step_in`, how far before the target the
other one stays, m; frames are processed ones; `switches_hidden` of the switches began when the target was hidden;
`gate_rejections` are frames with measured detections, all of them rejected; `least_visible` is the smallest
visible share before the other one steps in; times in s, empty if there is none; `stop_time` counts from the occlusion's
start; `seconds_visible` from the first confirmation on. `printed_...` are those of the paper's tracker to the
letter, which takes its depth samples from the box whosoever they are."""


_TRACKERS = {"ours": "", "printed": "printed_"}
_GREEN, _VERMILION = "#009E73", "#D55E00"


@dataclass(frozen=True)
class Frame:
    """A processed frame.

    Attributes:
        time: s.
        people: Who is there.
        shown: The picture and its truth.
        found: What was detected.
        track: What the tracker knows then.
        printed: What the paper's tracker to the letter knows of the same detections.
    """

    time: float
    people: Sequence[Placed]
    shown: Picture
    found: Sequence[Detection]
    track: Track
    printed: Track

    def followed(self, track: Track) -> str | None:
        """Return whose place a tracker measured: `target`, `other` or `nobody`; None without a measurement."""
        if track.measurement is None:
            return None
        x, y, _ = track.measurement
        place = CAMERA.x + x, CAMERA.y + y
        away = {one.id: float(np.linalg.norm(one.vertices[:, :2] - place, axis=1).min()) for one in self.people}
        nearest = min(away, key=lambda id: away[id])
        if away[nearest] > NEAR:
            return "nobody"
        return "target" if nearest == TARGET or away[TARGET] <= TOUCH else "other"


def play(seed: int, detector: Detector | None = None) -> Row:
    """Play an episode and return its row; the same seed and detections give the same row.

    Args:
        seed: Of the episode, a whole number from 0.
        detector: Finds the people; None for perfect boxes of who is visible, so that the tracker's errors stand alone.

    Raises:
        ValueError: If the seed is no whole number from 0.
    """
    script = draw_script(seed)
    row: Row = {"perception": "mask" if detector is None else "detector", "seed": seed}
    row |= {name: getattr(script, name) for name in ("suit", "body", "posture", "distance", "gap", "step_in")}
    row |= {"passes_behind": int(script.passes_behind)}
    ours, printed = [], []
    for frame in film(seed, detector):
        ours.append(_Moment.of(frame, frame.track))
        printed.append(_Moment.of(frame, frame.printed))
    step_in_time = script.step_in_time
    row |= _judge(ours, step_in_time)
    row |= {f"printed_{name}": value for name, value in _judge(printed, step_in_time).items()}
    return {name: row[name] for name in COLUMNS}


def table(rows: Sequence[Mapping[str, Value]]) -> str:
    """Return a markdown table of totals: a row for the tracker and one for the printed one, for each source of boxes.

    Args:
        rows: Of any number of episodes.
    """
    lines = [
        "| boxes | tracker | episodes | with the wrong person (95 % interval) | switches before / after hidden "
        "| wrong frames | hidden | stopped, nobody wrong | time to stop, median / p95 (paper 1.0) "
        "| false stops per minute |",
        "|---|---|---|---|---|---|---|---|---|---|",
    ]
    for perception in dict.fromkeys(row["perception"] for row in rows):
        chosen = [row for row in rows if row["perception"] == perception]
        lines += [_table_line(str(perception), name, prefix, chosen) for name, prefix in _TRACKERS.items()]
    lines += [
        "",
        "`ours` reads boxes only at the target's depth, `printed` is the paper's to the letter. In a wrong frame the "
        f"measured place is nearer to the other person than to the target and over {100 * TOUCH:.0f} cm from the "
        "target; a switch is a wrong frame after a right one. "
        "The target is hidden when "
        f"less than {100 * HALF:.0f} % of its pixels are visible for longer than {HIDDEN_TIME:g} s; times count from "
        "then, in s. Intervals are Wilson's. Share stopped: of the episodes in which the target was hidden.",
    ]
    return "\n".join(lines) + "\n"


def draw(detector: Detector | None, path: Path) -> None:
    """Draw two film strips, the close pass (Figure 17) and the occlusion (Figure 18), with boxes, states and times.

    Args:
        detector: As in `play`.
        path: The picture; its folder exists.
    """
    script = draw_script(FILMED)
    arrival, leaving, passed, stepping, stepped = (script.keys[k][0] for k in (2, 3, -5, -4, -2))
    behind = 0.5 * (leaving + passed)
    strips = (
        (0.5 * arrival + 0.5 * script.keys[1][0], arrival, leaving, behind, stepping),
        (stepping + 0.4 * (stepped - stepping), *(stepped - 0.4 + 0.6 * k for k in range(4))),
    )
    wanted = {round(time / PERIOD): place for place, time in _places(strips)}
    with picture(path, width=12.0, height=4.6) as figure:
        panels = figure.subplots(len(strips), len(strips[0]))
        for number, frame in enumerate(film(FILMED, detector)):
            if number in wanted:
                _draw_frame(panels[wanted[number]], frame)
        panels[0][0].set_ylabel("close pass")
        panels[1][0].set_ylabel("occlusion")


def film(seed: int, detector: Detector | None = None) -> Iterator[Frame]:
    """Yield the processed frames of an episode; the arguments are those of `play`."""
    script = draw_script(seed)
    cast, noise, watches = Cast(script), np.random.default_rng((1, seed)), (Watch(), Watch(PRINTED))
    for frame in range(int(script.keys[-1][0] / PERIOD) + 1):
        time = frame * PERIOD
        people = cast.people(time)
        shown = stage().take(people, int(noise.integers(1 << 63)))
        found = shown.perfect_detections() if detector is None else detector.detect(shown.rgb, shown.depth)
        tracks = [watch.see(shown, found) for watch in watches]
        yield Frame(time, people, shown, found, *tracks)
        for watch, track in zip(watches, tracks, strict=True):
            if track.alarm and shown.shares[TARGET] >= WHOLE:
                watch.tracker.confirm(shown.boxes[TARGET])


def _table_line(perception: str, name: str, prefix: str, rows: Sequence[Mapping[str, Value]]) -> str:
    def numbers(column: str) -> list[float]:
        return [float(str(row[column])) for row in rows if row[column] is not None]

    switches, wrong = numbers(f"{prefix}switches"), numbers(f"{prefix}wrong_frames")
    hidden_switches = sum(numbers(f"{prefix}switches_hidden"))
    switched = sum(count > 0.0 for count in wrong)
    low, high = share_interval(switched, len(rows))
    hidden = [row for row in rows if row["occlusion_start"] is not None]
    stopped = sum(row[f"{prefix}stop_time"] is not None and row[f"{prefix}wrong_frames"] == 0 for row in hidden)
    times = sorted(numbers(f"{prefix}stop_time"))
    median, late = (f"{np.quantile(times, q):.2f}" for q in (0.5, 0.95)) if times else ("", "")
    minutes = math.fsum(numbers("seconds_visible")) / 60.0
    cells = (
        perception,
        name,
        len(rows),
        f"{switched} ({100 * low:.1f}-{100 * high:.1f} %)",
        f"{sum(switches) - hidden_switches:.0f} / {hidden_switches:.0f}",
        f"{sum(wrong):.0f}",
        len(hidden),
        f"{stopped} ({100 * stopped / len(hidden):.1f} %)" if hidden else "",
        f"{median} / {late}",
        f"{sum(numbers(f'{prefix}false_stops')) / minutes:.2f}" if minutes else "",
    )
    return "| " + " | ".join(map(str, cells)) + " |"


def _places(strips: Sequence[Sequence[float]]) -> Iterator[tuple[tuple[int, int], float]]:
    for row, times in enumerate(strips):
        for column, time in enumerate(times):
            yield (row, column), time


def _draw_frame(axes: Axes, frame: Frame) -> None:
    """Show a picture: the tracked box green, other detections red, as in the paper; a tracked one is drawn broader."""
    from matplotlib.patches import Rectangle

    tracked = frame.track.box if frame.track.measurement is not None else None
    most = max((overlap(detection.box, tracked) for detection in frame.found), default=0.0) if tracked else 0.0
    axes.imshow(frame.shown.rgb)
    for detection in frame.found:
        u0, v0, u1, v1 = detection.box
        is_target = tracked is not None and overlap(detection.box, tracked) == most
        color, width = (_GREEN, 2.4) if is_target else (_VERMILION, 1.2)
        axes.add_patch(Rectangle((u0, v0), u1 - u0, v1 - v0, edgecolor=color, facecolor="none", linewidth=width))
    axes.set_xlim(0, frame.shown.rgb.shape[1])
    axes.set_ylim(frame.shown.rgb.shape[0], 0)
    axes.set_xticks([])
    axes.set_yticks([])
    axes.grid(visible=False)
    axes.set_title(f"{frame.time:.1f} s: {frame.track.state}", fontsize=9)


@dataclass(frozen=True)
class _Moment:
    """What of a frame the row is made of."""

    time: float
    share: float
    state: str
    confirmed: bool
    followed: str | None
    rejected: bool

    @classmethod
    def of(cls, frame: Frame, track: Track) -> _Moment:
        rejected = track.measurement is None and track.gate_distance is not None and track.state in ("coasting", "lost")
        share = frame.shown.shares[TARGET]
        return cls(frame.time, share, track.state, track.confirmations > 0, frame.followed(track), rejected)

    @property
    def visible(self) -> bool:
        return self.share >= HALF


def _judge(moments: Sequence[_Moment], step_in_time: float) -> Row:
    """Return the part of the row that the tracker is responsible for."""
    tracked = [moment for moment in moments if moment.followed is not None]
    switched = [b for a, b in pairwise(tracked) if b.followed == "other" and a.followed != "other"]
    stops = [b for a, b in pairwise(moments) if b.state == "lost" and a.state != "lost"]
    start = _occlusion(moments)
    stop = next((m.time for m in stops if start is not None and m.time >= start), None)
    return {
        "frames": len(moments),
        "confirmed_time": next((m.time for m in moments if m.confirmed), None),
        "tracked_frames": len(tracked),
        "wrong_frames": sum(m.followed == "other" for m in tracked),
        "nobody_frames": sum(m.followed == "nobody" for m in tracked),
        "switches": len(switched),
        "switches_hidden": sum(not m.visible for m in switched),
        "gate_rejections": sum(m.rejected for m in moments),
        "least_visible": min(m.share for m in moments if m.time < step_in_time),
        "step_in_time": step_in_time,
        "occlusion_start": start,
        "stop_time": None if start is None or stop is None else stop - start,
        "false_stops": sum(m.visible for m in stops),
        "seconds_visible": PERIOD * sum(m.confirmed and m.visible for m in moments),
    }


def _occlusion(moments: Sequence[_Moment]) -> float | None:
    """Return when the target began to stay hidden for longer than `HIDDEN_TIME`."""
    for visible, run in groupby(moments, key=lambda moment: moment.visible):
        times = [moment.time for moment in run]
        if not visible and times[-1] - times[0] > HIDDEN_TIME + 0.5 * PERIOD:
            return times[0]
    return None
