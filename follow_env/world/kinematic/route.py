# mypy: disable-error-code="no-untyped-def"
"""The walker's route in a world's record: drawn as `follow_env.world.motion.routes` draws it, walked by integration."""

import math

from numba import njit

from follow_env.compilation import compilable
from follow_env.world.kinematic.philox import ROUTE, START, uniforms
from follow_env.world.kinematic.place import nearer_than
from follow_env.world.motion.profile import speed_at, turned_at, walked_at
from follow_env.world.motion.routes import (
    ATTEMPTS,
    CLEARANCE,
    CORNER_CUT,
    EARLIEST_TURN,
    LARGEST_TURN,
    LATEST_TURN,
    OUTLINE_STEP,
    PAPER_DISTANCE,
    PAPER_DURATION,
    PAPER_RAMP,
    QUICKEST_TURN,
    SLOWEST_TURN,
    SMALLEST_TURN,
    TABLE_STEP,
)

KERNEL_ROUTES = ("paper", "straight", "standing")
"""Routes that are drawn here, by their number in a world's record. All others come as tables."""
MOST_TURNS = 2
"""Turns that a paper route can have."""
_PAPER, _STANDING = KERNEL_ROUTES.index("paper"), KERNEL_ROUTES.index("standing")
_UNKNOWN = -1.0  # a speed like no other: speeds are not negative

compilable(speed_at, turned_at, walked_at)
_jit = njit(nogil=True, error_model="numpy", forceinline=True)


@_jit
def draw_route(world, place, stretch):
    """Draw the route that the record names from the person's pose in it; False if none fits the place.

    All its times are those of the paper by `stretch`: `Route.at_speed`.
    """
    world.turns = 0
    world.duration, world.ramp = PAPER_DURATION, PAPER_RAMP
    if world.route == _STANDING:
        world.distance_total = 0.0
        return True
    world.distance_total = PAPER_DISTANCE
    fits = world.route != _PAPER or _draw_paper_route(world, place)
    world.duration, world.ramp = stretch * PAPER_DURATION, stretch * PAPER_RAMP
    for k in range(world.turns):
        world.turn_start[k], world.turn_duration[k] = stretch * world.turn_start[k], stretch * world.turn_duration[k]
    return fits


@_jit
def _draw_paper_route(world, place):
    """Draw turns until the walk is free of obstacles; False if it never is: `routes.paper_route`."""
    world.turns = 1 if uniforms(world, 0, 1, START)[0] < 0.5 else 2
    for attempt in range(ATTEMPTS):
        _draw_turns(world, attempt)
        if _outline_is_free(world, place) and _path_is_free(world, place):
            return True
    return False


@_jit
def _draw_turns(world, attempt):
    """Draw the turns in the order of time: `routes._draw_turns`."""
    for k in range(world.turns):
        begin, angle, sign, duration = uniforms(world, attempt, k, ROUTE)
        world.turn_start[k] = EARLIEST_TURN + (LATEST_TURN - EARLIEST_TURN) * begin
        size = SMALLEST_TURN + (LARGEST_TURN - SMALLEST_TURN) * angle
        world.turn_angle[k] = size if sign < 0.5 else -size
        world.turn_duration[k] = QUICKEST_TURN + (SLOWEST_TURN - QUICKEST_TURN) * duration
    if world.turns == MOST_TURNS and world.turn_start[1] < world.turn_start[0]:
        world.turn_start[0], world.turn_start[1] = world.turn_start[1], world.turn_start[0]


@_jit
def _outline_is_free(world, place):
    """Whether turns do not overlap or exceed 50 deg and the path with sharp corners is free: `routes._outline`."""
    turned, last_end = 0.0, 0.0
    for k in range(world.turns):
        turned += world.turn_angle[k]
        if world.turn_start[k] < last_end or abs(turned) > LARGEST_TURN:
            return False
        last_end = world.turn_start[k] + world.turn_duration[k]
    x, y, heading = world.person_x, world.person_y, world.route_heading
    along, walked, turned = 0.0, 0.0, 0.0
    for k in range(world.turns + 1):
        corner = PAPER_DISTANCE
        if k < world.turns:
            corner = PAPER_DISTANCE * (world.turn_start[k] + 0.5 * world.turn_duration[k]) / PAPER_DURATION
        cosine, sine = math.cos(heading + turned), math.sin(heading + turned)
        while along <= min(corner, PAPER_DISTANCE - 0.5 * OUTLINE_STEP):
            if nearer_than(place, x + (along - walked) * cosine, y + (along - walked) * sine, CLEARANCE - CORNER_CUT):
                return False
            along += OUTLINE_STEP
        x, y = x + (corner - walked) * cosine, y + (corner - walked) * sine
        walked = corner
        if k < world.turns:
            turned += world.turn_angle[k]
    return True


@_jit
def _path_is_free(world, place):
    """Whether every third point of the route's table keeps the clearance."""
    x, y = world.person_x, world.person_y
    motion = _motion(world, 0.0, (0.0, 0.0, _UNKNOWN, 0.0))
    for i in range(math.ceil(PAPER_DURATION / TABLE_STEP) + 1):
        if i % 3 == 0 and nearer_than(place, x, y, CLEARANCE):
            return False
        x, y, motion = _walk(world, x, y, motion, i * TABLE_STEP, TABLE_STEP)
    return True


@_jit
def start_person(world, tables, i):
    """Put the person of world i where its motion begins."""
    if world.by_table:
        world.ramp = math.inf  # never steady
        follow_table(world, tables, i, 0)
    else:
        world.heading = heading_of(world, 0.0)
        world.person_vx, world.person_vy = velocity(world, 0.0)


@njit(nogil=True, error_model="numpy")
def follow_table(world, tables, i, step):
    """Put the person of world i where the motion's table has it at a step; after the last row, at the last row."""
    k = min(step, world.rows - 1)
    world.person_x, world.person_y, world.heading = tables[i, k, 0], tables[i, k, 1], tables[i, k, 2]
    world.speed, world.walked = tables[i, k, 3], tables[i, k, 4]
    world.person_vx, world.person_vy = world.speed * math.cos(world.heading), world.speed * math.sin(world.heading)


@_jit
def advance_person(world, tables, i, dt, substeps):
    """Move the person of world i on by dt: position, heading and velocity."""
    t = world.steps * dt
    x, y, vx, vy = world.person_x, world.person_y, world.person_vx, world.person_vy
    if _steady(world, t, t + dt):
        world.person_x, world.person_y = x + dt * vx, y + dt * vy
        return
    if world.by_table:
        follow_table(world, tables, i, world.steps + 1)
        return
    h, motion = dt / substeps, (vx, vy, _UNKNOWN, 0.0)
    for k in range(substeps):
        x, y, motion = _walk(world, x, y, motion, t + k * h, h)
    world.person_x, world.person_y = x, y
    world.person_vx, world.person_vy, _, _ = motion
    world.heading = heading_of(world, t + dt)


@_jit
def _steady(world, t0, t1):
    """Whether speed and heading stay the same between two times."""
    if t0 < world.ramp or t1 > world.duration - world.ramp:
        return False
    for k in range(world.turns):
        if t1 > world.turn_start[k] and t0 < world.turn_start[k] + world.turn_duration[k]:
            return False
    return True


@_jit
def _walk(world, x, y, motion, t, h):
    """Return position and motion h after t: Simpson's rule, as `Route._tabulate`."""
    middle = _motion(world, t + 0.5 * h, motion)
    last = _motion(world, t + h, middle)
    x += h / 6.0 * (motion[0] + 4.0 * middle[0] + last[0])
    y += h / 6.0 * (motion[1] + 4.0 * middle[1] + last[1])
    return x, y, last


@_jit
def _motion(world, t, last):
    """Return velocity (2), speed and heading at time t; the `last` again if speed and heading are still the same."""
    speed, heading = speed_of(world, t), heading_of(world, t)
    if speed == last[2] and heading == last[3]:
        return last
    return speed * math.cos(heading), speed * math.sin(heading), speed, heading


@_jit
def velocity(world, t):
    """Return the velocity at time t, m/s."""
    vx, vy, _, _ = _motion(world, t, (0.0, 0.0, _UNKNOWN, 0.0))
    return vx, vy


@_jit
def speed_of(world, t):
    """Return the walking speed at time t, m/s."""
    return speed_at(t, _cruise(world), world.duration, world.ramp)


@_jit
def walked_of(world, t):
    """Return the distance walked until time t, m."""
    return walked_at(t, world.distance_total, _cruise(world), world.duration, world.ramp)


@_jit
def _cruise(world):
    return world.distance_total / (world.duration - world.ramp)


@_jit
def heading_of(world, t):
    """Return the heading at time t, rad: `Route.heading`."""
    heading = world.route_heading
    for k in range(world.turns):
        heading += turned_at(t, world.turn_start[k], world.turn_duration[k], world.turn_angle[k])
    return heading
