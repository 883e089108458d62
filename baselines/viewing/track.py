"""`follow track`: paper A's tracker on a recorded RGB-D stream; tables of the track and an annotated video."""

from __future__ import annotations

import csv
import dataclasses
import json
import math
from collections import Counter
from collections.abc import Callable
from pathlib import Path

import cv2
import numpy as np

from baselines.benchmark.progress import progress
from baselines.benchmark.provenance import machine, packages
from baselines.viewing.video import VideoWriter
from tracker.person_tracker import Detector, PersonTracker, Pixel, State, Track, TrackerSettings
from tracker.recording import Recording, UnreadableFrame

COLUMNS = (
    *("frame", "picture", "time", "state", "measured", "x", "y", "z", "vx", "vy", "vz", "bearing", "distance"),
    *("u0", "v0", "u1", "v1", "confidence", "gate_distance", "score", "failures", "age", "confirmations"),
)
"""Of `tracks.csv`: frames counted from 0, SI units, robot frame; boxes px; empty where there is nothing."""
COLORS: dict[State, tuple[int, int, int]] = {
    "searching": (200, 200, 200),
    "confirming": (240, 228, 66),
    "tracking": (0, 158, 115),
    "coasting": (230, 159, 0),
    "lost": (213, 94, 0),
}
"""Okabe-Ito colors of the states in the video."""


def track(
    recording: Recording,
    out: Path,
    detector: Detector,
    target: Pixel | None = None,
    report: Callable[[str], None] = print,
) -> str:
    """Track one person through a recording and return a summary.

    Writes `tracks.csv` (a row per frame), `tracks.txt` (MOT Challenge: frame from 1, id = number of the confirmation,
    left, top, width, height, confidence, x, y, z; frames with a measurement only), `video.mp4` and `config.json`. A
    frame that cannot be read is reported and skipped; for the tracker the person was not seen in it. The camera is
    taken to stand, as a recording has no odometry.

    Args:
        recording: What to track in, see `tracker.recording`.
        out: Folder to write to; made if it does not exist.
        detector: Finds the people.
        target: Picture point of the person to track; by default the largest, most central one.
        report: Is told of each frame that cannot be read.

    Raises:
        ValueError: If a picture is not of the camera's size, or none can be read.
        OSError: If the folder cannot be written.
    """
    settings = TrackerSettings.for_rate(recording.rate)
    tracker = PersonTracker(detector, recording.intrinsics, recording.mount, settings)
    tracker.confirm(target)
    out.mkdir(parents=True, exist_ok=True)
    states: Counter[State] = Counter()
    skipped = 0
    with (
        open(out / "tracks.csv", "w", newline="", encoding="utf-8") as table,
        open(out / "tracks.txt", "w", encoding="utf-8") as mot,
        VideoWriter(out / "video.mp4", recording.rate) as video,
    ):
        rows = csv.writer(table, lineterminator="\n")
        rows.writerow(COLUMNS)
        for frame, (picture, _) in enumerate(progress(recording.frames, len(recording.frames), unit="frame")):
            try:
                rgb, depth = recording.read(frame)
            except UnreadableFrame as error:
                report(f"frame {frame} is skipped: {error}.")
                skipped += 1
                seen = tracker.skip()
            else:
                seen = tracker.update(rgb, depth)
                video.write(_annotated(rgb, seen))
            states[seen.state] += 1
            rows.writerow(_row(frame, picture.name, frame / recording.rate, seen))
            mot.write(_mot_line(frame, seen))
    if skipped == len(recording.frames):
        raise ValueError(f"none of the {skipped} frames of {recording.folder} can be read; check the picture files.")
    content = {
        "source": recording.folder.name,
        "camera": dataclasses.asdict(recording.intrinsics) | dataclasses.asdict(recording.mount),
        "tracker": dataclasses.asdict(settings),
        "detector": type(detector).__name__,
        "target": target,
        "packages": packages(),
        "machine": machine(),
    }
    (out / "config.json").write_text(json.dumps(content, indent=1) + "\n", encoding="utf-8")
    counts = ", ".join(f"{states[state]} {state}" for state in COLORS if states[state])
    return (
        f"{len(recording.frames)} frames, {skipped} skipped: {counts}; "
        f"{seen.confirmations} confirmed, {'stopped' if seen.alarm else 'not stopped'} at the end.\n"
        f"tracks.csv, tracks.txt, video.mp4 and config.json are in {out}."
    )


def _row(frame: int, picture: str, time: float, seen: Track) -> list[object]:
    box, nowhere = seen.box or ("",) * 4, ("",) * 3
    numbers = (
        *(seen.position or nowhere),
        *(seen.velocity or nowhere),
        *(seen.bearing, seen.distance),
        *box,
        *(seen.confidence, seen.gate_distance, seen.score),
    )
    written = [f"{value:.6g}" if isinstance(value, float) else value for value in numbers]
    measured = int(seen.measurement is not None)
    return [
        *(frame, picture, f"{time:.4f}", seen.state, measured),
        *written,
        *(seen.failures, f"{seen.age:.4f}", seen.confirmations),
    ]


def _mot_line(frame: int, seen: Track) -> str:
    if seen.measurement is None or seen.box is None:
        return ""
    u0, v0, u1, v1 = seen.box
    x, y, z = seen.measurement
    return (
        f"{frame + 1},{seen.confirmations},{u0:.2f},{v0:.2f},{u1 - u0:.2f},{v1 - v0:.2f},"
        f"{seen.confidence:.4f},{x:.4f},{y:.4f},{z:.4f}\n"
    )


def _annotated(rgb: np.ndarray, seen: Track) -> np.ndarray:
    """Return the picture with the box, thin where nothing was measured, and a line of text."""
    image, color = rgb.copy(), COLORS[seen.state]
    if seen.box is not None:
        u0, v0, u1, v1 = (round(value) for value in seen.box)
        cv2.rectangle(image, (u0, v0), (u1 - 1, v1 - 1), color, 1 if seen.measurement is None else 2)
    text: str = seen.state
    if seen.distance is not None and seen.bearing is not None:
        text += f"  {seen.distance:.2f} m  {math.degrees(seen.bearing):+.1f} deg"
    elif seen.alarm:
        text += "  alarm: confirm again"
    size = max(image.shape[1] / 800.0, 0.35)
    line = round(30 * size)
    cv2.rectangle(image, (0, 0), (image.shape[1], line), (40, 40, 40), -1)
    cv2.putText(image, text, (4, round(0.72 * line)), cv2.FONT_HERSHEY_SIMPLEX, size, color, 1, cv2.LINE_AA)
    return image
