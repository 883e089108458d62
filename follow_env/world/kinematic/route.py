# mypy: disable-error-code="no-untyped-def"
"""The walker's route in a world's record: drawn as `follow_env.world.motion.routes` draws it, walked by integration."""

import math

from numba import njit

from follow_env.world.kinematic.philox import ROUTE, START, uniforms
from follow_env.world.kinematic.place import nearer_than
from follow_env.world.kinematic.records import MOST_TURNS, ROUTE_NUMBERS
from follow_env.world.motion.routes import CLEARANCE, CORNER_CUT, LARGEST_TURN, TABLE_STEP

DISTANCE, DURATION, RAMP = 12.0, 14.0, 1.0
"""Of the paper's routes: m, s and s."""
ATTEMPTS = 1000
_PAPER, _STANDING = ROUTE_NUMBERS["paper"], ROUTE_NUMBERS["standing"]
_SHORTEST_TURN = math.radians(20.0)
_UNKNOWN = -1.0  # a speed like no other: speeds are not negative

_jit = njit(nogil=True, error_model="numpy", forceinline=True)


@_jit
def draw_route(world, place, stretch):
    """Draw the route that the record names from the person's pose in it; False if none fits the place.

    All its times are those of the paper by `stretch`: `Route.at_speed`.
    """
    world.turns = 0
    world.duration, world.ramp = DURATION, RAMP
    if world.route == _STANDING:
        world.distance_total = 0.0
        return True
    world.distance_total = DISTANCE
    fits = world.route != _PAPER or _draw_paper_route(world, place)
    world.duration, world.ramp = stretch * DURATION, stretch * RAMP
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
        world.turn_start[k] = 1.5 + 10.5 * begin
        size = _SHORTEST_TURN + (LARGEST_TURN - _SHORTEST_TURN) * angle
        world.turn_angle[k] = size if sign < 0.5 else -size
        world.turn_duration[k] = 0.8 + 0.8 * duration
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
        corner = DISTANCE
        if k < world.turns:
            corner = DISTANCE * (world.turn_start[k] + 0.5 * world.turn_duration[k]) / DURATION
        cosine, sine = math.cos(heading + turned), math.sin(heading + turned)
        while along <= min(corner, DISTANCE - 0.2):
            if nearer_than(place, x + (along - walked) * cosine, y + (along - walked) * sine, CLEARANCE - CORNER_CUT):
                return False
            along += 0.4
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
    for i in range(math.ceil(DURATION / TABLE_STEP) + 1):
        if i % 3 == 0 and nearer_than(place, x, y, CLEARANCE):
            return False
        x, y, motion = _walk(world, x, y, motion, i * TABLE_STEP, TABLE_STEP)
    return True


@_jit
def advance_person(world, t, dt, substeps):
    """Move the person from time t to t + dt: position, heading and velocity."""
    x, y, vx, vy = world.person_x, world.person_y, world.person_vx, world.person_vy
    if _steady(world, t, t + dt):
        world.person_x, world.person_y = x + dt * vx, y + dt * vy
        return
    h, motion = dt / substeps, (vx, vy, _UNKNOWN, 0.0)
    for k in range(substeps):
        x, y, motion = _walk(world, x, y, motion, t + k * h, h)
    world.person_x, world.person_y = x, y
    world.person_vx, world.person_vy, _, _ = motion
    world.heading = heading_at(world, t + dt)


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
    speed, heading = speed_at(world, t), heading_at(world, t)
    if speed == last[2] and heading == last[3]:
        return last
    return speed * math.cos(heading), speed * math.sin(heading), speed, heading


@_jit
def velocity(world, t):
    """Return the velocity at time t, m/s."""
    vx, vy, _, _ = _motion(world, t, (0.0, 0.0, _UNKNOWN, 0.0))
    return vx, vy


@_jit
def speed_at(world, t):
    """Return the walking speed at time t, m/s: `Route.speed`."""
    edge = min(t, world.duration - t)
    if edge <= 0.0:
        return 0.0
    cruise = world.distance_total / (world.duration - world.ramp)
    if edge >= world.ramp:
        return cruise
    return cruise * 0.5 * (1.0 - math.cos(math.pi * edge / world.ramp))


@_jit
def walked_at(world, t):
    """Return the distance walked until time t, m: `Route.walked`."""
    t = min(max(t, 0.0), world.duration)
    edge = min(t, world.duration - t)
    cruise = world.distance_total / (world.duration - world.ramp)
    if edge >= world.ramp:
        way = cruise * (edge - 0.5 * world.ramp)
    else:
        way = cruise * 0.5 * (edge - world.ramp / math.pi * math.sin(math.pi * edge / world.ramp))
    return way if edge == t else world.distance_total - way


@_jit
def heading_at(world, t):
    """Return the heading at time t, rad: `Route.heading`."""
    heading = world.route_heading
    for k in range(world.turns):
        share = (t - world.turn_start[k]) / world.turn_duration[k]
        if share >= 1.0:
            heading += world.turn_angle[k]
        elif share > 0.0:
            heading += world.turn_angle[k] * 0.5 * (1.0 - math.cos(math.pi * share))
    return heading
