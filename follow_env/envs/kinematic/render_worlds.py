# mypy: disable-error-code="no-untyped-def"
"""The compiled picture of a world: `paint` poses the person, draws, corrupts and hands over a range of worlds."""

import math
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numba import njit

from follow_env.camera.raster.kernels import draw, halve
from follow_env.camera.raster.scene import ScenePack
from follow_env.camera.raster.work import PeoplePack, View, Workspace
from follow_env.camera.sensor.kernels import SensorModel, SensorWork, corrupt, pack_bytes
from follow_env.compilation import digest
from follow_env.envs.kinematic.kernels import BEGIN, SKIP
from follow_env.world.people.skinning import skin, smooth_normals
from follow_env.world.people.stride import Figure, walk


class Canvas(NamedTuple):
    """A frame that is being drawn: (H, W, 3) uint8, (H, W) float32 m and (H, W) uint8."""

    rgb: np.ndarray
    depth: np.ndarray
    ids: np.ndarray


class Studio(NamedTuple):
    """What one thread draws with.

    Attributes:
        camera: the view, from wherever.
        fine_camera: the same with twice as many pixels each way.
        canvas: of the size of `camera`.
        fine_canvas: of the size of `fine_camera` with `supersample` 2, otherwise empty.
        forward: of the camera from the robot's origin, m.
        scene: the place.
        people: the person.
        work: buffers of the raster.
        figure: the person's gait.
        bones: (V, 4), see `Body`.
        weights: (V, 4), see `Body`.
        rotations: (J, 3, 3) float64, buffer.
        positions: (J, 3) float64, buffer.
        sensor: the camera's errors.
        sensor_work: their buffers.
    """

    camera: View
    fine_camera: View
    canvas: Canvas
    fine_canvas: Canvas
    forward: float
    scene: ScenePack
    people: PeoplePack
    work: Workspace
    figure: Figure
    bones: np.ndarray
    weights: np.ndarray
    rotations: np.ndarray
    positions: np.ndarray
    sensor: SensorModel
    sensor_work: SensorWork


def _compiled(sources: int) -> Callable[..., bool]:
    @njit(cache=True, nogil=True, error_model="numpy")
    def paint(first, last, todo, worlds, settings, studio, rgb, depth, colors, distances):
        """Draw the worlds first <= i < last that begin or step; hand over what all of them observe.

        Args:
            first: of the range.
            last: of the range, exclusive.
            todo: (n,) int8, `SKIP`, `BEGIN` or `STEP` for each world.
            worlds: (n,) `records.WORLD`.
            settings: (1,) `records.SETTINGS`, or (n,) if each world has its own.
            studio: `Studio`.
            rgb: (slots, n, H, W, 3) uint8, the latest pictures; all slots are filled when a world begins.
            depth: (slots, n, H, W) float32, m.
            colors: (n, H, W, 3) uint8, out, or (n, H, W, 4) with nearness: see `pack_bytes`.
            distances: (n, H, W) float32, out, m.

        Returns:
            Whether all of it was finite.
        """
        key = sources  # noqa: F841  captured, hence part of the cache key
        slots, own = rgb.shape[0], 1 if len(settings) > 1 else 0
        for i in range(first, last):
            world = worlds[i]
            latest, oldest = world.steps % slots, (world.steps + slots - settings[own * i].delay) % slots
            if todo[i] != SKIP:
                if not _draw(world, studio):
                    return False
                canvas = studio.canvas
                if studio.sensor.color.exact:
                    rgb[latest, i] = canvas.rgb
                given = studio.sensor, studio.sensor_work, depth[latest, i], rgb[latest, i]
                corrupt(canvas.depth, canvas.rgb, world.picture_seed, *given)
            if todo[i] == BEGIN:
                for slot in range(slots):
                    if slot != latest:
                        rgb[slot, i], depth[slot, i] = rgb[latest, i], depth[latest, i]
            distances[i] = depth[oldest, i]
            if colors.shape[3] == 4:
                pack_bytes(rgb[oldest, i], depth[oldest, i], colors[i])
            else:
                colors[i] = rgb[oldest, i]
        return True

    return paint


@njit(nogil=True, error_model="numpy")
def _draw(world, studio):
    """Draw what the camera of a world sees, without errors; False if a vertex is not finite."""
    people, figure, rotations, positions = studio.people, studio.figure, studio.rotations, studio.positions
    walk(figure, world.walked, world.speed, rotations, positions)
    c, s = math.cos(world.heading), math.sin(world.heading)
    placement = (world.person_x, world.person_y, 0.0, c, s)
    given = studio.bones, studio.weights, rotations, positions, figure.joints, placement
    skin(people.anchors, *given, people.vertices)
    smooth_normals(people.vertices, people.faces, people.normals)
    fine, canvas = studio.fine_canvas, studio.canvas
    drawn = True
    if fine.rgb.size > 0:
        drawn = _render(_from_robot(studio.fine_camera, world, studio.forward), studio, True, fine)
        halve(fine.rgb, canvas.rgb)
    return drawn and _render(_from_robot(studio.camera, world, studio.forward), studio, fine.rgb.size == 0, canvas)


@njit(nogil=True, error_model="numpy")
def _render(view, studio, colored, canvas):
    out = canvas.rgb, canvas.depth, canvas.ids
    return draw(view, studio.scene, studio.people, studio.work, 0, view.rows, colored, *out) == 0


@njit(nogil=True, error_model="numpy")
def _from_robot(view, world, forward):
    """Return `view` from where the robot's camera is."""
    x, y = world.x + forward * world.cosine, world.y + forward * world.sine
    lens = view.near, view.far, view.wide, view.high, view.left, view.top, view.step
    return View(x, y, view.z, world.cosine, world.sine, *lens, view.width, view.height, view.columns, view.rows)


def _sources() -> list[Path]:
    package = Path(__file__).parents[2]
    people = package / "world/people"
    camera = [*package.glob("camera/raster/*.py"), package / "camera/sensor/kernels.py"]
    return [*camera, people / "skinning.py", people / "stride.py"]


paint = _compiled(digest(_sources()))
