"""Do person detectors that were trained on photographs find the drawn people? Counts it on random views.

Run from the repository's root; the packages are no dependencies of the project:

    pip install ai-edge-litert==2.3.0 && pip install --no-deps mediapipe==0.10.21
    npm install --prefix NPM @vladmandic/human@3.3.6 @tensorflow/tfjs-core@4.22.0 \
        @tensorflow/tfjs-converter@4.22.0 @tensorflow/tfjs-backend-wasm@4.22.0
    python tools/detector_recall.py OUT.json --npm NPM

The weights are inside these packages (of mediapipe nothing else is used). The detectors, each at its own threshold:

- centernet: CenterNet on MobileNetV3, trained on COCO, run by Human (score 0.2, class person). A person is found by a
  box of IoU >= 0.5 with the box of the visible pixels.
- blazepose: the person detector of MediaPipe Pose (score 0.5). It gives no box but the middle of the hips and a circle
  about the whole body, seen or not: a person is found if that point is in the box of the visible pixels and the
  circle's vertical extent has an IoU >= 0.5 with that of the whole body.
- hog: OpenCV's HOG and SVM after Dalal and Triggs, made for whole, upright people, with the settings and shrunk boxes
  of OpenCV's sample peopledetect. Criterion of centernet.

A view: any body and outfit, anywhere in the free space, walking in any direction at 0 to 1.6 m/s, 1.5 to 4 m ahead of
the robot, the axis at least 3.75 deg inside the picture; nothing stands between, but the picture's edges may cut.
"""

import argparse
import importlib.metadata
import json
import math
import subprocess
import tempfile
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np

from follow_env.camera import CameraPose, PinholeCamera, make_renderer
from follow_env.config import CameraConfig, RobotConfig
from follow_env.world.people.bodies import BODIES, OUTFITS, load_body
from follow_env.world.people.walker import Walker
from follow_env.world.scenes import SCENES, make_scene

WIDTH, HEIGHT = 640, 480  # of what the detectors get, px; pictures drawn at 320 x 240 are enlarged
HUMAN = """
const fs = require('fs'), [file, root, W, H] = process.argv.slice(1), modules = root + '/node_modules/';
const { Human } = require(modules + '@vladmandic/human/dist/human.node-wasm.js'), off = { enabled: false };
globalThis.fetch = async (url) => new Response(fs.readFileSync(String(url).replace('file://', '')));
const human = new Human({ backend: 'wasm', wasmPath: modules + '@tensorflow/tfjs-backend-wasm/dist/', debug: false,
  modelBasePath: 'file://' + modules + '@vladmandic/human/models/', cacheSensitivity: 0, filter: off, face: off,
  body: off, hand: off, gesture: off, object: { enabled: true } });
(async () => {
  await human.load();
  const all = [], input = fs.openSync(file), picture = Buffer.alloc(H * W * 3);
  while (fs.readSync(input, picture) === picture.length) {
    const tensor = human.tf.tensor(new Uint8Array(picture), [1, +H, +W, 3], 'float32');
    const people = (await human.detect(tensor)).object.filter((found) => found.label === 'person');
    all.push(people.map(({ box: [u, v, w, h] }) => [u, v, u + w, v + h]));
    tensor.dispose();
  }
  fs.writeFileSync(file, JSON.stringify(all));
})();
"""
Box = Sequence[float]


@dataclass(frozen=True)
class View:
    """A picture (H, W, 3), the boxes (px) of the person's visible pixels and of the whole body, and what it shows."""

    picture: np.ndarray
    box: Box
    whole: Box
    kinds: dict[str, str]


def main() -> None:
    """Draw, detect, count, print and write."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("out", type=Path, help="JSON file to write")
    parser.add_argument("--npm", type=Path, help="folder of the npm packages; without it centernet is left out")
    parser.add_argument("--views", type=int, default=200)
    parser.add_argument("--seed", type=int, default=0)
    options = parser.parse_args()
    table = {}
    for size in ((640, 480), (320, 240)):
        views = draw_views(options.views, options.seed, CameraConfig(*size))
        runs = [("centernet", centernet(views, options.npm), boxed)] if options.npm else []
        for name, found, hit in [*runs, ("blazepose", blazepose(views), encircled), ("hog", hog(views), boxed)]:
            title = f"{name}, {size[0]}x{size[1]}"
            table[title] = count(views, found, hit)
            print(f"\n{title:24} views  found recall false/frame")
            for kind, row in table[title].items():
                print(f"{kind:24}{row['views']:6d}{row['found']:7d}{row['recall']:7.2f}{row['false_per_frame']:12.3f}")
    options.out.write_text(json.dumps({"views": options.views, "seed": options.seed, "detectors": table}, indent=1))


def draw_views(number: int, seed: int, config: CameraConfig) -> list[View]:
    """Return views of the scenes in turn; the same seed gives the same views whatever the camera's resolution."""
    rng, camera, robot = np.random.default_rng(seed), PinholeCamera(config), RobotConfig()
    scenes = {name: make_scene(name) for name in SCENES}
    renderers = {name: make_renderer("raster", scene, camera) for name, scene in scenes.items()}
    widest, scale, views = 0.5 * camera.hfov - math.radians(3.75), WIDTH / config.width, []
    for name in np.resize(list(SCENES), number).tolist():
        low, high = np.reshape(scenes[name].bounds, (2, 2)).T
        body, outfit = str(rng.choice(BODIES)), str(rng.choice(list(OUTFITS)))
        distance, side, heading = rng.uniform(1.5, 4.0), rng.uniform(-widest, widest), rng.uniform(-math.pi, math.pi)
        walked, speed = rng.uniform(0.0, 2.0), rng.uniform(0.0, 1.6)
        reach, free = (distance - robot.camera_forward) / math.cos(side), False
        while not free:
            start, yaw = rng.uniform(low, high), rng.uniform(-math.pi, math.pi)
            between = start + np.linspace(0.0, reach, 20)[:, None] * (math.cos(yaw + side), math.sin(yaw + side))
            free = ((between > low) & (between < high)).all() and scenes[name].clearance(between) > 0.35
        placed = Walker(load_body(body, outfit)).place(*between[-1].tolist(), heading, walked, speed)
        eye = CameraPose(*start.tolist(), robot.camera_height, yaw)
        frame = renderers[name].render(eye, (placed,))
        points = np.array([camera.project(eye, tuple(point))[:2] for point in placed.vertices.tolist()])
        box, whole = np.array(frame.person_box()), np.concatenate([points.min(axis=0), points.max(axis=0)])
        share = float(np.prod(box[2:] - box[:2]) / np.prod(whole[2:] - whole[:2]))
        turn = abs(math.remainder(heading - yaw - side, 2.0 * math.pi))
        step = math.floor(2.0 * distance) / 2.0
        kinds = {"scene": name, "body": body, "outfit": outfit, "distance": f"{step:.1f}-{step + 0.5:.1f} m"}
        kinds["seen from"] = ("behind", "the side", "ahead")[(turn > 0.25 * math.pi) + (turn > 0.75 * math.pi)]
        kinds["visible"] = "0.9-1" if share > 0.9 else "0.6-0.9" if share > 0.6 else "0-0.6"
        picture = cv2.resize(frame.rgb, (WIDTH, HEIGHT), interpolation=cv2.INTER_LINEAR)
        views.append(View(picture, (scale * box).tolist(), (scale * whole).tolist(), kinds))
    return views


def centernet(views: list[View], npm: Path) -> list[list[Box]]:
    """Return the boxes (u0, v0, u1, v1), px, of the people that Human's object detector finds."""
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder, "pictures")
        file.write_bytes(b"".join(view.picture.tobytes() for view in views))
        subprocess.run(["node", "-e", HUMAN, file, npm.resolve(), str(WIDTH), str(HEIGHT)], check=True)
        return json.loads(file.read_text())


def blazepose(views: list[View]) -> list[list[Box]]:
    """Return the squares (u0, v0, u1, v1), px, about the circles of BlazePose's person detector."""
    from ai_edge_litert.interpreter import Interpreter

    weights = next(f for f in importlib.metadata.files("mediapipe") or () if f.name == "pose_detection.tflite")
    net = Interpreter(str(weights.locate()))
    net.allocate_tensors()
    given, (raw, logit) = net.get_input_details()[0], net.get_output_details()
    size, margin, found = given["shape"][1], (WIDTH - HEIGHT) // 2, []
    cells = [(np.mgrid[:n, :n][::-1].reshape(2, -1).T.repeat(k, 0) + 0.5) / n for n, k in ((28, 2), (14, 2), (7, 6))]
    for view in views:
        square = np.pad(view.picture, ((margin, margin), (0, 0), (0, 0)))
        small = cv2.resize(square, (size, size), interpolation=cv2.INTER_AREA)
        net.set_tensor(given["index"], (small[None] / 127.5 - 1.0).astype(np.float32))
        net.invoke()
        points = net.get_tensor(raw["index"])[0].reshape(-1, 6, 2) / size  # face: center, size; hips, rim, two unused
        points[:, [0, 2, 3]] += np.concatenate(cells)[:, None]
        faces = np.hstack((points[:, 0] - 0.5 * points[:, 1], points[:, 1]))
        scores = net.get_tensor(logit["index"])[0, :, 0]  # a score of 0.5 is a logit of 0
        kept = np.ravel(cv2.dnn.NMSBoxes(faces.tolist(), scores.tolist(), 0.0, 0.3)).astype(int)
        circles = [(WIDTH * hips - (0, margin), WIDTH * math.dist(hips, rim)) for hips, rim in points[kept, 2:4]]
        found.append([(*(hips - radius).tolist(), *(hips + radius).tolist()) for hips, radius in circles])
    return found


def hog(views: list[View]) -> list[list[Box]]:
    """Return the boxes (u0, v0, u1, v1), px, of OpenCV's default people detector."""
    detector, found = cv2.HOGDescriptor(), []
    detector.setSVMDetector(cv2.HOGDescriptor.getDefaultPeopleDetector())
    for view in views:
        boxes, _ = detector.detectMultiScale(view.picture[:, :, ::-1].copy(), 0.0, (8, 8), (0, 0), 1.05, 2, False)
        found.append([(u + 0.1 * w, v + 0.07 * h, u + 0.9 * w, v + 0.87 * h) for u, v, w, h in boxes])
    return found


def boxed(found: Box, view: View) -> bool:
    """Return whether the box has an IoU of at least 0.5 with that of the visible pixels."""
    width, height = (max(0.0, min(found[k + 2], view.box[k + 2]) - max(found[k], view.box[k])) for k in (0, 1))
    areas = sum((b[2] - b[0]) * (b[3] - b[1]) for b in (found, view.box))
    return width * height >= 0.5 * (areas - width * height)


def encircled(found: Box, view: View) -> bool:
    """Return whether the circle's center is in the box of the visible pixels and its height fits the whole body."""
    inside = all(view.box[k] <= 0.5 * (found[k] + found[k + 2]) <= view.box[k + 2] for k in (0, 1))
    common = min(found[3], view.whole[3]) - max(found[1], view.whole[1])
    return inside and common >= 0.5 * (max(found[3], view.whole[3]) - min(found[1], view.whole[1]))


def count(views: list[View], found: list[list[Box]], hit: Callable[[Box, View], bool]) -> dict[str, dict[str, float]]:
    """Return views, people found, recall and false detections per frame, over all views and by kind of view."""
    rows: dict[str, list[tuple[bool, int]]] = {}
    for view, boxes in zip(views, found, strict=True):
        seen = any(hit(box, view) for box in boxes)
        for kind in ("all", *(f"{name} {value}" for name, value in view.kinds.items())):
            rows.setdefault(kind, []).append((seen, len(boxes) - seen))
    sums = {kind: (len(rows[kind]), *np.sum(rows[kind], axis=0).tolist()) for kind in sorted(rows)}
    return {k: {"views": n, "found": f, "recall": f / n, "false_per_frame": e / n} for k, (n, f, e) in sums.items()}


if __name__ == "__main__":
    main()
