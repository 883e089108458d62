"""People: the assets hold what they state, and the gait keeps its promises about the floor, the feet and the axis."""

import math
import time
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

from follow_env.world.people import dimensions
from follow_env.world.people.bodies import ASSETS, BODIES, DETAILS, MATERIALS, OUTFITS, Outfit, load_body
from follow_env.world.people.stride import FOOT, HAND, HEAD, LEFT, RIGHT, SHIN, THIGH
from follow_env.world.people.walker import POSTURES, Walker

SPEEDS = (0.25, 0.8, 1.2, 1.4, 1.6)
WALKING = (0.0, 0.1, 0.25, 0.8, 1.15)
LEGS = {"Left": 1.0, "Right": -1.0}


@pytest.fixture(scope="module")
def walkers() -> dict[str, Walker]:
    return {name: Walker(load_body(name)) for name in BODIES}


def cycle(walker: Walker, speed: float, count: int = 128, cycles: float = 1.0) -> np.ndarray:
    """Vertices (n + 1, V, 3) of a straight walk along x."""
    walked = [cycles * walker.stride * k / count for k in range(count + 1)]
    return np.stack([walker.place(s, 0.0, 0.0, s, speed).vertices for s in walked])


def soles(walker: Walker, side: float) -> np.ndarray:
    rest = walker.body.mesh.anchors
    return np.flatnonzero((rest[:, 2] < 0.005) & (side * rest[:, 1] > 0))


def moved_by(walker: Walker, *bones: int) -> np.ndarray:
    """Vertices that follow these bones more than any others."""
    body = walker.body
    return np.flatnonzero(np.isin(body.bones[np.arange(len(body.bones)), body.weights.argmax(axis=1)], bones))


def carried(walker: Walker, vertices: np.ndarray, bone: int, joint: int) -> np.ndarray:
    """Where a bone carries a joint: the affine motion of the vertices that follow it alone, applied to the joint."""
    body = walker.body
    own = (np.where(body.bones == bone, body.weights, 0.0).sum(axis=1)) > 0.999
    rest = np.column_stack([body.mesh.anchors[own].astype(float), np.ones(own.sum())])
    motion, _, rank, _ = np.linalg.lstsq(rest, vertices[own].astype(float), rcond=None)
    assert rank == 4
    return np.array([*body.joints[joint], 1.0]) @ motion


def edges(faces: np.ndarray) -> np.ndarray:
    pairs = np.sort(np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]]), axis=1)
    return np.unique(pairs, axis=0)


def test_assets_are_small_and_come_with_their_licenses():
    files = sorted(path.stem for path in ASSETS.glob("*.npz"))
    assert files == sorted([*BODIES, "gait"])
    assert all(path.stat().st_size < 60_000 for path in ASSETS.glob("*.npz"))
    assert "CC0 1.0 Universal" in (ASSETS / "LICENSE-CC0.md").read_text()
    licenses = (ASSETS / "LICENSES.md").read_text()
    assert all(f"`{name}.npz`" in licenses for name in files)


@pytest.mark.parametrize("name", BODIES)
@pytest.mark.parametrize("detail", DETAILS)
def test_body_is_well_formed(name: str, detail: str):
    body = load_body(name, detail=detail)
    mesh, rest = body.mesh, body.mesh.anchors
    low, high = {"low": (1100, 1350), "high": (2800, 3300)}[detail]
    assert low <= len(mesh.faces) <= high
    assert np.array_equal(np.unique(mesh.faces), np.arange(len(rest)))
    assert mesh.colors.shape == (len(mesh.faces), 3)
    assert len(np.unique(mesh.colors, axis=0)) == len(MATERIALS)
    assert np.abs(body.weights.sum(axis=1) - 1.0).max() < 1e-6
    assert body.weights.min() >= 0.0
    assert body.parents[0] == -1
    assert (body.parents[1:] < np.arange(1, len(body.parents))).all()
    assert rest[:, 2].min() == 0.0
    assert abs(rest[:, 2].max() - body.height) < 0.002 if detail == "high" else rest[:, 2].max() <= body.height


@pytest.mark.parametrize("name", BODIES)
def test_rest_pose_is_symmetric(name: str):
    body = load_body(name)
    points = {tuple(p) for p in np.round(body.mesh.anchors, 6).tolist()}
    assert {(x, -y if y else y, z) for x, y, z in points} == points
    names = body.bone_names
    mirror = [names.index(b.replace("Left", "*").replace("Right", "Left").replace("*", "Right")) for b in names]
    assert np.allclose(body.joints[mirror], body.joints * (1, -1, 1), atol=1e-6)


def test_surfaces_face_outward(walkers):
    for walker in walkers.values():
        placed = walker.place(0.0, 0.0, 0.0, 0.0, 0.0, "stand")
        a, b, c = (placed.vertices[placed.mesh.faces[:, k]].astype(float) for k in range(3))
        volume = float((a * np.cross(b, c)).sum()) / 6.0
        assert 0.015 < volume < 0.15  # liters of a person and not minus that; open hems leave a little out
        assert np.abs((placed.normals.astype(float) ** 2).sum(axis=1) - 1.0).max() < 1e-4
        across = np.cross(b - a, c - a)
        outward = (placed.normals[placed.mesh.faces].mean(axis=1) * across).sum(axis=1) > 0.0
        area = np.sqrt((across**2).sum(axis=1))
        assert area[outward].sum() > 0.99 * area.sum()  # the thin edge of a hand may turn


@pytest.mark.parametrize("name", BODIES)
def test_standing_height_is_the_stated_one(name: str):
    walker = Walker(load_body(name, detail="high"))
    vertices = walker.place(0.0, 0.0, 0.0, 0.0, 0.0, "stand").vertices
    assert abs(np.ptp(vertices[:, 2]) - walker.body.height) < 0.02
    assert abs(vertices[:, 2].min()) < 0.001


def test_the_default_person_is_as_tall_as_the_collision_body():
    assert load_body().height == pytest.approx(dimensions.HEIGHT, abs=0.03)


@pytest.mark.parametrize("speed", [0.0, 0.25, 0.92, 1.15])
def test_the_visible_body_is_where_the_collision_body_is(walkers, speed: float):
    """The trunk and the head stay inside the capsule (25 cm around the axis), the limbs within a step of it."""
    for name, walker in walkers.items():
        trunk, middle = moved_by(walker, *range(HEAD + 1)), moved_by(walker, *range(4))
        for k in range(48):
            vertices = walker.place(2.0, -1.0, 0.8, walker.stride * k / 48, speed).vertices
            away = np.hypot(vertices[:, 0] - 2.0, vertices[:, 1] + 1.0)
            assert away[trunk].max() < dimensions.RADIUS, (name, k)
            assert away.max() < 0.65, (name, k)
            assert vertices[middle, :2].mean(axis=0) == pytest.approx((2.0, -1.0), abs=0.05), (name, k)


def test_bodies_differ_and_cover_the_stated_range(walkers):
    heights = {name: walker.body.height for name, walker in walkers.items()}
    assert min(heights, key=heights.__getitem__) == "child"
    assert heights["child"] < 1.4
    assert max(heights.values()) > 1.8
    assert belly(walkers["man_heavy"]) > 1.15 * belly(walkers["man"]) > 1.1 * belly(walkers["woman_slim"])


def belly(walker: Walker) -> float:
    """Depth of the trunk around the navel, m."""
    rest, height = walker.body.mesh.anchors, walker.body.height
    trunk = (walker.body.bones[:, 0] < 4) & (np.abs(rest[:, 2] / height - 0.6) < 0.05)
    return float(np.ptp(rest[trunk, 0]))


@pytest.mark.parametrize("posture", POSTURES)
def test_no_joint_tears_in_any_posture(walkers, posture: str):
    for walker in walkers.values():
        pairs = edges(walker.body.mesh.faces)
        rest = walker.body.mesh.anchors[pairs]
        before = np.sqrt(((rest[:, 0] - rest[:, 1]) ** 2).sum(axis=1))
        placed = walker.place(0.0, 0.0, 0.0, 0.2, 1.6, posture)
        now = placed.vertices[pairs]
        after = np.sqrt(((now[:, 0] - now[:, 1]) ** 2).sum(axis=1))
        assert (after - before).max() < 0.16 * walker.body.height / 1.75


@pytest.mark.parametrize("speed", SPEEDS)
def test_stance_foot_does_not_slide(walkers, speed: float):
    for name, walker in walkers.items():
        points = cycle(walker, speed, cycles=2.0, count=256)
        for side in LEGS.values():
            foot = points[:, soles(walker, side)]
            slid, worst, steps = 0.0, 0.0, 0
            for before, after in pairwise(foot):
                touching = (before[:, 2] < 0.003) & (after[:, 2] < 0.003)
                steps += slid > 0.0 and not touching.any()
                moved = np.sqrt(((after - before)[touching, :2] ** 2).sum(axis=1))
                slid = slid + float(moved.min()) if touching.any() else 0.0
                worst = max(worst, slid)
            assert worst < 0.01, (name, side)
            assert steps >= 1, (name, "the foot never left the floor")


@pytest.mark.parametrize("speed", [*WALKING, 1.4, 1.6])
def test_feet_are_on_the_floor(walkers, speed: float):
    for walker in walkers.values():
        lowest = cycle(walker, speed, count=48)[:, :, 2].min(axis=1)
        assert lowest.min() > -0.01
        assert lowest.max() < (0.015 if speed in WALKING else 0.04)


def test_swinging_foot_clears_the_floor(walkers):
    for walker in walkers.values():
        points = cycle(walker, 0.8)
        left, right = (points[:, soles(walker, side), 2].min(axis=1) for side in LEGS.values())
        assert min(left.max(), right.max()) > 0.02
        assert np.minimum(left, right).max() < 0.003


@pytest.mark.parametrize("heading", [0.0, 1.3, -2.6])
def test_person_faces_the_heading(walkers, heading: float):
    forward = np.array([math.cos(heading), math.sin(heading)])
    for walker in walkers.values():
        placed = walker.place(3.0, -2.0, heading, 0.4, 0.8)
        rest = walker.body.mesh.anchors
        nose = int(np.argmax(np.where(rest[:, 2] > 0.85 * walker.body.height, rest[:, 0], -9.0)))
        nape = int(np.argmin(np.where(rest[:, 2] > 0.85 * walker.body.height, rest[:, 0], 9.0)))
        assert (placed.vertices[nose, :2] - placed.vertices[nape, :2]) @ forward > 0.1
        shoes = [placed.vertices[soles(walker, side)] for side in LEGS.values()]
        for shoe in shoes:
            along = (shoe[:, :2] - (3.0, -2.0)) @ forward
            assert np.ptp(along) > 0.1


@pytest.mark.parametrize("heading", [0.0, 1.0, math.pi / 2, -2.5])
def test_toes_and_knees_point_where_the_heading_does(walkers, heading: float):
    """Toes before heels, knees bending forward, the left foot on the left."""
    forward = np.array([math.cos(heading), math.sin(heading)])
    leftward = np.array([-math.sin(heading), math.cos(heading)])
    for name, walker in walkers.items():
        rest, shoes = walker.body.mesh.anchors, {side: soles(walker, side) for side in LEGS.values()}
        widths = []
        for k in range(12):
            vertices = walker.place(1.0, 2.0, heading, walker.stride * k / 12, 0.92).vertices
            along = (vertices[:, :2] - (1.0, 2.0)) @ forward
            for shoe in shoes.values():
                toe, heel = shoe[rest[shoe, 0].argmax()], shoe[rest[shoe, 0].argmin()]
                assert along[toe] - along[heel] > 0.085 * walker.body.height, (name, k)
            for first in (LEFT, RIGHT):
                bones = ((THIGH, THIGH), (THIGH, SHIN), (SHIN, FOOT))
                joints = [carried(walker, vertices, first + bone, first + joint)[:2] for bone, joint in bones]
                hip, knee, ankle = ((joint - (1.0, 2.0)) @ forward for joint in joints)
                assert knee > 0.5 * (hip + ankle) - 0.01, (name, k)
            left, right = (vertices[shoes[side], :2].mean(axis=0) @ leftward for side in (1.0, -1.0))
            widths.append(left - right)
        assert min(widths) > 0.05, name
        assert np.ptp(widths) < 0.015, name


def test_legs_alternate_and_arms_swing_against_them(walkers):
    for walker in walkers.values():
        points = np.stack([walker.place(0.0, 0.0, 0.0, walker.stride * k / 48, 0.92).vertices for k in range(48)])
        feet, hands = (
            [points[:, moved_by(walker, first + bone), 0].mean(axis=1) for first in (LEFT, RIGHT)]
            for bone in (FOOT, HAND)
        )
        assert np.roll(feet[0], 24) == pytest.approx(feet[1], abs=5e-4)
        difference = feet[0] - feet[1]
        assert np.count_nonzero(np.diff(np.sign(difference))) in (1, 2)
        assert np.ptp(difference) > 0.75 * walker.stride
        for foot, hand in zip(feet, hands, strict=True):
            assert np.corrcoef(foot, hand)[0, 1] < -0.7


def test_the_raised_foot_moves_forward_past_the_standing_one(walkers):
    """The other way round would be walking backwards."""
    for walker in walkers.values():
        feet = [cycle(walker, 0.92, count=48)[:, soles(walker, side)] for side in LEGS.values()]
        ahead = feet[0][:, :, 0].mean(axis=1) - feet[1][:, :, 0].mean(axis=1)
        above = feet[0][:, :, 2].min(axis=1) - feet[1][:, :, 2].min(axis=1)
        faster, higher = np.diff(ahead), 0.5 * (above[1:] + above[:-1])
        clearly = np.abs(higher) > 0.02
        assert clearly.sum() > 10
        assert np.corrcoef(faster[clearly], higher[clearly])[0, 1] > 0.7


def test_heading_and_place_are_a_rigid_motion(walkers):
    walker = walkers["man"]
    at_origin = walker.place(0.0, 0.0, 0.0, 0.7, 0.9)
    placed = walker.place(4.0, -1.5, 2.1, 0.7, 0.9)
    c, s = math.cos(2.1), math.sin(2.1)
    turn = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
    assert np.allclose(placed.vertices, at_origin.vertices @ turn.T + (4.0, -1.5, 0.0), atol=2e-6)
    assert np.allclose(placed.normals, at_origin.normals @ turn.T, atol=1e-3)


def test_pelvis_axis_averages_to_the_stated_place(walkers):
    for walker in walkers.values():
        hips = (walker.body.bones[:, 0] == 0) & (walker.body.weights[:, 0] > 0.5)
        for speed in (0.5, 1.0, 1.6):
            points = np.stack([walker.place(2.0, 1.0, 0.0, walker.stride * k / 32, speed).vertices for k in range(32)])
            rest = walker.body.mesh.anchors[hips, :2].mean(axis=0)
            offset = points[:, hips, :2].mean(axis=(0, 1)) - rest - (2.0, 1.0)
            assert abs(offset[1]) < 0.002
            assert abs(offset[0]) < (0.01 if speed < 1.2 else 0.06)  # a jog leans forward about the axis


@pytest.mark.parametrize("speed", [0.25, 0.8, 1.2])
def test_person_walks_upright_over_the_feet(walkers, speed: float):
    for walker in walkers.values():
        points = np.stack([walker.place(0.0, 0.0, 0.0, walker.stride * k / 32, speed).vertices for k in range(32)])
        assert points[:, :, 2].max(axis=1).min() > 0.95 * walker.body.height
        for side in LEGS.values():
            foot = points[:, soles(walker, side)].mean(axis=1)
            assert abs(foot[:, 0].mean()) < 0.08
            assert foot[:, 0].max() > 0.25 * walker.stride
            assert foot[:, 0].min() < -0.2 * walker.stride
            assert (side * foot[:, 1] > 0.0).all()  # the feet do not cross


@pytest.mark.parametrize("speed", [0.1, 0.8, 1.6])
def test_phase_is_locked_to_the_distance_walked(walkers, speed: float):
    for walker in walkers.values():
        for walked in (0.0, 0.37, 5.21):
            now = walker.place(walked, 0.0, 0.0, walked, speed).vertices
            later = walked + walker.stride
            then = walker.place(later, 0.0, 0.0, later, speed).vertices
            assert np.allclose(then - (walker.stride, 0.0, 0.0), now, atol=5e-6)


def test_half_a_stride_later_is_the_mirror_image(walkers):
    walker = walkers["woman"]
    now = walker.place(0.0, 0.0, 0.0, 0.1, 0.8).vertices
    then = walker.place(0.0, 0.0, 0.0, 0.1 + 0.5 * walker.stride, 0.8).vertices
    rest = walker.body.mesh.anchors
    mirror = ((rest[:, None] * (1, -1, 1) - rest[None]) ** 2).sum(axis=2).argmin(axis=1)
    assert np.allclose(then[mirror], now * (1, -1, 1), atol=5e-4)


def test_pose_is_continuous_in_phase_and_speed(walkers):
    for walker in walkers.values():
        step = walker.stride / 512
        points = np.stack([walker.place(0.0, 0.0, 0.0, step * k, 0.8).vertices for k in range(513)])
        moved = np.sqrt((np.diff(points, axis=0) ** 2).sum(axis=2)).max()
        assert moved < 8.0 * step  # nothing moves faster than eight times the walking speed
        points = np.stack([walker.place(0.0, 0.0, 0.0, 0.3, 0.002 * k).vertices for k in range(901)])
        assert np.sqrt((np.diff(points, axis=0) ** 2).sum(axis=2)).max() < 0.012


def test_standing_is_speed_zero(walkers):
    walker = walkers["man"]
    still = walker.place(0.0, 0.0, 0.0, 0.0, 0.0).vertices
    assert np.array_equal(still, walker.place(0.0, 0.0, 0.0, 0.9, 0.0, "stand").vertices)
    assert np.abs(still - walker.place(0.0, 0.0, 0.0, 0.0, 0.8).vertices).max() > 0.1


def test_same_call_same_bytes():
    first, second = Walker(load_body("woman")), Walker(load_body("woman"))
    first.place(9.0, 1.0, 2.0, 3.3, 1.6)
    for posture in POSTURES:
        a, b = (w.place(1.0, 2.0, 0.5, 0.77, 1.1, posture) for w in (first, second))
        assert a.vertices.tobytes() == b.vertices.tobytes()
        assert a.normals.tobytes() == b.normals.tobytes()


def test_frames_do_not_share_memory(walkers):
    first = walkers["man"].place(0.0, 0.0, 0.0, 0.0, 0.8)
    copy = first.vertices.copy()
    walkers["man"].place(1.0, 1.0, 1.0, 0.5, 0.8)
    assert np.array_equal(first.vertices, copy)


def test_postures_are_distinct_and_where_they_say(walkers):
    for walker in walkers.values():
        height = walker.body.height
        poses = {p: walker.place(0.0, 0.0, 0.0, 0.0, 0.0, p).vertices for p in POSTURES if p != "walk"}
        assert all(np.isfinite(v).all() for v in poses.values())
        names = list(poses)
        for k, one in enumerate(names):
            for other in names[k + 1 :]:
                assert np.abs(poses[one] - poses[other]).max() > 0.2, (one, other)
        top = {p: float(v[:, 2].max()) / height for p, v in poses.items()}
        assert top["crouch"] < 0.75 < top["stand"]
        assert top["bent"] < 0.85
        assert top["arms_raised"] > 1.1
        assert np.abs(poses["sideways"][:, 1]).max() > 1.2 * np.abs(poses["stand"][:, 1]).max()
        assert poses["floating"][:, 2].min() > 0.2 * height
        head = walker.body.mesh.anchors[:, 2] > 0.9 * height
        assert poses["head_down"][head, 2].max() < 0.3 * height
        for grounded in ("stand", "crouch", "arms_raised", "sideways", "bent"):
            for side in LEGS.values():
                assert abs(poses[grounded][soles(walker, side), 2].min()) < 0.005, grounded


def test_outfits_color_the_materials():
    plain, checked = load_body("man", "blue"), load_body("man", "checks")
    assert (plain.mesh.pattern == 0).all()
    shirt = (checked.mesh.colors == np.float32(OUTFITS.get("checks").shirt)).all(axis=1)
    assert shirt.any()
    assert np.array_equal(checked.mesh.pattern == 2, shirt)
    assert np.array_equal(plain.mesh.faces, checked.mesh.faces)


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: load_body("men"), "man"),
        (lambda: load_body("man", "bleu"), "blue"),
        (lambda: load_body("man", detail="lo"), "low"),
        (lambda: Outfit(shirt=(2.0, 0.0, 0.0)), "shirt"),
        (lambda: Walker(load_body("man"), id=0), "1 to 255"),
        (lambda: Walker(load_body("man")).place(math.nan, 0.0, 0.0, 0.0, 0.0), "finite"),
        (lambda: Walker(load_body("man")).place(0.0, 0.0, 0.0, 0.0, -1.0), "0 or more"),
        (lambda: Walker(load_body("man")).place(0.0, 0.0, 0.0, 0.0, 0.0, "crouched"), "crouch"),
    ],
)
def test_bad_input_is_one_clear_sentence(call, message: str):
    with pytest.raises(ValueError, match=message):
        call()


def test_a_frame_is_cheap(walkers):
    walker = walkers["man"]
    times = []
    for k in range(300):
        start = time.perf_counter()
        walker.place(0.0, 0.0, 0.0, 0.01 * k, 0.8)
        times.append(time.perf_counter() - start)
    assert sorted(times)[150] < 3e-4


def test_no_build_time_package_is_imported():
    sources = [path.read_text() for path in Path(ASSETS).parent.glob("*.py")]
    assert not any("anny" in source or "pybullet" in source for source in sources)
