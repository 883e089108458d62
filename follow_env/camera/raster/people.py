# mypy: disable-error-code="no-untyped-def"
"""Kernels that prepare the people of a picture: which triangles may be seen, where, and how they are lit."""

import math

import numpy as np
from numba import njit

from follow_env.camera.raster.setup import edge, polygon_bounds
from follow_env.camera.raster.shade import lamp_lights

TRIANGLE_NUMBERS = 24
"""Columns of a triangle's record: three edges, 1/Z, light/Z and three anchor coordinates/Z, three coefficients each."""

_jit = njit(nogil=True, error_model="numpy")


@_jit
def find_triangles(view, people, scene, work):
    """Fill `work.triangles` with the triangles of people that may be seen; return how many, or -1 if one is not finite.

    A triangle that meets no pixel center is left out, and so is one turned away, unless an open border is near: then
    its back is drawn. Vertices are lit here, once each, and the light is interpolated over the triangle in perspective.
    """
    near = view.near
    vertices, faces, anchors = people.vertices, people.faces, people.anchors
    pattern, borders = people.pattern, people.borders
    points, surface, records, place = work.camera_points, work.surface, work.triangles, work.triangle_places
    front, back = work.front_light, work.back_light
    corners, bounds = work.quad, work.bounds
    count = 0
    for person in range(people.starts.shape[0] - 1):
        first, last = people.starts[person, 0], people.starts[person + 1, 0]
        _columns(vertices, people.normals, first, last, surface)
        ahead = _to_camera(view, surface, first, last, points)
        if ahead < 0:
            return -1
        if ahead == 0:
            continue
        _light_vertices(surface, first, last, scene.lamps, scene.ambient, front, back)
        for f in range(people.starts[person, 1], people.starts[person + 1, 1]):
            i, j, k = np.uint64(faces[f, 0]), np.uint64(faces[f, 1]), np.uint64(faces[f, 2])
            ax, ay, az = points[0, i], points[1, i], points[2, i]
            bx, by, bz = points[0, j], points[1, j], points[2, j]
            cx, cy, cz = points[0, k], points[1, k], points[2, k]
            volume = (ax * (bz * cy - by * cz) + ay * (bx * cz - bz * cx)) + az * (by * cx - bx * cy)
            if volume <= 0.0 and (volume == 0.0 or not borders[f]):
                continue
            if min(az, bz, cz) >= near:
                x0, x1 = min(points[3, i], points[3, j], points[3, k]), max(points[3, i], points[3, j], points[3, k])
                y0, y1 = min(points[4, i], points[4, j], points[4, k]), max(points[4, i], points[4, j], points[4, k])
            else:
                for m in range(3):
                    corners[0, m], corners[1, m], corners[2, m] = points[m, i], points[m, j], points[m, k]
                if not polygon_bounds(corners, 3, near, bounds):
                    continue
                x0, x1 = (bounds[0] - view.left) / view.step, (bounds[1] - view.left) / view.step
                y0, y1 = (bounds[2] - view.top) / view.step, (bounds[3] - view.top) / view.step
            if not (_pixels(x0, x1, view.width, place, count, 1) and _pixels(y0, y1, view.height, place, count, 3)):
                continue
            place[count, 0] = f
            light = front[i], front[j], front[k]
            if volume < 0.0:  # the back of the triangle: the other way round
                j, k, volume = k, j, -volume
                bx, by, bz, cx, cy, cz = cx, cy, cz, bx, by, bz
                light = back[i], back[j], back[k]
            edge(bx, by, bz, ax, ay, az, records, count, 0)
            edge(cx, cy, cz, bx, by, bz, records, count, 3)
            edge(ax, ay, az, cx, cy, cz, records, count, 6)
            inverse = 1.0 / volume
            _interpolate(light, inverse, records, count)
            if pattern[f]:
                _interpolate_anchors(i, j, k, inverse, anchors, records, count)
            count += 1
    return count


@_jit
def _columns(vertices, normals, first, last, surface):
    """Copy coordinate by coordinate to `surface` (6, V): the compiler makes vectors of what lies in a row."""
    for i in range(np.uint64(first), np.uint64(last)):
        for m in range(np.uint64(3)):
            surface[m, i], surface[m + np.uint64(3), i] = vertices[i, m], normals[i, m]


@_jit
def _to_camera(view, surface, first, last, points):
    """Write vertices in the camera frame, and their columns and rows in the picture, to `points` (5, V).

    Return how many lie beyond the near plane, or -1 if one is not finite.
    """
    ex, ey, ez, c, s, near = view.x, view.y, view.z, view.cosine, view.sine, view.near
    left, top, step = view.left, view.top, view.step
    ahead, lost = 0, 0
    for i in range(np.uint64(first), np.uint64(last)):
        dx, dy, dz = surface[0, i] - ex, surface[1, i] - ey, surface[2, i] - ez
        x, y, z = s * dx - c * dy, -dz, c * dx + s * dy
        points[0, i], points[1, i], points[2, i] = x, y, z
        points[3, i], points[4, i] = (x / z - left) / step, (y / z - top) / step
        ahead += 1 if z >= near else 0
        lost += 0 if abs(dx) + abs(dy) + abs(dz) < np.inf else 1
    return -1 if lost else ahead


@_jit
def _light_vertices(surface, first, last, lamps, ambient, front, back):
    """Write the light on both sides of the surface at each vertex."""
    start, stop = np.uint64(first), np.uint64(last)
    for i in range(start, stop):
        front[i] = back[i] = ambient
    for n in range(lamps.shape[0]):
        lx, ly, lz, strength = lamps[n, 0], lamps[n, 1], lamps[n, 2], lamps[n, 3]
        for i in range(start, stop):
            dx, dy, dz = lx - surface[0, i], ly - surface[1, i], lz - surface[2, i]
            ahead, behind = lamp_lights(dx, dy, dz, surface[3, i], surface[4, i], surface[5, i], strength)
            front[i] += ahead
            back[i] += behind


@_jit
def _pixels(start, stop, size, place, row, column):
    """Write the first and last pixel whose center may lie between two places in px; False if there is none."""
    if not (stop > -0.01 and start < size - 0.99):
        return False
    place[row, column] = math.ceil(max(start - 0.01, 0.0))
    place[row, column + 1] = math.floor(min(stop + 0.01, size - 1.0))
    return place[row, column] <= place[row, column + 1]


@_jit
def _interpolate(light, inverse, records, row):
    """Write the planes of 1/Z and light/Z: the edge opposite to a corner, over the volume, is its share over Z."""
    for m in range(3):
        a, b, c = inverse * records[row, 3 + m], inverse * records[row, 6 + m], inverse * records[row, m]
        records[row, 9 + m] = (a + b) + c
        records[row, 12 + m] = (a * light[0] + b * light[1]) + c * light[2]


@_jit
def _interpolate_anchors(i, j, k, inverse, anchors, records, row):
    """Write the planes of the three anchor coordinates over Z."""
    for m in range(3):
        a, b, c = inverse * records[row, 3 + m], inverse * records[row, 6 + m], inverse * records[row, m]
        for n in range(3):
            records[row, 15 + 3 * n + m] = (a * anchors[i, n] + b * anchors[j, n]) + c * anchors[k, n]
