"""Compiled posing: forward kinematics, linear blend skinning and smooth normals. No fast maths: frames are exact."""

import math

import numba
import numpy as np


@numba.njit(cache=True)
def rotation_matrix(q: np.ndarray, out: np.ndarray) -> None:
    """Write the rotation matrix (3, 3) of the quaternion (w, x, y, z), of any length > 0, into `out`."""
    w, x, y, z = q[0], q[1], q[2], q[3]
    s = 2.0 / (w * w + x * x + y * y + z * z)
    out[0, 0] = 1.0 - s * (y * y + z * z)
    out[0, 1] = s * (x * y - w * z)
    out[0, 2] = s * (x * z + w * y)
    out[1, 0] = s * (x * y + w * z)
    out[1, 1] = 1.0 - s * (x * x + z * z)
    out[1, 2] = s * (y * z - w * x)
    out[2, 0] = s * (x * z - w * y)
    out[2, 1] = s * (y * z + w * x)
    out[2, 2] = 1.0 - s * (x * x + y * y)


@numba.njit(cache=True)
def multiply(a: np.ndarray, b: np.ndarray, out: np.ndarray) -> None:
    """Write the product of two (3, 3) matrices into a third."""
    for i in range(3):
        for j in range(3):
            out[i, j] = a[i, 0] * b[0, j] + a[i, 1] * b[1, j] + a[i, 2] * b[2, j]


@numba.njit(cache=True)
def chain(
    rotations: np.ndarray, root: np.ndarray, joints: np.ndarray, parents: np.ndarray, positions: np.ndarray
) -> None:
    """Write every bone's position (J, 3) from the bones' rotations (J, 3, 3), both in the body's frame."""
    for b in range(len(parents)):
        p = parents[b]
        for i in range(3):
            if p < 0:
                positions[b, i] = root[i]
            else:
                positions[b, i] = (
                    positions[p, i]
                    + rotations[p, i, 0] * (joints[b, 0] - joints[p, 0])
                    + rotations[p, i, 1] * (joints[b, 1] - joints[p, 1])
                    + rotations[p, i, 2] * (joints[b, 2] - joints[p, 2])
                )


@numba.njit(cache=True, nogil=True)
def skin(
    rest: np.ndarray,
    bones: np.ndarray,
    weights: np.ndarray,
    rotations: np.ndarray,
    positions: np.ndarray,
    joints: np.ndarray,
    placement: np.ndarray | tuple[float, ...],
    vertices: np.ndarray,
) -> None:
    """Write the vertices (V, 3) in the world frame.

    Args:
        rest: (V, 3) float32.
        bones: (V, 4).
        weights: (V, 4).
        rotations: (J, 3, 3) in the body's frame.
        positions: (J, 3) in the body's frame.
        joints: (J, 3) at rest.
        placement: x, y, z, cosine and sine of the heading.
        vertices: output, float32.
    """
    x, y, z, c, s = placement[0], placement[1], placement[2], placement[3], placement[4]
    count = len(rotations)
    moves = np.empty((count, 3, 4))
    for b in range(count):
        for i in range(3):
            moved = positions[b, i]
            for j in range(3):
                moves[b, i, j] = rotations[b, i, j]
                moved -= rotations[b, i, j] * joints[b, j]
            moves[b, i, 3] = moved
        for j in range(4):
            forward, left = moves[b, 0, j], moves[b, 1, j]
            moves[b, 0, j] = c * forward - s * left
            moves[b, 1, j] = s * forward + c * left
        moves[b, 0, 3] += x
        moves[b, 1, 3] += y
        moves[b, 2, 3] += z
    for v in range(len(rest)):
        px, py, pz = rest[v, 0], rest[v, 1], rest[v, 2]
        sx, sy, sz = 0.0, 0.0, 0.0
        for k in range(4):
            w = weights[v, k]
            if w > 0.0:
                bone = np.uint64(bones[v, k])
                sx += w * (moves[bone, 0, 0] * px + moves[bone, 0, 1] * py + moves[bone, 0, 2] * pz + moves[bone, 0, 3])
                sy += w * (moves[bone, 1, 0] * px + moves[bone, 1, 1] * py + moves[bone, 1, 2] * pz + moves[bone, 1, 3])
                sz += w * (moves[bone, 2, 0] * px + moves[bone, 2, 1] * py + moves[bone, 2, 2] * pz + moves[bone, 2, 3])
        vertices[v, 0] = sx
        vertices[v, 1] = sy
        vertices[v, 2] = sz


@numba.njit(cache=True, nogil=True)
def smooth_normals(vertices: np.ndarray, faces: np.ndarray, normals: np.ndarray) -> None:
    """Write unit normals (V, 3) float32: the mean of the faces around a vertex, weighted by their area."""
    normals[:] = 0.0
    for f in range(len(faces)):
        a, b, c = np.uint64(faces[f, 0]), np.uint64(faces[f, 1]), np.uint64(faces[f, 2])
        ux, uy, uz = vertices[b, 0] - vertices[a, 0], vertices[b, 1] - vertices[a, 1], vertices[b, 2] - vertices[a, 2]
        vx, vy, vz = vertices[c, 0] - vertices[a, 0], vertices[c, 1] - vertices[a, 1], vertices[c, 2] - vertices[a, 2]
        nx, ny, nz = uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx
        for corner in (a, b, c):
            normals[corner, 0] += nx
            normals[corner, 1] += ny
            normals[corner, 2] += nz
    for v in range(len(normals)):
        nx, ny, nz = normals[v, 0], normals[v, 1], normals[v, 2]
        length = math.sqrt(nx * nx + ny * ny + nz * nz)
        if length > 1e-20:
            normals[v, 0] = nx / length
            normals[v, 1] = ny / length
            normals[v, 2] = nz / length
        else:
            normals[v, 2] = 1.0
