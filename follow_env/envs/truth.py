"""What is true at a moment: where the person is as the robot sees it, how near, and whether in view.

Frames are REP-103: robot x forward, y left, origin at the axle's middle.
"""

import math
from collections.abc import Callable
from typing import Any

from follow_env.world.people import dimensions
from follow_env.world.people.dimensions import CHEST_HEIGHT, TRUNK

NEAREST_SEEN = 0.3
"""Persons nearer to the camera than this are not seen, m ahead of it."""


def seen_from_robot(
    x: float, y: float, cosine: float, sine: float, person_x: float, person_y: float
) -> tuple[float, float, float]:
    """Return the person's (bearing, distance ahead, offset to the left) in the robot's frame; rad and m.

    Args:
        x: of the robot, m.
        y: of the robot, m.
        cosine: of the robot's yaw.
        sine: of the robot's yaw.
        person_x: x of the person, m.
        person_y: y of the person, m.
    """
    dx, dy = person_x - x, person_y - y
    distance, left = cosine * dx + sine * dy, -sine * dx + cosine * dy
    return math.atan2(left, distance), distance, left


def surface_distance(x: float, y: float, person_x: float, person_y: float, hull_radius: float) -> float:
    """Return the gap between the robot's hull and the person, m."""
    dx, dy = person_x - x, person_y - y
    return max(math.sqrt(dx * dx + dy * dy) - hull_radius - dimensions.RADIUS, 0.0)


def in_view(
    sight: Callable[..., bool],
    world: Any,
    eye: tuple[float, float, float],
    person: tuple[float, float],
    direction: tuple[float, float],
    depth: float,
    left: float,
    half_view: float,
) -> bool:
    """Whether any of the trunk (axis, left or right side) is in the camera's field with a free line of sight.

    Args:
        sight: function (world, eye, point) that says whether nothing of the scene stands between the two.
        world: what `sight` looks at.
        eye: the camera's optical center, m.
        person: x and y of the person, m.
        direction: cosine and sine of the camera's yaw.
        depth: of the person ahead of the camera, m.
        left: of the person to the left of the optical axis, m.
        half_view: tangent of half the horizontal field of view.
    """
    if depth <= NEAREST_SEEN:
        return False
    reach = depth * half_view
    for offset in TRUNK:
        if abs(left + offset) <= reach:
            point = (person[0] - offset * direction[1], person[1] + offset * direction[0], CHEST_HEIGHT)
            if sight(world, eye, point):
                return True
    return False
