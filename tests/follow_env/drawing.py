"""What the tests of the renderers share: small places, people made of few triangles, and a ray caster in NumPy."""

import hashlib
import math

import cv2
import numpy as np

from follow_env.camera import CameraPose, PinholeCamera
from follow_env.camera.raster.renderer import RasterRenderer
from follow_env.config import CameraConfig
from follow_env.world.people.mesh import Mesh, Placed
from follow_env.world.scene import Box, Capsule, Cylinder, Light, Material, Scene, Sphere

SMALL = PinholeCamera(CameraConfig(width=160, height=120))
GRAY, RED = Material((0.5, 0.5, 0.5)), Material((0.7, 0.2, 0.1))
LAMPS = (Light((1.0, 0.5, 2.6), 0.8), Light((6.0, -1.0, 2.4), 0.5))


def scene(*primitives, lights=LAMPS):
    return Scene("test", primitives, GRAY, lights, 0.3, (-20.0, 20.0, -20.0, 20.0))


def blob(x, y, z, radius=(0.25, 0.3, 0.8), id=1, pattern=0, rows=9, sides=12, open_rows=0):
    """An ellipsoid of 2 * sides * (rows - 1) triangles around (x, y, z); only `math`, so the same everywhere.

    Without the lowest `open_rows` rows of triangles it is a bell with an open border.
    """
    directions = [(0.0, 0.0, 1.0)]
    for i in range(1, rows):
        up, out = math.cos(math.pi * i / rows), math.sin(math.pi * i / rows)
        directions += [
            (out * math.cos(2 * math.pi * k / sides), out * math.sin(2 * math.pi * k / sides), up) for k in range(sides)
        ]
    directions.append((0.0, 0.0, -1.0))
    last, faces = len(directions) - 1, []
    for k in range(sides):
        following = (k + 1) % sides
        faces += [(0, 1 + k, 1 + following)] + [(last, last - sides + following, last - sides + k)] * (not open_rows)
        for i in range(rows - 1 - max(open_rows, 1)):
            a, b = 1 + i * sides + k, 1 + i * sides + following
            faces += [(a, a + sides, b), (b, a + sides, b + sides)]
    points = np.array([[d * r for d, r in zip(direction, radius, strict=True)] for direction in directions])
    slopes = np.array([[d / r for d, r in zip(direction, radius, strict=True)] for direction in directions])
    normals = slopes / np.sqrt((slopes * slopes).sum(axis=1, keepdims=True))
    colors = np.array([(0.2 + 0.6 * (f % 3 == 0), 0.4, 0.7) for f in range(len(faces))], np.float32)
    mesh = Mesh(np.array(faces, np.int32), colors, np.full(len(faces), pattern, np.uint8), points.astype(np.float32))
    return Placed(mesh, (points + np.array((x, y, z))).astype(np.float32), normals.astype(np.float32), id)


def reference(place, camera, pose, people=()):
    """Cast a ray through every pixel center; return depth, ids, normals (H, W, 3), albedo and points, in float64.

    A box is met by the slab test in its own frame, a cylinder by the quadratic and its ends, a sphere or capsule by
    walking along the ray by the distance to its surface, a triangle by Cramer's rule. What lies nearer than `near`
    along the optical axis does not count, nor what lies beyond `far`. Normals point to the camera.
    """
    near, far = camera.config.near, camera.config.far
    v, u = np.mgrid[: camera.height, : camera.width] + 0.5
    across, up = (camera.cx - u) / camera.focal, (camera.cy - v) / camera.focal
    c, s = math.cos(pose.yaw), math.sin(pose.yaw)
    rays = np.stack([c - s * across, s + c * across, up], axis=-1)
    eye = np.array((pose.x, pose.y, pose.z))
    depth, ids = np.full(u.shape, far), np.zeros(u.shape, int)
    normals, albedo = np.zeros((*u.shape, 3)), np.zeros((*u.shape, 3))

    def meet(t, hit, normal, color, id):
        closer = hit & (t >= near) & (t < depth)
        depth[closer], ids[closer], albedo[closer] = t[closer], id, color
        normal = np.broadcast_to(normal, normals.shape)
        normals[closer] = (normal * -np.sign((normal * rays).sum(axis=-1, keepdims=True)))[closer]

    x0, x1, y0, y1 = place.bounds
    floor = Box(((x0 + x1) / 2, (y0 + y1) / 2, -0.05), (x1 - x0, y1 - y0, 0.1), place.floor)
    with np.errstate(divide="ignore", invalid="ignore"):
        for p in (floor, *place.primitives):
            if isinstance(p, Box):
                frame = np.array(
                    [
                        (math.cos(p.yaw), math.sin(p.yaw), 0.0),
                        (-math.sin(p.yaw), math.cos(p.yaw), 0.0),
                        (0.0, 0.0, 1.0),
                    ]
                )
                own, own_rays = frame @ (eye - p.center), rays @ frame.T
                half = 0.5 * np.array(p.size)
                first, second = (-half - own) / own_rays, (half - own) / own_rays
                enter, leave = np.minimum(first, second), np.maximum(first, second)
                hit = enter.max(axis=-1) <= leave.min(axis=-1)
                ends = (enter.max(axis=-1), enter.argmax(axis=-1)), (leave.min(axis=-1), leave.argmin(axis=-1))
                for t, axis in ends:
                    way = np.take_along_axis(own_rays, axis[..., None], axis=-1)
                    meet(t, hit, -np.sign(way) * frame[axis], p.material.color, 0)
            elif isinstance(p, Sphere | Capsule):
                t, outward = walk(p, eye, rays, near)
                meet(t, t < far, outward, p.material.color, 0)
            else:
                offset, half = eye - p.center, 0.5 * p.height
                a = rays[..., 0] ** 2 + rays[..., 1] ** 2
                b = rays[..., 0] * offset[0] + rays[..., 1] * offset[1]
                root = np.sqrt(b * b - a * (offset[0] ** 2 + offset[1] ** 2 - p.radius**2))
                for t in ((-b - root) / a, (-b + root) / a):
                    point = offset + t[..., None] * rays
                    outward = np.stack([point[..., 0], point[..., 1], np.zeros_like(t)], axis=-1) / p.radius
                    meet(t, np.abs(point[..., 2]) <= half, outward, p.material.color, 0)
                for end in (half, -half):
                    t = (end - offset[2]) / rays[..., 2]
                    point = offset + t[..., None] * rays
                    hit = point[..., 0] ** 2 + point[..., 1] ** 2 <= p.radius**2
                    meet(t, hit, (0.0, 0.0, math.copysign(1.0, end)), p.material.color, 0)
        for person in people:
            corners = person.vertices.astype(float)[person.mesh.faces] - eye
            for (p0, p1, p2), color in zip(corners, person.mesh.colors, strict=True):
                normal = np.cross(p1 - p0, p2 - p0)
                t = normal @ p0 / (rays @ normal)
                q = t[..., None] * rays
                hit = (rays @ normal) < 0.0
                for start, stop in ((p0, p1), (p1, p2), (p2, p0)):
                    hit &= np.cross(stop - start, q - start) @ normal >= 0.0
                meet(t, hit, normal / np.linalg.norm(normal), color, person.id)
    return depth, ids, normals, albedo, eye + depth[..., None] * rays


def walk(solid, eye, rays, near):
    """Walk along the rays from `near` to a sphere or capsule: depth (inf: missed) and outward normals.

    A step is the distance to the surface, so none is passed; Newton's method, on a convex function, then ends exactly.
    """
    half = 0.5 * solid.straight if isinstance(solid, Capsule) else 0.0
    t = np.full(rays.shape[:2], near)
    length = np.sqrt((rays**2).sum(axis=-1))
    for step in range(66):
        offset = eye + t[..., None] * rays - solid.center
        offset[..., 2] -= np.clip(offset[..., 2], -half, half)
        distance = np.sqrt((offset**2).sum(axis=-1))
        gap = distance - solid.radius
        if step == 0:
            side = np.sign(gap)
        t = t + side * gap / length if step < 60 else t - gap * distance / (offset * rays).sum(axis=-1)
    return np.where(np.abs(gap) < 1e-9, t, np.inf), offset / solid.radius


def flat(depth, slack=0.03):
    """Where the depth is smooth: no neighbor (3 x 3) differs by more than `slack` of it (at least of 1 m)."""
    depth = depth.astype(np.float32)
    window = np.ones((3, 3), np.uint8)
    return cv2.dilate(depth, window) - cv2.erode(depth, window) <= slack * np.maximum(depth, 1.0)


def frames_hash(frames):
    digest = hashlib.sha256()
    for frame in frames:
        for array in (frame.rgb, frame.depth, frame.ids):
            digest.update(np.ascontiguousarray(array).tobytes())
    return digest.hexdigest()


def golden(threads=1):
    """Hash of 42 views: every primitive, texture and pattern, from inside a box and a capsule, and an open border."""
    textures = ("plain", "tiles", "wood", "brick", "carpet", "spines")
    parts = [
        Box((2.0 + 0.7 * k, -1.2 + 0.5 * k, 0.5), (0.5, 0.4, 1.0), Material((0.6, 0.4, 0.3), texture=t), 0.3 * k)
        for k, t in enumerate(textures)
    ]
    parts += [Cylinder((3.0, 1.5, 0.7), 0.3, 1.4, Material((0.3, 0.6, 0.4), texture="wood"))]
    parts += [Sphere((4.0, 1.0, 0.9), 0.35, Material((0.7, 0.6, 0.2), texture="tiles"))]
    parts += [Capsule((2.6, -0.4, 1.2), 0.2, 0.9, Material((0.3, 0.3, 0.7), texture="brick"))]
    place = Scene("golden", tuple(parts), Material((0.5, 0.5, 0.5), 0.1, "tiles"), LAMPS, 0.3, (-9.0, 9.0, -9.0, 9.0))
    camera = PinholeCamera(CameraConfig(width=150, height=110))
    renderer = RasterRenderer(place, camera, threads=threads)
    people = [blob(2.2, 0.3, 0.8, pattern=1), blob(3.5, -0.8, 0.9, id=2, pattern=2, open_rows=4)]
    frames = [
        renderer.render(CameraPose(0.06 * k, 0.3 - 0.02 * k, 0.7 + 0.02 * k, 0.05 * k - 0.5), people) for k in range(39)
    ]
    inside = CameraPose(2.0, -1.2, 0.5, 0.3), CameraPose(2.6, -0.4, 1.3, 2.0), CameraPose(3.5, -0.8, 0.4, 0.3)
    frames += [renderer.render(pose, people) for pose in inside]
    renderer.close()
    return frames_hash(frames)
