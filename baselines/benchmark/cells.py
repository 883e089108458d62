"""Which episodes are run: a cell is one combination of factors, and a study is a list of cells."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

PERCEPTIONS = ("truth", "emulated", "mask", "detector")
"""The rungs of Table 1, from best to real."""
PIXELS = "pixels"
"""What a policy perceives that drives straight from the picture."""
SCENES = ("corridor", "indoor")
ESTIMATORS = ("none", "kf", "akf", "akf_cv")
ENVIRONMENT_IDS = {"corridor": "follow_env/Corridor-v0", "indoor": "follow_env/Indoor-v0"}
SENSORS = {
    **{"truth": "exact", "emulated": "fitted", "mask": "six_smallest", "detector": "six_smallest"},
    PIXELS: "xtion",
}
"""The sensor at each perception unless told otherwise: for Table 1 the emulated one that is fitted to the paper's
No filter row, and the rule by which depth is read from the rendered or detected box."""
DEPTH_RULES = ("six_smallest", "grid_mean", "centroid")
"""Rules of `tracker.depth` that are compared on rendered frames."""

Q_SCALES = (0.1, 0.3, 1.0, 3.0, 10.0)
ALPHAS = (0.01, 0.05, 0.1)


@dataclass(frozen=True, slots=True)
class Cell:
    """One combination of the benchmark's factors.

    Attributes:
        perception: Where the measurement comes from: ``truth``, ``emulated``, ``mask`` or ``detector``; ``pixels`` has
            none.
        scene: ``corridor`` or ``indoor``.
        estimator: ``none``, ``kf``, ``akf`` or ``akf_cv``.
        controller: ``pi``, ``parked``, ``random``, ``oracle`` or the name of a learned agent.
        q_scale: Multiple of the process noise that the rule for Q gives.
        alpha: Significance of the adaptive filter's outlier test.
        sensor: Name of the emulated sensor, or the depth rule of ``mask`` and ``detector``; empty takes that of
            ``SENSORS``.
        walking_speed: Of the person, m/s; None is the paper's.
    """

    perception: str
    scene: str
    estimator: str
    controller: str = "pi"
    q_scale: float = 1.0
    alpha: float = 0.05
    sensor: str = ""
    walking_speed: float | None = None

    def __post_init__(self) -> None:
        for field, value, known in (
            ("perception", self.perception, (*PERCEPTIONS, PIXELS)),
            ("scene", self.scene, SCENES),
            ("estimator", self.estimator, ESTIMATORS),
        ):
            if value not in known:
                raise ValueError(f"{field} is {value!r}, but it must be one of {', '.join(known)}.")
        if not self.sensor:
            object.__setattr__(self, "sensor", SENSORS[self.perception])
        if not 0.0 < self.q_scale < float("inf"):
            raise ValueError(f"q_scale is {self.q_scale}, but a multiple of Q must be positive and finite.")
        if not 0.0 < self.alpha < 1.0:
            raise ValueError(f"alpha is {self.alpha}, but a significance must lie between 0 and 1.")

    @property
    def key(self) -> str:
        """A stable name, the same in every process and version: it identifies the cell in the store."""
        return (
            f"{self.perception}/{self.scene}/{self.estimator}/{self.controller}"
            f"/q{float(self.q_scale)!r}/a{float(self.alpha)!r}/{self.sensor}"
            + ("" if self.walking_speed is None else f"/w{self.walking_speed!r}")
        )


def table1_cells(perceptions: Iterable[str]) -> list[Cell]:
    """Cells of Table 1: every scene and estimator at each of the given perceptions, in the order of PERCEPTIONS."""
    wanted = set(perceptions)
    unknown = sorted(wanted.difference(PERCEPTIONS))
    if unknown:
        raise ValueError(f"perception is {unknown[0]!r}, but it must be one of {', '.join(PERCEPTIONS)}.")
    return [
        Cell(perception, scene, estimator)
        for perception in PERCEPTIONS
        if perception in wanted
        for scene in SCENES
        for estimator in ESTIMATORS
    ]


def sensitivity_cells() -> list[Cell]:
    """How the result moves with Q and alpha, on the emulated sensor; the No filter cell is the reference."""
    cells = []
    for scene in SCENES:
        cells.append(Cell("emulated", scene, "none"))
        cells += [Cell("emulated", scene, "kf", q_scale=scale) for scale in Q_SCALES]
        cells += [Cell("emulated", scene, "akf", q_scale=scale, alpha=alpha) for alpha in ALPHAS for scale in Q_SCALES]
    return cells


def family_cells(sensors: Iterable[str]) -> list[Cell]:
    """How the result depends on the sensor: the fitted one first, then every other of the family.

    Args:
        sensors: Names of emulated sensors that all match the paper's No filter row.
    """
    return [
        Cell("emulated", scene, estimator, sensor=sensor)
        for sensor in dict.fromkeys((SENSORS["emulated"], *sensors))
        for scene in SCENES
        for estimator in ("none", "kf", "akf")
    ]


def rule_cells() -> list[Cell]:
    """How the result depends on the rule that reads a depth from the box, on rendered frames."""
    return [
        Cell("mask", scene, estimator, sensor=rule)
        for rule in DEPTH_RULES
        for scene in SCENES
        for estimator in ("none", "kf", "akf")
    ]
