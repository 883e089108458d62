"""A person in the world: `Walker.place` turns a pose on the floor plan into a skinned mesh for the renderer."""

import math

import numpy as np

from follow_env.registry import choose
from follow_env.world.people import postures, stride
from follow_env.world.people.bodies import ASSETS, Body
from follow_env.world.people.mesh import Placed
from follow_env.world.people.skinning import chain, multiply, skin, smooth_normals

POSTURES = ("walk", "stand", *postures.POSTURES)
"""Names that `Walker.place` takes."""


class Walker:
    """A body that stands, walks and jogs, or holds a posture.

    The gait's phase is the distance walked over `stride`, so the feet do not slide. The pelvis' axis, averaged over a
    cycle, is at (x, y): that is where the person is.

    Args:
        body: who walks.
        id: of the pixels, 1 = the person to follow, 2 and more = others.
    """

    def __init__(self, body: Body, id: int = 1):
        if not 1 <= id <= 255:
            raise ValueError(f"id is {id}; expected 1 to 255 (0 is the scene)")
        self.body = body
        self.id = id
        joints, left = body.joints, stride.LEFT
        thigh = _length(joints[left + stride.SHIN] - joints[left + stride.THIGH])
        shin = _length(joints[left + stride.FOOT] - joints[left + stride.SHIN])
        with np.load(ASSETS / "gait.npz") as table:
            self.stride = float(table["walk_stride"]) * (thigh + shin)
            clips = ("walk", "run")
            trunk_clips = np.stack(
                [np.concatenate([table[f"{c}_rotations"].reshape(-1, 20), table[f"{c}_pelvis"]], axis=1) for c in clips]
            )
            foot_clips = np.stack(
                [
                    np.column_stack(
                        [
                            table[f"{c}_ankle"],
                            table[f"{c}_pitch"],
                            np.full(len(table[f"{c}_pitch"]), table[f"{c}_stride"]),
                        ]
                    )
                    for c in clips
                ]
            )
        spread = self._arm_spread()
        self._hang, self._leg_frames = self._hanging(max(0.0, spread - 0.2)), self._rest_leg_frames()
        self._rotations, self._positions = np.zeros((len(joints), 3, 3)), np.zeros((len(joints), 3))
        figure = stride.Figure(
            self.stride,
            np.zeros(3),
            joints,
            body.parents,
            self._hang,
            self._leg_frames,
            _standing(min(spread, 0.2)),
            *self._shoe(),
            trunk_clips,
            foot_clips,
        )
        blends = (0.0, 0.0), (1.0, 0.0), (1.0, stride.JOG_SHARE)
        self.figure = figure._replace(drops=np.array([self._needed_drop(figure, *blend) for blend in blends]))
        self._held = {name: self._hold(posture) for name, posture in postures.POSTURES.items()}

    def place(self, x: float, y: float, heading: float, walked: float, speed: float, posture: str = "walk") -> Placed:
        """Return the person's mesh in the world.

        Args:
            x: of the pelvis' axis, world frame, m.
            y: of the pelvis' axis, world frame, m.
            heading: walking direction, rad, counter-clockwise from the world's x axis.
            walked: distance walked so far, m: the gait's phase.
            speed: walking speed >= 0, m/s: how much of a step it is.
            posture: one of `POSTURES`; all but "walk" ignore `walked` and `speed`.

        Raises:
            ValueError: a number is not finite, the speed is negative, or there is no such posture.
        """
        if not all(map(math.isfinite, (x, y, heading, walked, speed))):
            raise ValueError(f"the pose is {(x, y, heading, walked, speed)}; expected finite numbers")
        if speed < 0.0:
            raise ValueError(f"speed is {speed} m/s; expected 0 or more (turn the heading to walk back)")
        choose("posture", posture, POSTURES)
        if posture in self._held:
            rotations, positions = self._held[posture]
        else:
            speed = 0.0 if posture == "stand" else speed
            stride.walk(self.figure, float(walked), float(speed), self._rotations, self._positions)
            rotations, positions = self._rotations, self._positions
        placement = np.array([x, y, 0.0, math.cos(heading), math.sin(heading)])
        return self._skinned(rotations, positions, placement, (x, y, heading))

    def _skinned(
        self,
        rotations: np.ndarray,
        positions: np.ndarray,
        placement: np.ndarray,
        pose: tuple[float, float, float] = (0.0, 0.0, 0.0),
    ) -> Placed:
        mesh, body = self.body.mesh, self.body
        vertices = np.empty(mesh.anchors.shape, np.float32)
        normals = np.empty(mesh.anchors.shape, np.float32)
        skin(mesh.anchors, body.bones, body.weights, rotations, positions, body.joints, placement, vertices)
        smooth_normals(vertices, mesh.faces, normals)
        return Placed(mesh, vertices, normals, self.id, pose)

    def _needed_drop(self, figure: stride.Figure, amplitude: float, jog: float) -> float:
        """Return how far the pelvis must ride below its rest height for both feet to be in reach at every phase."""
        given = (amplitude, jog, 0.0, self._rotations, self._positions)
        return -min(stride.pose_gait(figure, k / 64, *given) for k in range(64))

    def _arm_spread(self) -> float:
        """Return the angle of the arms to the side at which the hands clear the hips, rad."""
        body, joints = self.body, self.body.joints
        shoulder, wrist = joints[stride.LEFT + stride.ARM], joints[stride.LEFT + stride.HAND]
        elbow = joints[stride.LEFT + stride.FOREARM]
        trunk = (body.bones[:, 0] <= stride.CHEST) | np.isin(body.bones[:, 0], (stride.LEFT + stride.THIGH,))
        near = trunk & (np.abs(body.mesh.anchors[:, 2] - joints[stride.HIPS, 2]) < 0.12)
        width = float(body.mesh.anchors[near, 1].max()) + 0.05
        length = _length(elbow - shoulder) + _length(wrist - elbow)
        return math.asin(min(max((width - float(shoulder[1])) / length, 0.08), 0.4))

    def _hanging(self, spread: float) -> np.ndarray:
        """Return (2, 2, 3, 3): the rotations that hang upper arm and forearm down, `spread` rad to the side."""
        joints = self.body.joints
        hang = np.zeros((2, 2, 3, 3))
        for side, first in enumerate((stride.LEFT, stride.RIGHT)):
            outward = math.sin(spread) * (1.0 if side == 0 else -1.0)
            down = np.array([0.0, outward, -math.cos(spread)])
            for k, (start, end) in enumerate(((stride.ARM, stride.FOREARM), (stride.FOREARM, stride.HAND))):
                along = joints[first + end] - joints[first + start]
                hang[side, k] = _shortest(along / _length(along), down)
        return hang

    def _rest_leg_frames(self) -> np.ndarray:
        """Return (2, 2, 3, 3): rest frames of thigh and shin, columns along the bone, hinge (left), their product."""
        joints = self.body.joints
        frames = np.zeros((2, 2, 3, 3))
        for side, first in enumerate((stride.LEFT, stride.RIGHT)):
            for k, (start, end) in enumerate(((stride.THIGH, stride.SHIN), (stride.SHIN, stride.FOOT))):
                along = joints[first + end] - joints[first + start]
                along = along / _length(along)
                hinge = np.array([0.0, -along[2], along[1]])
                hinge /= _length(hinge)
                frames[side, k] = np.column_stack([along, hinge, np.cross(along, hinge)])
        return frames

    def _shoe(self) -> tuple[np.ndarray, np.ndarray]:
        """Return the numbers and sole points of the left foot that `stride.pose_gait` wants."""
        body, joints, left = self.body, self.body.joints, stride.LEFT
        ankle, toe = joints[left + stride.FOOT], joints[left + stride.TOES]
        toes = np.where(body.bones == left + stride.TOES, body.weights, 0.0).sum(axis=1)
        foot = np.where(body.bones == left + stride.FOOT, body.weights, 0.0).sum(axis=1)
        low = (foot + toes > 0.6) & (body.mesh.anchors[:, 2] < ankle[2])
        points = body.mesh.anchors[low].astype(np.float64)
        sole = np.column_stack([points[:, 0] - ankle[0], points[:, 2] - ankle[2], toes[low]])
        heel = float(points[points[:, 2] < 0.01, 0].min() - ankle[0]) + 0.01
        hip = joints[left + stride.THIGH]
        numbers = [heel, toe[0] - ankle[0], toe[2], ankle[2], ankle[0], 0.95 * hip[1], 0.55 * hip[1]]
        return np.array(numbers), np.ascontiguousarray(sole)

    def _hold(self, posture: postures.Posture) -> tuple[np.ndarray, np.ndarray]:
        """Return bone rotations and positions of a posture whose lowest point is where it says."""
        body, joints = self.body, self.body.joints
        rotations, positions = np.zeros((len(joints), 3, 3)), np.zeros((len(joints), 3))
        trunk, *sides = postures.rotations(posture)
        between = [trunk["pelvis"], *_between(trunk["pelvis"], trunk["chest"]), trunk["chest"]]
        rotations[stride.HIPS : stride.CHEST + 1] = between
        rotations[stride.NECK : stride.HEAD + 1] = [*_between(trunk["chest"], trunk["head"]), trunk["head"]]
        for side, (first, limbs) in enumerate(zip((stride.LEFT, stride.RIGHT), sides, strict=True)):
            rotations[first + stride.SHOULDER] = trunk["chest"]
            multiply(limbs["upper_arm"], self._hang[side, 0], rotations[first + stride.ARM])
            multiply(limbs["forearm"], self._hang[side, 1], rotations[first + stride.FOREARM])
            rotations[first + stride.HAND] = rotations[first + stride.FOREARM]
            for k, (name, bone) in enumerate((("thigh", stride.THIGH), ("shin", stride.SHIN))):
                upright = _shortest(self._leg_frames[side, k][:, 0], np.array([0.0, 0.0, -1.0]))
                multiply(limbs[name], upright, rotations[first + bone])
            rotations[first + stride.FOOT] = rotations[first + stride.TOES] = limbs["foot"]
        chain(rotations, np.zeros(3), joints, body.parents, positions)
        lowest = self._skinned(rotations, positions, np.array([0.0, 0.0, 0.0, 1.0, 0.0])).vertices[:, 2].min()
        positions[:, 2] += posture.clearance * body.height - float(lowest)
        return rotations, positions


def _standing(spread: float) -> np.ndarray:
    """Return (5, 4): pelvis, chest, head, left upper arm and left forearm of a person who stands, as quaternions."""
    arm = (math.cos(0.5 * spread), math.sin(0.5 * spread), 0.0, 0.0)
    flexed = math.radians(14.0)
    forearm = (math.cos(0.5 * flexed), 0.7 * math.sin(0.5 * spread), -math.sin(0.5 * flexed), 0.0)
    return np.array([(1.0, 0.0, 0.0, 0.0)] * 3 + [arm, forearm])


def _length(vector: np.ndarray) -> float:
    return math.sqrt(float((vector**2).sum()))


def _shortest(start: np.ndarray, end: np.ndarray) -> np.ndarray:
    """Return the smallest rotation (3, 3) from one unit vector to another that is not its opposite."""
    x, y, z = np.cross(start, end)
    skew = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    square = (skew[:, :, None] * skew[None]).sum(axis=1)
    return np.eye(3) + skew + square / (1.0 + float((start * end).sum()))


def _between(start: np.ndarray, end: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the rotations at one and two thirds, near enough: the blended columns, made orthonormal again."""
    return _orthonormal(2.0 * start + end), _orthonormal(start + 2.0 * end)


def _orthonormal(matrix: np.ndarray) -> np.ndarray:
    first = matrix[:, 0] / _length(matrix[:, 0])
    second = matrix[:, 1] - first * float((first * matrix[:, 1]).sum())
    second = second / _length(second)
    return np.column_stack([first, second, np.cross(first, second)])
