"""Who moves where and when in an episode with a look-alike (paper A's Figures 17 and 18).

An episode, drawn from its seed and from nothing else:

1. the target is alone, moves gently at its place and is confirmed as the largest, most central person;
2. the other one enters beside the camera, comes close to the target until they stand shoulder to shoulder, and passes
   behind it to its other side or steps away and back: the tracker must stay with the target (Figure 17);
3. the other one steps between camera and target and stays: the tracker must stop after a second, and never follow the
   other person (Figure 18).
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.random import Generator

from baselines.papers.zhang2018.stage import CAMERA, PERIOD
from follow_env.world.people.bodies import SUITS, load_body
from follow_env.world.people.mesh import Placed
from follow_env.world.people.walker import Walker

TARGET, OTHER = 1, 2
"""Ids of the two."""
ADULTS = ("man", "man_tall", "man_heavy", "woman", "woman_slim", "woman_old")
POSTURES = ("walk", "bent", "arms_raised")
"""Of the target: standing or stepping about, bent over its work, arms raised."""
REACH = 0.5
"""So much farther a bent body reaches forward, m; the other one keeps clear of it, as nobody walks through anybody."""


@dataclass(frozen=True)
class Script:
    """What an episode shows; lengths m, times s, angles rad.

    Attributes:
        suit, body, posture: Of the target; the other one wears the same suit and has the same body, but walks.
        distance: Of the target from the camera.
        left: Where the target is beside the line of sight.
        heading: Of the target, and of the other one when it stands.
        sway: Amplitude, period and phase of the target's movement forward and to the left.
        gap: Between the two when close.
        passes_behind: Whether the other one passes behind the target; else it steps away and back.
        step_in: How far before the target the other one stays in the end.
        keys: Of the other one's way: (time, how much farther than the target, how far to its left), as the camera
            sees it. The last four: it leaves the target's side, is before it, has stepped in, and the episode ends.
    """

    suit: str
    body: str
    posture: str
    distance: float
    left: float
    heading: float
    sway: tuple[tuple[float, float, float], tuple[float, float, float]]
    gap: float
    passes_behind: bool
    step_in: float
    keys: tuple[tuple[float, float, float], ...]

    @property
    def step_in_time(self) -> float:
        """When the other one leaves the target's side for the last time."""
        return self.keys[-4][0]

    def target(self, time: float) -> tuple[float, float]:
        """Return where the target is, (forward, left) of the camera."""
        forward, left = (size * math.sin(2.0 * math.pi * time / period + phase) for size, period, phase in self.sway)
        return self.distance + forward, self.left + left

    def other(self, time: float) -> tuple[float, float]:
        """Return where the other one is, (forward, left) of the camera; it goes from key to key and rests at each."""
        x, y = self.target(time)
        range_ = math.hypot(x, y)
        start, end = next((pair for pair in pairwise(self.keys) if time <= pair[1][0]), (self.keys[-1],) * 2)
        share = min(max((time - start[0]) / max(end[0] - start[0], 1e-9), 0.0), 1.0)
        share *= share * (3.0 - 2.0 * share)
        farther, left = (a + share * (b - a) for a, b in zip(start[1:], end[1:], strict=True))
        return x + (farther * x - left * y) / range_, y + (farther * y + left * x) / range_


def draw_script(seed: int) -> Script:
    """Return what the episode of a seed shows.

    Raises:
        ValueError: If the seed is no whole number from 0.
    """
    if not isinstance(seed, int) or seed < 0:
        raise ValueError(f"seed is {seed!r}; expected a whole number from 0")
    rng = np.random.default_rng(seed)
    posture = _choice(rng, POSTURES)
    away = bool(rng.random() < 0.3)
    reach = REACH if posture == "bent" else 0.0
    turned = _between(rng, -0.6, 0.6) if posture != "bent" else _between(rng, -0.2, 0.2)
    distance, gap, step_in = _between(rng, 2.2, 3.2), _between(rng, 0.5, 0.7), _between(rng, 0.7, 1.1)
    step_in, behind = (step_in, 0.55 + reach) if away else (step_in + reach, 0.55)
    side, passes_behind = -1.0 if rng.random() < 0.5 else 1.0, bool(rng.random() < 0.5)
    if passes_behind:
        leg = [(behind, side * gap), (behind, -side * gap), (0.0, -side * gap)]
    else:
        leg = [(0.0, side * (gap + 0.45)), (0.0, side * gap)]
    stops = [
        ((0.6 - distance, side * 1.1), 0.0),
        ((0.0, side * (gap + 0.45)), 0.0),
        ((0.0, side * gap), _between(rng, 1.0, 3.0)),
        *((place, 0.0) for place in leg[:-1]),
        (leg[-1], _between(rng, 0.5, 2.0)),
        ((-step_in, leg[-1][1]), 0.0),
        ((-step_in, _between(rng, -0.05, 0.05)), 3.0),
    ]
    keys = _timed(stops, _between(rng, 3.0, 4.0), _between(rng, 0.4, 0.9))
    return Script(
        suit=_choice(rng, tuple(SUITS)),
        body=_choice(rng, ADULTS),
        posture=posture,
        distance=distance,
        left=_between(rng, -0.25, 0.25),
        heading=(0.0 if away else math.pi) + turned,
        sway=(_sway(rng), _sway(rng)),
        gap=gap,
        passes_behind=passes_behind,
        step_in=step_in,
        keys=tuple(keys),
    )


class Cast:
    """The two people of a script, who move on from frame to frame."""

    def __init__(self, script: Script) -> None:
        body = load_body(script.body, SUITS[script.suit], "high")
        self._script = script
        self._target = _Mover(Walker(body, TARGET), script.posture, script.heading)
        self._other = _Mover(Walker(body, OTHER), "walk", script.heading)

    def people(self, time: float) -> list[Placed]:
        """Return who is there in the next processed frame, at `time` s."""
        people = [self._target.go(self._script.target(time), turns=False)]
        if time >= self._script.keys[0][0]:
            people.append(self._other.go(self._script.other(time)))
        return people


class _Mover:
    """Moves a walker from place to place: its gait is that of its speed, it turns into its way and back at rest."""

    TURN = 3.0 * PERIOD
    MOVING = 0.2

    def __init__(self, walker: Walker, posture: str, heading: float) -> None:
        self._walker, self._posture, self._rest = walker, posture, heading
        self._heading, self._walked = heading, 0.0
        self._place: tuple[float, float] | None = None

    def go(self, place: tuple[float, float], turns: bool = True) -> Placed:
        """Return the person at the next frame's place, (forward, left) of the camera."""
        x, y = self._place or place
        step = math.dist((x, y), place)
        goal = self._rest
        if turns and step > self.MOVING * PERIOD:
            goal = math.atan2(place[1] - y, place[0] - x)
        off = math.remainder(goal - self._heading, 2.0 * math.pi)
        self._heading += min(max(off, -self.TURN), self.TURN)
        self._walked += step
        self._place = place
        where = CAMERA.x + place[0], CAMERA.y + place[1]
        return self._walker.place(*where, self._heading, self._walked, step / PERIOD, self._posture)


def _between(rng: Generator, low: float, high: float) -> float:
    return float(rng.uniform(low, high))


def _choice(rng: Generator, names: Sequence[str]) -> str:
    return names[int(rng.integers(len(names)))]


def _sway(rng: Generator) -> tuple[float, float, float]:
    return _between(rng, 0.05, 0.20), _between(rng, 5.0, 9.0), _between(rng, 0.0, 2.0 * math.pi)


def _timed(
    stops: Iterable[tuple[tuple[float, float], float]], time: float, speed: float
) -> Iterator[tuple[float, float, float]]:
    """Yield the keys of a way through places at each of which one waits; `speed` is the highest, 1.5 times the mean."""
    last = None
    for place, wait in stops:
        if last is not None:
            time += 1.5 * math.dist(last, place) / speed
        yield time, *place
        if wait > 0.0:
            time += wait
            yield time, *place
        last = place
