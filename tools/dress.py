"""Dress the base mesh: cut it into head, hands, hair, shirt, trousers and shoes, and lift each layer off the skin.

Only the left half is made; the right one is its mirror image.
"""

from dataclasses import dataclass

import numpy as np
from base_mesh import BONES, Base

HEAD, EYE, HAND, TORSO, UPPER_SLEEVE, SLEEVE, LEG, SHOE, CROP, BOB = range(10)
"""Parts that a triangle can belong to; a body shows one of the two hair styles."""

HIDDEN = 0.004
"""Depth under the hair from which the scalp is left out, m (five times that at the nape)."""


@dataclass
class Half:
    """The dressed left half: every vertex is a point of the base mesh or lies on one of its edges.

    Attributes:
        source: (V, 2) base vertices and share (V,) of the second.
        positions: (B, V, 3) of all bodies, m; shifts: (B, 3), what was taken from the base mesh's coordinates.
        faces: (F, 3); zones: (F,); features: per vertex, the lines it lies on; importance: (V,) of errors.
    """

    source: np.ndarray
    share: np.ndarray
    positions: np.ndarray
    shifts: np.ndarray
    faces: np.ndarray
    zones: np.ndarray
    features: list[frozenset]
    importance: np.ndarray


def dress(base: Base, shapes: list[np.ndarray], reference: np.ndarray) -> Half:
    """Cut the base mesh into head, hands, hair, shirt, trousers and shoes; return the left half of all bodies.

    Cuts are chosen on the `reference` points and fall on the same edges of every body.
    """
    x, y, z = reference.T
    left = {g: _left_triangles(q, y) for g, q in base.quads.items() if g in ("body", "helper-tights")}
    joint = {bone: base.joint(reference, bone) for bone in BONES}
    crotch = z[_midline(base.quads["helper-tights"], y)].min()
    hand_weight = base.weights[:, BONES.index("LeftHand")]
    arm = joint["LeftForeArm"] - joint["LeftArm"]
    along = ((reference - joint["LeftArm"]) @ arm) / (arm @ arm)
    is_arm = base.weights[:, [BONES.index("Left" + b) for b in ("Arm", "ForeArm", "Hand")]].sum(axis=1) > 0.5
    hem, waist = crotch + 0.055, crotch + 0.19
    ankle = joint["LeftFoot"][2]

    sealed, of_eye = _seal(base, reference)
    cutter = Cutter(sealed)
    eye = reference[base.cubes["joint-l-eye"]].mean(axis=0)
    neck = joint["Neck"]
    collar = neck[2] + 0.015 - 0.55 * (x - neck[0])
    skull = [t for t in left["body"] if max((z - collar)[t]) > -0.045 and not is_arm[t].any()]
    is_eye = [bool(of_eye[t].any()) for t in skull]
    crop, bob = _hair_lines(reference, eye)
    bare = [min(*crop[t], *bob[t]) < (HIDDEN if x[t].max() > eye[0] - 0.1 else 5 * HIDDEN) for t in skull]
    cutter.add("skin", [t for t, e, b in zip(skull, is_eye, bare, strict=True) if b and not e], None, HEAD)
    cutter.add("skin", [t for t, e in zip(skull, is_eye, strict=True) if e], None, EYE)
    cutter.add("crop", skull, crop, CROP)
    cutter.add("bob", skull, bob, BOB)
    forearm = joint["LeftHand"] - joint["LeftForeArm"]
    along_forearm = ((reference - joint["LeftForeArm"]) @ forearm) / (forearm @ forearm)
    bare_hand = np.where(is_arm, along_forearm - 0.72, hand_weight - 0.5)
    cutter.add("skin", [t for t in left["body"] if is_arm[t].all()], bare_hand, HAND)

    tights = left["helper-tights"]
    above = [t for t in tights if max(z[t]) > hem]
    sleeve = np.where(is_arm, along - 0.62, -1.0)
    upper = np.where(is_arm, 0.62 - along, -1.0)
    arms = [t for t in above if is_arm[t].all()]
    cutter.add("shirt", arms, sleeve, SLEEVE)
    cutter.add("shirt", arms, upper, UPPER_SLEEVE)
    cutter.add("shirt", [t for t in above if not is_arm[t].all()], np.minimum(z - hem, collar - z), TORSO)
    legs = [t for t in tights if not is_arm[t].all() and min(z[t]) < waist]
    cutter.add(
        "trousers", [t for t in legs if max(z[t]) > ankle - 0.035], np.minimum(waist - z, z - (ankle - 0.035)), LEG
    )
    cutter.add("shoe", [t for t in tights if min(z[t]) < ankle + 0.03], ankle + 0.03 - z, SHOE)

    order = sorted(cutter.keys, key=cutter.keys.__getitem__)
    source = np.array([key[1:3] for key in order])
    share = np.array([key[3] for key in order])
    layers = [key[0] for key in order]
    faces, zones = np.array(cutter.faces), np.array(cutter.zones)
    depths = {"crop": crop, "bob": bob}
    clothed = [_clothed(base, p, layers, source, share, faces, depths) for p in shapes]
    positions = np.stack([position for position, _ in clothed])
    shifts = np.stack([shift for _, shift in clothed])
    importance = np.array(
        [_importance(layer, source[i, 0], hand_weight, eye, reference) for i, layer in enumerate(layers)]
    )
    return Half(source, share, positions, shifts, faces, zones, _features(faces, zones, positions), importance)


def _left_triangles(quads: list[list[int]], y: np.ndarray) -> list[list[int]]:
    left = [q for q in quads if y[q].mean() > 0 and y[q].min() > -1e-3]
    return [t for a, b, c, d in left for t in ([a, b, c], [a, c, d])]


def _midline(quads: list[list[int]], y: np.ndarray) -> np.ndarray:
    used = np.unique(quads)
    return used[np.abs(y[used]) < 1e-3]


def _seal(base: Base, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the vertex that each vertex is moved onto, which closes mouth and eye sockets, and who was in a socket."""
    normals = base.normals(points)
    inside = np.zeros(len(points), bool)
    sockets = np.zeros(len(points), bool)
    body = np.zeros(len(points), bool)
    body[np.unique(base.quads["body"])] = True
    teeth = np.unique(base.quads["helper-upper-teeth"] + base.quads["helper-lower-teeth"])
    eye = np.unique(base.quads["helper-l-eye"])
    for used, reach, is_socket in ((teeth, 1.35, False), (eye, 1.5, True)):
        center = 0.5 * (points[used].min(axis=0) + points[used].max(axis=0))
        toward = center - points
        radius = 0.5 * np.ptp(points[used], axis=0).max()
        found = body & ((toward**2).sum(axis=1) < (reach * radius) ** 2) & ((toward * normals).sum(axis=1) > 0)
        if not is_socket:  # the nose and the chin look back at the teeth too
            found &= (toward[:, 0] > -0.3 * radius) | (np.abs(toward[:, 2]) < 0.013)
        inside |= found
        sockets |= found & is_socket
    target = np.where(inside, -1, np.arange(len(points)))
    while (target < 0).any():
        reached = target.copy()
        for quad in base.quads["body"]:
            for a, b in zip(quad, quad[1:] + quad[:1], strict=True):
                for u, v in ((a, b), (b, a)):
                    if target[u] < 0 <= target[v]:
                        reached[u] = max(reached[u], target[v])
        target = reached
    return target, sockets


def _hair_lines(points: np.ndarray, eye: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return level sets that are positive where short hair grows and where a bob hangs."""
    behind = eye[0] - points[:, 0]
    high = points[:, 2] - eye[2]
    temple = np.clip((behind - 0.02) / 0.045, 0.0, 1.0)
    nape = np.clip((behind - 0.115) / 0.02, 0.0, 1.0)
    crop = high - 0.062 + 0.045 * temple + 0.085 * nape
    bob = high - 0.062 + 0.187 * np.clip((behind - 0.045) / 0.02, 0.0, 1.0)
    return crop, bob


def _clothed(
    base: Base,
    points: np.ndarray,
    layers: list[str],
    source: np.ndarray,
    share: np.ndarray,
    faces: np.ndarray,
    depths: dict[str, np.ndarray],
) -> tuple[np.ndarray, np.ndarray]:
    """Return the positions (V, 3) on one body, each layer off the skin by its thickness, and the shift (3,) taken."""
    normals = base.normals(points)
    scale = np.ptp(points[np.unique(base.quads["body"])][:, 2]) / 1.75
    joint = {bone: base.joint(points, bone) for bone in ("Hips", "LeftLeg", "LeftFoot", "Head", "LeftUpLeg")}
    offset = np.zeros(len(layers))
    position = points[source[:, 0]] * (1 - share[:, None]) + points[source[:, 1]] * share[:, None]
    normal = normals[source[:, 0]] * (1 - share[:, None]) + normals[source[:, 1]] * share[:, None]
    knee, ankle, hip = joint["LeftLeg"][2], joint["LeftFoot"][2], joint["Hips"][2]
    for i, layer in enumerate(layers):
        z = position[i, 2]
        if layer == "shirt":
            offset[i] = 0.006 + 0.012 * min(1.0, max(0.0, (hip + 0.18 - z) / 0.2)) * (abs(position[i, 1]) < 0.25)
        elif layer == "trousers":
            offset[i] = (
                0.004
                - 0.012 * min(1.0, max(0.0, (z - hip) / 0.08))
                + 0.016 * min(1.0, max(0.0, (knee + 0.15 - z) / (knee + 0.15 - ankle)))
            )
        elif layer == "shoe":
            offset[i] = 0.007
        elif layer in ("crop", "bob"):
            depth = min(1.0, (depths[layer][source[i]] * (1 - share[i], share[i])).sum() / 0.03)
            offset[i] = 0.004 + depth * (0.012 if layer == "crop" else 0.024)
    position = position + scale * offset[:, None] * normal
    position[np.abs(points[source[:, 0], 1]) < 1e-4, 1] = 0.0
    position = _smooth_hair(position, faces, np.array([layer == "bob" for layer in layers]))
    shoes = np.array([layer == "shoe" for layer in layers])
    floor = position[shoes, 2].min()
    sole = shoes & (position[:, 2] < floor + 0.022 * scale)
    position[sole, 2] = floor
    shift = np.array([joint["Hips"][0], 0.0, floor])
    return position - shift, shift


def _smooth_hair(position: np.ndarray, faces: np.ndarray, is_hair: np.ndarray, rounds: int = 12) -> np.ndarray:
    """Even out the hair (ears and neck show through it otherwise); its border stays."""
    edges: dict[tuple[int, int], int] = {}
    for face in faces[is_hair[faces[:, 0]]].tolist():
        for a, b in zip(face, face[1:] + face[:1], strict=True):
            edges[min(a, b), max(a, b)] = edges.get((min(a, b), max(a, b)), 0) + 1
    pairs = np.array(list(edges))
    border = np.zeros(len(position), bool)
    border[np.unique([e for e, n in edges.items() if n == 1])] = True
    middle = border & (position[:, 1] == 0.0)
    free = is_hair & (~border | middle)
    count = np.bincount(pairs.ravel(), minlength=len(position))[:, None]
    for _ in range(rounds):
        total = np.zeros_like(position)
        np.add.at(total, pairs[:, 0], position[pairs[:, 1]])
        np.add.at(total, pairs[:, 1], position[pairs[:, 0]])
        mean = total / np.maximum(count, 1)
        position = np.where(free[:, None], 0.5 * (position + mean), position)
        position[middle, 1] = 0.0
    return position


def _importance(layer: str, vertex: int, hand: np.ndarray, eye: np.ndarray, points: np.ndarray) -> float:
    if layer == "skin":
        behind, _, high = eye - points[vertex]
        if hand[vertex] > 0.3:
            return 0.25
        if behind < 0.02 and (abs(high) < 0.015 or abs(high - 0.07) < 0.014):
            return 15.0  # eyes and mouth
        if behind < -0.012 and 0.01 < high < 0.055:
            return 15.0  # the nose
        if 0.065 < behind < 0.13 and -0.05 < high < 0.07:
            return 0.5  # the ear
        return 4.0 if behind < 0.05 and high < 0.1 else 1.2
    return {"shirt": 1.0, "trousers": 1.0, "shoe": 1.0, "crop": 1.2, "bob": 1.2}[layer]


def _features(faces: np.ndarray, zones: np.ndarray, positions: np.ndarray) -> list[frozenset]:
    """Return, per vertex, the lines it must stay on: the midline, open borders and borders between zones."""
    edges: dict[tuple[int, int], list[int]] = {}
    for face, zone in zip(faces.tolist(), zones.tolist(), strict=True):
        for a, b in zip(face, face[1:] + face[:1], strict=True):
            edges.setdefault((min(a, b), max(a, b)), []).append(zone)
    lines: list[set] = [set() for _ in range(positions.shape[1])]
    middle = np.abs(positions[:, :, 1]).max(axis=0) < 1e-6
    for (a, b), around in edges.items():
        if middle[a] and middle[b] and len(around) == 1:
            name: tuple = ("middle",)
        elif len(around) == 1:
            name = ("border", around[0])
        elif around[0] != around[1]:
            name = ("zones", *sorted(around))
        else:
            continue
        lines[a].add(name)
        lines[b].add(name)
    return [frozenset(line) for line in lines]


class Cutter:
    """Collects triangles of the base mesh and cuts them along level sets, always at the same share of an edge."""

    def __init__(self, sealed: np.ndarray) -> None:
        self.sealed = sealed
        self.keys: dict[tuple, int] = {}
        self.faces: list[tuple[int, int, int]] = []
        self.zones: list[int] = []

    def vertex(self, layer: str, a: int, b: int, share: float) -> int:
        """Return the number of the point at a share of the way from a to b."""
        a, b = int(self.sealed[a]), int(self.sealed[b])
        if a > b:
            a, b, share = b, a, 1.0 - share
        return self.keys.setdefault((layer, a, b, round(share, 9)), len(self.keys))

    def add(self, layer: str, triangles: list[list[int]], level: np.ndarray | None, zone: int) -> None:
        """Add the parts of the triangles where `level` >= 0 (all of them where it is None)."""
        for triangle in triangles:
            if level is None or min(level[i] for i in triangle) >= 0:
                polygon = [self.vertex(layer, i, i, 0.0) for i in triangle]
            else:
                polygon = []
                for a, b in zip(triangle, triangle[1:] + triangle[:1], strict=True):
                    if level[a] >= 0:
                        polygon.append(self.vertex(layer, a, a, 0.0))
                    if (level[a] >= 0) != (level[b] >= 0):
                        polygon.append(self.vertex(layer, a, b, level[a] / (level[a] - level[b])))
            polygon = [p for k, p in enumerate(polygon) if p != polygon[k - 1]]
            if len(set(polygon)) < len(polygon):
                continue
            for k in range(1, len(polygon) - 1):
                self.faces.append((polygon[0], polygon[k], polygon[k + 1]))
                self.zones.append(zone)
