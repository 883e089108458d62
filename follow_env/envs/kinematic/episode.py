# mypy: disable-error-code="no-untyped-def"
"""One world's episode: begin, step, look, measure, observe. The order of things is that of `FollowEnv`."""

import math

import numpy as np
from numba import njit

from follow_env.envs.follow import HALF_TRUNK, LOST_AFTER
from follow_env.envs.observations import MAX_DISTANCE
from follow_env.envs.task import BAND_BEARING, BAND_DISTANCE, SET_POINT, SUCCESS_BAND_SHARE, SUCCESS_OUT_OF_VIEW
from follow_env.world.bullet import PERSON_RADIUS
from follow_env.world.kinematic.drive import limit, roll
from follow_env.world.kinematic.philox import NOISE, OUTLIER, PICTURE, START, normals, uniforms, words
from follow_env.world.kinematic.place import free_sight, touches_person, touches_place
from follow_env.world.kinematic.route import advance_person, draw_route, heading_at, speed_at, velocity, walked_at

CHEST_HEIGHT = 1.2
"""Height at which the person is looked for, m."""
NEAREST_SEEN = 0.3
"""Persons nearer to the camera than this are not seen, m."""
_LOW, _HIGH = BAND_DISTANCE

_jit = njit(nogil=True, error_model="numpy", forceinline=True)


@_jit
def begin(world, settings, place):
    """Start the world's next episode; False if no route fits.

    `given_pose`: the robot's pose stands in the record already. `given_route`: start pose, route and error draws do.
    """
    world.episode += 1
    world.steps = 0
    world.taped = world.given_route
    fits = True
    if not world.given_route:
        cosine, sine = math.cos(settings.start_yaw), math.sin(settings.start_yaw)
        x = settings.start_x
        y = settings.start_y + (2.0 * uniforms(world, 0, 0, START)[0] - 1.0) * settings.start_width
        if not world.given_pose:
            world.x, world.y, world.yaw = x, y, settings.start_yaw
        world.person_x, world.person_y = x + SET_POINT * cosine, y + SET_POINT * sine
        world.route_heading = settings.start_yaw
        fits = draw_route(world, place, settings.stretch)
    world.given_pose, world.given_route, world.route = False, False, settings.route
    world.heading = heading_at(world, 0.0)
    world.person_vx, world.person_vy = velocity(world, 0.0)
    world.left, world.right, world.command_left, world.command_right = 0.0, 0.0, 0.0, 0.0
    world.v, world.omega, world.first, world.second = 0.0, 0.0, 0.0, 0.0
    world.out_of_view, world.longest_out_of_view, world.in_band, world.collision = 0, 0, 0, 0
    world.saturated, world.last_measured = False, 0.0
    _look(world, settings, place)
    return fits


@_jit
def step(world, settings, place, first, second, rewards):
    """Drive for one control period; write the rewards' terms, return (terminated, truncated)."""
    first, second = min(max(first, -1.0), 1.0), min(max(second, -1.0), 1.0)
    if settings.wheel_actions:
        left, right = first * settings.max_wheel_speed, second * settings.max_wheel_speed
    else:
        v, half = first * settings.max_speed, 0.5 * settings.track_width * (second * settings.max_yaw_rate)
        left, right = v - half, v + half
    advance_person(world, world.steps * settings.dt, settings.dt, settings.person_substeps)
    world.steps += 1
    world.command_left, world.command_right = limit(
        left,
        right,
        world.command_left,
        world.command_right,
        settings.max_wheel_speed,
        settings.max_wheel_acceleration * settings.dt,
    )
    world.x, world.y, world.yaw, world.left, world.right, world.v, world.omega = roll(
        world.x,
        world.y,
        world.yaw,
        world.cosine,
        world.sine,
        world.left,
        world.right,
        world.command_left,
        world.command_right,
        settings.decay,
        settings.substeps,
        settings.track_width,
    )
    world.saturated = max(abs(world.command_left - left), abs(world.command_right - right)) > 1e-9
    _look(world, settings, place)
    world.collision = _collision(world, settings, place)
    effort = max(abs(first - world.first), abs(second - world.second))
    world.first, world.second = float(np.float32(first)), float(np.float32(second))
    distance_error, bearing_error = (world.distance - SET_POINT) / 0.5, world.bearing / 0.35
    rewards[0] = 0.4 / (1.0 + distance_error * distance_error)
    rewards[1] = 0.4 / (1.0 + bearing_error * bearing_error)
    rewards[2] = 0.1 if world.visible else 0.0
    rewards[3] = 0.1 * (1.0 - 0.5 * effort)
    rewards[4] = -1.0 if world.collision > 0 else 0.0
    terminated = world.collision > 0 or world.out_of_view * settings.dt > LOST_AFTER
    return terminated, not terminated and world.steps * settings.dt >= world.duration - 1e-9


@_jit
def _collision(world, settings, place):
    half_track, wheel = 0.5 * settings.track_width, settings.wheel_radius
    x, y, cosine, sine = world.x, world.y, world.cosine, world.sine
    if touches_person(x, y, cosine, sine, world.person_x, world.person_y, wheel, half_track):
        return 2
    return 1 if touches_place(place, x, y, cosine, sine, wheel, half_track) else 0


@_jit
def _look(world, settings, place):
    """Update the truth and what is counted from it: `FollowEnv._look`."""
    world.cosine, world.sine = math.cos(world.yaw), math.sin(world.yaw)
    dx, dy = world.person_x - world.x, world.person_y - world.y
    world.distance = world.cosine * dx + world.sine * dy
    left = -world.sine * dx + world.cosine * dy
    world.bearing = math.atan2(left, world.distance)
    world.surface_distance = max(math.sqrt(dx * dx + dy * dy) - settings.hull_radius - PERSON_RADIUS, 0.0)
    world.visible = _in_view(world, settings, place, world.distance - settings.camera_forward, left)
    world.out_of_view = 0 if world.visible else world.out_of_view + 1
    world.longest_out_of_view = max(world.longest_out_of_view, world.out_of_view)
    if _LOW <= world.distance <= _HIGH and abs(world.bearing) <= BAND_BEARING:
        world.in_band += 1
    if settings.pictures:
        t = world.steps * settings.dt
        world.walked, world.speed = walked_at(world, t), speed_at(world, t)
        high, low, _, _ = words(world, world.steps, 0, PICTURE)
        world.picture_seed = high << np.uint64(32) | low


@_jit
def _in_view(world, settings, place, depth, left):
    """Whether the person's axis or either side of the trunk is in the camera's field with a free line of sight."""
    if depth <= NEAREST_SEEN:
        return False
    reach = depth * settings.half_view
    eye_x = world.x + settings.camera_forward * world.cosine
    eye_y = world.y + settings.camera_forward * world.sine
    for offset in (0.0, HALF_TRUNK, -HALF_TRUNK):
        if abs(left + offset) <= reach:
            x, y = world.person_x - offset * world.sine, world.person_y + offset * world.cosine
            if free_sight(place, eye_x, eye_y, settings.camera_height, x, y, CHEST_HEIGHT):
                return True
    return False


@_jit
def measure(world, settings, draws):
    """Return (valid, bearing, distance) as measured with the six `draws` of a step: `MeasurementModel.measure`."""
    z_bearing, z_distance, renew, kind, size, miss = draws
    if world.steps == 0:
        world.bearing_error, world.distance_error = z_bearing, z_distance
    else:
        world.bearing_error = settings.bearing_keep * world.bearing_error + settings.bearing_fresh * z_bearing
        world.distance_error = settings.distance_keep * world.distance_error + settings.distance_fresh * z_distance
    if renew < settings.renew or world.steps == 0:
        span = settings.outlier_high - settings.outlier_low
        world.outlier = settings.outlier_low + span * size if kind < settings.outlier_share else 0.0
    if not world.visible or miss < settings.miss_share:
        return False, 0.0, 0.0
    bearing = world.bearing + settings.bearing_bias + settings.bearing_noise * world.bearing_error
    distance = world.distance + settings.distance_bias + settings.distance_noise * world.distance_error
    return True, bearing, max(distance + world.outlier, 0.0)


@_jit
def draw(world, settings):
    """Return the six random numbers of a step's measurement; what is multiplied by 0 is not drawn."""
    renew = kind = size = miss = 1.0
    z_bearing = z_distance = 0.0
    if settings.bearing_noise > 0.0 or settings.distance_noise > 0.0:
        z_bearing, z_distance = normals(world, world.steps, 0, NOISE)
    if settings.outlier_share > 0.0 or settings.miss_share > 0.0:
        renew, kind, size, miss = uniforms(world, world.steps, 0, OUTLIER)
    return z_bearing, z_distance, renew, kind, size, miss


@_jit
def observe(world, settings, measured):
    """Return the `state` or `measurement` observation, eight numbers; `measured` is (valid, bearing, distance)."""
    own = world.v, world.omega, world.first, world.second
    if settings.observe_state:
        vx, vy = world.person_vx, world.person_vy
        ahead, left = world.cosine * vx + world.sine * vy, world.cosine * vy - world.sine * vx
        return (world.bearing, world.distance, ahead, left, *own)
    valid, bearing, distance = measured
    time = world.steps * settings.dt
    if not valid:
        return (0.0, 0.0, 0.0, time - world.last_measured, *own)
    age = settings.delay * settings.dt
    world.last_measured = time - age
    return (min(max(bearing, -math.pi), math.pi), min(distance, MAX_DISTANCE), 1.0, age, *own)


@_jit
def report(world, settings, info):
    """Write what `info` says of the world, without the rewards: `FollowEnv._info`."""
    info.time = world.steps * settings.dt
    info.bearing, info.distance, info.surface_distance = world.bearing, world.distance, world.surface_distance
    info.robot_pose[0], info.robot_pose[1], info.robot_pose[2] = world.x, world.y, world.yaw
    info.person_pose[0], info.person_pose[1], info.person_pose[2] = world.person_x, world.person_y, world.heading
    info.person_velocity[0], info.person_velocity[1] = world.person_vx, world.person_vy
    info.twist[0], info.twist[1] = world.v, world.omega
    info.command[0] = 0.5 * (world.command_left + world.command_right)
    info.command[1] = (world.command_right - world.command_left) / settings.track_width
    info.collision_with = world.collision
    info.visible, info.collision, info.saturated = world.visible, world.collision > 0, world.saturated
    info.is_success = (
        world.collision == 0
        and world.longest_out_of_view * settings.dt <= SUCCESS_OUT_OF_VIEW + 1e-9
        and world.in_band >= SUCCESS_BAND_SHARE * (world.steps + 1)
    )
