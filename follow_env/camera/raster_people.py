# mypy: disable-error-code="no-untyped-def"
"""Kernels that prepare the people of a picture: which triangles may be seen, where, and how they are lit."""

import math

from numba import njit

from follow_env.camera.raster_setup import edge, polygon_bounds
from follow_env.camera.raster_shade import lamp_light

TRIANGLE_NUMBERS = 24
"""Columns of a triangle's record: three edges, 1/Z, light/Z and three anchor coordinates/Z, three coefficients each."""

_jit = njit(nogil=True, error_model="numpy")


@_jit
def find_triangles(view, people, scene, work):
    """Fill `work.triangles` with the triangles of people that may be seen; return how many, or -1 if one is not finite.

    A triangle turned away, or that meets no pixel centre, is left out. Vertices are lit here, once each, and the light
    A triangle that meets no pixel centre is left out, and so is one turned away, unless an open border is near: then
    its back is drawn. Vertices are lit here, once each, and the light is interpolated over the triangle in perspective.
    """
    near = view.near
    vertices, faces, anchors = people.vertices, people.faces, people.anchors
    pattern, borders = people.pattern, people.borders
    points, records, place = work.camera_points, work.triangles, work.triangle_places
    front, back = work.front_light, work.back_light
    corners, bounds = work.quad, work.bounds
    count = 0
    for person in range(people.starts.shape[0] - 1):
        first, last = people.starts[person, 0], people.starts[person + 1, 0]
        ahead = _to_camera(view, vertices, first, last, points)
        if ahead < 0:
            return -1
        if ahead == 0:
            continue
        _light_vertices(vertices, people.normals, first, last, scene.lamps, scene.ambient, front, back)
        for f in range(people.starts[person, 1], people.starts[person + 1, 1]):
            i, j, k = faces[f, 0], faces[f, 1], faces[f, 2]
            ax, ay, az = points[i, 0], points[i, 1], points[i, 2]
            bx, by, bz = points[j, 0], points[j, 1], points[j, 2]
            cx, cy, cz = points[k, 0], points[k, 1], points[k, 2]
            volume = (ax * (bz * cy - by * cz) + ay * (bx * cz - bz * cx)) + az * (by * cx - bx * cy)
            if volume <= 0.0 and (volume == 0.0 or not borders[f]):
                continue
            if min(az, bz, cz) >= near:
                u0, v0, u1, v1, u2, v2 = ax / az, ay / az, bx / bz, by / bz, cx / cz, cy / cz
                x0, x1, y0, y1 = min(u0, u1, u2), max(u0, u1, u2), min(v0, v1, v2), max(v0, v1, v2)
            else:
                for m in range(3):
                    corners[0, m], corners[1, m], corners[2, m] = points[i, m], points[j, m], points[k, m]
                if not polygon_bounds(corners, 3, near, bounds):
                    continue
                x0, x1, y0, y1 = bounds[0], bounds[1], bounds[2], bounds[3]
            if not _pixels(x0, x1, view.left, view.step, view.width, place, count, 1):
                continue
            if not _pixels(y0, y1, view.top, view.step, view.height, place, count, 3):
                continue
            place[count, 0] = f
            lit = front
            if volume < 0.0:  # the back of the triangle: the other way round
                j, k, volume, lit = k, j, -volume, back
                bx, by, bz, cx, cy, cz = cx, cy, cz, bx, by, bz
            edge(bx, by, bz, ax, ay, az, records, count, 0)
            edge(cx, cy, cz, bx, by, bz, records, count, 3)
            edge(ax, ay, az, cx, cy, cz, records, count, 6)
            inverse = 1.0 / volume
            _interpolate(i, j, k, inverse, lit, records, count)
            if pattern[f]:
                _interpolate_anchors(i, j, k, inverse, anchors, records, count)
            count += 1
    return count


@_jit
def _to_camera(view, vertices, first, last, points):
    """Move vertices to the camera frame; return how many lie beyond the near plane, or -1 if one is not finite."""
    ex, ey, ez, c, s, near = view.x, view.y, view.z, view.cosine, view.sine, view.near
    ahead, total = 0, 0.0
    for i in range(first, last):
        dx, dy, dz = vertices[i, 0] - ex, vertices[i, 1] - ey, vertices[i, 2] - ez
        points[i, 0], points[i, 1], points[i, 2] = s * dx - c * dy, -dz, c * dx + s * dy
        total += abs(dx) + abs(dy) + abs(dz)
        if points[i, 2] >= near:
            ahead += 1
    return ahead if math.isfinite(total) else -1


@_jit
def _light_vertices(vertices, normals, first, last, lamps, ambient, front, back):
    """Write the light on both sides of the surface at each vertex."""
    for i in range(first, last):
        nx, ny, nz = normals[i, 0], normals[i, 1], normals[i, 2]
        front[i] = back[i] = ambient
        for n in range(lamps.shape[0]):
            dx, dy, dz = lamps[n, 0] - vertices[i, 0], lamps[n, 1] - vertices[i, 1], lamps[n, 2] - vertices[i, 2]
            front[i] += lamp_light(dx, dy, dz, nx, ny, nz, lamps[n, 3])
            back[i] += lamp_light(dx, dy, dz, -nx, -ny, -nz, lamps[n, 3])


@_jit
def _pixels(low, high, first, step, size, place, row, column):
    """Write the first and last pixel whose centre may lie between the rays; False if there is none."""
    start, stop = (low - first) / step, (high - first) / step
    if not (stop > -0.01 and start < size - 0.99):
        return False
    place[row, column] = math.ceil(max(start - 0.01, 0.0))
    place[row, column + 1] = math.floor(min(stop + 0.01, size - 1.0))
    return place[row, column] <= place[row, column + 1]


@_jit
def _interpolate(i, j, k, inverse, light, records, row):
    """Write the planes of 1/Z and light/Z: the edge opposite to a corner, over the volume, is its share over Z."""
    for m in range(3):
        a, b, c = inverse * records[row, 3 + m], inverse * records[row, 6 + m], inverse * records[row, m]
        records[row, 9 + m] = (a + b) + c
        records[row, 12 + m] = (a * light[i] + b * light[j]) + c * light[k]


@_jit
def _interpolate_anchors(i, j, k, inverse, anchors, records, row):
    """Write the planes of the three anchor coordinates over Z."""
    for m in range(3):
        a, b, c = inverse * records[row, 3 + m], inverse * records[row, 6 + m], inverse * records[row, m]
        for n in range(3):
            records[row, 15 + 3 * n + m] = (a * anchors[i, n] + b * anchors[j, n]) + c * anchors[k, n]
