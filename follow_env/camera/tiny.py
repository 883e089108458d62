"""`TinyRenderer`: PyBullet's software rasterizer behind the `Renderer` interface, a cross-check for the default camera.

It draws in a client of its own, so that the physics client steps without visual bodies. One directional light stands
for the scene's lamps; its strength follows the lamps' falloff at the place the camera looks at. People are rigid: each
keeps the posture in which it was seen first and is moved by its pose, since PyBullet cannot change a mesh.
"""

import math
import tempfile
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pybullet

from follow_env.camera.frame import RGBDFrame
from follow_env.camera.pinhole import CameraPose, PinholeCamera
from follow_env.world.people.mesh import Mesh, Placed
from follow_env.world.scene import Box, Capsule, Primitive, Scene, Sphere

LIGHT_DIRECTION = (0.25, 0.45, 1.0)
AWAY = (0.0, 0.0, -1000.0)
"""Where people are put who are not in the picture, m."""


class TinyRenderer:
    """Draws `scene` and people with PyBullet's TinyRenderer, without shadows, one ray a pixel."""

    def __init__(self, scene: Scene, camera: PinholeCamera) -> None:
        if camera.config.supersample != 1:
            raise ValueError(
                f"the renderer 'tiny' cannot draw with supersample {camera.config.supersample}; expected 1, or use "
                "the renderer 'raster'"
            )
        self._scene, self._camera = scene, camera
        self._client = pybullet.connect(pybullet.DIRECT)
        x0, x1, y0, y1 = scene.bounds
        floor = Box((0.5 * (x0 + x1), 0.5 * (y0 + y1), -0.05), (x1 - x0, y1 - y0, 0.1), scene.floor)
        for primitive in (floor, *scene.primitives):
            self._add_primitive(primitive)
        self._people: list[tuple[Mesh, list[int]]] = []
        self._projection = camera.projection_matrix()
        # TinyRenderer samples a pixel at its lower left corner, not its center: shift the picture by half a pixel.
        self._projection[8] += 1.0 / camera.width
        self._projection[9] += 1.0 / camera.height

    def render(self, camera: CameraPose, people: Sequence[Placed] = ()) -> RGBDFrame:
        """Return the frame seen from `camera` with the people at their poses."""
        client, config = self._client, self._camera.config
        owner = self._place(people)
        ahead = (camera.x + 2.0 * math.cos(camera.yaw), camera.y + 2.0 * math.sin(camera.yaw))
        lamps = self._scene.illumination(*ahead)
        _, _, rgba, buffer, segmentation = pybullet.getCameraImage(
            config.width,
            config.height,
            self._camera.view_matrix(camera),
            self._projection,
            lightDirection=LIGHT_DIRECTION,
            lightColor=(1.0, 1.0, 1.0),
            lightDistance=10.0,
            shadow=0,
            lightAmbientCoeff=self._scene.ambient + 0.30 * min(lamps, 1.3),
            lightDiffuseCoeff=0.60 * min(lamps, 1.3),
            lightSpecularCoeff=0.02,
            renderer=pybullet.ER_TINY_RENDERER,
            physicsClientId=client,
        )
        shape = (config.height, config.width)
        rgb = np.ascontiguousarray(np.asarray(rgba, np.uint8).reshape(*shape, 4)[:, :, :3])
        z_buffer = np.asarray(buffer, np.float64).reshape(shape)
        depth = config.far * config.near / (config.far - (config.far - config.near) * z_buffer)
        ids = owner[np.asarray(segmentation).reshape(shape) + 1]
        return RGBDFrame(rgb, depth.astype(np.float32), ids)

    def close(self) -> None:
        """Disconnect from PyBullet; a second call does nothing."""
        if self._client >= 0:
            pybullet.disconnect(self._client)
            self._client = -1

    def _place(self, people: Sequence[Placed]) -> np.ndarray:
        """Move the people's bodies; return the id to report for each body number plus one."""
        present = [(person, self._bodies_of(person)) for person in people]
        for _, bodies in self._people:
            for body in bodies:
                pybullet.resetBasePositionAndOrientation(body, AWAY, (0.0, 0.0, 0.0, 1.0), physicsClientId=self._client)
        owner = np.zeros(pybullet.getNumBodies(physicsClientId=self._client) + 1, np.uint8)
        for person, bodies in present:
            x, y, heading = person.pose
            turn = (0.0, 0.0, math.sin(0.5 * heading), math.cos(0.5 * heading))
            for body in bodies:
                pybullet.resetBasePositionAndOrientation(body, (x, y, 0.0), turn, physicsClientId=self._client)
                owner[body + 1] = person.id
        return owner

    def _bodies_of(self, person: Placed) -> list[int]:
        """Bodies of a person, one for each color, made when the person is seen for the first time."""
        for mesh, bodies in self._people:
            if mesh is person.mesh:
                return bodies
        x, y, heading = person.pose
        cosine, sine = math.cos(heading), math.sin(heading)
        vertices, normals = person.vertices.astype(np.float64), person.normals.astype(np.float64)
        vertices[:, :2] -= (x, y)
        for part in (vertices, normals):
            ahead, left = part[:, 0].copy(), part[:, 1].copy()
            part[:, 0], part[:, 1] = cosine * ahead + sine * left, cosine * left - sine * ahead
        colors, kind = np.unique(person.mesh.colors, axis=0, return_inverse=True)
        bodies = [
            self._add_mesh(vertices, normals, person.mesh.faces[kind.reshape(-1) == k], color)
            for k, color in enumerate(colors)
        ]
        self._people.append((person.mesh, bodies))
        return bodies

    def _add_primitive(self, primitive: Primitive) -> None:
        if isinstance(primitive, Sphere | Capsule):
            straight = primitive.straight if isinstance(primitive, Capsule) else 0.0
            points, normals, faces = _lathe(primitive.radius, straight)
            self._add_mesh(points + primitive.center, normals, faces, np.array(primitive.material.color))
            return
        client, yaw = self._client, primitive.yaw if isinstance(primitive, Box) else 0.0
        look = dict(rgbaColor=(*primitive.material.color, 1.0), specularColor=(0.0, 0.0, 0.0), physicsClientId=client)
        if isinstance(primitive, Box):
            half = [0.5 * s for s in primitive.size]
            shape = pybullet.createVisualShape(pybullet.GEOM_BOX, halfExtents=half, **look)
        else:
            shape = pybullet.createVisualShape(
                pybullet.GEOM_CYLINDER, radius=primitive.radius, length=primitive.height, **look
            )
        turn = (0.0, 0.0, math.sin(0.5 * yaw), math.cos(0.5 * yaw))
        pybullet.createMultiBody(0, -1, shape, primitive.center, turn, physicsClientId=client)

    def _add_mesh(self, vertices: np.ndarray, normals: np.ndarray, faces: np.ndarray, color: np.ndarray) -> int:
        """Add a mesh by way of an OBJ file: PyBullet loses the memory of meshes that are handed over as lists."""
        lines = [f"v {x!r} {y!r} {z!r}" for x, y, z in vertices.tolist()]
        lines += [f"vn {x!r} {y!r} {z!r}" for x, y, z in normals.tolist()]
        lines += ["vt 0 0", *(f"f {a}/1/{a} {b}/1/{b} {c}/1/{c}" for a, b, c in (faces + 1).tolist())]
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder, "segment.obj")
            path.write_text("\n".join(lines) + "\n", encoding="ascii")
            shape = pybullet.createVisualShape(
                pybullet.GEOM_MESH,
                fileName=str(path),
                rgbaColor=(*color.tolist(), 1.0),
                specularColor=(0.0, 0.0, 0.0),
                physicsClientId=self._client,
            )
            return pybullet.createMultiBody(0, -1, shape, physicsClientId=self._client)


def _lathe(radius: float, straight: float, rows: int = 16, sides: int = 48) -> tuple[np.ndarray, ...]:
    """Return points (V, 3), normals (V, 3) and faces (F, 3) of a capsule around the origin; a sphere if not straight.

    PyBullet's own capsule is a low-poly cone.
    """
    around = [2.0 * math.pi * k / sides for k in range(sides)]
    points, normals = [], []
    for half in (1.0, -1.0):
        for i in range(rows + 1):
            tilt = 0.5 * math.pi * (i if half > 0.0 else rows + i) / rows
            out, up = math.sin(tilt), math.cos(tilt)
            normals += [(out * math.cos(a), out * math.sin(a), up) for a in around]
            points += [(radius * x, radius * y, radius * z + 0.5 * half * straight) for x, y, z in normals[-sides:]]
    faces = []
    for i in range(2 * rows + 1):
        for k in range(sides):
            a, b = i * sides + k, i * sides + (k + 1) % sides
            faces += [(a, a + sides, b), (b, a + sides, b + sides)]
    return np.array(points), np.array(normals), np.array(faces)
