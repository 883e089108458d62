"""Results do not depend on the machine's vector units: a closed loop would amplify the last bit of a sine."""

import ast
import hashlib
import os
import subprocess
import sys
from pathlib import Path

import pytest

import follow_env

VECTOR_UNITS = {
    "AVX2", "FMA3", "AVX512F", "AVX512CD", "AVX512_KNL", "AVX512_KNM", "AVX512_SKX", "AVX512_CLX", "AVX512_CNL",
    "AVX512_ICL", "AVX512_SPR", "X86_V3", "X86_V4", "ASIMDHP", "ASIMDDP", "SVE", "VSX2", "VSX3", "VSX4",
}  # fmt: skip
"""What one NumPy or another calls them; those that this one does not know are left out."""
EPISODE = """
import hashlib, sys
import gymnasium, numpy as np, follow_env

def feed(digest, value):
    if isinstance(value, dict):
        for key in sorted(value):
            digest.update(key.encode())
            feed(digest, value[key])
    elif isinstance(value, np.ndarray):
        digest.update(value.dtype.str.encode() + value.tobytes())
    else:
        digest.update(repr(value).encode())

env = gymnasium.make("follow_env/Indoor-v0", obs=sys.argv[1], camera={"width": 40, "height": 30}).unwrapped
digest = hashlib.sha256()
for seed in range(int(sys.argv[2])):
    observation, info = env.reset(seed=seed)
    done = False
    while not done:
        bearing, distance = float(info["bearing"]), float(info["distance"])
        if sys.argv[1] == "measurement" and observation[2]:
            bearing, distance = float(observation[0]), float(observation[1])
        action = (min(max(1.2 * (distance - 1.2), -1.0), 1.0), min(max(0.8 * bearing, -1.0), 1.0))
        observation, reward, terminated, truncated, info = env.step(np.array(action, np.float32))
        feed(digest, observation)
        feed(digest, info)
        feed(digest, [reward, terminated, truncated])
        done = terminated or truncated
    assert info["time"] > 5.0, info
print(digest.hexdigest())
"""


def disabled():
    """The features of this NumPy that this machine has and that can be switched off."""
    from numpy._core._multiarray_umath import __cpu_dispatch__, __cpu_features__

    return [unit for unit in __cpu_dispatch__ if unit in VECTOR_UNITS and __cpu_features__.get(unit)]


def fingerprint(obs, episodes, **environment):
    """Hash of everything that the episodes returned, computed in a fresh process."""
    run = subprocess.run(
        [sys.executable, "-W", "error", "-c", EPISODE, obs, str(episodes)],
        env={**os.environ, **environment},
        capture_output=True,
        text=True,
        check=False,
    )
    assert run.returncode == 0, run.stderr
    return run.stdout.split()[-1]


@pytest.mark.parametrize(("obs", "episodes"), [("measurement", 3), ("rgbd_box", 1)])
def test_an_episode_is_the_same_on_a_machine_without_vector_units(obs, episodes):
    units = disabled()
    if not units:
        pytest.skip("this machine has no vector units that NumPy can switch off")
    plain = fingerprint(obs, episodes, NPY_DISABLE_CPU_FEATURES=" ".join(units))
    assert plain == fingerprint(obs, episodes)
    assert len(plain) == hashlib.sha256().digest_size * 2


def test_switching_vector_units_off_changes_numpy():
    """Otherwise the test above compares a thing with itself: NumPy's own exponential differs in its last bits."""
    units = disabled()
    if not any(unit.startswith(("AVX512", "X86_V4")) for unit in units):
        pytest.skip("NumPy's exponential is the same with and without this machine's vector units")
    code = (
        "import hashlib, numpy as np; print(hashlib.sha256(np.exp(np.linspace(-3.0, 3.0, 9999)).tobytes()).hexdigest())"
    )
    hashes = {
        subprocess.run(
            [sys.executable, "-W", "error", "-c", code],
            env={**os.environ, "NPY_DISABLE_CPU_FEATURES": features},
            capture_output=True,
            text=True,
            check=True,
        ).stdout
        for features in ("", " ".join(units))
    }
    assert len(hashes) == 2


def test_the_path_of_an_episode_computes_no_vectorised_transcendentals():
    """They and BLAS may differ in their last bits between machines; pictures for people and OpenGL's may use them.

    `math` and the exactly rounded operations (among them the square root) are the same everywhere.
    """
    inexact = {
        "sin", "cos", "tan", "arcsin", "arccos", "arctan", "arctan2", "sinh", "cosh", "tanh", "exp", "exp2", "expm1",
        "log", "log2", "log10", "log1p", "power", "hypot", "dot", "matmul", "inner", "vdot", "einsum", "linalg",
    }  # fmt: skip
    package, found = Path(follow_env.__file__).parent, []
    skipped = {"dashboard.py", "opengl"}
    files = [file for file in sorted(package.rglob("*.py")) if not skipped.intersection(file.parts)]
    assert len(files) > 10
    for file in files:
        for node in ast.walk(ast.parse(file.read_text(encoding="utf-8"))):
            numpys = isinstance(node, ast.Attribute) and isinstance(node.value, ast.Name) and node.value.id == "np"
            if (numpys and node.attr in inexact) or (isinstance(node, ast.BinOp) and isinstance(node.op, ast.MatMult)):
                found.append(f"{file.relative_to(package)}:{node.lineno}: {ast.unparse(node)}")
    assert found == []


def test_the_global_generators_are_neither_used_nor_moved():
    code = (
        "import random, gymnasium, numpy as np, follow_env\n"
        "random.seed(1); np.random.seed(1)\n"
        "before = random.getstate(), np.random.get_state()[1].tolist()\n"
        "env = gymnasium.make('follow_env/Corridor-v0', obs='rgbd_box', camera={'width': 32, 'height': 24}).unwrapped\n"
        "env.reset(seed=0)\n"
        "for _ in range(5): env.step(np.zeros(2, np.float32))\n"
        "assert before == (random.getstate(), np.random.get_state()[1].tolist())\n"
    )
    subprocess.run([sys.executable, "-W", "error", "-c", code], check=True, capture_output=True)
