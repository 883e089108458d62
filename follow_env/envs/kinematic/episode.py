# mypy: disable-error-code="no-untyped-def"
"""One world's episode: begin, step, look, measure, observe. The order of things is that of `FollowEnv`."""

import math

import numpy as np
from numba import njit

from follow_env.camera.measurement import gauss_markov, measured, next_errors
from follow_env.compilation import compilable
from follow_env.envs import task
from follow_env.envs.observations import measurement_values, no_measurement_values, state_values
from follow_env.envs.truth import in_view, seen_from_robot, surface_distance
from follow_env.world.kinematic.drive import roll
from follow_env.world.kinematic.philox import NOISE, OUTLIER, PICTURE, START, normals, uniforms, words
from follow_env.world.kinematic.place import free_sight, touched
from follow_env.world.kinematic.route import (
    advance_person,
    draw_route,
    speed_of,
    start_person,
    walked_of,
)
from follow_env.world.robots.diff_drive import is_saturated, limited, twist_of, wheel_speeds

compilable(gauss_markov, measured, next_errors)
compilable(measurement_values, no_measurement_values, state_values)
compilable(task.reward_terms, task.effort, task.in_band, task.ends, task.succeeds)
compilable(in_view, seen_from_robot, surface_distance)
compilable(is_saturated, limited, twist_of, wheel_speeds)
_jit = njit(nogil=True, error_model="numpy", forceinline=True)


@_jit
def begin(world, settings, place, tables, i):
    """Start the next episode of world i; False if no route fits.

    What is there already: with `given_pose` the robot's pose; with `given_motion` that and the person's motion, in
    `tables`; with `given_draws` the draws of the measurement's errors.
    """
    world.episode += 1
    world.steps = 0
    world.by_table, world.taped = world.given_motion, world.given_draws
    fits = True
    if not world.given_motion:
        x, y, yaw = settings.start_x, settings.start_y, settings.start_yaw
        y += (2.0 * uniforms(world, 0, 0, START)[0] - 1.0) * settings.start_width
        if not world.given_pose:
            world.x, world.y, world.yaw = x, y, yaw
        away = settings.task.set_point
        world.person_x, world.person_y = x + away * math.cos(yaw), y + away * math.sin(yaw)
        world.route_heading = yaw
        fits = draw_route(world, place, settings.stretch)
    start_person(world, tables, i)
    world.given_pose, world.given_motion, world.given_draws, world.route = False, False, False, settings.route
    world.left, world.right, world.command_left, world.command_right = 0.0, 0.0, 0.0, 0.0
    world.v, world.omega, world.first, world.second = 0.0, 0.0, 0.0, 0.0
    world.out_of_view, world.longest_out_of_view, world.in_band, world.collision = 0, 0, 0, 0
    world.saturated, world.last_measured = False, 0.0
    _look(world, settings, place)
    return fits


@_jit
def step(world, settings, place, tables, i, first, second, rewards):
    """Drive world i for one control period; write the rewards' terms, return (terminated, truncated)."""
    first, second = min(max(first, -1.0), 1.0), min(max(second, -1.0), 1.0)
    if settings.wheel_actions:
        left, right = first * settings.max_wheel_speed, second * settings.max_wheel_speed
    else:
        v, omega = first * settings.max_speed, second * settings.max_yaw_rate
        left, right = wheel_speeds(v, omega, settings.track_width)
    advance_person(world, tables, i, settings.dt, settings.person_substeps)
    world.steps += 1
    world.command_left, world.command_right = limited(
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
    world.saturated = is_saturated(left, right, world.command_left, world.command_right)
    _look(world, settings, place)
    robot, person = (world.x, world.y, world.cosine, world.sine), (world.person_x, world.person_y)
    world.collision = touched(place, settings.hull, *robot, *person)
    effort = task.effort(first, second, world.first, world.second)
    world.first, world.second = float(np.float32(first)), float(np.float32(second))
    collided = world.collision > 0
    terms = task.reward_terms(settings.task, world.bearing, world.distance, world.visible, effort, collided)
    for k in range(len(terms)):
        rewards[k] = terms[k]
    return task.ends(
        settings.task, collided, world.out_of_view * settings.dt, world.steps * settings.dt, world.duration
    )


@_jit
def _look(world, settings, place):
    """Update the truth and what is counted from it: `FollowEnv._look`."""
    world.cosine, world.sine = math.cos(world.yaw), math.sin(world.yaw)
    x, y, cosine, sine = world.x, world.y, world.cosine, world.sine
    person_x, person_y = world.person_x, world.person_y
    world.bearing, world.distance, left = seen_from_robot(x, y, cosine, sine, person_x, person_y)
    world.surface_distance = surface_distance(x, y, person_x, person_y, settings.hull_radius)
    forward = settings.camera_forward
    eye = x + forward * cosine, y + forward * sine, settings.camera_height
    person, direction, depth = (person_x, person_y), (cosine, sine), world.distance - forward
    world.visible = in_view(free_sight, place, eye, person, direction, depth, left, settings.half_view)
    world.out_of_view = 0 if world.visible else world.out_of_view + 1
    world.longest_out_of_view = max(world.longest_out_of_view, world.out_of_view)
    world.in_band += task.in_band(settings.task, world.bearing, world.distance)
    if settings.pictures:
        if not world.by_table:
            t = world.steps * settings.dt
            world.walked, world.speed = walked_of(world, t), speed_of(world, t)
        high, low, _, _ = words(world, world.steps, 0, PICTURE)
        world.picture_seed = high << np.uint64(32) | low


@_jit
def measure(world, settings, draws):
    """Return (valid, bearing, distance) as measured with the six `draws` of a step: `MeasurementModel.measure`."""
    z_bearing, z_distance, renew, kind, size, miss = draws
    last = world.bearing_error, world.distance_error, world.outlier
    errors = next_errors(settings, last, (z_bearing, z_distance, renew, kind, size), world.steps == 0)
    world.bearing_error, world.distance_error, world.outlier = errors
    if not world.visible or miss < settings.miss_share:
        return False, 0.0, 0.0
    bearing, distance = measured(settings, world.bearing, world.distance, errors)
    return True, bearing, distance


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
def observe(world, settings, seen):
    """Return the `state` or `measurement` observation, eight numbers; `seen` is (valid, bearing, distance)."""
    own = world.v, world.omega, world.first, world.second
    if settings.observe_state:
        velocity, direction = (world.person_vx, world.person_vy), (world.cosine, world.sine)
        return state_values(world.bearing, world.distance, velocity, direction, own)
    valid, bearing, distance = seen
    time = world.steps * settings.dt
    if not valid:
        return no_measurement_values(time - world.last_measured, own)
    age = settings.delay * settings.dt
    world.last_measured = time - age
    return measurement_values(bearing, distance, age, own)


@_jit
def report(world, settings, info):
    """Write what `info` says of the world, without the rewards: `FollowEnv._info`."""
    info.time = world.steps * settings.dt
    info.bearing, info.distance, info.surface_distance = world.bearing, world.distance, world.surface_distance
    info.robot_pose[0], info.robot_pose[1], info.robot_pose[2] = world.x, world.y, world.yaw
    info.person_pose[0], info.person_pose[1], info.person_pose[2] = world.person_x, world.person_y, world.heading
    info.person_velocity[0], info.person_velocity[1] = world.person_vx, world.person_vy
    info.twist[0], info.twist[1] = world.v, world.omega
    info.command[0], info.command[1] = twist_of(world.command_left, world.command_right, settings.track_width)
    info.collision_with = world.collision
    info.visible, info.collision, info.saturated = world.visible, world.collision > 0, world.saturated
    longest = world.longest_out_of_view * settings.dt
    info.is_success = task.succeeds(settings.task, world.collision > 0, longest, world.in_band, world.steps + 1)
