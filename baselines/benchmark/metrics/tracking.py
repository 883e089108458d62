"""What a tracker did in an episode: whom it tracked, when it stopped, and how well it measured."""

from __future__ import annotations

import math
from collections.abc import Mapping
from itertools import pairwise
from typing import Any

from baselines.benchmark.metrics.episode import Row
from tracker.person_tracker import Track

AT_THE_PERSON = 0.5
"""A track farther than this from the person's true axis, on the ground, is one of something else, m."""

COLUMNS = (
    *("perception", "scene", "estimator", "seed", "processed_frames", "accepted_share"),
    *("confirmations", "false_confirmations", "stops", "untracked_s", "wrong_target_s", "tracked_at_end"),
    *("measured_steps", "measured_angle_rmse_rad", "measured_angle_bias_rad"),
    *("measured_distance_rmse_m", "measured_distance_bias_m"),
)
"""Columns of ``tracking_episodes.csv``. Untracked: since the first confirmation; accepted: of the processed frames;
measured: errors of the measurements alone, in the frames that have one."""


class TrackingMetrics:
    """Collects the tracks of one episode; its columns are none if there were no tracks."""

    def __init__(self) -> None:
        self._steps: list[tuple[float, Track, bool]] = []
        self._errors: list[tuple[float, float]] = []

    def record(self, info: Mapping[str, Any], track: Track) -> None:
        """Add one instant: what was true, and the track of that instant's picture."""
        bearing, distance = float(info["bearing"]), float(info["distance"])
        person = distance, distance * math.tan(bearing)
        right = track.position is not None and math.dist(track.position[:2], person) <= AT_THE_PERSON
        self._steps.append((float(info["time"]), track, right))
        if track.measurement is not None:
            x, y, _ = track.measurement
            self._errors.append((math.atan2(y, x) - bearing, x - distance))

    def columns(self) -> Row:
        """The episode's numbers, keyed by those of COLUMNS that ``metrics.COLUMNS`` lacks."""
        if not self._steps:
            return {}
        steps = self._steps
        processed = sum(track.processed for _, track, _ in steps)
        confirmed = [
            right for (_, before, _), (_, track, right) in pairwise(steps) if track.confirmations > before.confirmations
        ]
        period = (steps[-1][0] - steps[0][0]) / max(len(steps) - 1, 1)
        row: Row = {
            "processed_frames": processed,
            "accepted_share": len(self._errors) / processed,
            "confirmations": len(confirmed),
            "false_confirmations": confirmed.count(False),
            "stops": sum(track.alarm for _, track, _ in steps),
            "untracked_s": period * sum(track.confirmations > 0 and track.position is None for _, track, _ in steps),
            "wrong_target_s": period * sum(track.state == "tracking" and not right for _, track, right in steps),
            "tracked_at_end": int(steps[-1][2]),
            "measured_steps": len(self._errors),
        }
        for axis, (name, unit) in enumerate((("angle", "rad"), ("distance", "m"))):
            errors = [error[axis] for error in self._errors]
            mean, square = (math.fsum(e**k for e in errors) / len(errors) if errors else None for k in (1, 2))
            row[f"measured_{name}_rmse_{unit}"] = None if square is None else math.sqrt(square)
            row[f"measured_{name}_bias_{unit}"] = mean
        return row
