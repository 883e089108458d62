"""How well the robot followed: metrics of a trace that any policy has."""

from __future__ import annotations

import math

from baselines.benchmark.metrics.base import metric
from baselines.benchmark.metrics.episode import (
    differences,
    path_ratio,
    rms,
    seconds_near,
    share,
    spans_out_of_view,
)
from baselines.benchmark.trace import Trace


@metric("success")
def success(trace: Trace) -> int:
    """No collision, in band for at least the task's share of the steps, never out of view for longer than it allows."""
    return int(trace.success)


@metric("angle_tracking_rmse_rad", "rad", root_mean_square=True)
def angle_tracking_rmse(trace: Trace) -> float | None:
    """RMS of the true bearing, whose set point is 0."""
    return rms(trace.bearing.tolist())


@metric("distance_tracking_rmse_m", "m", root_mean_square=True)
def distance_tracking_rmse(trace: Trace) -> float | None:
    """RMS of the true forward distance less the set point."""
    return rms([distance - trace.distance_set_point for distance in trace.distance.tolist()])


@metric("distance_tracking_bias_m", "m")
def distance_tracking_bias(trace: Trace) -> float:
    """Mean of the true forward distance less the set point."""
    return math.fsum(distance - trace.distance_set_point for distance in trace.distance.tolist()) / len(trace)


@metric("visible_share")
def visible_share(trace: Trace) -> float:
    """Share of the moments in which the person was in view."""
    return share(trace.visible)


@metric("collided")
def collided(trace: Trace) -> int:
    """Whether the robot ran into something."""
    return int(trace.collision[-1])


@metric("lost")
def lost(trace: Trace) -> int:
    """Whether the episode ended because the person was out of view for too long."""
    return int(trace.terminated and not trace.collision[-1])


@metric("loss_count")
def loss_count(trace: Trace) -> int:
    """How often the person went out of view."""
    return len(spans_out_of_view(trace.steps()))


@metric("longest_out_of_view_s", "s")
def longest_out_of_view(trace: Trace) -> float:
    """The longest time without the person in view."""
    return max(spans_out_of_view(trace.steps()), default=0.0)


@metric("min_surface_distance_m", "m")
def min_surface_distance(trace: Trace) -> float:
    """The smallest gap between robot and person."""
    return float(trace.surface_distance.min())


@metric("seconds_nearer_045_m", "s")
def seconds_nearer(trace: Trace) -> float:
    """Time with a gap below 0.45 m, the intimate zone."""
    return seconds_near(trace.steps())


@metric("rms_jerk_m_s3", "m/s^3", root_mean_square=True)
def rms_jerk(trace: Trace) -> float | None:
    """RMS of the second difference of the odometry's speed."""
    steps = trace.steps()
    return rms(differences(differences(trace.twist[:, 0].tolist(), steps), steps[1:]))


@metric("rms_angular_jerk_rad_s3", "rad/s^3", root_mean_square=True)
def rms_angular_jerk(trace: Trace) -> float | None:
    """RMS of the second difference of the odometry's turning rate."""
    steps = trace.steps()
    return rms(differences(differences(trace.twist[:, 1].tolist(), steps), steps[1:]))


@metric("saturation_share")
def saturation_share(trace: Trace) -> float:
    """Share of the control periods in which the wheels could not do what was asked."""
    return share(trace.saturated[1:])


@metric("path_ratio")
def way_ratio(trace: Trace) -> float | None:
    """The robot's path length over the person's; none where the person stood."""
    return path_ratio(trace.steps())


@metric("episode_return")
def episode_return(trace: Trace) -> float:
    """Sum of the rewards."""
    return math.fsum(trace.rewards[1:].ravel().tolist())
