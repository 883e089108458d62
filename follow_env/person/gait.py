"""The gait: joint angles as functions of the distance walked, and the segments' poses that follow.

Sagittal joint curves are smooth fits to level walking (hip range about 40 deg, knee 60 deg in swing and 15 deg in
stance, ankle 25 deg, arms opposite to the legs), locked to the distance walked; their amplitude grows with speed, so a
standing person stands. The pelvis rides at the height that puts the lower foot on the floor.
"""

import math

from follow_env.person.body import (
    FOOT,
    FOOT_PROFILE,
    FOREARM,
    HIP_WIDTH,
    SHIN,
    SHOULDER_WIDTH,
    THIGH,
    TRUNK,
    UPPER_ARM,
)

STRIDE = 1.36
"""Distance of a full gait cycle (two steps), m."""
FULL_SPEED = 0.8
"""Speed from which the joint curves have their full amplitude, m/s."""

SegmentPose = tuple[tuple[float, float, float], tuple[float, float, float, float]]


def _bump(phase: float, centre: float, width: float) -> float:
    offset = (phase - centre + 0.5) % 1.0 - 0.5
    return 0.5 * (1.0 + math.cos(math.pi * offset / width)) if abs(offset) < width else 0.0


def leg_angles(phase: float, amplitude: float) -> tuple[float, float, float]:
    """Return hip flexion, knee flexion and foot pitch (toes up) in rad; phase 0 is that leg's heel strike."""
    hip = math.radians(8.0 + 21.0 * math.cos(2.0 * math.pi * (phase - 0.97)))
    knee = math.radians(4.0 + 13.0 * _bump(phase, 0.14, 0.14) + 56.0 * _bump(phase, 0.73, 0.26))
    foot = math.radians(17.0 * _bump(phase, 0.98, 0.12) - 30.0 * _bump(phase, 0.66, 0.22))
    return amplitude * hip, amplitude * knee, amplitude * foot


def _drop(foot: float) -> float:
    """Depth of the foot's lowest point below the ankle at this pitch, m: the toes' when it points down."""
    sine, cosine = math.sin(foot), math.cos(foot)
    return max(0.04 + (0.06 - FOOT * share) * sine + depth * cosine for share, _, depth in FOOT_PROFILE)


def pose(x: float, y: float, heading: float, walked: float, speed: float) -> list[SegmentPose]:
    """Return (position m, quaternion xyzw) of every segment in the world frame, in the order of `body.segments`.

    Args:
        x: of the pelvis axis, m.
        y: of the pelvis axis, m.
        heading: walking direction, rad.
        walked: distance walked so far, m (the gait's phase).
        speed: walking speed, m/s (the gait's amplitude).
    """
    amplitude = min(1.0, speed / FULL_SPEED)
    cycle = walked / STRIDE
    legs = [leg_angles((cycle + shift) % 1.0, amplitude) for shift in (0.0, 0.5)]
    pelvis = max(THIGH * math.cos(hip) + SHIN * math.cos(hip - knee) + _drop(foot) for hip, knee, foot in legs)
    cosine, sine = math.cos(heading), math.sin(heading)
    half_c, half_s = math.cos(0.5 * heading), math.sin(0.5 * heading)

    def place(forward: float, left: float, up: float, flexion: float) -> SegmentPose:
        c, s = math.cos(0.5 * flexion), -math.sin(0.5 * flexion)
        position = (x + cosine * forward - sine * left, y + sine * forward + cosine * left, up)
        return position, (-half_s * s, half_c * s, half_s * c, half_c * c)

    lean = 0.05 * amplitude
    shoulder = pelvis + TRUNK
    poses = [
        place(lean * TRUNK, 0.0, shoulder + 0.01, -lean),
        place(0.0, 0.0, pelvis + 0.03, 0.0),
        place(lean * TRUNK, 0.0, shoulder + 0.11, 0.0),
        place(lean * TRUNK + 0.02, 0.0, shoulder + 0.325, 0.0),
        place(lean * TRUNK + 0.005, 0.0, shoulder + 0.335, 0.0),
    ]
    for side, (hip, knee, foot) in zip((1.0, -1.0), legs, strict=True):
        knee_x, knee_z = THIGH * math.sin(hip), pelvis - THIGH * math.cos(hip)
        ankle_x, ankle_z = knee_x + SHIN * math.sin(hip - knee), knee_z - SHIN * math.cos(hip - knee)
        left = side * HIP_WIDTH
        heel_x = ankle_x - 0.06 * math.cos(foot)
        poses += [
            place(0.0, left, pelvis, hip),
            place(knee_x, left, knee_z, hip - knee),
            place(heel_x, left, ankle_z - 0.04 - 0.06 * math.sin(foot), 0.5 * math.pi + foot),
        ]
        swing = -amplitude * 0.55 * (hip - math.radians(8.0) * amplitude) - 0.02
        elbow = swing + math.radians(8.0 + 14.0 * amplitude)
        elbow_x = lean * TRUNK + UPPER_ARM * math.sin(swing)
        elbow_z = shoulder - 0.05 - UPPER_ARM * math.cos(swing)
        wrist_x, wrist_z = elbow_x + FOREARM * math.sin(elbow), elbow_z - FOREARM * math.cos(elbow)
        out = side * (SHOULDER_WIDTH + 0.01)
        poses += [
            place(lean * TRUNK, out, shoulder - 0.05, swing),
            place(elbow_x, out, elbow_z, elbow),
            place(wrist_x, out, wrist_z, elbow),
        ]
    return poses
