"""`RasterRenderer`: the default camera. Solids and people in one z-buffer, compiled by numba.

Flat faces are half-planes and a linear 1/Z over the picture, cylinders are solved per column, balls (spheres and the
ends of capsules) per pixel, people are triangles. The nearest at a pixel center wins, and each visible pixel is shaded
once. The rooms: `raster_scene` packs the scene, `raster_setup` and `raster_people` find what may be seen, `raster_fill`
draws tiles, `raster_shade` colors them.
"""

from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import nullcontext

import numpy as np

from follow_env.camera.frame import RGBDFrame
from follow_env.camera.pinhole import CameraPose, PinholeCamera
from follow_env.camera.raster.kernels import draw, halve
from follow_env.camera.raster.scene import pack_scene
from follow_env.camera.raster.work import PeoplePack, View, Workspace, make_view, make_workspace, pack_people
from follow_env.compilation import announced
from follow_env.world.people.mesh import Mesh, Placed
from follow_env.world.scene import Scene


class RasterRenderer:
    """Draws `scene` and people.

    The picture depends only on the scene, the camera and the people: not on the processor, the number of threads or
    what was drawn before. A pixel that sees nothing within `far` has depth `far` and id 0.

    Args:
        scene: the place.
        camera: the intrinsics; with `supersample` 2 colors are averages, depth and ids those of the pixel centers.
        threads: threads that share a picture (or the cameras of a batch).

    Raises:
        ValueError: if `threads` is out of range, or the scene has values that are not finite.
    """

    def __init__(self, scene: Scene, camera: PinholeCamera, threads: int = 1) -> None:
        if not isinstance(threads, int) or threads < 1:
            raise ValueError(f"threads is {threads!r}; expected a whole number from 1")
        self._camera, self._supersample, self._threads = camera, camera.config.supersample, threads
        self._scene = pack_scene(scene)
        self._pool = ThreadPoolExecutor(threads) if threads > 1 else None
        self._meshes: list[tuple[Mesh, int]] = []
        self._people, self._workspaces = self._pack([])
        shape = (camera.height * 2, camera.width * 2) if self._supersample == 2 else (0, 0)
        self._fine = RGBDFrame(np.empty((*shape, 3), np.uint8), np.empty(shape, np.float32), np.empty(shape, np.uint8))
        self._warm = False

    def render(self, camera: CameraPose, people: Sequence[Placed] = ()) -> RGBDFrame:
        """Return the frame seen from `camera`, without sensor errors.

        Raises:
            ValueError: if the camera's pose or a vertex is not finite.
        """
        frame = self._blank(())
        self._render_into(frame, camera, people)
        return frame

    def render_batch(self, cameras: Sequence[CameraPose], people: Sequence[Sequence[Placed]]) -> RGBDFrame:
        """Return one frame with a leading axis (N, ...): what each camera sees, with the people that stand before it.

        Raises:
            ValueError: if there is not one group of people for each camera, or a pose or vertex is not finite.
        """
        if len(cameras) != len(people):
            raise ValueError(f"{len(people)} groups of people for {len(cameras)} cameras; expected one for each camera")
        frames = self._blank((len(cameras),))
        for k, (camera, group) in enumerate(zip(cameras, people, strict=True)):
            self._render_into(RGBDFrame(frames.rgb[k], frames.depth[k], frames.ids[k]), camera, group)
        return frames

    def close(self) -> None:
        """Stop the threads; a second call does nothing."""
        if self._pool is not None:
            self._pool.shutdown()
            self._pool = None

    def _blank(self, leading: tuple[int, ...]) -> RGBDFrame:
        shape = (*leading, self._camera.height, self._camera.width)
        return RGBDFrame(np.empty((*shape, 3), np.uint8), np.empty(shape, np.float32), np.empty(shape, np.uint8))

    def _render_into(self, frame: RGBDFrame, camera: CameraPose, people: Sequence[Placed]) -> None:
        view = make_view(self._camera, camera, 1)
        self._place(people)
        with nullcontext() if self._warm else announced("the camera"):
            if self._supersample == 2:
                self._draw(make_view(self._camera, camera, 2), True, self._fine)
                halve(self._fine.rgb, frame.rgb)
            self._draw(view, self._supersample == 1, frame)
        self._warm = True

    def _place(self, people: Sequence[Placed]) -> None:
        """Copy the people's vertices; pack the rest again only when other meshes or ids come."""
        meshes = [(person.mesh, person.id) for person in people]
        same = len(meshes) == len(self._meshes) and all(
            new[0] is old[0] and new[1] == old[1] for new, old in zip(meshes, self._meshes, strict=True)
        )
        if not same:
            self._people, self._workspaces = self._pack(meshes)
            self._meshes = meshes
        first = 0
        for person in people:
            last = first + len(person.vertices)
            self._people.vertices[first:last] = person.vertices
            self._people.normals[first:last] = person.normals
            first = last

    def _pack(self, meshes: list[tuple[Mesh, int]]) -> tuple[PeoplePack, list[Workspace]]:
        people = pack_people(meshes)
        sizes = len(people.vertices), len(people.faces)
        return people, [make_workspace(self._scene, *sizes) for _ in range(self._threads)]

    def _draw(self, view: View, colored: bool, frame: RGBDFrame) -> None:
        """Draw the rows of tiles, one band a thread."""
        edges = [view.rows * k // self._threads for k in range(self._threads + 1)]
        jobs = [
            (view, self._scene, self._people, work, first, last, colored, frame.rgb, frame.depth, frame.ids)
            for work, first, last in zip(self._workspaces, edges[:-1], edges[1:], strict=True)
        ]
        if self._pool is not None and self._warm:
            states = list(self._pool.map(lambda job: draw(*job), jobs))
        else:
            states = [draw(*job) for job in jobs]
        if min(states) < 0:
            raise ValueError("a person has a vertex that is not finite; expected world coordinates in meters")
