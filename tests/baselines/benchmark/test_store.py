"""The store: what was added is there exactly, whatever happens to the process, and a strange file is never touched."""

import os
import random
import signal
import sqlite3
import subprocess
import sys
import tempfile
import threading
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from baselines.benchmark.cells import Cell
from baselines.benchmark.player import Episode, Timing
from baselines.benchmark.store import FILE_NAME, InputError, Store

ROOT = Path(__file__).resolve().parents[3]
CELL = Cell("emulated", "indoor", "akf")


def episode(seed: int) -> Episode:
    generator = np.random.default_rng(seed)
    row = {"scene": "indoor", "seed": seed, "angle_rmse_rad": float(generator.normal()), "path_ratio": None}
    return Episode(row, generator.normal(size=(400, 3)).cumsum(axis=0), Timing(1e-4, 2e-4, 3e-4, 4e-5))


def fill(folder: Path, count: int) -> None:
    with Store(folder, "abc") as store:
        for seed in range(count):
            store.add(CELL, seed, episode(seed))


def test_an_episode_comes_back_bit_for_bit(tmp_path: Path) -> None:
    fill(tmp_path, 3)
    with Store(tmp_path, "abc") as store:
        assert store.finished() == {(CELL.key, seed) for seed in range(3)}
        for seed in range(3):
            back, original = store.episode(CELL, seed), episode(seed)
            assert (back.row, back.timing) == (original.row, original.timing)
            assert list(back.row) == list(original.row)
            assert back.curve.tobytes() == original.curve.tobytes()
        with pytest.raises(KeyError, match="seed 3"):
            store.episode(CELL, 3)


def test_the_same_episode_counts_once_and_the_first_stays(tmp_path: Path) -> None:
    with Store(tmp_path, "abc") as store:
        store.add(CELL, 0, episode(0))
        store.add(CELL, 0, episode(1))
        assert len(store) == 1
        assert store.episode(CELL, 0).row == episode(0).row


def test_several_writers_lose_and_double_nothing(tmp_path: Path) -> None:
    start = threading.Barrier(4)
    failures = []

    def write(offset: int) -> None:
        try:
            start.wait()
            with Store(tmp_path, "abc") as store:
                for seed in range(offset, offset + 20):
                    store.add(CELL, seed, episode(seed))
        except Exception as error:
            failures.append(error)

    writers = [threading.Thread(target=write, args=(10 * number,)) for number in range(4)]
    for writer in writers:
        writer.start()
    for writer in writers:
        writer.join()
    assert failures == []
    with Store(tmp_path, "abc") as store:
        assert store.finished() == {(CELL.key, seed) for seed in range(50)}


def test_a_killed_writer_loses_nothing_that_it_had_finished(tmp_path: Path) -> None:
    script = (
        "import sys; sys.path.insert(0, sys.argv[2]); from pathlib import Path; from test_store import *\n"
        "with Store(Path(sys.argv[1]), 'abc') as store:\n"
        "    for seed in range(len(store), 10**6):\n"
        "        store.add(CELL, seed, episode(seed)); print(seed, flush=True)\n"
    )
    generator = random.Random(0)
    told = -1
    for _ in range(4):
        command = [sys.executable, "-c", script, str(tmp_path), str(Path(__file__).parent)]
        environment = {**os.environ, "PYTHONPATH": str(ROOT)}
        with subprocess.Popen(command, stdout=subprocess.PIPE, text=True, env=environment) as writer:
            assert writer.stdout is not None
            for _ in range(generator.randrange(5, 60)):
                told = int(writer.stdout.readline())
            writer.send_signal(signal.SIGKILL)
            told = max([told, *(int(line) for line in writer.stdout)])
        with Store(tmp_path, "abc") as store:
            assert len(store) in (told + 1, told + 2)
            assert store.finished() == {(CELL.key, seed) for seed in range(len(store))}


def test_another_configuration_is_refused_and_nothing_changes(tmp_path: Path) -> None:
    fill(tmp_path, 2)
    before = (tmp_path / FILE_NAME).read_bytes()
    with pytest.raises(InputError, match=r"2 episodes of another configuration .*--out"):
        Store(tmp_path, "other")
    assert (tmp_path / FILE_NAME).read_bytes() == before


def test_a_store_without_episodes_takes_a_new_configuration(tmp_path: Path) -> None:
    fill(tmp_path, 0)
    with Store(tmp_path, "other") as store:
        store.add(CELL, 0, episode(0))
    with pytest.raises(InputError, match="another configuration"):
        Store(tmp_path, "abc")


def overwrite_header(content: bytearray) -> None:
    content[:64] = b"x" * 64


def cut_in_half(content: bytearray) -> None:
    del content[len(content) // 2 :]


def clear_a_page(content: bytearray) -> None:
    content[8192:12288] = bytes(4096)


def flip_a_bit_of_a_curve(content: bytearray) -> None:
    content[-100] ^= 1


def break_the_text(content: bytearray) -> None:
    content[content.index(b"angle_rmse_rad")] = 0xFF


@pytest.mark.parametrize("damage", [overwrite_header, cut_in_half, clear_a_page, flip_a_bit_of_a_curve, break_the_text])
def test_a_damaged_file_is_one_sentence_and_left_as_it_is(tmp_path: Path, damage) -> None:
    fill(tmp_path, 10)
    path = tmp_path / FILE_NAME
    content = bytearray(path.read_bytes())
    damage(content)
    path.write_bytes(content)
    with pytest.raises(InputError, match=r"^\S+ is damaged \(.+\); it was left as it is: .*--out\.$") as caught:
        Store(tmp_path, "abc")
    assert "\n" not in str(caught.value)
    assert path.read_bytes() == content
    assert [entry.name for entry in tmp_path.iterdir()] == [FILE_NAME]


def test_the_database_of_another_program_is_refused(tmp_path: Path) -> None:
    path = tmp_path / FILE_NAME
    with sqlite3.connect(path) as other:
        other.execute("CREATE TABLE songs (title TEXT)")
    other.close()
    before = path.read_bytes()
    with pytest.raises(InputError, match="another program"):
        Store(tmp_path, "abc")
    assert path.read_bytes() == before


@pytest.fixture
def locked_folder() -> Iterator[Path]:
    """A folder with a store in which this process may not write; as root that needs another user's eyes."""
    root = os.geteuid() == 0
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        fill(folder, 2)
        folder.chmod(0o555)
        (folder / FILE_NAME).chmod(0o444)
        if root:
            os.seteuid(65534)
        try:
            yield folder
        finally:
            if root:
                os.seteuid(0)
            folder.chmod(0o755)


def test_a_store_that_cannot_be_written_says_so_before_any_work(locked_folder: Path) -> None:
    with pytest.raises(InputError, match=r"cannot be used \(.*readonly.*\): make the folder writable"):
        Store(locked_folder, "abc")


def test_a_store_cannot_be_made_where_nothing_may_be_written(locked_folder: Path) -> None:
    with pytest.raises(InputError, match=r"cannot be used \(unable to open"):
        Store(locked_folder / "missing", "abc")
