"""Read the CC0 base mesh of MakeHuman / MPFB2: points, faces by group, shape targets, rig and skin weights."""

import gzip
import json
from pathlib import Path

import numpy as np

MERGED = {
    "LHipJoint": "Hips",
    "RHipJoint": "Hips",
    "LThumb": "LeftHand",
    "RThumb": "RightHand",
    "LeftFingerBase": "LeftHand",
    "LeftHandFinger1": "LeftHand",
    "RightFingerBase": "RightHand",
    "RightHandFinger1": "RightHand",
}
"""Bones of the 31-bone rig that never move on their own here, and the bone that carries them."""
LIMBS = ("Shoulder", "Arm", "ForeArm", "Hand", "UpLeg", "Leg", "Foot", "ToeBase")
BONES = (
    *("Hips", "LowerBack", "Spine", "Spine1", "Neck", "Neck1", "Head"),
    *(f"Left{name}" for name in LIMBS),
    *(f"Right{name}" for name in LIMBS),
)


class Base:
    """The base mesh, its faces by group, its targets and the rig's weights; frame: x forward, y left, z up, m."""

    def __init__(self, folder: Path):
        self.folder = folder
        points: list[list[float]] = []
        self.quads: dict[str, list[list[int]]] = {}
        group = ""
        for line in (folder / "3dobjs" / "base.obj").read_text().splitlines():
            words = line.split()
            if words[:1] == ["v"]:
                points.append([float(w) for w in words[1:4]])
            elif words[:1] == ["g"]:
                group = words[1]
            elif words[:1] == ["f"]:
                self.quads.setdefault(group, []).append([int(w.split("/")[0]) - 1 for w in words[1:]])
        self.points = np.array(points)[:, [2, 0, 1]] / 10.0
        groups = json.loads((folder / "mesh_metadata" / "basemesh_vertex_groups.json").read_text())
        self.cubes = {name: np.arange(r[0][0], r[0][1] + 1) for name, r in groups.items() if name.startswith("joint-")}
        self.rig = json.loads((folder / "rigs" / "standard" / "rig.cmu_mb.json").read_text())
        weights = json.loads((folder / "rigs" / "standard" / "weights.cmu_mb.json").read_text())["weights"]
        self.weights = np.zeros((len(points), len(BONES)))
        for bone, pairs in weights.items():
            for vertex, weight in pairs:
                self.weights[vertex, BONES.index(MERGED.get(bone, bone))] += weight
        self.weights /= np.maximum(self.weights.sum(axis=1, keepdims=True), 1e-9)

    def shape(self, targets: dict[str, float], height: float) -> np.ndarray:
        """Return the morphed points (n, 3), scaled so that the bare body has the stated height."""
        points = self.points.copy()
        for name, weight in targets.items():
            with gzip.open(self.folder / "targets" / f"{name}.target.gz", "rt") as lines:
                for line in lines:
                    if line.strip() and not line.startswith("#"):
                        index, x, y, z = line.split()
                        points[int(index)] += weight * np.array([float(z), float(x), float(y)]) / 10.0
        body = points[np.unique(self.quads["body"])]
        return points * (height / np.ptp(body[:, 2]))

    def joint(self, points: np.ndarray, bone: str) -> np.ndarray:
        """Return the rest position (3,) of a bone's head."""
        head = self.rig[bone]["head"]
        vertices = head["vertex_indices"] if head["strategy"] == "MEAN" else self.cubes[head["cube_name"]]
        return points[vertices].mean(axis=0)

    def normals(self, points: np.ndarray) -> np.ndarray:
        """Return unit normals (n, 3) of body and tights."""
        normals = np.zeros_like(points)
        for group in ("body", "helper-tights"):
            a, b, c, d = np.array(self.quads[group]).T
            normal = np.cross(points[c] - points[a], points[d] - points[b])
            for corner in (a, b, c, d):
                np.add.at(normals, corner, normal)
        return normals / np.maximum(np.sqrt((normals**2).sum(axis=1, keepdims=True)), 1e-12)

    def parent(self, bone: str) -> int:
        """Return the number of the bone that carries this one, -1 for the root."""
        parent = self.rig[bone]["parent"]
        return BONES.index(MERGED.get(parent, parent)) if parent else -1
