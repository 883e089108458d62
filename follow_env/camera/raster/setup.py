# mypy: disable-error-code="no-untyped-def"
"""Kernels that prepare a picture: which flat facets, cylinders and balls may be seen, and where.

Camera frame: X right, Y down, Z forward along the optical axis; the camera is level. A pixel looks along the ray
(X, Y, 1), and a plane n . P = d is seen at 1/Z = (nx X + ny Y + nz) / d: affine in the picture, exact everywhere.
An edge from P to Q splits the picture by the sign of (P x Q) . (X, Y, 1), also when an end lies behind the camera, so
nothing has to be cut at the near plane. Neighbors see the same edge with exactly opposite signs: no cracks.
"""

import math

import numpy as np
from numba import njit

from follow_env.camera.raster.fill import TILE

FACET_NUMBERS = 16
"""Columns of a facet's record: four edges of three coefficients, then the three of 1/Z, then the greatest 1/Z."""
_CORNERS = np.array([[0, 2, 6, 4], [1, 5, 7, 3], [0, 4, 5, 1], [2, 3, 7, 6], [0, 1, 3, 2], [4, 6, 7, 5]], np.int64)
"""Corners of the faces -x, +x, -y, +y, -z, +z, clockwise seen from outside; bit k of a corner is the sign of axis k."""

_jit = njit(nogil=True, error_model="numpy")


@_jit
def tile_range(low, high, first, step, tiles):
    """Return the first and last tile that rays with `low` <= ray <= `high` can meet (last < first: none)."""
    start, stop = (low - first) / step, (high - first) / step
    limit = float(TILE * tiles)
    start, stop = min(max(start - 0.01, -1.0), limit), min(max(stop + 0.01, -1.0), limit)
    return math.ceil(start) // TILE if start > 0.0 else 0, math.floor(stop) // TILE if stop >= 0.0 else -1


@_jit
def polygon_bounds(corners, count, near, bounds):
    """Write (x_min, x_max, y_min, y_max) of the rays that meet the polygon (count, 3) beyond `near`; False if none."""
    bounds[0], bounds[1], bounds[2], bounds[3] = np.inf, -np.inf, np.inf, -np.inf
    seen = False
    for i in range(count):
        k = i + 1 if i + 1 < count else 0
        z, z_next = corners[i, 2], corners[k, 2]
        x, y = corners[i, 0], corners[i, 1]
        if z >= near:
            seen = True
            bounds[0], bounds[1] = min(bounds[0], x / z), max(bounds[1], x / z)
            bounds[2], bounds[3] = min(bounds[2], y / z), max(bounds[3], y / z)
        if (z >= near) != (z_next >= near):
            share = (near - z) / (z_next - z)
            x, y = x + share * (corners[k, 0] - x), y + share * (corners[k, 1] - y)
            seen = True
            bounds[0], bounds[1] = min(bounds[0], x / near), max(bounds[1], x / near)
            bounds[2], bounds[3] = min(bounds[2], y / near), max(bounds[3], y / near)
    return seen


@_jit
def outside(x, y, z, radius, view):
    """Whether the sphere around (x, y, z) lies outside the field of view for certain."""
    near, far, wide, high = view.near, view.far, view.wide, view.high
    if z + radius < near or z - radius > far:
        return True
    aside, above = abs(x) - wide * z, abs(y) - high * z
    return aside > radius * math.sqrt(1.0 + wide * wide) or above > radius * math.sqrt(1.0 + high * high)


@_jit
def find_facets(view, boxes, work):
    """Fill `work.facets`, `work.places` and `work.order` with the faces of boxes that may be seen; return how many.

    A face turned away is left out unless the camera is so close that the near plane may cut the box open.
    """
    ex, ey, ez, c, s, near, far = view.x, view.y, view.z, view.cosine, view.sine, view.near, view.far
    reach = near * math.sqrt(1.0 + view.wide**2 + view.high**2)
    corners, quad, bounds, facets, place = work.corners, work.quad, work.bounds, work.facets, work.places
    count = 0
    for b in range(boxes.shape[0]):
        dx, dy, dz = boxes[b, 0] - ex, boxes[b, 1] - ey, boxes[b, 2] - ez
        hx, hy, hz, bc, bs = boxes[b, 3], boxes[b, 4], boxes[b, 5], boxes[b, 6], boxes[b, 7]
        if outside(s * dx - c * dy, -dz, c * dx + s * dy, math.sqrt(hx * hx + hy * hy + hz * hz), view):
            continue
        own = (-(bc * dx + bs * dy), bs * dx - bc * dy, -dz)
        half = (hx, hy, hz)
        gap_x, gap_y, gap_z = max(abs(own[0]) - hx, 0.0), max(abs(own[1]) - hy, 0.0), max(abs(own[2]) - hz, 0.0)
        cut = gap_x * gap_x + gap_y * gap_y + gap_z * gap_z <= reach * reach
        for k in range(8):
            x, y = (hx if k & 1 else -hx), (hy if k & 2 else -hy)
            wx, wy = dx + bc * x - bs * y, dy + bs * x + bc * y
            corners[k, 0], corners[k, 2] = s * wx - c * wy, c * wx + s * wy
            corners[k, 1] = -(dz + (hz if k & 4 else -hz))
        for face in range(6):
            axis = face // 2
            height = (own[axis] if face % 2 else -own[axis]) - half[axis]
            if height == 0.0 or (height < 0.0 and not cut):
                continue
            nearest = 0.0
            for i in range(4):
                k = _CORNERS[face, i]
                for m in range(3):
                    quad[i, m] = corners[k, m]
                nearest = max(nearest, 1.0 / quad[i, 2] if quad[i, 2] > near else 1.0 / near)
            if not polygon_bounds(quad, 4, near, bounds) or nearest * far < 1.0:
                continue
            tx0, tx1 = tile_range(bounds[0], bounds[1], view.left, view.step, view.columns)
            ty0, ty1 = tile_range(bounds[2], bounds[3], view.top, view.step, view.rows)
            if tx0 > tx1 or ty0 > ty1 or tx0 >= view.columns or ty0 >= view.rows:
                continue
            for i in range(4):
                p, q = (i, (i + 1) % 4) if height > 0.0 else ((i + 1) % 4, i)
                edge(quad[p, 0], quad[p, 1], quad[p, 2], quad[q, 0], quad[q, 1], quad[q, 2], facets, count, 3 * i)
            _plane(quad, facets, count)
            facets[count, 15] = nearest
            place[count, 0], place[count, 1], place[count, 2] = 1 + 6 * b + face, tx0, tx1
            place[count, 3], place[count, 4] = ty0, ty1
            count += 1
    _sort(facets, work.order, count)
    return count


@_jit
def edge(px, py, pz, qx, qy, qz, records, row, column):
    """Write P x Q, the edge from P to Q of a polygon that is clockwise in the picture: positive inside."""
    records[row, column] = py * qz - pz * qy
    records[row, column + 1] = pz * qx - px * qz
    records[row, column + 2] = px * qy - py * qx


@_jit
def _plane(quad, records, row):
    """Write the coefficients of 1/Z over the picture of a parallelogram's plane."""
    ax, ay, az = quad[1, 0] - quad[0, 0], quad[1, 1] - quad[0, 1], quad[1, 2] - quad[0, 2]
    bx, by, bz = quad[3, 0] - quad[0, 0], quad[3, 1] - quad[0, 1], quad[3, 2] - quad[0, 2]
    nx, ny, nz = ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx
    d = nx * quad[0, 0] + ny * quad[0, 1] + nz * quad[0, 2]
    records[row, 12], records[row, 13], records[row, 14] = nx / d, ny / d, nz / d


@_jit
def _sort(facets, order, count):
    """Write the facets' numbers into `order` by their greatest 1/Z, descending."""
    for i in range(count):
        k = i
        while k > 0 and facets[order[k - 1], 15] < facets[i, 15]:
            order[k] = order[k - 1]
            k -= 1
        order[k] = i


@_jit
def find_cylinders(view, cylinders, work):
    """Fill `work.rounds` with the cylinders that may be seen; return how many.

    A record is (X, Z of the axis, radius, Y of the top, Y of the bottom, greatest 1/Z, draw the top, the bottom).
    """
    ex, ey, ez, c, s, near = view.x, view.y, view.z, view.cosine, view.sine, view.near
    reach = near * math.sqrt(1.0 + view.wide**2 + view.high**2)
    count = 0
    for n in range(cylinders.shape[0]):
        dx, dy = cylinders[n, 0] - ex, cylinders[n, 1] - ey
        low, high, radius = cylinders[n, 2], cylinders[n, 3], cylinders[n, 4]
        top, bottom = ez - high, ez - low
        x, z = s * dx - c * dy, c * dx + s * dy
        if outside(x, 0.5 * (top + bottom), z, math.sqrt(radius * radius + 0.25 * (high - low) ** 2), view):
            continue
        gap, rise = max(math.sqrt(dx * dx + dy * dy) - radius, 0.0), max(top, -bottom, 0.0)
        cut = gap * gap + rise * rise <= reach * reach
        if not _round_tiles(view, x, z, radius, top, bottom, work.round_places, count, n):
            continue
        rounds = work.rounds
        rounds[count, 0], rounds[count, 1], rounds[count, 2] = x, z, radius
        rounds[count, 3], rounds[count, 4] = top, bottom
        rounds[count, 5] = 1.0 / max(z - radius, near)
        closed = cylinders[n, 5] > 0.0
        rounds[count, 6], rounds[count, 7] = closed and (top > 0.0 or cut), closed and (bottom < 0.0 or cut)
        count += 1
    return count


@_jit
def find_balls(view, balls, work):
    """Fill `work.balls` with the balls that may be seen; return how many.

    A record is (X, Y, Z of the center, its squared distance less the squared radius, least and greatest Y of the part
    that counts, greatest 1/Z).
    """
    ex, ey, ez, c, s, near = view.x, view.y, view.z, view.cosine, view.sine, view.near
    records = work.balls
    count = 0
    for n in range(balls.shape[0]):
        dx, dy, y, radius = balls[n, 0] - ex, balls[n, 1] - ey, ez - balls[n, 2], balls[n, 3]
        x, z = s * dx - c * dy, c * dx + s * dy
        if outside(x, y, z, radius, view):
            continue
        if not _round_tiles(view, x, z, radius, y - radius, y + radius, work.ball_places, count, n):
            continue
        records[count, 0], records[count, 1], records[count, 2] = x, y, z
        records[count, 3] = ((x * x + y * y) + z * z) - radius * radius
        records[count, 4], records[count, 5] = ez - balls[n, 5], ez - balls[n, 4]
        records[count, 6] = 1.0 / max(z - radius, near)
        count += 1
    return count


@_jit
def _round_tiles(view, x, z, radius, top, bottom, place, row, number):
    """Write the number of a round solid and the tiles that may show it; False if none does.

    It lies within `radius` of (X, Z) and between the Y `top` and `bottom`.
    """
    front, back = z - radius, z + radius
    tx0, tx1, ty0, ty1 = 0, view.columns - 1, 0, view.rows - 1
    if front > view.near:
        left, right = x - radius, x + radius
        tx0, tx1 = tile_range(
            min(left / front, left / back), max(right / front, right / back), view.left, view.step, view.columns
        )
        ty0, ty1 = tile_range(
            min(top / front, top / back), max(bottom / front, bottom / back), view.top, view.step, view.rows
        )
    place[row, 0], place[row, 1], place[row, 2], place[row, 3], place[row, 4] = number, tx0, tx1, ty0, ty1
    return tx0 <= tx1 and ty0 <= ty1 and tx0 < view.columns and ty0 < view.rows
