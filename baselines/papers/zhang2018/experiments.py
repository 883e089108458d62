"""Paper A's experiments as parts that can be played one by one: what each plays, keeps and writes."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from baselines.benchmark.files import Value
from baselines.papers.zhang2018 import lookalike, rectangle, table2
from baselines.papers.zhang2018.sequences import POSTURES
from baselines.papers.zhang2018.sequences import Sequence as Film
from baselines.papers.zhang2018.table2 import OURS
from tracker.person_tracker import Detector

Row = Mapping[str, Value]
Detectors = Mapping[str, Detector]

EPISODES = 200
"""Episodes with a look-alike; with fewer, the sequences of Table 2 are cut in the same proportion."""
PERCEPTIONS = ("mask", "detector")
"""Perfect boxes, so that the tracker's errors stand alone, and those of our net."""


@dataclass(frozen=True)
class Part:
    """What is played, with a seed: a sequence (the seed is the posture's number), a walk, or the look-alikes."""

    experiment: str
    name: str

    @property
    def key(self) -> str:
        """Identifies the part in the store."""
        return f"{self.experiment}/{self.name}"


@dataclass(frozen=True)
class Rows:
    """The rows of a finished part."""

    rows: Sequence[Row]

    def pack(self) -> tuple[str, bytes, str]:
        """As the store keeps them; they have no curve and no timing."""
        return json.dumps(self.rows, allow_nan=False), b"", ""

    @classmethod
    def unpack(cls, row: str, curve: bytes, timing: str) -> Rows:
        """The rows that were packed."""
        return cls(json.loads(row))


@dataclass(frozen=True)
class Experiment:
    """An experiment of the paper.

    Attributes:
        title: Of its section in the report.
        columns: Of its raw rows.
        picture: Name of the file of its picture.
        parts: Parts and seeds for a number of look-alike episodes.
        play: Returns the rows of a part's name and seed.
        show: Draws the picture and returns the section's text, both from all rows.
    """

    title: str
    columns: Sequence[str]
    picture: str
    parts: Callable[[int], Iterable[tuple[str, int]]]
    play: Callable[[str, int, Detectors], Sequence[Row]]
    show: Callable[[Sequence[Row], Detectors, Path], str]


@dataclass(frozen=True)
class Player:
    """Plays parts with the same detectors; a worker process gets a copy."""

    detectors: Detectors

    def __call__(self, part: Part, seed: int) -> Rows:
        """Play a part; its rows depend on nothing else."""
        return Rows(EXPERIMENTS[part.experiment].play(part.name, seed, self.detectors))


def tasks(experiment: str, episodes: int) -> list[tuple[Part, int]]:
    """Return the parts and seeds of an experiment."""
    return [(Part(experiment, name), seed) for name, seed in EXPERIMENTS[experiment].parts(episodes)]


def _table2_parts(episodes: int) -> list[tuple[str, int]]:
    films = table2.films(min(1.0, episodes / EPISODES))
    return [(f"{film.suit}/{film.view}/{film.frames}", k) for film in films for k in range(len(POSTURES))]


def _table2_play(name: str, seed: int, detectors: Detectors) -> Sequence[Row]:
    suit, view, frames = name.split("/")
    return table2.detect(Film(suit, int(view), int(frames)), seed, detectors)


def _table2_show(rows: Sequence[Row], detectors: Detectors, picture: Path) -> str:
    table2.draw(detectors[OURS], picture)
    return (
        f"{table2.table(table2.records(rows))}\n\n"
        "All nets saw the same pictures. The paper's subjects, cabin and weights are not public: its figures are no "
        "target;\nwhat can be compared is which net misses less.\n\n"
        "### By posture\n\nAll sequences together; the paper could not test the headstand.\n\n"
        f"{table2.by_posture(rows)}"
    )


def _rectangle_parts(episodes: int) -> list[tuple[str, int]]:
    return [(f"{perception}/{posture}", 0) for perception in PERCEPTIONS for posture in rectangle.POSTURES]


def _rectangle_play(name: str, seed: int, detectors: Detectors) -> Sequence[Row]:
    perception, _, posture = name.partition("/")
    return rectangle.play(posture, _detector(perception, detectors)).rows


def _rectangle_show(rows: Sequence[Row], detectors: Detectors, picture: Path) -> str:
    rectangle.draw([row for row in rows if row["perception"] == "detector"], picture)
    return rectangle.table(rows).strip()


def _lookalike_parts(episodes: int) -> list[tuple[str, int]]:
    return [(perception, seed) for perception in PERCEPTIONS for seed in range(episodes)]


def _lookalike_play(name: str, seed: int, detectors: Detectors) -> Sequence[Row]:
    return [lookalike.play(seed, _detector(name, detectors))]


def _lookalike_show(rows: Sequence[Row], detectors: Detectors, picture: Path) -> str:
    lookalike.draw(detectors[OURS], picture)
    return lookalike.table(rows).strip()


def _detector(perception: str, detectors: Detectors) -> Detector | None:
    return None if perception == "mask" else detectors[OURS]


EXPERIMENTS = {
    "table2": Experiment(
        "Table 2: detecting a person in every posture",
        table2.COLUMNS,
        "figure11.png",
        _table2_parts,
        _table2_play,
        _table2_show,
    ),
    "rectangle": Experiment(
        "Experiment 1: around a rectangle in five postures (Figure 16)",
        rectangle.COLUMNS,
        "figure16.png",
        _rectangle_parts,
        _rectangle_play,
        _rectangle_show,
    ),
    "lookalike": Experiment(
        "Experiment 2: a second person in the same clothes (Figures 17 and 18)",
        lookalike.COLUMNS,
        "figures17_18.png",
        _lookalike_parts,
        _lookalike_play,
        _lookalike_show,
    ),
}
"""By name; Table 3 is no experiment of this kind, as times do not come back."""
