"""Draw docs/people.png (bodies, postures, the robot's view) and docs/scenes.png (places, lights, primitives).

Run from the repository's root: `python tools/picture_sheet.py`.
"""

import math
import sys
from pathlib import Path

import cv2
import numpy as np

from follow_env.camera import CameraPose, PinholeCamera, RGBDFrame, make_renderer
from follow_env.config import CameraConfig
from follow_env.world.people.bodies import BODIES, load_body
from follow_env.world.people.postures import POSTURES
from follow_env.world.people.walker import Walker
from follow_env.world.scene import Box, Capsule, Cylinder, Light, Material, Scene, Sphere
from follow_env.world.scenes import LIGHTS, SCENES, make_scene

CAMERA = PinholeCamera(CameraConfig(width=240, height=180, supersample=2))
EYE = CameraPose(4.0, 0.0, 1.0, 0.0)
VIEWS = dict.fromkeys(SCENES, (CameraPose(1.0, 0.0, 1.0, 0.0), CameraPose(9.5, -1.2, 1.4, 2.7), EYE))
VIEWS["cabin"] = (CameraPose(-2.8, 0.0, 1.0, 0.0), CameraPose(3.2, -0.7, 1.4, 2.7), CameraPose(-3.5, 0.0, 1.0, 0.0))
"""Where each place is seen from: along it, across it, and by the robot; everywhere else by the robot, `EYE`."""
DEPTH_RANGE = 8.0
INK, PAPER = (40, 40, 40), 255
ID_COLORS = np.array(((225, 225, 225), (230, 159, 0), (0, 114, 178)), np.uint8)
"""Okabe-Ito: scene gray, the person to follow orange, others blue."""


def main(folder: Path) -> None:
    """Write both sheets into `folder`."""
    for name, rows in (("people.png", people_sheet()), ("scenes.png", scenes_sheet())):
        widest = max(map(len, rows))
        blank = np.full_like(rows[0][0], PAPER)
        sheet = np.vstack([np.hstack(row + [blank] * (widest - len(row))) for row in rows])
        cv2.imwrite(str(folder / name), sheet[:, :, ::-1], [cv2.IMWRITE_PNG_COMPRESSION, 9])


def people_sheet() -> list[list[np.ndarray]]:
    """Every body, the postures, and people at four distances from the robot."""
    worn = dict(zip(BODIES, ("blue", "green", "orange", "red", "white", "checks", "stripes"), strict=True))
    places = {name: make_scene(name) for name in SCENES}
    views = (("corridor", "woman", "stripes", 1.0), ("corridor", "woman", "stripes", 1.5))
    views += (("corridor", "woman", "stripes", 2.5), ("corridor", "woman", "stripes", 4.0))
    views += (("indoor", "man_tall", "checks", 1.5), ("indoor", "man_tall", "checks", 2.5))
    views += (("indoor", "man_tall", "checks", 4.0),)
    frame = shot(places["indoor"], EYE, person(EYE, 1.5, "woman_slim", "green"))
    return [
        [
            tile(shot(places["indoor"], EYE, person(EYE, 2.6, body, outfit, math.pi - 0.5)).rgb, body)
            for body, outfit in worn.items()
        ],
        [
            tile(shot(places["indoor"], EYE, person(EYE, 2.6, "man", "orange", 2.2, posture)).rgb, posture)
            for posture in POSTURES
        ],
        [
            tile(shot(places[name], EYE, person(EYE, distance, body, outfit)).rgb, f"{name}, {distance:g} m")
            for name, body, outfit, distance in views
        ],
        [tile(frame.rgb, "color"), depth_tile(frame), id_tile(frame)],
    ]


def scenes_sheet() -> list[list[np.ndarray]]:
    """Each place in each light from two viewpoints with depth and ids, the robot's view, and the primitives."""
    rows = []
    for name in SCENES:
        ahead, across, _ = VIEWS[name]
        for label, eye, distance, turn in (("along", ahead, 2.5, 0.3), ("across", across, 3.0, -1.0)):
            frames = {
                light: shot(make_scene(name, light), eye, person(eye, distance, "man", "orange", turn))
                for light in LIGHTS
            }
            row = [tile(frame.rgb, f"{name}, {label}, {light}") for light, frame in frames.items()]
            rows.append([*row, depth_tile(frames["normal"]), id_tile(frames["normal"])])
    for name in SCENES:
        place = make_scene(name)
        eye = VIEWS[name][2]
        frames = {d: shot(place, eye, person(eye, d, "woman", "blue")) for d in (1.0, 1.5, 2.5, 4.0)}
        rows.append([tile(frame.rgb, f"{name}, robot's view at {d:g} m") for d, frame in frames.items()])
    eye = CameraPose(0.0, 0.0, 1.0, 0.0)
    frame = shot(primitives(), eye, person(eye, 2.6, "child", "green", 2.6))
    rows.append([tile(frame.rgb, "box, cylinder, sphere, capsule"), depth_tile(frame), id_tile(frame)])
    return rows


def primitives() -> Scene:
    """A small place with one of each primitive, in front of a wall."""
    wall = Material((0.86, 0.84, 0.78))
    parts = (
        Box((4.5, 0.0, 1.6), (0.1, 9.0, 3.2), wall),
        Box((3.4, 1.3, 0.4), (0.6, 0.6, 0.8), Material((0.62, 0.44, 0.27), texture="wood"), 0.5),
        Cylinder((3.2, 0.55, 0.45), 0.22, 0.9, Material((0.66, 0.45, 0.36), texture="brick")),
        Sphere((2.5, -0.5, 0.75), 0.25, Material((0.0, 0.45, 0.70))),
        Capsule((3.3, -1.2, 0.75), 0.25, 1.5, Material((0.80, 0.47, 0.65))),
    )
    lamps = (Light((1.0, 1.5, 2.6), 0.9), Light((3.0, -1.5, 2.6), 0.6))
    return Scene("primitives", parts, Material((0.62, 0.62, 0.60), 0.4, "tiles"), lamps, 0.3, (-2.0, 4.5, -4.5, 4.5))


def person(eye: CameraPose, distance: float, body: str, outfit: str, turn: float = 0.3, posture: str = "walk") -> tuple:
    """Return the person who stands so far ahead of `eye`, m, turned by `turn` (rad) from its direction."""
    x, y = eye.x + distance * math.cos(eye.yaw), eye.y + distance * math.sin(eye.yaw)
    return (Walker(load_body(body, outfit)).place(x, y, eye.yaw + turn, 0.45, 0.9, posture),)


def shot(place: Scene, eye: CameraPose, people: tuple) -> RGBDFrame:
    """Return the frame that `eye` sees."""
    return make_renderer("raster", place, CAMERA).render(eye, people)


def depth_tile(frame: RGBDFrame) -> np.ndarray:
    """Return the depth in colors, with the bar that explains them in its head."""
    share = np.clip(frame.depth / DEPTH_RANGE, 0.0, 1.0)
    picture = tile(viridis(1.0 - share), "depth")
    left, right = 80, CAMERA.width - 42
    picture[5:17, left:right] = viridis(np.linspace(1.0, 0.0, right - left)[None, :])
    text(picture, "0", left - 12)
    text(picture, f"{DEPTH_RANGE:g} m", right + 5)
    return picture


def viridis(share: np.ndarray) -> np.ndarray:
    """Return the colors (H, W, 3) of shares (H, W) in [0, 1]."""
    return cv2.applyColorMap((255.0 * share).astype(np.uint8), cv2.COLORMAP_VIRIDIS)[:, :, ::-1]


def id_tile(frame: RGBDFrame) -> np.ndarray:
    """Return the ids in colors."""
    return tile(ID_COLORS[frame.ids], "ids: orange = the person")


def tile(picture: np.ndarray, label: str) -> np.ndarray:
    """Return the picture with its label above, uint8 (H, W, 3)."""
    head = np.full((22, picture.shape[1], 3), PAPER, np.uint8)
    text(head, label, 4)
    return np.pad(np.vstack((head, picture)), ((0, 4), (0, 4), (0, 0)), constant_values=PAPER)


def text(picture: np.ndarray, label: str, left: int) -> None:
    """Write into the picture's head."""
    cv2.putText(picture, label, (left, 15), cv2.FONT_HERSHEY_SIMPLEX, 0.42, INK, 1, cv2.LINE_AA)


if __name__ == "__main__":
    main(Path(sys.argv[1] if len(sys.argv) > 1 else "docs"))
