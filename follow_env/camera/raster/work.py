"""What the kernels are given: the view, the people as one mesh, and the buffers of a thread."""

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from follow_env.camera.pinhole import CameraPose, PinholeCamera
from follow_env.camera.raster.fill import PLANES, TILE
from follow_env.camera.raster.people import TRIANGLE_NUMBERS
from follow_env.camera.raster.scene import FACES, ScenePack
from follow_env.camera.raster.setup import FACET_NUMBERS
from follow_env.world.people.mesh import Mesh


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
    """All people of a picture as one mesh; `starts` (P + 1, 2) are the first vertex and face of each.

    `borders` (F,) are the faces that are drawn from both sides, see `Mesh.near_border`.
    """

    vertices: np.ndarray
    normals: np.ndarray
    faces: np.ndarray
    colors: np.ndarray
    pattern: np.ndarray
    borders: np.ndarray
    anchors: np.ndarray
    ids: np.ndarray
    starts: np.ndarray


class Workspace(NamedTuple):
    """Buffers of one thread, used again for every picture."""

    lanes: np.ndarray
    seen: np.ndarray
    colors: np.ndarray
    corners: np.ndarray
    quad: np.ndarray
    bounds: np.ndarray
    facets: np.ndarray
    places: np.ndarray
    order: np.ndarray
    row: np.ndarray
    done: np.ndarray
    rounds: np.ndarray
    round_places: np.ndarray
    balls: np.ndarray
    ball_places: np.ndarray
    surface: np.ndarray
    camera_points: np.ndarray
    front_light: np.ndarray
    back_light: np.ndarray
    triangles: np.ndarray
    triangle_places: np.ndarray


def make_view(camera: PinholeCamera, pose: CameraPose, scale: int) -> View:
    """Return the view from a pose with `scale` times as many pixels each way as the camera has.

    Raises:
        ValueError: if the pose is not finite.
    """
    if not all(map(math.isfinite, (pose.x, pose.y, pose.z, pose.yaw))):
        raise ValueError(f"the camera's pose is {pose!r}; expected finite numbers in meters and radians")
    width, height, step = scale * camera.width, scale * camera.height, 1.0 / (scale * camera.focal)
    return View(
        float(pose.x),
        float(pose.y),
        float(pose.z),
        math.cos(pose.yaw),
        math.sin(pose.yaw),
        float(camera.config.near),
        float(camera.config.far),
        0.5 * width * step,
        0.5 * height * step,
        (0.5 - 0.5 * width) * step,
        (0.5 - 0.5 * height) * step,
        step,
        width,
        height,
        -(-width // TILE),
        -(-height // TILE),
    )


def pack_people(people: Sequence[tuple[Mesh, int]]) -> PeoplePack:
    """Return people as one mesh, each given by a mesh and an id; where they are is not known yet."""
    meshes = [mesh for mesh, _ in people]
    sizes = np.array([(0, 0), *((len(m.anchors), len(m.faces)) for m in meshes)], np.int64)
    starts = np.cumsum(sizes, axis=0)
    vertices = int(starts[-1, 0])
    none = np.zeros((0, 3), np.float32)
    return PeoplePack(
        np.zeros((vertices, 3), np.float32),
        np.zeros((vertices, 3), np.float32),
        np.concatenate(
            [np.zeros((0, 3), np.int32), *(m.faces + np.int32(s[0]) for m, s in zip(meshes, starts, strict=False))]
        ),
        np.concatenate([none, *(m.colors for m in meshes)]),
        np.concatenate([np.zeros(0, np.uint8), *(m.pattern for m in meshes)]),
        np.concatenate([np.zeros(0, np.bool_), *(m.near_border for m in meshes)]),
        np.concatenate([none, *(m.anchors for m in meshes)]),
        np.repeat(np.array([number for _, number in people], np.uint8), sizes[1:, 1]),
        starts,
    )


def make_workspace(scene: ScenePack, vertices: int, faces: int) -> Workspace:
    """Return buffers for `scene` and people of so many vertices and faces in all."""
    facets, rounds = FACES * len(scene.boxes), len(scene.cylinders)

    def real(*shape: int) -> np.ndarray:
        return np.zeros(shape, np.float32)

    def whole(*shape: int) -> np.ndarray:
        return np.zeros(shape, np.int32)

    return Workspace(
        real(PLANES * TILE * TILE),
        whole(TILE * TILE),
        np.zeros(TILE * TILE, np.uint32),
        np.zeros((8, 3)),
        np.zeros((4, 3)),
        np.zeros(4),
        real(facets, FACET_NUMBERS),
        whole(facets, 5),
        whole(facets),
        whole(facets),
        whole(TILE * TILE),
        np.zeros((rounds, 8)),
        whole(rounds, 5),
        np.zeros((len(scene.balls), 7)),
        whole(len(scene.balls), 5),
        real(6, vertices),
        np.zeros((5, vertices)),
        real(vertices),
        real(vertices),
        real(faces + 1, TRIANGLE_NUMBERS),
        whole(faces + 1, 5),
    )
