"""Paper A's Table 2: a subject in three colors turns in every posture before two cameras; which net misses it less?

Both nets see the same pictures, with the sensor's errors.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path

import cv2
import numpy as np

from baselines.benchmark.files import Value
from baselines.benchmark.markdown import markdown_table
from baselines.papers.zhang2018.sequences import POSTURES, TABLE_2, play
from baselines.papers.zhang2018.sequences import Sequence as Film
from tracker.depth import Box
from tracker.metrics import DetectionCounts, count_detections
from tracker.person_tracker import Detector

Row = Mapping[str, Value]

OURS, SSD = "light", "light_ssd"
NETS = (SSD, OURS)
"""The nets compared, in the paper's order, both on the light trunk: SSD's 8732 priors without shared features, and the
paper's 2252 with them."""

PAPER: dict[tuple[str, int], dict[str, DetectionCounts]] = {
    ("green", 1): {SSD: DetectionCounts(1850, 1844, 0, 6, 4), OURS: DetectionCounts(1850, 1850, 0, 0, 0)},
    ("green", 2): {SSD: DetectionCounts(1853, 1779, 0, 74, 23), OURS: DetectionCounts(1853, 1850, 0, 3, 3)},
    ("blue", 1): {SSD: DetectionCounts(2131, 2117, 0, 14, 5), OURS: DetectionCounts(2131, 2122, 0, 9, 5)},
    ("blue", 2): {SSD: DetectionCounts(2050, 2049, 0, 1, 1), OURS: DetectionCounts(2050, 2041, 0, 9, 9)},
    ("indigo", 1): {SSD: DetectionCounts(1675, 1675, 0, 0, 0), OURS: DetectionCounts(1675, 1675, 0, 0, 0)},
    ("indigo", 2): {SSD: DetectionCounts(1893, 1893, 0, 0, 0), OURS: DetectionCounts(1893, 1893, 0, 0, 0)},
}
"""What the paper printed, by sequence, of the net that stands in the same place here."""
COLUMNS = ("suit", "view", "frame", "posture", "truth", *NETS)
"""Of the rows: a frame each. Boxes are `u0 v0 u1 v1`, px; the nets' have a score behind, and `;` between them."""
COUNTS = ("tp", "fp", "fn", "cfn", "tda")
RECORD_COLUMNS = ("suit", "view", "frames", "net", *COUNTS, "paper_frames", *(f"paper_{name}" for name in COUNTS))
ALL = "all"


def films(share: float = 1.0) -> list[Film]:
    """Return the sequences, each cut to a share of its frames: the subject then turns the faster."""
    return [Film(row.suit, row.view, max(len(POSTURES), round(share * row.frames))) for row in TABLE_2]


def detect(film: Film, part: int, detectors: Mapping[str, Detector]) -> list[Row]:
    """Return rows with `COLUMNS`: what each detector finds in the frames of one posture, by its number."""
    frames = film.part(part)
    rows: list[Row] = []
    for number, shown in zip(frames, play(film, frames), strict=True):
        box = shown.person_box()
        row: dict[str, Value] = {"suit": film.suit, "view": film.view, "frame": number, "posture": film.posture(number)}
        row["truth"] = None if box is None else " ".join(f"{edge:.0f}" for edge in box)
        for net in NETS:
            row[net] = None
        for net in detectors:
            found = detectors[net].detect(shown.rgb, shown.depth)
            row[net] = ";".join(" ".join([*(f"{e:.1f}" for e in one.box), f"{one.score:.3f}"]) for one in found)
        rows.append(row)
    return rows


def records(rows: Iterable[Row]) -> list[dict[str, Value]]:
    """Return a record with `RECORD_COLUMNS` for each sequence and net, and for all sequences together.

    Args:
        rows: Of whole sequences, in the order of the frames.
    """
    found: list[dict[str, Value]] = []
    sequences = _grouped(rows, lambda row: (str(row["suit"]), int(str(row["view"]))))
    totals: dict[str, list[tuple[DetectionCounts, DetectionCounts]]] = {}
    for (suit, view), group in sequences.items():
        for net in _nets(group):
            counts, paper = _count(group, net), PAPER[suit, view][net]
            totals.setdefault(net, []).append((counts, paper))
            found.append({"suit": suit, "view": view, "net": net, **_fields(counts, paper)})
    for net, pairs in totals.items():
        counts, paper = (_total([pair[k] for pair in pairs]) for k in (0, 1))
        found.append({"suit": ALL, "view": None, "net": net, **_fields(counts, paper)})
    return found


def table(found: Sequence[Row]) -> str:
    """Return the records as Markdown, the paper's TP, FN, CFN and TDA beside ours."""
    header = ["clothes", "view", "frames", "net", "TP", "FP", "FN", "CFN", "TDA"]
    header += ["paper: net", "frames", "TP", "FP", "FN", "CFN", "TDA"]
    lines = []
    for record in found:
        ours, theirs = ([_number(record, f"{prefix}{name}") for name in COUNTS] for prefix in ("", "paper_"))
        view = "both" if record["view"] is None else str(record["view"])
        lines.append(
            [
                *(str(record["suit"]), view, str(record["frames"]), str(record["net"]), *ours),
                *("SSD" if record["net"] == SSD else "theirs", str(record["paper_frames"]), *theirs),
            ]
        )
    return markdown_table(header, lines, left=2)


def by_posture(rows: Iterable[Row]) -> str:
    """Return a Markdown table of the TDA of each net in each posture, all sequences together."""
    rows = list(rows)
    nets, lines = _nets(rows), []
    for posture, group in _grouped(rows, lambda row: str(row["posture"])).items():
        counts = [_count(group, net) for net in nets]
        lines.append(
            [posture.replace("_", " "), str(counts[0].frames), *(f"{100.0 * one.tda:.2f} %" for one in counts)]
        )
    return markdown_table(["posture", "frames", *(f"TDA of {net}" for net in nets)], lines, left=1)


def draw(detector: Detector, path: Path) -> None:
    """Draw Figure 11: the subject in blue in each posture, a view a line, with the detector's boxes in red.

    Args:
        detector: Finds the people.
        path: The picture; its folder exists.
    """
    size, each = (200, 150), 8
    lines = []
    for view in (1, 2):
        film = Film("blue", view, each * len(POSTURES))
        moments = [each * k + 3 * k % each for k in range(len(POSTURES))]  # every posture from another side
        pictures = []
        for shown in play(film, moments):
            picture = cv2.resize(shown.rgb, size, interpolation=cv2.INTER_AREA)
            scale = size[0] / shown.rgb.shape[1]
            for one in detector.detect(shown.rgb, shown.depth):
                u0, v0, u1, v1 = (round(scale * edge) for edge in one.box)
                cv2.rectangle(picture, (u0, v0), (u1 - 1, v1 - 1), (230, 20, 20), 2)
            pictures.append(picture)
        lines.append(np.hstack(pictures))
    cv2.imwrite(str(path), np.vstack(lines)[:, :, ::-1])


def _grouped(rows: Iterable[Row], key: Callable[[Row], object]) -> dict:
    groups: dict[object, list[Row]] = {}
    for row in rows:
        groups.setdefault(key(row), []).append(row)
    return groups


def _nets(rows: Sequence[Row]) -> list[str]:
    """Return the nets that saw the frames: a net that found nobody has an empty text, one that was not there none."""
    return [net for net in NETS if rows[0][net] is not None]


def _count(rows: Sequence[Row], net: str) -> DetectionCounts:
    truth = [_box(str(row["truth"])) if row["truth"] else None for row in rows]
    return count_detections(truth, [[_box(text) for text in str(row[net] or "").split(";") if text] for row in rows])


def _box(text: str) -> Box:
    u0, v0, u1, v1 = (float(edge) for edge in text.split()[:4])
    return u0, v0, u1, v1


def _total(counts: Sequence[DetectionCounts]) -> DetectionCounts:
    frames, tp, fp, fn = (sum(getattr(one, name) for one in counts) for name in ("frames", "tp", "fp", "fn"))
    return DetectionCounts(frames, tp, fp, fn, max(one.cfn for one in counts))


def _fields(counts: DetectionCounts, paper: DetectionCounts) -> dict[str, Value]:
    return {
        f"{prefix}{name}": getattr(one, name)
        for prefix, one in (("", counts), ("paper_", paper))
        for name in ("frames", *COUNTS)
    }


def _number(record: Row, name: str) -> str:
    return f"{100.0 * float(str(record[name])):.2f} %" if name.endswith("tda") else str(record[name])
