"""Bake the gait: read two motion clips that PyBullet ships and write follow_env/person/assets/gait.npz.

Run once, by hand, after a change here: `python tools/bake_gait.py`. The clips have the layout of Peng et al., DeepMimic
(2018): per frame the duration, the root's position and rotation, then joint rotations, in a frame with x forward, y up
and z right. They become 32 phases of one cycle that starts at the left foot's heel strike. The cycle is made symmetric
(the right side is the left side half a cycle later, mirrored), periodic, and smooth (five harmonics).
"""

import argparse
import json
import math
from pathlib import Path

import numpy as np
import pybullet_data
from bake_people import ASSETS, save

PHASES, HARMONICS = 32, 5
HIP, THIGH, SHIN = 0.084887, 0.421546, 0.40987
"""Half hip width and lengths of the clips' skeleton, m."""
ROTATIONS = ("pelvis", "chest", "head", "upper_arm", "forearm")


def main() -> None:
    """Write the table of both clips."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, default=ASSETS, help="folder for gait.npz")
    out = parser.parse_args().out
    arrays: dict[str, np.ndarray] = {}
    for clip in ("walk", "run"):
        arrays |= {f"{clip}_{name}": values for name, values in cycle(clip).items()}
    print(f"gait: {save(out / 'gait.npz', arrays) / 1000:.1f} kB")


def cycle(clip: str) -> dict[str, np.ndarray]:
    """Return the clip's table.

    Returns:
        rotations (32, 5, 4): of `ROTATIONS` in the walking frame (w, x, y, z), arms of the left side; the
            identity stands with the arms hanging.
        ankle (32, 2): the left one, forward and left of the mean pelvis, leg lengths.
        pitch (32,): of the left foot, rad, toes up.
        pelvis (32, 2): left and up from its mean, leg lengths.
        stride: leg lengths.
    """
    path = Path(pybullet_data.getDataPath()) / "data" / "motions" / f"humanoid3d_{clip}.txt"
    frames = np.array(json.loads(path.read_text())["Frames"])
    period = len(frames) - 1
    travel = np.linspace(0.0, frames[-1, 1] - frames[0, 1], period + 1)
    sides = {"left": (30, 34, 35, 39, 43), "right": (16, 20, 21, 25, 29)}
    tables = {
        side: np.array([_pose(f, t, columns) for f, t in zip(frames[:-1], travel, strict=False)])
        for side, columns in sides.items()
    }
    tables["right"] = _mirror(tables["right"])
    strike = int(np.argmax(tables["left"][:, 20]))
    left = _resample(np.roll(tables["left"], -strike, axis=0))
    right = _resample(np.roll(tables["right"], -strike, axis=0))
    table = 0.5 * (left + np.roll(right, -PHASES // 2, axis=0))
    rotations = table[:, :20].reshape(PHASES, 5, 4)
    rotations /= np.sqrt((rotations**2).sum(axis=2, keepdims=True))
    leg = THIGH + SHIN
    pelvis = table[:, 24:26] - (0.0, table[:, 25].mean())
    return {
        "rotations": rotations,
        "ankle": table[:, 20:22] / leg,
        "pitch": table[:, 23],
        "pelvis": pelvis / leg,
        "stride": np.float64((frames[-1, 1] - frames[0, 1]) / leg),
    }


def _pose(frame: np.ndarray, traveled: float, columns: tuple[int, ...]) -> np.ndarray:
    """Return one side's row: rotations, ankle (3) from the evenly moving pelvis, foot pitch, pelvis left and up."""
    hip, knee, ankle, shoulder, elbow = columns
    side = 1.0 if hip == 30 else -1.0
    pelvis = _turn(frame[4:8])
    chest = _times(pelvis, _turn(frame[8:12]))
    head = _times(chest, _turn(frame[12:16]))
    arm = _times(chest, _turn(frame[shoulder : shoulder + 4]))
    forearm = _times(arm, _hinge(frame[elbow]))
    thigh = _times(pelvis, _turn(frame[hip : hip + 4]))
    shin = _times(thigh, _hinge(frame[knee]))
    foot = _times(shin, _turn(frame[ankle : ankle + 4]))
    sway, up = -frame[3], frame[2]
    at = np.array([frame[1] - traveled, sway, 0.0])
    at = (
        at
        + _rotate(pelvis, (0.0, side * HIP, 0.0))
        + _rotate(thigh, (0.0, 0.0, -THIGH))
        + _rotate(shin, (0.0, 0.0, -SHIN))
    )
    toes = _rotate(foot, (1.0, 0.0, 0.0))
    quaternions = [q if q[0] >= 0 else -q for q in (pelvis, chest, head, arm, forearm)]
    return np.array([*np.concatenate(quaternions), *at, math.atan2(toes[2], toes[0]), sway, up])


def _mirror(table: np.ndarray) -> np.ndarray:
    signs = np.ones(26)
    signs[[1, 3, 5, 7, 9, 11, 13, 15, 17, 19, 21, 24]] = -1.0
    return table * signs


def _resample(table: np.ndarray) -> np.ndarray:
    """Return the periodic rows at `PHASES` phases, with `HARMONICS` harmonics."""
    spectrum = np.fft.rfft(table, axis=0)[: HARMONICS + 1] / len(table)
    angle = 2.0 * np.pi * np.outer(np.arange(PHASES) / PHASES, np.arange(HARMONICS + 1))
    wave = np.exp(1j * angle)[:, :, None] * spectrum[None]
    return wave[:, 0].real + 2.0 * wave[:, 1:].real.sum(axis=1)


def _turn(quaternion: np.ndarray) -> np.ndarray:
    w, x, y, z = quaternion
    return np.array([w, x, -z, y])


def _hinge(angle: float) -> np.ndarray:
    return np.array([math.cos(0.5 * angle), 0.0, -math.sin(0.5 * angle), 0.0])


def _times(p: np.ndarray, q: np.ndarray) -> np.ndarray:
    a, b, c, d = p
    e, f, g, h = q
    return np.array(
        [
            a * e - b * f - c * g - d * h,
            a * f + b * e + c * h - d * g,
            a * g - b * h + c * e + d * f,
            a * h + b * g - c * f + d * e,
        ]
    )


def _rotate(q: np.ndarray, vector: tuple[float, float, float]) -> np.ndarray:
    return _times(_times(q, np.array([0.0, *vector])), q * (1.0, -1.0, -1.0, -1.0))[1:]


if __name__ == "__main__":
    main()
