"""Running a plan: claim a folder, play what is missing, keep each episode, end cleanly on Ctrl-C."""

from __future__ import annotations

import contextlib
import math
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path

from baselines.benchmark import store
from baselines.benchmark.cells import Cell
from baselines.benchmark.executors.processes import Kind, play_all
from baselines.benchmark.files import Value, write_csv, write_text
from baselines.benchmark.markdown import markdown_table
from baselines.benchmark.metrics.episode import Row
from baselines.benchmark.player import Episode, EpisodeFunction
from baselines.benchmark.progress import progress
from baselines.benchmark.store import InputError, Packable, Store

CONFIG = "config.json"
_RESULTS = (CONFIG, "table1.csv", "table1.md", "followers.csv", "followers.md", "astronaut.md", "episodes.csv")
_TIMING_COLUMNS = (
    *("cell", "seed", "policy_step_mean_s", "policy_step_p95_s"),
    *("environment_step_mean_s", "metrics_step_mean_s"),
)


Played = Mapping[Cell, Sequence[Episode]]
"""Episodes of each cell in the order of their seeds, which begin at 0."""


class Interrupted(KeyboardInterrupt):
    """The user stopped the run; the message says what was kept and how to go on."""


def run(
    tasks: Sequence[tuple[Cell, int]],
    digest: str,
    config: str,
    episode: EpisodeFunction,
    write: Callable[[Store], tuple[str, Played]],
    out: Path,
    jobs: int,
    resume: bool,
) -> str:
    """Play the episodes that the folder lacks, then write every result into it; see `complete`.

    Args:
        tasks: Cells and seeds, each once.
        digest: Hash of all that episodes in one folder must share.
        config: Text of ``config.json``.
        episode: Plays one cell and seed; picklable when several jobs are used.
        write: Writes tables and figures from the finished episodes; returns the report and the episodes of its table,
            whose costs `timing.csv` and `timing.md` then hold.
        out: Results folder.
        jobs: Number of processes.
        resume: Whether to go on with what the folder holds.
    """

    def write_all(episodes: Store, done: str) -> str:
        text, table = write(episodes)
        _write_timing(out, table, done)
        return text

    return complete(tasks, digest, config, episode, write_all, out, jobs, resume)


def complete(
    tasks: Sequence[tuple[Kind, int]],
    digest: str,
    config: str,
    play: Callable[[Kind, int], Packable],
    write: Callable[[Store, str], str],
    out: Path,
    jobs: int,
    resume: bool,
) -> str:
    """Play the tasks that the folder lacks, keep each, then write every result.

    Args:
        tasks: What to play and the seed, each pair once.
        digest: Hash of all that results in one folder must share.
        config: Text of ``config.json``.
        play: Plays one task; picklable when several jobs are used.
        write: Writes everything from the finished tasks, given a sentence that says what playing them took; returns
            the report.
        out: Results folder; made when missing.
        jobs: Number of processes. The results do not depend on it.
        resume: Whether to go on with the episodes that the folder already holds.

    Returns:
        The report.

    Raises:
        InputError: If the folder cannot be used; nothing in it has changed.
        EpisodeError: If an episode fails; the finished ones are kept.
        Interrupted: On Ctrl-C; the finished episodes are kept.
    """
    _claim(out)
    with Store(out, digest) as episodes:
        if len(episodes) and not resume:
            raise InputError(
                f"{out} already holds {len(episodes)} episodes of this configuration: "
                "go on with --resume, or choose another folder with --out."
            )
        try:
            with _writable(out):
                write_text(out / CONFIG, config)
            began, missing = time.perf_counter(), len(_missing(tasks, episodes))
            _play_missing(tasks, play, episodes, jobs)
            spent = time.perf_counter() - began
            with _writable(out):
                done = f"{missing} episodes played in {spent:.0f} s by {jobs} process{'es' if jobs > 1 else ''}."
                return write(episodes, done)
        except KeyboardInterrupt:
            kept = len(tasks) - len(_missing(tasks, episodes))
            raise Interrupted(
                f"interrupted: {kept} of {len(tasks)} episodes are kept in {out}; "
                "the same command with --resume goes on."
            ) from None


def rows(played: Played) -> list[Row]:
    """The episodes' rows in the order of the cells."""
    return [episode.row for group in played.values() for episode in group]


def _write_timing(out: Path, played: Played, done: str) -> None:
    """Write what each episode cost, and the mean cost of a step by stage."""
    records: list[dict[str, Value]] = []
    stages: dict[tuple[str, str], list[tuple[float, float, float]]] = {}
    for cell, group in played.items():
        stages.setdefault((cell.perception, cell.controller), []).extend(
            (one.timing.environment, one.timing.mean, one.timing.metrics) for one in group
        )
        for seed, one in enumerate(group):
            timing = (one.timing.mean, one.timing.p95, one.timing.environment, one.timing.metrics)
            records.append(dict(zip(_TIMING_COLUMNS, (cell.key, seed, *timing), strict=True)))
    write_csv(out / "timing.csv", _TIMING_COLUMNS, records)
    lines = [
        [*key, *(f"{1e3 * math.fsum(one[k] for one in costs) / len(costs):.3f}" for k in range(3))]
        for key, costs in stages.items()
    ]
    header = ["perception", "policy", "environment (ms)", "policy (ms)", "metrics (ms)"]
    text = "Mean cost of a step, by the wall clock of the processes that shared the machine:"
    write_text(out / "timing.md", f"{done}\n\n{text}\n\n{markdown_table(header, lines, left=2)}\n")


def _claim(out: Path) -> None:
    """Make the folder, and refuse one whose results would be lost."""
    with _writable(out):
        out.mkdir(parents=True, exist_ok=True)
        results = [name for name in _RESULTS if (out / name).exists()]
        path = out / store.FILE_NAME
        stored = path.exists() and path.stat().st_size > 0
    if results and not stored:
        raise InputError(
            f"{out} holds {results[0]} but not the episodes it was made from ({store.FILE_NAME}), so it would be lost: "
            "choose another folder with --out."
        )


@contextlib.contextmanager
def _writable(out: Path) -> Iterator[None]:
    """Turn the system's refusals into sentences with a remedy."""
    try:
        yield
    except OSError as error:
        raise InputError(
            f"{out} cannot be written ({error.strerror or error}): make it a writable folder on a disk with space, "
            "or choose another with --out."
        ) from error


def _play_missing(
    tasks: Sequence[tuple[Kind, int]], play: Callable[[Kind, int], Packable], episodes: Store, jobs: int
) -> None:
    missing = _missing(tasks, episodes)
    if missing:
        with contextlib.closing(play_all(play, missing, jobs)) as playing:
            for (cell, seed), result in progress(playing, total=len(tasks), done=len(tasks) - len(missing)):
                episodes.add(cell, seed, result)


def _missing(tasks: Sequence[tuple[Kind, int]], episodes: Store) -> list[tuple[Kind, int]]:
    finished = episodes.finished()
    return [(cell, seed) for cell, seed in tasks if (cell.key, seed) not in finished]
