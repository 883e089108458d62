"""The person as physics and visibility see one: an upright capsule, and the part of it that is looked for."""

RADIUS = 0.25
"""Of the capsule that the robot can run into, m."""
HEIGHT = 1.75
"""Of a person of average size, m."""
STRAIGHT = HEIGHT - 2.0 * RADIUS - 0.02
"""Length of the capsule between its two half-spheres, m: it ends 1 cm above the floor."""
CHEST_HEIGHT = 1.2
"""Height at which the person is looked for, m."""
HALF_TRUNK = 0.16
"""The person counts as visible while any of the trunk, this far to either side of its axis, is in view, m."""
TRUNK = (0.0, HALF_TRUNK, -HALF_TRUNK)
"""Points of the trunk that are looked for, m to the left of its axis as the robot sees it."""
