"""Draw docs/people.png: every body, the postures, both scenes and the robot's view at four distances.

Run from the repository's root: `python tools/picture_sheet.py`.
"""

import math
import sys
from pathlib import Path

import cv2
import numpy as np

from follow_env.camera import CameraPose, PinholeCamera, RGBDFrame, make_renderer
from follow_env.config import CameraConfig
from follow_env.person.bodies import BODIES, load_body
from follow_env.person.postures import POSTURES
from follow_env.person.walker import Walker
from follow_env.scenes import make_scene

SIZE = (240, 180)
EYE = CameraPose(4.0, 0.0, 1.0, 0.0)
INK, PAPER = (40, 40, 40), 255


def main(out: Path) -> None:
    """Write the sheet to `out`."""
    camera = PinholeCamera(CameraConfig(width=SIZE[0], height=SIZE[1]))
    renderers = {
        name: make_renderer(name="raster", scene=make_scene(name), camera=camera) for name in ("corridor", "indoor")
    }

    def shot(
        scene: str, body: str, outfit: str, distance: float, turn: float = 0.3, posture: str = "walk"
    ) -> RGBDFrame:
        walker = Walker(load_body(body, outfit))
        return renderers[scene].render(EYE, (walker.place(EYE.x + distance, 0.0, turn, 0.45, 0.9, posture),))

    worn = dict(zip(BODIES, ("blue", "green", "orange", "red", "white", "checks", "stripes"), strict=True))
    rows = [
        [tile(shot("indoor", body, outfit, 2.6, math.pi - 0.5).rgb, body) for body, outfit in worn.items()],
        [tile(shot("indoor", "man", "orange", 2.6, 2.2, name).rgb, name) for name in POSTURES],
        [tile(shot("corridor", "woman", "stripes", d).rgb, f"corridor, {d:g} m") for d in (1.0, 1.5, 2.5, 4.0)]
        + [tile(shot("indoor", "man_tall", "checks", d).rgb, f"indoor, {d:g} m") for d in (1.5, 2.5, 4.0)],
    ]
    frame = shot("indoor", "woman_slim", "green", 1.5)
    share = np.clip(frame.depth / 8.0, 0.0, 1.0)
    depth = cv2.applyColorMap((255.0 * (1.0 - share)).astype(np.uint8), cv2.COLORMAP_VIRIDIS)[:, :, ::-1]
    ids = np.repeat((frame.ids * 255)[:, :, None], 3, axis=2)
    rows.append([tile(frame.rgb, "colour"), tile(depth, "depth, 0 (yellow) to 8 m"), tile(ids, "id of the person")])
    widest = max(map(len, rows))
    blank = np.full_like(rows[0][0], PAPER)
    sheet = np.vstack([np.hstack(row + [blank] * (widest - len(row))) for row in rows])
    cv2.imwrite(str(out), sheet[:, :, ::-1])


def tile(picture: np.ndarray, label: str) -> np.ndarray:
    """Return the picture with its label above, uint8 (H, W, 3)."""
    head = np.full((22, picture.shape[1], 3), PAPER, np.uint8)
    cv2.putText(head, label, (4, 15), cv2.FONT_HERSHEY_SIMPLEX, 0.42, INK, 1, cv2.LINE_AA)
    return np.pad(np.vstack((head, picture)), ((0, 4), (0, 4), (0, 0)), constant_values=PAPER)


if __name__ == "__main__":
    main(Path(sys.argv[1] if len(sys.argv) > 1 else "docs/people.png"))
