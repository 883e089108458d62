"""Reduce triangles by edge collapses with quadric errors (Garland and Heckbert 1997), for many shapes of one topology.

A collapse moves a vertex onto a neighbor, so what remains is a subset of the vertices, and lower levels of detail are
subsets of higher ones. The error is summed over all shapes.
"""

import heapq

import numpy as np

BORDER_WEIGHT = 10.0
"""Weight of the planes that hold borders in place, against those of the faces."""
LENGTH_WEIGHT = 2e-5
"""Share of the squared edge length in the error: prefers short edges among equals."""


def reduce_mesh(
    positions: np.ndarray,
    faces: np.ndarray,
    features: list[frozenset],
    importance: np.ndarray,
    zones: np.ndarray,
    targets: tuple[int, ...],
) -> list[np.ndarray]:
    """Return one face list per target count, in the order given (large to small).

    Args:
        positions: (B, V, 3) of every shape.
        faces: (F, 3).
        features: per vertex, the lines it must stay on; it may only move onto a vertex that lies on all of them.
        importance: (V,) factors of the error.
        zones: (F,) labels; a face keeps its own.
        targets: counts of faces, descending.

    Returns:
        For every target an (n, 4) array: three vertices and the index of the original face.
    """
    mesh = _Mesh(positions, faces, features, importance)
    levels = []
    for target in targets:
        mesh.collapse_until(target)
        levels.append(np.array([[*mesh.faces[f], f] for f in sorted(mesh.faces)]))
    return levels


class _Mesh:
    def __init__(self, positions: np.ndarray, faces: np.ndarray, features: list[frozenset], importance: np.ndarray):
        self.points = positions.transpose(1, 0, 2)
        self.features, self.importance = features, importance
        self.faces = {f: list(face) for f, face in enumerate(faces.tolist())}
        self.around: list[set[int]] = [set() for _ in range(len(self.points))]
        for f, face in self.faces.items():
            for v in face:
                self.around[v].add(f)
        x, y, z = self.points[..., 0], self.points[..., 1], self.points[..., 2]
        one = np.ones_like(x)
        self.monomials = np.stack([x * x, x * y, x * z, x, y * y, y * z, y, z * z, z, one], axis=-1)
        self.quadrics = self._quadrics(faces)
        self.version = [0] * len(self.points)
        self.heap: list[tuple[float, int, int, int, int]] = []
        for v in range(len(self.points)):
            for n in self._neighbors(v):
                self._push(v, n)

    def collapse_until(self, target: int) -> None:
        """Remove the cheapest edges until no more than `target` faces are left."""
        while len(self.faces) > target and self.heap:
            _, gone, stays, version_gone, version_stays = heapq.heappop(self.heap)
            if self.version[gone] != version_gone or self.version[stays] != version_stays:
                continue
            if self._allowed(gone, stays):
                self._collapse(gone, stays)

    def _quadrics(self, faces: np.ndarray) -> np.ndarray:
        quadrics = np.zeros_like(self.monomials)
        for a, b, c in faces.tolist():
            corner = self.points[[a, b, c]]
            normal = np.cross(corner[1] - corner[0], corner[2] - corner[0])
            area = np.sqrt((normal**2).sum(axis=1, keepdims=True))
            unit = normal / np.maximum(area, 1e-15)
            plane = _quadric(unit, corner[0], area)
            for v in (a, b, c):
                quadrics[v] += plane
            for u, v in ((a, b), (b, c), (c, a)):
                line = self.features[u] & self.features[v]
                if line:
                    edge = self.points[v] - self.points[u]
                    wall = np.cross(edge, unit)
                    wall /= np.maximum(np.sqrt((wall**2).sum(axis=1, keepdims=True)), 1e-15)
                    held = _quadric(wall, self.points[u], BORDER_WEIGHT * (edge**2).sum(axis=1, keepdims=True))
                    quadrics[u] += held
                    quadrics[v] += held
        return quadrics * self.importance[:, None, None]

    def _neighbors(self, v: int) -> set[int]:
        return {n for f in self.around[v] for n in self.faces[f]} - {v}

    def _push(self, gone: int, stays: int) -> None:
        if not self.features[gone] <= self.features[stays]:
            return
        error = float(((self.quadrics[gone] + self.quadrics[stays]) * self.monomials[stays]).sum())
        length = float(((self.points[gone] - self.points[stays]) ** 2).sum())
        cost = error + LENGTH_WEIGHT * float(self.importance[gone]) * length
        heapq.heappush(self.heap, (cost, gone, stays, self.version[gone], self.version[stays]))

    def _allowed(self, gone: int, stays: int) -> bool:
        shared = self.around[gone] & self.around[stays]
        if self.features[gone] and len(shared) != 1 and not self._crease(gone, stays):
            return False
        common = self._neighbors(gone) & self._neighbors(stays)
        if len(common) != len(shared):
            return False
        for f in self.around[gone] - shared:
            old = self.points[self.faces[f]]
            new = self.points[[stays if v == gone else v for v in self.faces[f]]]
            before = np.cross(old[1] - old[0], old[2] - old[0])
            after = np.cross(new[1] - new[0], new[2] - new[0])
            size = np.sqrt((before**2).sum(axis=1) * (after**2).sum(axis=1))
            if ((before * after).sum(axis=1) < 0.2 * size).any():
                return False
        return True

    def _crease(self, gone: int, stays: int) -> bool:
        """Whether the edge lies on an inner line, not across an area between two points of a line."""
        inner = any(name[0] == "zones" for name in self.features[gone])
        return inner and len(self.features[gone]) == 1

    def _collapse(self, gone: int, stays: int) -> None:
        for f in list(self.around[gone]):
            face = self.faces[f]
            if stays in face:
                for v in face:
                    self.around[v].discard(f)
                del self.faces[f]
            else:
                face[face.index(gone)] = stays
                self.around[stays].add(f)
        self.around[gone] = set()
        self.version[gone] += 1
        self.version[stays] += 1
        self.quadrics[stays] += self.quadrics[gone]
        for n in sorted(self._neighbors(stays)):
            self._push(n, stays)
            self._push(stays, n)


def _quadric(normal: np.ndarray, point: np.ndarray, weight: np.ndarray) -> np.ndarray:
    """Return (B, 10) coefficients, matching the monomials, of the squared distance to the planes."""
    a, b, c = normal.T
    d = -(normal * point).sum(axis=1)
    terms = [a * a, 2 * a * b, 2 * a * c, 2 * a * d, b * b, 2 * b * c, 2 * b * d, c * c, 2 * c * d, d * d]
    return np.stack(terms, axis=-1) * weight
