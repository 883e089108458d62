"""`OpenGLRenderer`: the default camera's picture, drawn by a graphics chip or Mesa's software driver, without a window.

Scene and people are triangles in one format and one shader (`opengl_mesh`, `opengl_shaders`). The picture is drawn
upside down, so that the rows come back in the camera's order. Needs the extra `gl`.
"""

import importlib
import math
import os
from collections.abc import Sequence
from typing import Any, ClassVar

import numpy as np

from follow_env.camera.frame import RGBDFrame
from follow_env.camera.opengl.mesh import Triangles, person_triangles, scene_triangles
from follow_env.camera.opengl.shaders import CASTER_FRAGMENT, CASTER_VERTEX, LOOKS_WIDTH, VERTEX, surface_shader
from follow_env.camera.pinhole import CameraPose, PinholeCamera
from follow_env.camera.raster.scene import pack_scene
from follow_env.camera.raster.shade import BACKGROUND
from follow_env.world.people.mesh import Mesh, Placed
from follow_env.world.scene import Scene

SHADOW_SIDE = 2048
"""Side of a lamp's shadow map, px."""
SHADOW_SLOPE = 5.7
"""Tangent of the greatest angle from straight down at which a lamp casts shadows: 80 degrees."""
SHADOW_NEAR = 0.1
"""What is nearer to a lamp casts no shadow, m: its own fixture."""
SHADOW_BIAS = (4.0, 4.0)
"""How far casters are pushed away from the lamp, in slopes and steps of depth, lest a surface shade itself."""


class OpenGLRenderer:
    """Draws `scene` and people with OpenGL 3.3.

    Depth, ids and textures are those of `RasterRenderer`, colors to about a gray level; the last bits depend on the
    driver. A pixel that sees nothing within `far` has depth `far` and id 0. A renderer belongs to the process that
    made it.

    Args:
        scene: the place.
        camera: the intrinsics; with `supersample` 2 colors are averages, depth and ids those of the pixel centers.
        shadows: whether things stand in the lamps' direct light; the default camera draws no shadows.

    Raises:
        ValueError: if the scene has values that are not finite, or OpenGL is missing.
    """

    _process: ClassVar[int | None] = None
    """The first process that used OpenGL: the driver's threads do not survive a fork; a child would wait forever."""

    def __init__(self, scene: Scene, camera: PinholeCamera, shadows: bool = False) -> None:
        self._camera, self._shadows = camera, shadows
        pack = pack_scene(scene)
        self._lamps = pack.lamps if len(pack.lamps) else np.zeros((1, 4), np.float32)
        self._require_own_process()
        self._context: Any = _make_context()
        OpenGLRenderer._process = os.getpid()
        with self._context as context:
            context.gc_mode = "context_gc"
            context.enable_only(context.DEPTH_TEST)
            context.front_face = "cw"  # upside down
            self._surface = context.program(VERTEX, surface_shader(len(self._lamps), shadows))
            self._surface["ambient"] = float(pack.ambient)
            self._surface["far"] = camera.config.far
            self._surface["lamps"].write(self._lamps.tobytes())
            self._caster: Any = context.program(CASTER_VERTEX, CASTER_FRAGMENT) if shadows else None
            self._target = _Target(context, camera.width, camera.height)
            self._fine = (
                _Target(context, 2 * camera.width, 2 * camera.height) if camera.config.supersample == 2 else None
            )
            self._scene = _Drawable(context, self._surface, self._caster, scene_triangles(scene), 0)
            self._people: list[_Drawable] = []
            if shadows:
                self._make_shadow_map(context)
        self._meshes: list[tuple[Mesh, int]] = []

    def render(self, camera: CameraPose, people: Sequence[Placed] = ()) -> RGBDFrame:
        """Return the frame seen from `camera`, without sensor errors.

        Raises:
            ValueError: if the camera's pose or a vertex is not finite, or the process is a fork of the renderer's.
        """
        if not all(map(math.isfinite, (camera.x, camera.y, camera.z, camera.yaw))):
            raise ValueError(f"the camera's pose is {camera!r}; expected finite numbers in meters and radians")
        self._require_own_process()
        with self._context as context:
            self._place(context, people)
            if self._shadows:
                self._cast(context)
            self._surface["eye"] = camera.x, camera.y, camera.z
            self._surface["projection"].write(self._projection(camera))
            colors, depth = self._draw(self._target)
            ids = np.ascontiguousarray(colors[..., 3])
            if self._fine is not None:
                self._draw(self._fine)
                colors = self._fine.halved_colors()
        return RGBDFrame(np.ascontiguousarray(colors[..., :3]), depth, ids)

    def close(self) -> None:
        """Free the context and all that is in it; a second call does nothing."""
        if self._context is not None and self._process == os.getpid():
            self._people, self._meshes = [], []
            del self._scene, self._target, self._fine, self._surface, self._caster
            with self._context as context:
                context.gc()
            self._context.release()
        self._context = None

    def _require_own_process(self) -> None:
        if self._process not in (None, os.getpid()):
            raise ValueError(
                "OpenGL was used before this process was forked and cannot be used in it; start worker processes with "
                "'spawn' or draw nothing before they start"
            )

    def _projection(self, pose: CameraPose) -> bytes:
        """World to clip coordinates, column by column, with the picture's rows from below."""
        view, projection = (
            np.array(m).reshape(4, 4).T for m in (self._camera.view_matrix(pose), self._camera.projection_matrix())
        )
        return (np.diag((1.0, -1.0, 1.0, 1.0)) @ projection @ view).T.astype(np.float32).tobytes()

    def _place(self, context: Any, people: Sequence[Placed]) -> None:
        """Send the people's vertices; make their buffers again only when other meshes or ids come."""
        points = [np.hstack((person.vertices, person.normals)) for person in people]
        if not all(np.isfinite(array).all() for array in points):
            raise ValueError("a person has a vertex that is not finite; expected world coordinates in meters")
        meshes = [(person.mesh, person.id) for person in people]
        same = len(meshes) == len(self._meshes) and all(
            new[0] is old[0] and new[1] == old[1] for new, old in zip(meshes, self._meshes, strict=True)
        )
        if not same:
            self._people = [
                _Drawable(context, self._surface, self._caster, person_triangles(mesh), id) for mesh, id in meshes
            ]
            self._meshes = meshes
            context.gc()
        for person, array in zip(self._people, points, strict=True):
            person.move(array)

    def _draw(self, target: "_Target") -> tuple[np.ndarray, np.ndarray]:
        self._surface["focal"] = self._camera.focal * target.width / self._camera.width
        target.clear(self._camera.config.far)
        for drawable in (*self._people, self._scene):
            drawable.draw(self._surface)
        return target.read()

    def _make_shadow_map(self, context: Any) -> None:
        count = len(self._lamps)
        self._shadow_side = min(SHADOW_SIDE, context.info["GL_MAX_TEXTURE_SIZE"] // count)
        shadow_map = context.depth_texture((count * self._shadow_side, self._shadow_side))
        shadow_map.compare_func = "<="
        shadow_map.filter = context.LINEAR, context.LINEAR
        shadow_map.use(1)
        self._surface["looks"], self._surface["shadow_map"] = 0, 1
        self._shadow_buffer = context.framebuffer(depth_attachment=shadow_map)
        self._shadow_projections = [_lamp_projection(*map(float, lamp[:3])) for lamp in self._lamps]
        self._surface["shadow_projections"].write(b"".join(self._shadow_projections))

    def _cast(self, context: Any) -> None:
        """Draw the depth that every lamp sees."""
        side, buffer = self._shadow_side, self._shadow_buffer
        buffer.clear()
        buffer.use()
        context.polygon_offset = SHADOW_BIAS
        for k, projection in enumerate(self._shadow_projections):
            buffer.viewport = (k * side, 0, side, side)
            self._caster["projection"].write(projection)
            for drawable in (self._scene, *self._people):
                drawable.cast()
        buffer.viewport = (0, 0, len(self._shadow_projections) * side, side)
        context.polygon_offset = (0.0, 0.0)


class _Target:
    """A picture to draw into: colors with ids in the fourth channel, and depth in m."""

    def __init__(self, context: Any, width: int, height: int) -> None:
        self.width, self._shape = width, (height, width)
        self._colors = context.texture((width, height), 4)
        self._depth = context.texture((width, height), 1, dtype="f4")
        nearest = context.depth_renderbuffer((width, height))
        self._only_depth = context.framebuffer(self._depth)
        self._buffer = context.framebuffer((self._colors, self._depth), nearest)

    def clear(self, far: float) -> None:
        """Make the picture empty and draw into it from now on."""
        background = int(BACKGROUND)
        self._buffer.clear(*(((background >> shift) & 255) / 255 for shift in (0, 8, 16)), alpha=0.0)
        self._only_depth.clear(far)
        self._buffer.use()

    def read(self) -> tuple[np.ndarray, np.ndarray]:
        """Return colors and ids (H, W, 4) uint8 and depth (H, W) float32."""
        colors, depth = np.empty((*self._shape, 4), np.uint8), np.empty(self._shape, np.float32)
        self._colors.read_into(colors)
        self._depth.read_into(depth)
        return colors, depth

    def halved_colors(self) -> np.ndarray:
        """Return the colors averaged over 2 x 2 pixels, (H / 2, W / 2, 4) uint8."""
        colors = np.empty((self._shape[0] // 2, self._shape[1] // 2, 4), np.uint8)
        self._colors.build_mipmaps(0, 1)
        self._colors.read_into(colors, level=1)
        return colors


class _Drawable:
    """Triangles on the graphics chip."""

    def __init__(self, context: Any, surface: Any, caster: Any, triangles: Triangles, id: int) -> None:
        self._id = id / 255.0
        self._vertices = context.buffer(triangles.vertices.tobytes())
        faces, anchors = context.buffer(triangles.faces.tobytes()), context.buffer(triangles.anchors.tobytes())
        parts = [(self._vertices, "3f 3f", "in_position", "in_normal"), (anchors, "3f", "in_anchor")]
        self._array = context.vertex_array(surface, parts, index_buffer=faces)
        self._caster = caster and context.vertex_array(
            caster, [(self._vertices, "3f 12x", "in_position")], index_buffer=faces
        )
        rows = -(-len(triangles.looks) // LOOKS_WIDTH)
        looks = np.zeros((rows * LOOKS_WIDTH, 4), np.float32)
        looks[: len(triangles.looks)] = triangles.looks
        self._looks = context.texture((LOOKS_WIDTH, rows), 4, looks.tobytes(), dtype="f4")

    def move(self, vertices: np.ndarray) -> None:
        """Take other positions and normals, (V, 6) float32."""
        self._vertices.write(vertices.tobytes())

    def draw(self, surface: Any) -> None:
        """Draw with the program `surface`."""
        surface["id"] = self._id
        self._looks.use(0)
        self._array.render()

    def cast(self) -> None:
        """Draw only how near the triangles are."""
        self._caster.render()


def _make_context() -> Any:
    try:
        moderngl: Any = importlib.import_module("moderngl")
    except ImportError:
        raise ValueError("renderer 'opengl' needs moderngl; install it with pip install 'follow-env[gl]'") from None
    try:
        return moderngl.create_context(require=330, standalone=True, backend="egl")
    except Exception as error:
        raise ValueError(
            f"renderer 'opengl' found no OpenGL 3.3 over EGL ({error}); install a driver, on Debian "
            "apt install libegl1 libgl1 libgl1-mesa-dri, or use renderer 'raster'"
        ) from None


def _lamp_projection(x: float, y: float, z: float) -> bytes:
    """World to clip coordinates of a lamp that looks straight down, column by column."""
    near, far = SHADOW_NEAR, abs(z) + 1.0
    middle, shift = (far + near) / (far - near), 2.0 * far * near / (far - near)
    rows = (
        (1.0 / SHADOW_SLOPE, 0.0, 0.0, -x / SHADOW_SLOPE),
        (0.0, 1.0 / SHADOW_SLOPE, 0.0, -y / SHADOW_SLOPE),
        (0.0, 0.0, -middle, middle * z - shift),
        (0.0, 0.0, -1.0, z),
    )
    return np.array(rows, np.float32).T.tobytes()
