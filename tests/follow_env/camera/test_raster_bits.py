"""The default camera's pictures are the same bits everywhere: the golden hash."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from .. import drawing

GOLDEN = "83355e9f2639b0672c3fea40e62212fd944399a6180933887da02acc84afbf14"


@pytest.mark.parametrize("threads", [1, 2, 3])
def test_the_frames_are_the_golden_ones(threads):
    """The committed hash: a change of any bit of a picture, here or on another machine, shows."""
    assert drawing.golden(threads) == GOLDEN


def test_another_processor_gives_the_same_bits_and_compiles_once(tmp_path):
    """In a new process for a processor without vector extensions: same hash; one line about compiling, then none."""
    environment = {
        **os.environ,
        "NUMBA_CPU_NAME": "generic",
        "NUMBA_CPU_FEATURES": "",
        "NUMBA_CACHE_DIR": str(tmp_path),
        "PYTHONPATH": os.pathsep.join([str(Path(__file__).parents[3]), *sys.path]),
    }
    code = f"import runpy; print(runpy.run_path({drawing.__file__!r})['golden']())"
    for announcement in (["compiling the camera, once"], []):
        done = subprocess.run(
            [sys.executable, "-W", "error", "-c", code], env=environment, capture_output=True, text=True, timeout=300
        )
        assert done.returncode == 0, done.stderr
        assert done.stdout.split()[-1] == GOLDEN
        assert [line for line in done.stderr.splitlines() if "pybullet build" not in line] == announcement
