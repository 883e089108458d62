"""What good following is: bounded reward terms (they stand in `info["rewards"]`), the ends and the rule for success."""

import math

SET_POINT = 1.5
"""Following distance that is rewarded, m (paper B, section 3); the bearing's set point is 0 rad."""
BAND_DISTANCE = (1.0, 2.0)
"""In band: the distance lies between these, m ..."""
BAND_BEARING = math.radians(30.0)
"""... and |bearing| is at most this, rad."""
SUCCESS_BAND_SHARE = 0.8
"""An episode succeeds without collision, in band for at least this share of its steps ..."""
SUCCESS_OUT_OF_VIEW = 1.0
"""... and with the person never out of view for longer than this, s."""
LOST_AFTER = 5.0
"""The episode ends when the person was out of view for longer than this, s."""

REWARD_TERMS = ("distance", "bearing", "visible", "smoothness", "collision")
"""Names of what `reward_terms` returns, in order."""
DISTANCE_WEIGHT, BEARING_WEIGHT, VISIBLE_WEIGHT, SMOOTHNESS_WEIGHT, COLLISION_COST = 0.4, 0.4, 0.1, 0.1, 1.0
"""The largest size of each term."""
DISTANCE_SCALE, BEARING_SCALE = 0.5, 0.35
"""Errors at which half of a term is left, m and rad."""
TIME_ROUNDING = 1e-9
"""Times that differ by less are the same, s."""


def reward_terms(
    bearing: float, distance: float, visible: bool, effort: float, collided: bool
) -> tuple[float, float, float, float, float]:
    """Return the terms of one step, each in its stated range.

    Args:
        bearing: truth, rad.
        distance: truth, m.
        visible: whether the person is in view.
        effort: largest change of an action component since the last step, in [0, 2].
        collided: whether the robot touches a wall or the person.

    Returns:
        `distance` in [0, 0.4] and `bearing` in [0, 0.4], each half its maximum at an error of 0.5 m and 0.35 rad;
        `visible` 0 or 0.1; `smoothness` in [0, 0.1]; `collision` -1 or 0. The sum is at most 1.
    """
    distance_error, bearing_error = (distance - SET_POINT) / DISTANCE_SCALE, bearing / BEARING_SCALE
    return (
        DISTANCE_WEIGHT / (1.0 + distance_error * distance_error),
        BEARING_WEIGHT / (1.0 + bearing_error * bearing_error),
        VISIBLE_WEIGHT if visible else 0.0,
        SMOOTHNESS_WEIGHT * (1.0 - 0.5 * effort),
        -COLLISION_COST if collided else 0.0,
    )


def effort(first: float, second: float, last_first: float, last_second: float) -> float:
    """Return the largest change of an action component, in [0, 2]."""
    return max(abs(first - last_first), abs(second - last_second))


def total(terms: tuple[float, float, float, float, float]) -> float:
    """Return the reward, the terms added from left to right: the same bits on every Python."""
    return (((terms[0] + terms[1]) + terms[2]) + terms[3]) + terms[4]


def in_band(bearing: float, distance: float) -> bool:
    """Whether the robot follows at about the right distance with the person about ahead."""
    return BAND_DISTANCE[0] <= distance <= BAND_DISTANCE[1] and abs(bearing) <= BAND_BEARING


def ends(collided: bool, out_of_view: float, time: float, duration: float) -> tuple[bool, bool]:
    """Return (terminated, truncated): a collision or a lost person terminates, the route's end truncates.

    Args:
        collided: whether the robot touches a wall or the person.
        out_of_view: how long the person has been out of view, s.
        time: since the start, s.
        duration: of the route, s.
    """
    terminated = collided or out_of_view > LOST_AFTER
    return terminated, not terminated and time >= duration - TIME_ROUNDING


def succeeds(collided: bool, longest_out_of_view: float, steps_in_band: int, steps: int) -> bool:
    """Whether an episode of so many steps, the first moment included, is one of good following.

    Args:
        collided: whether it ended in a collision.
        longest_out_of_view: the longest time without the person in view, s.
        steps_in_band: of the steps.
        steps: all of them.
    """
    return (
        not collided
        and longest_out_of_view <= SUCCESS_OUT_OF_VIEW + TIME_ROUNDING
        and steps_in_band >= SUCCESS_BAND_SHARE * steps
    )
