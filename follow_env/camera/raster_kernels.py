"""The compiled picture: `draw` goes through the tiles of a picture, `halve` averages 2 x 2 pixels."""

import sys
import zlib
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numba import njit
from numba.core import event

from follow_env.camera.raster_fill import TILE, fill_cylinder, fill_facet, fill_triangle
from follow_env.camera.raster_scene import CYLINDER_PARTS, FACES, ScenePack
from follow_env.camera.raster_setup import (
    FACET_NUMBERS,
    TRIANGLE_NUMBERS,
    find_cylinders,
    find_facets,
    find_triangles,
)
from follow_env.camera.raster_shade import shade_row


class View(NamedTuple):
    """A camera: place (m), cosine and sine of the yaw, clipping (m), slopes of the field of view's edges, pixel grid.

    The ray (X, Y, 1) of pixel (i, j) is (left + j step, top + i step, 1).
    """

    x: float
    y: float
    z: float
    cosine: float
    sine: float
    near: float
    far: float
    wide: float
    high: float
    left: float
    top: float
    step: float
    width: int
    height: int
    columns: int
    rows: int


class PeoplePack(NamedTuple):
    """All people of a picture as one mesh; `starts` (P + 1, 2) are the first vertex and face of each."""

    vertices: np.ndarray
    normals: np.ndarray
    faces: np.ndarray
    colours: np.ndarray
    pattern: np.ndarray
    anchors: np.ndarray
    ids: np.ndarray
    starts: np.ndarray


class Tile(NamedTuple):
    """The pixels of one tile: rays, buffers, and rows of 16 lanes for the shading."""

    xs: np.ndarray
    ys: np.ndarray
    depth: np.ndarray
    seen: np.ndarray
    column: np.ndarray
    low: np.ndarray
    high: np.ndarray
    px: np.ndarray
    py: np.ndarray
    pz: np.ndarray
    nx: np.ndarray
    ny: np.ndarray
    s: np.ndarray
    t: np.ndarray
    sharpness: np.ndarray
    shade: np.ndarray
    light: np.ndarray


class Workspace(NamedTuple):
    """Buffers of one thread, used again for every picture."""

    tile: Tile
    corners: np.ndarray
    quad: np.ndarray
    bounds: np.ndarray
    facets: np.ndarray
    places: np.ndarray
    order: np.ndarray
    row: np.ndarray
    rounds: np.ndarray
    round_places: np.ndarray
    camera_points: np.ndarray
    vertex_light: np.ndarray
    triangles: np.ndarray
    triangle_places: np.ndarray


def make_workspace(scene: ScenePack, vertices: int, faces: int) -> Workspace:
    """Return buffers for `scene` and people of so many vertices and faces in all."""
    facets, rounds = FACES * len(scene.boxes), len(scene.cylinders)

    def real(*shape: int) -> np.ndarray:
        return np.zeros(shape, np.float32)

    def whole(*shape: int) -> np.ndarray:
        return np.zeros(shape, np.int32)

    lanes = [real(TILE) for _ in range(13)]
    return Workspace(
        Tile(real(TILE), real(TILE), real(TILE, TILE), whole(TILE, TILE), *lanes),
        np.zeros((8, 3)),
        np.zeros((4, 3)),
        np.zeros(4),
        real(facets, FACET_NUMBERS),
        whole(facets, 5),
        whole(facets),
        whole(facets),
        np.zeros((rounds, 8)),
        whole(rounds, 5),
        np.zeros((vertices, 3)),
        real(vertices),
        real(faces + 1, TRIANGLE_NUMBERS),
        whole(faces + 1, 5),
    )


def _digest() -> int:
    """Return a checksum of the kernels' sources.

    Numba's cache looks only at the file of the cached function itself. The checksum is a closure variable of `draw`,
    and so part of its cache key: a change in any of the other files is noticed as well.
    """
    digest = 0
    for path in sorted([*Path(__file__).parent.glob("raster_*.py"), Path(__file__).parent / "textures.py"]):
        digest = zlib.crc32(path.read_bytes(), digest)
    return digest


def _compiled(sources: int) -> Callable[..., int]:
    @njit(cache=True, nogil=True, error_model="numpy")
    def draw(view, scene, people, work, first_row, last_row, coloured, rgb, depth, ids):  # type: ignore[no-untyped-def]
        """Draw the rows of tiles `first_row` <= row < `last_row`; return 0, or -1 if a vertex is not finite.

        Args:
            view: `View`.
            scene: `ScenePack`.
            people: `PeoplePack`.
            work: `Workspace`.
            first_row: first row of tiles.
            last_row: the row of tiles after the last.
            coloured: whether `rgb` is wanted.
            rgb: (H, W, 3) uint8, out.
            depth: (H, W) float32, out, m.
            ids: (H, W) uint8, out.
        """
        assert sources >= 0
        facets = find_facets(view, scene.boxes, work)
        rounds = find_cylinders(view, scene.cylinders, work)
        triangles = find_triangles(view, people, scene, work)
        if triangles < 0:
            return -1
        starts, entries = _sort_into_tiles(triangles, view, work.triangle_places)
        for row in range(first_row, last_row):
            count = 0
            for k in range(facets):
                f = work.order[k]
                if work.places[f, 3] <= row <= work.places[f, 4]:
                    work.row[count] = f
                    count += 1
            for column in range(view.columns):
                _fill_tile(row, column, view, scene, work, count, rounds, starts, entries)
                _write_tile(row, column, view, scene, people, work, coloured, rgb, depth, ids)
        return 0

    return draw


@njit(nogil=True, error_model="numpy")
def _sort_into_tiles(triangles, view, places):  # type: ignore[no-untyped-def]
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


@njit(nogil=True, error_model="numpy")
def _fill_tile(row, column, view, scene, work, count, rounds, starts, entries):  # type: ignore[no-untyped-def]
    tile = work.tile
    background = np.float32(1.0 / view.far)
    limit = np.float32(1.0 / view.near)
    for k in range(TILE):
        tile.xs[k] = view.left + (column * TILE + k) * view.step
        tile.ys[k] = view.top + (row * TILE + k) * view.step
    for i in range(TILE):
        for j in range(TILE):
            tile.depth[i, j] = background
            tile.seen[i, j] = 0
    floor = background
    for k in range(count):
        f = work.row[k]
        if work.places[f, 1] <= column <= work.places[f, 2]:
            floor = fill_facet(work.facets[f], work.places[f, 0], tile, limit, floor)
    first = np.int32(1 + FACES * scene.boxes.shape[0])
    for k in range(rounds):
        place = work.round_places[k]
        inside = place[1] <= column <= place[2] and place[3] <= row <= place[4]
        if inside and work.rounds[k, 5] > floor:
            fill_cylinder(work.rounds[k], first + np.int32(CYLINDER_PARTS * place[0]), tile, view.near)
    first = np.int32(scene.surfaces.shape[0])
    n = row * view.columns + column
    for k in range(starts[n], starts[n + 1]):
        t = entries[k]
        upper = max(work.triangle_places[t, 3] - row * TILE, 0)
        lower = min(work.triangle_places[t, 4] - row * TILE, TILE - 1)
        fill_triangle(work.triangles[t], upper, lower, first + np.int32(t), tile, limit)


@njit(nogil=True, error_model="numpy")
def _write_tile(row, column, view, scene, people, work, coloured, rgb, depth, ids):  # type: ignore[no-untyped-def]
    tile = work.tile
    x0, y0 = column * TILE, row * TILE
    width, height = min(TILE, view.width - x0), min(TILE, view.height - y0)
    static = scene.surfaces.shape[0]
    far = np.float32(view.far)
    for i in range(height):
        for j in range(width):
            number = tile.seen[i, j]
            depth[y0 + i, x0 + j] = np.float32(1.0) / tile.depth[i, j] if number else far
            ids[y0 + i, x0 + j] = 0
            if number >= static:
                ids[y0 + i, x0 + j] = people.ids[work.triangle_places[number - static, 0]]
        if coloured:
            shade_row(i, width, view, scene, people, work, rgb[y0 + i, x0 : x0 + width])


draw = _compiled(_digest())


@njit(cache=True, nogil=True)
def halve(fine, rgb):  # type: ignore[no-untyped-def]
    """Average 2 x 2 pixels of `fine` (2 H, 2 W, 3) uint8 into `rgb` (H, W, 3) uint8, rounded."""
    for i in range(rgb.shape[0]):
        for j in range(rgb.shape[1]):
            for k in range(3):
                total = 2 + fine[2 * i, 2 * j, k] + fine[2 * i, 2 * j + 1, k]
                rgb[i, j, k] = (total + fine[2 * i + 1, 2 * j, k] + fine[2 * i + 1, 2 * j + 1, k]) >> 2


class _Announcer(event.Listener):
    """Says once that the camera is being compiled."""

    announced = False

    def on_start(self, event: Any) -> None:
        if not _Announcer.announced:
            _Announcer.announced = True
            print("compiling the camera, once", file=sys.stderr, flush=True)

    def on_end(self, event: Any) -> None:
        """Nothing is said at the end."""


@contextmanager
def announced() -> Iterator[None]:
    """Say on stderr, once, if what runs inside has to be compiled because the cache is empty or stale."""
    with event.install_listener("numba:compile", _Announcer()):
        yield
