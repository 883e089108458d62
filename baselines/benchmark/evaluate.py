"""`evaluate` and `compare`: followers in a suite, each on the same seeds; `follow bench` writes what they return."""

from __future__ import annotations

import contextlib
import dataclasses
import json
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from baselines.benchmark.executors.processes import play_all
from baselines.benchmark.files import Value, write_csv, write_text
from baselines.benchmark.markdown import markdown_table
from baselines.benchmark.metrics.base import find_metric, measured
from baselines.benchmark.metrics.episode import Row
from baselines.benchmark.progress import progress
from baselines.benchmark.provenance import machine, packages, run_digest
from baselines.benchmark.statistics import Difference, Score
from baselines.benchmark.store import InputError
from baselines.benchmark.suite import Suite, find_suite
from baselines.benchmark.trace import Trace
from baselines.benchmark.trial import Trial, TrialPlayer
from baselines.followers.spec import FollowerSpec

TRACES = "traces"
CONFIG = "config.json"
EPISODES = 10
SHOWN = 4


@dataclass(frozen=True)
class Result:
    """Every episode of several followers in a suite.

    Attributes:
        suite: what was played.
        followers: who drove; the first is the reference of the differences.
        traces: (scenario, follower's number) -> its episodes in the order of the seeds.
    """

    suite: Suite
    followers: tuple[FollowerSpec, ...]
    traces: Mapping[tuple[str, int], Sequence[Trace]]

    def rows(self, metrics: Iterable[str] | None = None) -> list[dict[str, Any]]:
        """Return a row of numbers for each episode; other metrics than the suite's need no replay."""
        names = tuple(metrics or self.suite.metrics)
        return [
            {"suite": self.suite.name, "scenario": scenario, "follower": spec.name, "kind": spec.kind, **row}
            for scenario, k, spec in self._cells()
            for row in self._measured(scenario, k, names)
        ]

    def table(self, metrics: Iterable[str] | None = None) -> list[dict[str, Any]]:
        """Return a row for each scenario and follower: each metric with its 95 % interval and its paired difference.

        A metric that an episode lacks (no estimate, for example) is left empty. RMS metrics are pooled as such.
        """
        names = tuple(metrics or self.suite.metrics)
        made = []
        for scenario, k, spec in self._cells():
            line: dict[str, Any] = {"scenario": scenario, "follower": spec.name, "kind": spec.kind}
            line["episodes"] = len(self.traces[scenario, k])
            for name in names:
                mine, reference = self._score(scenario, k, name), self._score(scenario, 0, name)
                line[name] = None if mine is None else mine.value
                line[f"{name}_low"], line[f"{name}_high"] = (mine and mine.interval) or (None, None)
                difference = None if mine is None or reference is None or k == 0 else mine.minus(reference)
                line[f"{name}_minus_reference"] = None if difference is None else difference.value
                low, high = (difference and difference.interval) or (None, None)
                line[f"{name}_minus_reference_low"], line[f"{name}_minus_reference_high"] = low, high
            made.append(line)
        return made

    def difference(self, scenario: str, follower: int, metric: str) -> Difference | None:
        """Return the paired difference of a follower (by its number) to the first one; None where one has no value."""
        mine, reference = self._score(scenario, follower, metric), self._score(scenario, 0, metric)
        return None if mine is None or reference is None else mine.minus(reference)

    def markdown(self, metrics: Iterable[str] | None = None) -> str:
        """Return the table as Markdown: value and interval; in brackets the paired difference to the first follower.

        Unless others are asked for, the suite's first `SHOWN` metrics.
        """
        names = tuple(metrics or self.suite.metrics[:SHOWN])
        lines = [
            [line["scenario"], line["follower"], line["kind"], str(line["episodes"]), *(_cell(line, n) for n in names)]
            for line in self.table(names)
        ]
        units = {name: find_metric(name).unit for name in names}
        header = [f"{name} ({units[name]})" if units[name] and "_" not in name else name for name in names]
        return markdown_table(["scenario", "follower", "kind", "episodes", *header], lines, left=3)

    def _cells(self) -> Iterator[tuple[str, int, FollowerSpec]]:
        for scenario in self.suite.scenarios:
            for k, spec in enumerate(self.followers):
                yield scenario.name, k, spec

    def _measured(self, scenario: str, k: int, names: Sequence[str]) -> list[Row]:
        return [measured(trace, names) for trace in self.traces[scenario, k]]

    def _score(self, scenario: str, k: int, name: str) -> Score | None:
        rows = self._measured(scenario, k, (name,))
        if not all(isinstance(row[name], int | float) for row in rows):
            return None
        return Score.of([rows], name, find_metric(name).root_mean_square)


def evaluate(
    followers: Any,
    suite: Any,
    episodes: int = EPISODES,
    first_seed: int = 0,
    jobs: int = 1,
    kept: Path | None = None,
    **changes: Any,
) -> Result:
    """Play followers in a suite, each on the same seeds.

    Args:
        followers: one, or a list: anything that `FollowerSpec.parse` takes. The first is the reference.
        suite: a `Suite`, a registered name, or `"module:object"`.
        episodes: of each follower in each scenario.
        first_seed: the seeds are this one and the next ones.
        jobs: processes; the result does not depend on it.
        kept: folder of traces; those that it holds are not played again, and new ones are written at once.
        changes: settings of every scenario that are replaced, such as `engine="kinematic"`.

    Raises:
        ValueError: for what cannot be played: an unknown name, a follower that does not fit; before anything is played.
    """
    from baselines.followers.build import build_follower, observation_settings
    from follow_env.envs.follow import FollowEnv

    suite = find_suite(suite)
    listed = followers if isinstance(followers, list | tuple) else [followers]
    specs = tuple(FollowerSpec.parse(follower) for follower in listed)
    if not specs or episodes < 1:
        raise ValueError(f"{len(specs)} followers and {episodes} episodes are asked for; expected at least one of each")
    trials = {}
    for scenario in suite.scenarios:
        for k, spec in enumerate(specs):
            env = FollowEnv(scenario.domain(**observation_settings(spec), **changes))
            build_follower(spec, env)
            env.close()
            trials[scenario.name, k] = Trial(suite.name, scenario, spec, changes)
    for name in suite.metrics:
        find_metric(name)
    seeds = range(first_seed, first_seed + episodes)
    keys = {id(trial): trial.key for trial in trials.values()}
    wanted = {(keys[id(trial)], seed): (trial, seed) for trial in trials.values() for seed in seeds}
    done: dict[tuple[str, int], Trace] = {}
    if kept is not None:
        kept.mkdir(parents=True, exist_ok=True)
        for key, seed in wanted:
            if (file := _file(kept, key, seed)).exists():
                done[key, seed] = Trace.load(file)
    missing = [task for name, task in wanted.items() if name not in done]
    player = TrialPlayer()
    with contextlib.closing(play_all(player, missing, jobs)) as playing, contextlib.closing(player):
        for (trial, seed), trace in progress(playing, total=len(wanted), done=len(done)) if missing else ():
            key = keys[id(trial)]
            done[key, seed] = trace
            if kept is not None:
                trace.save(_file(kept, key, seed))
    return Result(suite, specs, {cell: [done[keys[id(t)], seed] for seed in seeds] for cell, t in trials.items()})


def compare(
    one: Any, other: Any, suite: Any, metric: str = "distance_tracking_rmse_m", **settings: Any
) -> dict[str, Difference]:
    """Return by scenario how much larger a metric of `one` is than that of `other`, paired on the same seeds.

    Args:
        one: a follower.
        other: the follower it is compared with.
        suite: as in `evaluate`.
        metric: a name of `METRICS`, or `"module:object"`.
        settings: further arguments of `evaluate`.
    """
    result = evaluate([other, one], suite, **settings)
    found = {scenario.name: result.difference(scenario.name, 1, metric) for scenario in result.suite.scenarios}
    lacking = [scenario for scenario, difference in found.items() if difference is None]
    if lacking:
        raise ValueError(f"{metric} has no value in some episode of {lacking[0]!r}; expected a metric that both have")
    return {scenario: difference for scenario, difference in found.items() if difference is not None}


def write(result: Result, out: Path, metrics: Sequence[str] | None, how: Mapping[str, Any]) -> str:
    """Write tables, rows and how they were made into the folder of a run, and return the Markdown table."""
    names = tuple(metrics or result.suite.metrics)
    rows, table, text = result.rows(names), result.table(names), result.markdown(metrics)
    for file, records in (("episodes.csv", rows), ("table.csv", table)):
        plain: list[dict[str, Value]] = [dict(record) for record in records]
        write_csv(out / file, list(plain[0]), plain)
    content = {
        "suite": result.suite.name,
        "scenarios": [_told(dataclasses.asdict(scenario)) for scenario in result.suite.scenarios],
        "followers": [_told(dataclasses.asdict(spec)) for spec in result.followers],
        **how,
        "metrics": list(names),
        "packages": packages(),
        "machine": machine(),
    }
    write_text(out / CONFIG, json.dumps(content, indent=1, default=str) + "\n")
    write_text(out / "table.md", f"# {result.suite.name}\n\n{result.suite.card}\n\n{text}\n")
    return text


def code_digest() -> str:
    """Return the hash of the code that plays, with the packages that compute: traces of one folder share it."""
    return run_digest({"packages": packages()})


def claim(out: Path, resume: bool, code: str) -> Path:
    """Return the folder of the traces in a results folder of our own; `code` is that of `code_digest`.

    Raises:
        InputError: if the folder holds something else, or a run that is not to be resumed.
    """
    traces = out / TRACES
    inside = [path.name for path in out.iterdir()] if out.is_dir() else []
    if inside and not traces.is_dir():
        raise InputError(f"{out} holds {inside[0]} and is no folder of `follow bench`; choose another with --out.")
    if inside and not resume:
        raise InputError(f"{out} already holds a run: go on with --resume, or choose another folder with --out.")
    try:
        traces.mkdir(parents=True, exist_ok=True)
        told = traces / "code.txt"
        if told.exists() and told.read_text(encoding="utf-8") != code:
            raise InputError(f"{out} was played by another version of the code; choose another folder with --out.")
        write_text(told, code)
    except OSError as error:
        raise InputError(f"{out} cannot be written ({error.strerror}); choose another folder with --out.") from error
    return traces


def _file(folder: Path, key: str, seed: int) -> Path:
    return folder / f"{key.replace('/', '_').replace(' ', '')}_{seed}.npz"


def _told(value: Any) -> Any:
    return json.loads(json.dumps(value, default=lambda part: f"{type(part).__module__}.{type(part).__name__}"))


def _cell(line: Mapping[str, Any], name: str) -> str:
    value, low, high = line[name], line[f"{name}_low"], line[f"{name}_high"]
    if value is None:
        return "–"
    text = f"{value:.3f}" if low is None else f"{value:.3f} ({low:.3f} to {high:.3f})"
    less = line[f"{name}_minus_reference"]
    return text if less is None else f"{text} [{less:+.3f}]"
