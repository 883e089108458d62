# mypy: disable-error-code="no-untyped-def"
"""The compiled picture: `draw` goes through the tiles of a picture, `halve` averages 2 x 2 pixels."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
from numba import njit

from follow_env.camera.raster.fill import (
    DEPTH,
    DISTANCE,
    PIXELS,
    TILE,
    clear,
    fill_ball,
    fill_cylinder,
    fill_facet,
    fill_triangle,
)
from follow_env.camera.raster.people import find_triangles
from follow_env.camera.raster.scene import CYLINDER_PARTS, FACES
from follow_env.camera.raster.setup import find_balls, find_cylinders, find_facets
from follow_env.camera.raster.shade import BACKGROUND, shade_surface, shade_triangles
from follow_env.compilation import digest


def _compiled(sources: int) -> Callable[..., int]:
    @njit(cache=True, nogil=True, error_model="numpy")
    def draw(view, scene, people, work, first_row, last_row, colored, rgb, depth, ids):
        """Draw the rows of tiles `first_row` <= row < `last_row`; return 0, or -1 if a vertex is not finite.

        Args:
            view: `View`.
            scene: `ScenePack`.
            people: `PeoplePack`.
            work: `Workspace`.
            first_row: first row of tiles.
            last_row: the row of tiles after the last.
            colored: whether `rgb` is wanted.
            rgb: (H, W, 3) uint8, out.
            depth: (H, W) float32, out, m.
            ids: (H, W) uint8, out.
        """
        key = sources  # noqa: F841  captured, hence part of the cache key
        facet_count = find_facets(view, scene.boxes, work)
        cylinder_count = find_cylinders(view, scene.cylinders, work)
        ball_count = find_balls(view, scene.balls, work)
        triangle_count = find_triangles(view, people, scene, work)
        if triangle_count < 0:
            return -1
        lanes, seen, colors, done = work.lanes, work.seen, work.colors, work.done
        facets, places, order, in_row = work.facets, work.places, work.order, work.row
        cylinders, cylinder_places, balls, ball_places = work.rounds, work.round_places, work.balls, work.ball_places
        triangles, triangle_places = work.triangles, work.triangle_places
        surfaces, textures, lamps = scene.surfaces, scene.textures, scene.lamps
        names, pattern, albedo = people.ids, people.pattern, people.colors
        first_cylinder = 1 + FACES * scene.boxes.shape[0]
        first_ball = first_cylinder + CYLINDER_PARTS * scene.cylinders.shape[0]
        static = surfaces.shape[0]
        background, limit, far = np.float32(1.0 / view.far), np.float32(1.0 / view.near), np.float32(view.far)
        starts, entries = _sort_into_tiles(triangle_count, view, triangle_places)
        for row in range(first_row, last_row):
            count = 0
            for k in range(facet_count):
                f = order[k]
                if places[f, 3] <= row <= places[f, 4]:
                    in_row[count] = f
                    count += 1
            height, top = min(TILE, view.height - row * TILE), view.top + row * TILE * view.step
            for column in range(view.columns):
                width, left = min(TILE, view.width - column * TILE), view.left + column * TILE * view.step
                n = row * view.columns + column
                start, stop = starts[n], starts[n + 1]
                clear(lanes, seen, left, top, view.step, background)
                floor = _fill_facets(column, facets, places, in_row, count, lanes, seen, limit, background)
                given = lanes, seen, view.near, floor
                _fill_cylinders(row, column, cylinders, cylinder_places, cylinder_count, first_cylinder, *given)
                _fill_balls(row, column, balls, ball_places, ball_count, first_ball, *given)
                _fill_triangles(row, triangles, triangle_places, entries, start, stop, static, lanes, seen, limit)
                for k in range(PIXELS):
                    lanes[DISTANCE + k] = np.float32(1.0) / lanes[DEPTH + k] if seen[k] else far
                place = np.uint64(row * TILE), np.uint64(column * TILE), np.uint64(height), np.uint64(width)
                _write_depth(*place, lanes, depth)
                _write_ids(*place, stop > start, static, triangle_places, names, seen, ids)
                if not colored:
                    continue
                if stop > start:
                    looks = triangle_places, pattern, albedo, triangles
                    shade_triangles(height, width, static, *looks, lanes, seen, colors)
                lit = surfaces, textures, lamps, scene.ambient
                _shade_surfaces(height, width, view, *lit, done, lanes, seen, colors)
                _write_colors(*place, colors, rgb)
        return 0

    return draw


# Inlined by force, and given single arrays: numba counts references to those of a record by atomic operations.
_inline = njit(nogil=True, error_model="numpy", forceinline=True)


@_inline
def _sort_into_tiles(triangles, view, places):
    """Return (starts, entries): the triangles of tile n are entries[starts[n] : starts[n + 1]]."""
    columns = view.columns
    starts = np.zeros(view.rows * columns + 2, np.int32)
    for k in range(triangles):
        for row in range(places[k, 3] // TILE, places[k, 4] // TILE + 1):
            for column in range(places[k, 1] // TILE, places[k, 2] // TILE + 1):
                starts[row * columns + column + 2] += 1
    for n in range(2, starts.size):
        starts[n] += starts[n - 1]
    entries = np.empty(starts[-1], np.int32)
    for k in range(triangles):
        for row in range(places[k, 3] // TILE, places[k, 4] // TILE + 1):
            for column in range(places[k, 1] // TILE, places[k, 2] // TILE + 1):
                n = row * columns + column + 1
                entries[starts[n]] = k
                starts[n] += 1
    return starts, entries


@_inline
def _fill_facets(column, facets, places, in_row, count, lanes, seen, limit, floor):
    """Draw the first `count` facets of `in_row` into a tile; return the least 1/Z that it now has for certain."""
    for k in range(count):
        f = in_row[k]
        if places[f, 1] <= column <= places[f, 2]:
            floor = fill_facet(facets, f, places[f, 0], lanes, seen, limit, floor)
    return floor


@_inline
def _fill_cylinders(row, column, cylinders, places, count, first, lanes, seen, near, floor):
    """Draw cylinders, whose numbers begin at `first`, into a tile; what lies behind 1/Z = `floor` is left out."""
    for k in range(count):
        met = places[k, 1] <= column <= places[k, 2] and places[k, 3] <= row <= places[k, 4]
        if met and cylinders[k, 5] > floor:
            fill_cylinder(cylinders, k, np.int32(first + CYLINDER_PARTS * places[k, 0]), lanes, seen, near)


@_inline
def _fill_balls(row, column, balls, places, count, first, lanes, seen, near, floor):
    """Draw balls, whose numbers begin at `first`, into a tile; what lies behind 1/Z = `floor` is left out."""
    for k in range(count):
        met = places[k, 1] <= column <= places[k, 2] and places[k, 3] <= row <= places[k, 4]
        if met and balls[k, 6] > floor:
            fill_ball(balls, k, np.int32(first + places[k, 0]), lanes, seen, near)


@_inline
def _fill_triangles(row, triangles, places, entries, start, stop, first, lanes, seen, limit):
    """Draw the triangles `entries[start:stop]`, whose numbers begin at `first`, into a tile."""
    for n in range(start, stop):
        t = entries[n]
        upper, lower = max(places[t, 3] - row * TILE, 0), min(places[t, 4] - row * TILE, TILE - 1)
        fill_triangle(triangles, t, upper, lower, np.int32(first + t), lanes, seen, limit)


@_inline
def _shade_surfaces(height, width, view, surfaces, textures, lamps, ambient, done, lanes, seen, colors):
    """Color the pixels of the first `height` rows and `width` columns that see the scene or nothing.

    A surface is shaded once, from the first to the last row that shows it.
    """
    number_done = 0
    previous = np.int32(-1)
    for i in range(height):
        for k in range(np.uint64(TILE * i), np.uint64(TILE * i + width)):
            number = seen[k]
            if number == previous or number >= surfaces.shape[0]:
                continue
            if number == 0:
                colors[k] = BACKGROUND
                continue
            previous = number
            known = False
            for n in range(number_done):
                known |= done[n] == number
            if known:
                continue
            done[number_done] = number
            number_done += 1
            start, stop = np.uint64(i * TILE), np.uint64(_last_row(seen, number, i, height) * TILE + TILE)
            texture = textures[number]
            shade_surface(number, start, stop, view, surfaces, texture, lamps, ambient, lanes, seen, colors)


@_inline
def _last_row(seen, number, first, height):
    """Return the last row of the tile, from `first` on, in which `number` is seen."""
    for i in range(height - 1, first, -1):
        for j in range(np.uint64(TILE)):
            if seen[np.uint64(TILE * i) + j] == number:
                return i
    return first


@_inline
def _write_depth(y0, x0, rows, columns, lanes, depth):
    """Copy a tile's distances to its place in the picture."""
    for i in range(rows):
        for j in range(columns):
            depth[y0 + i, x0 + j] = lanes[DISTANCE + np.uint64(TILE) * i + j]


@_inline
def _write_ids(y0, x0, rows, columns, any_triangle, first, places, names, seen, ids):
    """Write who is seen to a tile's place in the picture."""
    for i in range(rows):
        for j in range(columns):
            ids[y0 + i, x0 + j] = 0
    if any_triangle:
        for i in range(rows):
            for j in range(columns):
                number = seen[np.uint64(TILE) * i + j]
                if number >= first:
                    ids[y0 + i, x0 + j] = names[places[number - first, 0]]


@_inline
def _write_colors(y0, x0, rows, columns, colors, rgb):
    """Copy a tile's colors to its place in the picture."""
    for i in range(rows):
        for j in range(columns):
            color = colors[np.uint64(TILE) * i + j]
            rgb[y0 + i, x0 + j, 0] = np.uint8(color)
            rgb[y0 + i, x0 + j, 1] = np.uint8(color >> np.uint32(8))
            rgb[y0 + i, x0 + j, 2] = np.uint8(color >> np.uint32(16))


draw = _compiled(digest(Path(__file__).parent.glob("*.py")))


@njit(cache=True, nogil=True)
def halve(fine, rgb):
    """Average 2 x 2 pixels of `fine` (2 H, 2 W, 3) uint8 into `rgb` (H, W, 3) uint8, rounded."""
    for i in range(rgb.shape[0]):
        for j in range(rgb.shape[1]):
            for k in range(3):
                total = 2 + fine[2 * i, 2 * j, k] + fine[2 * i, 2 * j + 1, k]
                rgb[i, j, k] = (total + fine[2 * i + 1, 2 * j, k] + fine[2 * i + 1, 2 * j + 1, k]) >> 2
