"""Draw docs/learning.png from the trainings under a folder: held-out errors against steps, the reference beside them.

Run from the repository's root: `python tools/learning_curves.py results/learned`.
"""

import math
import sys
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

from baselines.benchmark.build import cell_of, driver, environment
from baselines.benchmark.cells import SCENES
from baselines.benchmark.player import play
from baselines.learned.evaluation import HELD_SEEDS
from baselines.learned.training import read_curve

PANELS = (
    ("distance_tracking_rmse_m", "distance RMSE (cm)", 100.0, (1.0, 1000.0)),
    ("angle_tracking_rmse_rad", "bearing RMSE (mrad)", 1000.0, (10.0, 200.0)),
)
LOOKS = {
    "ppo": ("#0072B2", "o"),
    "ppo_estimate": ("#56B4E9", "s"),
    "recurrent_ppo": ("#009E73", "^"),
    "sac": ("#D55E00", "D"),
    "ppo_pixels": ("#CC79A7", "v"),
}


def main(folder: Path, picture: Path) -> None:
    """Draw every training in the folder's subfolders RECIPE-SEED."""
    trainings: dict[str, list[list[dict[str, float]]]] = {}
    for path in sorted(folder.iterdir()):
        if (path / "curve.csv").is_file():
            trainings.setdefault(path.name.rpartition("-")[0], []).append(read_curve(path))
    reference = reference_errors()
    figure, axes = plt.subplots(1, len(PANELS), figsize=(10.0, 4.0), layout="constrained")
    for panel, (key, label, scale, limits) in zip(axes, PANELS, strict=True):
        for recipe, curves in trainings.items():
            color, marker = LOOKS[recipe]
            for number, curve in enumerate(curves):
                steps = [leg["steps"] / 1e6 for leg in curve]
                errors = [scale * leg[key] for leg in curve]
                name = f"{recipe} ({len(curves)})" if number == 0 else None
                panel.plot(steps, errors, color=color, marker=marker, markersize=4, linewidth=1.2, label=name)
        panel.axhline(scale * reference[key], color="black", linestyle="--", label="AKF + PI")
        panel.set(xscale="log", yscale="log", ylim=limits, xlabel="steps (millions)", ylabel=label)
        for axis in (panel.xaxis, panel.yaxis):
            axis.set_major_formatter(lambda value, _: f"{value:g}")
        panel.grid(color="#e6e6e6")
    axes[0].legend(frameon=False, fontsize=8)
    figure.suptitle("Held-out episodes in PyBullet after each leg of training, both scenes")
    figure.savefig(picture, dpi=120)


def reference_errors() -> dict[str, float]:
    """Return the errors of the paper's follower on the held-out seeds."""
    rows = []
    for scene in SCENES:
        cell = cell_of("akf", scene)
        env = environment(cell)
        rows += [play(env, driver(cell), cell, seed).row for seed in HELD_SEEDS]
        env.close()
    return {key: math.sqrt(float(np.mean([float(str(row[key])) ** 2 for row in rows]))) for key, *_ in PANELS}


if __name__ == "__main__":
    main(Path(sys.argv[1]), Path("docs/learning.png"))
