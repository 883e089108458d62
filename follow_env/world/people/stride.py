"""Compiled gait: where every bone is at a phase of the cycle, between standing, walking and jogging.

Trunk, head and arms follow the clips. The legs follow the clips in swing
(lifted so that the sole clears the floor); in stance the foot is placed by construction,
so that it does not slide: it rolls over the heel until it is flat, stands, and rolls over the toe joint, and the points
it rolls over move back under the body by exactly what the body moves forward. Two-bone inverse kinematics gives thigh
and shin. Phase 0 is the left foot's heel strike. Lengths in m, angles in rad, frame: x forward, y left, z up.
"""

import math
from typing import NamedTuple

import numba
import numpy as np

from follow_env.world.people.skinning import chain, multiply, rotation_matrix

FULL_WALK = 0.2
"""Speed from which the steps have their full length, m/s; below, standing blends into walking and feet may slide."""
JOG_FROM, JOG_AT = 1.15, 1.6
"""Speeds between which walking blends into jogging, m/s."""
JOG_SHARE = 0.6
"""Share of the run clip in a jog: at 1.6 m/s nobody sprints."""
WALK_DUTY, JOG_DUTY = 0.62, 0.44
"""Share of the cycle that a foot is on the floor."""
STRIKE_PITCH, PUSH_PITCH = 0.32, 0.74
"""Toes up at heel strike, heel up at toe-off."""
FLAT_FROM, FLAT_UNTIL = 0.12, 0.36
"""Phases between which a foot stands flat in a walk."""
SWING_PITCH = 0.6
"""Share of the clips' foot pitch in swing: their skeleton's foot is shorter than a shoe."""
SWING_WIDTH = 0.3
"""Share of the clips' outward arc of the foot in swing."""
SWING_LIFT = 0.05
"""Greatest height of the swinging sole's lowest point, somewhat past mid-swing, leg lengths."""
STANCE_CENTER = -0.08
"""Of the ankle relative to the pelvis in mid-stance, leg lengths."""
ARM_JOG = 1.5
"""How much sooner than the rest the arms take the run clip's bent elbows."""
REACH = 0.996
"""Largest share of the leg's length between hip and ankle: a knee is never quite straight."""

HIPS, LOWER_BACK, SPINE, CHEST, NECK, NECK_UPPER, HEAD = range(7)
SHOULDER, ARM, FOREARM, HAND, THIGH, SHIN, FOOT, TOES = range(8)
LEFT, RIGHT = 7, 15
"""First bone of each side, to which SHOULDER .. TOES are added."""


class Figure(NamedTuple):
    """What the gait knows of a body of J bones.

    Attributes:
        stride: distance of a cycle, m.
        drops: (3,) how far the pelvis rides below its rest height in standing, walking and jogging, m.
        joints: (J, 3) at rest.
        parents: (J,).
        hang: (2, 2, 3, 3) left and right, rotation of upper arm and forearm from rest to hanging down.
        leg_frames: (2, 2, 3, 3) left and right, rest frames of thigh and shin (see `_aim`).
        stand: (5, 4) rotations of pelvis, chest, head, left upper arm and left forearm in standing.
        foot: heel x, toe joint x, toe joint z, ankle z (from the ankle in x, from the floor in z), standing ankle x, y
            and walking ankle y.
        sole: (N, 3) points of the left sole: x and z from the ankle, share of the toes.
        trunk_clips: (2, P, 22) rotations (5, 4) and the pelvis' shift left and up, of both clips.
        foot_clips: (2, P, 4) left ankle x and y, foot pitch, stride, of both clips.
    """

    stride: float
    drops: np.ndarray
    joints: np.ndarray
    parents: np.ndarray
    hang: np.ndarray
    leg_frames: np.ndarray
    stand: np.ndarray
    foot: np.ndarray
    sole: np.ndarray
    trunk_clips: np.ndarray
    foot_clips: np.ndarray


@numba.njit(cache=True)
def sample(table: np.ndarray, phase: float, out: np.ndarray) -> None:
    """Write the periodic rows (P, N) at a phase in cycles, by Catmull-Rom interpolation."""
    count = len(table)
    at = (phase - math.floor(phase)) * count
    k = int(at)
    t = at - k
    a, b, c, d = table[(k - 1) % count], table[k % count], table[(k + 1) % count], table[(k + 2) % count]
    for i in range(len(out)):
        out[i] = b[i] + 0.5 * t * (
            c[i] - a[i] + t * (2.0 * a[i] - 5.0 * b[i] + 4.0 * c[i] - d[i] + t * (3.0 * (b[i] - c[i]) + d[i] - a[i]))
        )


@numba.njit(cache=True)
def smooth(value: float) -> float:
    """Return a smooth step from 0 at 0 to 1 at 1."""
    t = min(max(value, 0.0), 1.0)
    return t * t * (3.0 - 2.0 * t)


@numba.njit(cache=True)
def _stance(
    phase: float, duty: float, jog: float, stride: float, leg: float, foot: np.ndarray
) -> tuple[float, float, float]:
    """Return ankle x, ankle z and foot pitch of a foot on the floor; `foot` holds heel and toe joint, see `Legs`."""
    flat_until = FLAT_UNTIL * duty / WALK_DUTY
    x = STANCE_CENTER * leg - stride * (phase - 0.5 * duty)
    heel_x, toe_x, toe_z, ankle_z = foot[0], foot[1], foot[2], foot[3]
    if phase < FLAT_FROM:
        share = 1.0 - phase / FLAT_FROM
        pitch = STRIKE_PITCH * (1.0 - 0.4 * jog) * share * share
        c, s = math.cos(pitch), math.sin(pitch)
        return x + heel_x - c * heel_x - s * ankle_z, -s * heel_x + c * ankle_z, pitch
    if phase > flat_until:
        share = (phase - flat_until) / (duty - flat_until)
        pitch = -PUSH_PITCH * share * share
        c, s = math.cos(pitch), math.sin(pitch)
        up = ankle_z - toe_z
        return x + toe_x - c * toe_x - s * up, toe_z - s * toe_x + c * up, pitch
    return x, ankle_z, 0.0


@numba.njit(cache=True)
def _bridge(s: float, start: float, start_slope: float, end: float, end_slope: float) -> float:
    """Return the cubic with these values and slopes at s = 0 and s = 1."""
    r = 1.0 - s
    return (
        start * r * r * (1.0 + 2.0 * s)
        + start_slope * s * r * r
        + end * s * s * (1.0 + 2.0 * r)
        - end_slope * r * s * s
    )


@numba.njit(cache=True)
def _clip_foot(phase: float, jog: float, stride: float, leg: float, clips: np.ndarray, out: np.ndarray) -> None:
    """Write ankle x, y and foot pitch of the clips' left foot, blended; clips: (2, P, 4) x, y, pitch, stride."""
    walk, run = np.empty(4), np.empty(4)
    sample(clips[0], phase, walk)
    sample(clips[1], phase, run)
    out[0] = stride * ((1.0 - jog) * walk[0] / walk[3] + jog * run[0] / run[3])
    out[1] = SWING_WIDTH * leg * walk[1]
    out[2] = SWING_PITCH * ((1.0 - jog) * walk[2] + jog * run[2])


@numba.njit(cache=True)
def _lowest(pitch: float, toe_pitch: float, sole: np.ndarray, foot: np.ndarray) -> float:
    """Return the height of a sole's lowest point above its ankle (so it is negative); see `pose_gait`."""
    toe_x, toe_z = foot[1], foot[2] - foot[3]
    c, s = math.cos(pitch), math.sin(pitch)
    ct, st = math.cos(toe_pitch), math.sin(toe_pitch)
    joint_z = s * toe_x + c * toe_z
    lowest = 1e9
    for k in range(len(sole)):
        x, z, share = sole[k, 0], sole[k, 1], sole[k, 2]
        with_foot = s * x + c * z
        with_toes = joint_z + st * (x - toe_x) + ct * (z - toe_z)
        lowest = min(lowest, (1.0 - share) * with_foot + share * with_toes)
    return lowest


@numba.njit(cache=True)
def _foot(
    phase: float,
    jog: float,
    stride: float,
    leg: float,
    foot: np.ndarray,
    sole: np.ndarray,
    clips: np.ndarray,
    out: np.ndarray,
) -> None:
    """Write ankle x, z, foot pitch, toe pitch and the swing's shift outward."""
    duty = (1.0 - jog) * WALK_DUTY + jog * JOG_DUTY
    if phase < duty:
        out[0], out[1], out[2] = _stance(phase, duty, jog, stride, leg, foot)
        out[3] = max(out[2], 0.0)
        out[4] = 0.0
        return
    length = 1.0 - duty
    s = (phase - duty) / length
    step = 1e-4
    now, lift, lift_next, land, land_next = np.empty(3), np.empty(3), np.empty(3), np.empty(3), np.empty(3)
    _clip_foot(phase, jog, stride, leg, clips, now)
    _clip_foot(duty, jog, stride, leg, clips, lift)
    _clip_foot(duty + step, jog, stride, leg, clips, lift_next)
    _clip_foot(1.0, jog, stride, leg, clips, land)
    _clip_foot(1.0 + step, jog, stride, leg, clips, land_next)
    leave = _stance(duty, duty, jog, stride, leg, foot)
    leave_before = _stance(duty - step, duty, jog, stride, leg, foot)
    strike = _stance(0.0, duty, jog, stride, leg, foot)
    strike_after = _stance(step, duty, jog, stride, leg, foot)
    for i in (0, 2):
        start_slope = (leave[i] - leave_before[i] - lift_next[i] + lift[i]) * length / step
        end_slope = (strike_after[i] - strike[i] - land_next[i] + land[i]) * length / step if i == 0 else 0.0
        out[i] = now[i] + _bridge(s, leave[i] - lift[i], start_slope, strike[i] - land[i], end_slope)
    out[3] = out[2] * smooth(3.0 * s)
    out[1] = 5.65 * SWING_LIFT * leg * s * (1.0 - s) * (0.35 + 0.65 * s) - _lowest(out[2], out[3], sole, foot)
    out[4] = now[1] + _bridge(s, -lift[1], (lift[1] - lift_next[1]) * length / step, -land[1], 0.0)


@numba.njit(cache=True)
def _aim(start: np.ndarray, end: np.ndarray, hinge: np.ndarray, rest: np.ndarray, out: np.ndarray) -> None:
    """Write the rotation that takes a bone's rest frame (3, 3 columns: along, hinge, third) to start -> end."""
    frame = np.empty((3, 3))
    length = 0.0
    for i in range(3):
        frame[i, 0] = end[i] - start[i]
        length += frame[i, 0] * frame[i, 0]
    length = math.sqrt(length)
    for i in range(3):
        frame[i, 0] /= length
        frame[i, 1] = hinge[i]
    for i in range(3):
        j, k = (i + 1) % 3, (i + 2) % 3
        frame[i, 2] = frame[j, 0] * frame[k, 1] - frame[k, 0] * frame[j, 1]
    multiply(frame, rest.T, out)


@numba.njit(cache=True, nogil=True)
def walk(figure: Figure, walked: float, speed: float, rotations: np.ndarray, positions: np.ndarray) -> None:
    """Write the pose of who has walked so far (m) at a speed (m/s): see `pose_gait`."""
    amplitude = smooth(speed / FULL_WALK)
    jog = smooth((speed - JOG_FROM) / (JOG_AT - JOG_FROM))
    stand, stroll, run = figure.drops[0], figure.drops[1], figure.drops[2]
    drop = stand + amplitude * (stroll - stand) + jog * (run - stroll)
    pose_gait(figure, walked / figure.stride, amplitude, JOG_SHARE * jog, drop, rotations, positions)


@numba.njit(cache=True, nogil=True)
def pose_gait(
    figure: Figure,
    phase: float,
    amplitude: float,
    jog: float,
    drop: float,
    rotations: np.ndarray,
    positions: np.ndarray,
) -> float:
    """Write the pose at a phase; return by how much the pelvis could rise (negative: it was lowered by that).

    Args:
        figure: who walks; its `drops` are not read.
        phase: of the cycle, in cycles.
        amplitude: 0 = standing, 1 = walking.
        jog: 0 = walking, 1 = the run clip.
        drop: of the pelvis below its rest height, m.
        rotations: output (J, 3, 3), body frame.
        positions: output (J, 3), body frame.
    """
    stride, joints, foot, sole = figure.stride, figure.joints, figure.foot, figure.sole
    hang, leg_frames, stand = figure.hang, figure.leg_frames, figure.stand
    trunk_clips, foot_clips = figure.trunk_clips, figure.foot_clips
    thigh = _distance(joints[LEFT + THIGH], joints[LEFT + SHIN])
    shin = _distance(joints[LEFT + SHIN], joints[LEFT + FOOT])
    leg = thigh + shin
    rows = np.empty((2, 22))
    quaternions = np.empty((7, 4))
    for side in range(2):
        walk, run = np.empty(22), np.empty(22)
        sample(trunk_clips[0], phase + 0.5 * side, walk)
        sample(trunk_clips[1], phase + 0.5 * side, run)
        for i in range(22):
            share = min(1.0, ARM_JOG * jog) if 12 <= i < 20 else jog
            rows[side, i] = (1.0 - share) * walk[i] + share * run[i]
        for k in range(5):
            for i in range(4):
                value = (1.0 - amplitude) * stand[k, i] + amplitude * rows[side, 4 * k + i]
                if side == 1 and (i == 1 or i == 3):
                    value = -value
                if side == 0:
                    quaternions[k, i] = value
                elif k >= 3:
                    quaternions[k + 2, i] = value
    for i in range(4):
        quaternions[2, i] = 0.5 * quaternions[2, i] + (0.5 if i == 0 else 0.0)  # the gaze is more level than the clips'
    blended = np.empty(4)
    for k in range(4):
        for i in range(4):
            blended[i] = (1.0 - k / 3.0) * quaternions[0, i] + (k / 3.0) * quaternions[1, i]
        rotation_matrix(blended, rotations[HIPS + k])
    for k in range(1, 4):
        for i in range(4):
            blended[i] = (1.0 - k / 3.0) * quaternions[1, i] + (k / 3.0) * quaternions[2, i]
        rotation_matrix(blended, rotations[CHEST + k])
    turn = np.empty((3, 3))
    for side in range(2):
        first = LEFT if side == 0 else RIGHT
        rotations[first + SHOULDER] = rotations[CHEST]
        rotation_matrix(quaternions[3 + 2 * side], turn)
        multiply(turn, hang[side, 0], rotations[first + ARM])
        rotation_matrix(quaternions[4 + 2 * side], turn)
        multiply(turn, hang[side, 1], rotations[first + FOREARM])
        rotations[first + HAND] = rotations[first + FOREARM]

    root = np.empty(3)
    root[0] = 0.0
    root[1] = amplitude * leg * rows[0, 20]
    root[2] = joints[HIPS, 2] - drop + amplitude * leg * (1.0 - jog * 0.75) * rows[0, 21]
    ankles, hips = np.empty((2, 3)), np.empty((2, 3))
    state = np.empty(5)
    room = 1e9
    for side in range(2):
        first = LEFT if side == 0 else RIGHT
        outward = 1.0 if side == 0 else -1.0
        own = phase + 0.5 * side
        _foot(own - math.floor(own), jog, stride, leg, foot, sole, foot_clips, state)
        pitch, toe_pitch = amplitude * state[2], amplitude * state[3]
        ankles[side, 0] = (1.0 - amplitude) * foot[4] + amplitude * state[0]
        ankles[side, 1] = outward * ((1.0 - amplitude) * foot[5] + amplitude * (foot[6] + state[4]))
        height = (1.0 - amplitude) * foot[3] + amplitude * state[1]
        ankles[side, 2] = max(height, -_lowest(pitch, toe_pitch, sole, foot))
        _pitched(pitch, rotations[first + FOOT])
        _pitched(toe_pitch, rotations[first + TOES])
        for i in range(3):
            hips[side, i] = root[i]
            for j in range(3):
                hips[side, i] += rotations[HIPS, i, j] * (joints[first + THIGH, j] - joints[HIPS, j])
        dx, dy = ankles[side, 0] - hips[side, 0], ankles[side, 1] - hips[side, 1]
        span = (REACH * leg) ** 2 - dx * dx - dy * dy
        room = min(room, ankles[side, 2] + math.sqrt(max(span, 0.0)) - hips[side, 2])
    lowered = min(room, 0.0)
    root[2] += lowered
    knee = np.empty(3)
    for side in range(2):
        first = LEFT if side == 0 else RIGHT
        hips[side, 2] += lowered
        hinge = _bend(hips[side], ankles[side], thigh, shin, knee)
        _aim(hips[side], knee, hinge, leg_frames[side, 0], rotations[first + THIGH])
        _aim(knee, ankles[side], hinge, leg_frames[side, 1], rotations[first + SHIN])
    chain(rotations, root, joints, figure.parents, positions)
    return room


@numba.njit(cache=True)
def _distance(a: np.ndarray, b: np.ndarray) -> float:
    return math.sqrt((a[0] - b[0]) ** 2 + (a[1] - b[1]) ** 2 + (a[2] - b[2]) ** 2)


@numba.njit(cache=True)
def _pitched(pitch: float, out: np.ndarray) -> None:
    """Write the rotation that lifts the x axis by a pitch."""
    c, s = math.cos(pitch), math.sin(pitch)
    out[:] = 0.0
    out[0, 0], out[0, 2], out[1, 1], out[2, 0], out[2, 2] = c, -s, 1.0, s, c


@numba.njit(cache=True)
def _bend(hip: np.ndarray, ankle: np.ndarray, thigh: float, shin: float, knee: np.ndarray) -> np.ndarray:
    """Write the knee's position, bent forward, and return the hinge's axis (3,), to the left."""
    along = np.empty(3)
    reach = min(_distance(hip, ankle), 0.9999 * (thigh + shin))
    for i in range(3):
        along[i] = (ankle[i] - hip[i]) / reach
    forward = np.array([1.0 - along[0] * along[0], -along[0] * along[1], -along[0] * along[2]])
    size = math.sqrt(forward[0] ** 2 + forward[1] ** 2 + forward[2] ** 2)
    down = (thigh * thigh - shin * shin + reach * reach) / (2.0 * reach)
    out = math.sqrt(max(thigh * thigh - down * down, 0.0))
    for i in range(3):
        forward[i] /= size
        knee[i] = hip[i] + along[i] * down + forward[i] * out
    hinge = np.empty(3)
    for i in range(3):
        j, k = (i + 1) % 3, (i + 2) % 3
        hinge[i] = forward[j] * along[k] - forward[k] * along[j]
    return hinge
