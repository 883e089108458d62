"""What good following is: bounded reward terms (they stand in `info["rewards"]`) and the rule for success."""

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


def reward_terms(bearing: float, distance: float, visible: bool, effort: float, collided: bool) -> dict[str, float]:
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
    distance_error, bearing_error = (distance - SET_POINT) / 0.5, bearing / 0.35
    return {
        "distance": 0.4 / (1.0 + distance_error * distance_error),
        "bearing": 0.4 / (1.0 + bearing_error * bearing_error),
        "visible": 0.1 if visible else 0.0,
        "smoothness": 0.1 * (1.0 - 0.5 * effort),
        "collision": -1.0 if collided else 0.0,
    }
