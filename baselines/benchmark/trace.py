"""`Trace`: a whole episode at control rate, kept so that every later question is asked of it instead of a replay."""

from __future__ import annotations

import dataclasses
import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from baselines.benchmark.files import write_bytes
from baselines.benchmark.metrics.episode import Step

Array = NDArray[Any]


@dataclass(frozen=True, eq=False)
class Trace:
    """One episode of n moments: the reset, and the end of every control period.

    What belongs to a moment is what was true then, what the policy believed when it had seen that moment's observation,
    and the action that it chose. Units are SI, angles rad, frames REP-103.

    Attributes:
        seed: of the environment's reset.
        config: settings of the episode, as plain data where they can be.
        terminated: whether the episode ended before its time.
        time: (n,) s.
        robot: (n, 3) x, y, yaw.
        person: (n, 3) x, y, heading.
        person_velocity: (n, 2).
        bearing, distance, surface_distance: (n,) of the person, true.
        visible, collision, saturated: (n,) bool.
        collision_with: (n,) text.
        twist, command: (n, 2) odometry and commanded v and omega.
        action: (n, 2) in [-1, 1].
        rewards: (n, 5) terms, in the order of `follow_env.envs.task.REWARD_TERMS`.
        measured: (n,) bool, whether there was a measurement.
        measurement: (n, 2) bearing and distance; 0 where `measured` is False.
        estimated: (n,) bool, whether the policy told an estimate.
        estimate, variance, innovation, nis, inflation: (n, 2) of `tracker.estimators.Estimate`; 0 where `estimated` is
            False.
        judged: (n, 2) text, what the filter did with the measurement: "accept", "inflate" or "miss".
        success: whether the environment called the episode one of good following.
        distance_set_point: m, of the task.
    """

    seed: int
    config: dict[str, Any]
    terminated: bool
    success: bool
    distance_set_point: float
    time: Array
    robot: Array
    person: Array
    person_velocity: Array
    bearing: Array
    distance: Array
    surface_distance: Array
    visible: Array
    collision: Array
    saturated: Array
    collision_with: Array
    twist: Array
    command: Array
    action: Array
    rewards: Array
    measured: Array
    measurement: Array
    estimated: Array
    estimate: Array
    variance: Array
    innovation: Array
    nis: Array
    inflation: Array
    judged: Array

    def __len__(self) -> int:
        return len(self.time)

    def steps(self) -> list[Step]:
        """Return the moments as the metrics of an episode read them."""
        columns = (self.bearing, self.distance, self.time, self.surface_distance)
        bearings, distances, times, gaps = (column.tolist() for column in columns)
        estimates, robots, persons, twists = (c.tolist() for c in (self.estimate, self.robot, self.person, self.twist))
        return [
            Step(
                time=times[k],
                bearing=bearings[k],
                distance=distances[k],
                errors=Step.errors_of(estimates[k], bearings[k], distances[k]) if self.estimated[k] else None,
                actions=(str(self.judged[k, 0]), str(self.judged[k, 1])),
                nis=(float(self.nis[k, 0]), float(self.nis[k, 1])),
                measured=bool(self.measured[k]),
                visible=bool(self.visible[k]),
                collision=bool(self.collision[k]),
                collision_with=str(self.collision_with[k]),
                surface_distance=gaps[k],
                robot=(robots[k][0], robots[k][1]),
                person=(persons[k][0], persons[k][1]),
                twist=(twists[k][0], twists[k][1]),
                saturated=bool(self.saturated[k]),
            )
            for k in range(len(self))
        ]

    def save(self, path: Path) -> None:
        """Write the trace as a compressed NumPy archive (`load` reads it), whole or not at all."""
        import io

        buffer = io.BytesIO()
        plain = {name: getattr(self, name) for name in _PLAIN}
        arrays = {f.name: getattr(self, f.name) for f in dataclasses.fields(self) if f.name not in _PLAIN}
        np.savez_compressed(buffer, plain=np.array(json.dumps(plain, sort_keys=True)), **arrays)
        write_bytes(path, buffer.getvalue())

    @classmethod
    def load(cls, path: Path) -> Trace:
        """Read a trace that `save` wrote.

        Raises:
            ValueError: if the file is none.
        """
        try:
            with np.load(path, allow_pickle=False) as archive:
                plain = json.loads(str(archive["plain"]))
                return cls(**plain, **{name: archive[name] for name in archive.files if name != "plain"})
        except (OSError, KeyError, TypeError, ValueError) as error:
            raise ValueError(f"{path} is no trace of an episode ({error}); expected what Trace.save wrote") from error


_PLAIN = ("seed", "config", "terminated", "success", "distance_set_point")
