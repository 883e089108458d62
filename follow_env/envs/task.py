"""What good following is: bounded reward terms (they stand in `info["rewards"]`), the ends and the rule for success."""

from typing import Any

from follow_env.config import TaskConfig

REWARD_TERMS = ("distance", "bearing", "visible", "smoothness", "collision")
"""Names of what `reward_terms` returns, in order."""
TIME_ROUNDING = 1e-9
"""Times that differ by less are the same, s."""


SET_POINT, BAND_BEARING = TaskConfig.set_point, TaskConfig.band_bearing
BAND_DISTANCE = TaskConfig.band_near, TaskConfig.band_far
SUCCESS_BAND_SHARE, SUCCESS_OUT_OF_VIEW = TaskConfig.success_band_share, TaskConfig.success_out_of_view
"""Of the paper's task."""


def reward_terms(
    task: Any, bearing: float, distance: float, visible: bool, effort: float, collided: bool
) -> tuple[float, float, float, float, float]:
    """Return the terms of one step, each in its stated range.

    Args:
        task: `TaskConfig`, or a record of the same names.
        bearing: truth, rad.
        distance: truth, m.
        visible: whether the person is in view.
        effort: largest change of an action component since the last step, in [0, 2].
        collided: whether the robot touches a wall or the person.

    Returns:
        With the default weights `distance` in [0, 0.4] and `bearing` in [0, 0.4], each half its maximum at an error of
        0.5 m and 0.35 rad; `visible` 0 or 0.1; `smoothness` in [0, 0.1]; `collision` -1 or 0. The sum is at most 1.
    """
    distance_error, bearing_error = (distance - task.set_point) / task.distance_scale, bearing / task.bearing_scale
    return (
        task.distance_weight / (1.0 + distance_error * distance_error),
        task.bearing_weight / (1.0 + bearing_error * bearing_error),
        task.visible_weight if visible else 0.0,
        task.smoothness_weight * (1.0 - 0.5 * effort),
        -task.collision_cost if collided else 0.0,
    )


def effort(first: float, second: float, last_first: float, last_second: float) -> float:
    """Return the largest change of an action component, in [0, 2]."""
    return max(abs(first - last_first), abs(second - last_second))


def total(terms: tuple[float, float, float, float, float]) -> float:
    """Return the reward, the terms added from left to right: the same bits on every Python."""
    return (((terms[0] + terms[1]) + terms[2]) + terms[3]) + terms[4]


def in_band(task: Any, bearing: float, distance: float) -> bool:
    """Whether the robot follows at about the right distance with the person about ahead."""
    return bool(task.band_near <= distance <= task.band_far and abs(bearing) <= task.band_bearing)


def ends(task: Any, collided: bool, out_of_view: float, time: float, duration: float) -> tuple[bool, bool]:
    """Return (terminated, truncated): a collision or a lost person terminates, the route's end truncates.

    Args:
        task: see `reward_terms`.
        collided: whether the robot touches a wall or the person.
        out_of_view: how long the person has been out of view, s.
        time: since the start, s.
        duration: of the route, s.
    """
    terminated = collided or out_of_view > task.lost_after
    return terminated, not terminated and time >= duration - TIME_ROUNDING


def succeeds(task: Any, collided: bool, longest_out_of_view: float, steps_in_band: int, steps: int) -> bool:
    """Whether an episode of so many steps, the first moment included, is one of good following.

    Args:
        task: see `reward_terms`.
        collided: whether it ended in a collision.
        longest_out_of_view: the longest time without the person in view, s.
        steps_in_band: of the steps.
        steps: all of them.
    """
    in_time = longest_out_of_view <= task.success_out_of_view + TIME_ROUNDING
    return bool(not collided and in_time and steps_in_band >= task.success_band_share * steps)
