# mypy: disable-error-code="no-untyped-def"
"""The compiled entry: `play` begins or steps a range of worlds. Worlds share nothing, so ranges may run in threads."""

from collections.abc import Callable
from pathlib import Path

from numba import njit

from follow_env.compilation import compilable, digest
from follow_env.envs.kinematic.episode import begin, draw, measure, observe, report, step
from follow_env.envs.task import total

compilable(total)
SKIP, BEGIN, STEP = range(3)
"""What `play` does with a world."""


def _sources() -> list[Path]:
    package = Path(__file__).parents[2]
    own = [
        path
        for path in Path(__file__).parent.glob("*.py")
        if path.stem not in ("render_worlds", "pictures", "episodes")
    ]
    world = [*package.glob("world/kinematic/*.py"), *package.glob("world/motion/*.py"), package / "world/clearance.py"]
    parts = "world/clock", "world/people/dimensions", "world/robots/diff_drive", "camera/measurement"
    envs = "envs/observations", "envs/task", "envs/truth"
    return [*own, *world, *(package / f"{name}.py" for name in (*parts, *envs))]


def _compiled(sources: int) -> Callable[..., int]:
    @njit(cache=True, nogil=True, error_model="numpy")
    def play(
        first,
        last,
        todo,
        worlds,
        queues,
        tapes,
        tables,
        settings,
        place,
        actions,
        observations,
        infos,
        rewards,
        ended,
        cut,
    ):
        """Begin or step the worlds first <= i < last; return how many found no route.

        Args:
            first: of the range.
            last: of the range, exclusive.
            todo: (n,) int8, `SKIP`, `BEGIN` or `STEP` for each world.
            worlds: (n,) `records.WORLD`.
            queues: (n, longest delay, 3) float64, delayed measurements.
            tapes: (n, steps, 6) float64, given draws of the measurement's errors; read for the worlds that are `taped`.
            tables: (n, rows, 5) float64, motions: `records.TABLE_COLUMNS`; read for the worlds that are `by_table`.
            settings: (1,) `records.SETTINGS`, or (n,) if each world has its own.
            place: `Place`.
            actions: (n, 2) float64.
            observations: (n, 8) float32, out; (n, 0) if pictures are observed.
            infos: (n,) `records.INFO`, out.
            rewards: (n,) float64, out where a world steps.
            ended: (n,) bool, terminated, out where a world steps.
            cut: (n,) bool, truncated, out where a world steps.
        """
        key = sources  # noqa: F841  captured, hence part of the cache key
        failures, own = 0, 1 if len(settings) > 1 else 0
        for i in range(first, last):
            if todo[i] == SKIP:
                continue
            world, info, setting = worlds[i], infos[i], settings[own * i]
            if todo[i] == BEGIN:
                if not begin(world, setting, place, tables, i):
                    failures += 1
                info.rewards[:] = 0.0
            else:
                terms = info.rewards
                ended[i], cut[i] = step(world, setting, place, tables, i, actions[i, 0], actions[i, 1], terms)
                rewards[i] = total(terms)
            if observations.shape[1] > 0:
                measured = (False, 0.0, 0.0)
                if setting.measure:
                    draws = _taped(tapes, i, world.steps) if world.taped else draw(world, setting)
                    measured = measure(world, setting, draws)
                    if setting.delay > 0:
                        measured = _delayed(queues, i, setting.delay, world.steps, measured)
                observation = observe(world, setting, measured)
                for k in range(8):
                    observations[i, k] = observation[k]
            report(world, setting, info)
        return failures

    return play


# Inlined by force, and given whole arrays and i: numba counts references to a row of an array by atomic operations.
_inline = njit(nogil=True, error_model="numpy", forceinline=True)


@_inline
def _taped(tapes, i, steps):
    """Return the six draws of a step that were given to world i; after the last, the last again."""
    k = min(steps, tapes.shape[1] - 1)
    return tapes[i, k, 0], tapes[i, k, 1], tapes[i, k, 2], tapes[i, k, 3], tapes[i, k, 4], tapes[i, k, 5]


@_inline
def _delayed(queues, i, delay, steps, measured):
    """Put a measurement into the queue of world i; return the one that was put there `delay` steps ago."""
    k = steps % delay
    old = steps >= delay and queues[i, k, 0] > 0.0, queues[i, k, 1], queues[i, k, 2]
    queues[i, k, 0], queues[i, k, 1], queues[i, k, 2] = measured
    return old


play = _compiled(digest(_sources()))
