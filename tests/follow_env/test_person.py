"""The person: meshes that are solid, and a gait that walks on the floor, forward, without sliding."""

import itertools
import math

import numpy as np
import pytest

from follow_env.person import body, gait
from follow_env.physics import PERSON_RADIUS

PHASES = np.linspace(0.0, 1.0, 48, endpoint=False)


def test_meshes_enclose_their_profile_and_their_normals_point_outwards():
    """The signed volume is that of the stacked ellipses, which a hole or a face turned inside out would change."""
    for segment in body.segments():
        points, normals, indices = segment.mesh()
        assert np.sqrt((normals**2).sum(axis=1)) == pytest.approx(1.0)
        side = np.sqrt((points[:, :2] ** 2).sum(axis=1)) > 1e-3
        assert (np.einsum("ij,ij->i", normals[side][:, :2], points[side][:, :2]) > -1e-9).all(), segment.name
        triangles = points[indices.reshape(-1, 3)]
        volume = np.einsum("ij,ij->i", triangles[:, 0], np.cross(triangles[:, 1], triangles[:, 2])).sum() / 6.0
        radii = np.array([w * d for _, w, d in segment.profile])
        shares = np.array([share for share, _, _ in segment.profile]) * segment.length
        wanted = math.pi * np.trapezoid(radii, shares)
        assert volume == pytest.approx(wanted, rel=0.08), segment.name


def test_a_standing_adult_is_175_cm_tall_with_both_feet_on_the_floor(vertices):
    placed = vertices(gait.pose(0.0, 0.0, 0.0, 5.0, 0.0))
    assert max(part[:, 2].max() for part in placed.values()) == pytest.approx(1.75, abs=0.03)
    for foot in ("foot_left", "foot_right"):
        assert placed[foot][:, 2].min() == pytest.approx(0.0, abs=0.01)


@pytest.mark.parametrize("speed", [0.3, 0.6, 0.92])
def test_the_lower_foot_is_on_the_floor_and_nothing_below_it(vertices, speed):
    """The lowest point of every pose of the gait cycle, from the meshes."""
    for phase in PHASES:
        placed = vertices(gait.pose(0.0, 0.0, 0.0, float(phase) * gait.STRIDE, speed))
        lowest = min(part[:, 2].min() for part in placed.values())
        assert lowest == pytest.approx(0.0, abs=0.02), phase


def test_the_visible_body_is_where_the_collision_body_is(vertices):
    """The trunk stays inside the capsule (25 cm around the axis), the limbs within a step of it."""
    for phase in PHASES:
        placed = vertices(gait.pose(2.0, -1.0, 0.8, float(phase) * gait.STRIDE, 0.92))
        away = {name: np.hypot(part[:, 0] - 2.0, part[:, 1] + 1.0).max() for name, part in placed.items()}
        for name in ("trunk", "hips", "neck", "head", "hair"):
            assert away[name] < PERSON_RADIUS, (phase, name)
        assert max(away.values()) < 0.65, phase
        centre = np.mean([placed[name].mean(axis=0) for name in ("trunk", "hips")], axis=0)
        assert centre[:2] == pytest.approx((2.0, -1.0), abs=0.05)


@pytest.mark.parametrize("heading", [0.0, 1.0, math.pi / 2, -2.5])
def test_the_person_faces_where_the_heading_points(vertices, heading):
    """Toes before heels, knees bending forward, the left foot on the left."""
    forward = np.array((math.cos(heading), math.sin(heading)))
    leftward = np.array((-math.sin(heading), math.cos(heading)))
    for phase in PHASES[::4]:
        placed = vertices(gait.pose(1.0, 2.0, heading, float(phase) * gait.STRIDE, 0.92))
        for side in ("left", "right"):
            foot = placed[f"foot_{side}"]
            heel, toe = foot[:14].mean(axis=0), foot[-14:].mean(axis=0)
            assert (toe - heel)[:2] @ forward > 0.15, (phase, side)
            shin, thigh = placed[f"shin_{side}"], placed[f"thigh_{side}"]
            hip, knee, ankle = (part.mean(axis=0)[:2] @ forward for part in (thigh[:14], shin[:14], shin[-14:]))
            assert knee > 0.5 * (hip + ankle) - 0.01, (phase, side)
        apart = placed["foot_left"].mean(axis=0) - placed["foot_right"].mean(axis=0)
        assert apart[:2] @ leftward == pytest.approx(2.0 * body.HIP_WIDTH, abs=0.01)


def test_legs_alternate_and_arms_swing_against_them(vertices):
    ahead = {name: [] for name in ("foot_left", "foot_right", "hand_left", "hand_right")}
    for phase in PHASES:
        placed = vertices(gait.pose(0.0, 0.0, 0.0, float(phase) * gait.STRIDE, 0.92))
        for name, track in ahead.items():
            track.append(placed[name][:, 0].mean())
    tracks = {name: np.array(track) for name, track in ahead.items()}
    half = len(PHASES) // 2
    assert np.roll(tracks["foot_left"], half) == pytest.approx(tracks["foot_right"], abs=1e-9)
    difference = tracks["foot_left"] - tracks["foot_right"]
    assert np.count_nonzero(np.diff(np.sign(difference))) in (1, 2)
    assert np.ptp(difference) > 1.0
    for side in ("left", "right"):
        assert np.corrcoef(tracks[f"foot_{side}"], tracks[f"hand_{side}"])[0, 1] < -0.7


def feet(phase, vertices):
    """World x of both feet's middles and z of their lowest points, walking along +x from the origin, (left, right)."""
    placed = vertices(gait.pose(phase * gait.STRIDE, 0.0, 0.0, phase * gait.STRIDE, 0.92))
    pair = [placed[name] for name in ("foot_left", "foot_right")]
    return [part[:, 0].mean() for part in pair], [part[:, 2].min() for part in pair]


def test_the_raised_foot_moves_forward_past_the_standing_one(vertices):
    """The other way round would be walking backwards."""
    ahead, height = (
        np.array(column) for column in zip(*(feet(float(phase), vertices) for phase in (*PHASES, 1.0)), strict=True)
    )
    faster = np.diff(ahead[:, 0] - ahead[:, 1])
    higher = (height[1:, 0] - height[1:, 1] + height[:-1, 0] - height[:-1, 1]) / 2.0
    clearly = np.abs(higher) > 0.04
    assert clearly.sum() > 10
    assert np.corrcoef(faster[clearly], higher[clearly])[0, 1] > 0.7


def test_the_standing_foot_does_not_slide(vertices):
    """Through mid-stance the person walks 44 cm; the left foot stays within 6 cm, flat on the floor."""
    stance = [feet(float(phase), vertices) for phase in np.linspace(0.10, 0.42, 33)]
    assert np.ptp([ahead[0] for ahead, _ in stance]) < 0.06
    assert np.abs([height[0] for _, height in stance]).max() < 0.01


def test_the_gait_is_a_smooth_function_of_the_distance_walked(vertices):
    """One stride later everything is where it was, a stride ahead; in 5 mm of walking nothing moves by 5 cm."""
    for phase in PHASES[::6]:
        walked = float(phase) * gait.STRIDE
        now, later = (vertices(gait.pose(0.0, 0.0, 0.0, walked + more, 0.9)) for more in (0.0, gait.STRIDE))
        for name, part in later.items():
            assert part == pytest.approx(now[name], abs=1e-9)
    track = [vertices(gait.pose(0.0, 0.0, 0.0, 0.005 * step, 0.9)) for step in range(273)]
    for before, after in itertools.pairwise(track):
        for name in before:
            assert np.abs(after[name] - before[name]).max() < 0.05, name
