"""Does the wheel work in an empty environment? Builds it, installs it beside nothing else, and plays an episode.

Usage:
    python tools/check_wheel.py [PYTHON ...] [--without-pybullet]

Each PYTHON (default: the one that runs this) gets a virtual environment of its own in a temporary folder, with the
wheel and its core dependencies: the versions of constraints.txt, save what has no wheel there. The digests that are
printed are those of the observations: every Python should print the same. The exit code is 1 if any check fails.
"""

from __future__ import annotations

import argparse
import re
import subprocess
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
EXTRAS = ("matplotlib", "torch", "tqdm", "stable_baselines3")
"""What the core must work without."""

IMPORTS = f"""
import importlib.util, sys
import follow_env, tracker, baselines
loaded = {{"cv2", "matplotlib", "numba", "pybullet", "pydantic", "torch"}} & set(sys.modules)
assert not loaded, f"importing loaded {{loaded}}"
there = [name for name in {EXTRAS!r} if importlib.util.find_spec(name)]
assert not there, f"the core brought {{there}}"
print("imports are light")
"""

EPISODE = """
import hashlib, sys
import gymnasium as gym
import follow_env
from baselines import build_follower
env = gym.make("follow_env/Corridor-v0", engine=sys.argv[1])
policy = build_follower("akf+pi", env)
observation, info = env.reset(seed=0)
state, over, total, steps, seen = None, False, 0.0, 0, hashlib.sha256()
while not over:
    action, state = policy.predict(observation, state)
    observation, reward, terminated, truncated, info = env.step(action)
    seen.update(observation.tobytes())
    over, total, steps = terminated or truncated, total + reward, steps + 1
env.close()
assert steps > 100 and total > 0.0, (steps, total)
print(f"{sys.argv[1]}: {steps} steps, return {total!r}, observations {seen.hexdigest()[:16]}")
"""

BATCH = """
import hashlib
import numpy as np
import gymnasium as gym
import follow_env
envs = gym.make_vec("follow_env/Corridor-v0", num_envs=8)
envs.reset(seed=0)
ended, seen = np.zeros(8, bool), hashlib.sha256()
for _ in range(450):
    observations, rewards, terminated, truncated, _ = envs.step(np.full((8, 2), 0.3, np.float32))
    seen.update(observations.tobytes())
    ended |= terminated | truncated
envs.close()
assert ended.all(), ended
print(f"batch: every world ended, observations {seen.hexdigest()[:16]}")
"""

PICTURES = """
import hashlib
import gymnasium as gym
import follow_env
env = gym.make("follow_env/Indoor-v0", engine="kinematic", obs="rgbd_uint8")
observation, _ = env.reset(seed=0)
for _ in range(5):
    observation, *_ = env.step(env.action_space.high)
env.close()
seen = hashlib.sha256(b"".join(observation[key].tobytes() for key in sorted(observation))
                      if isinstance(observation, dict) else observation.tobytes())
print(f"pictures: {seen.hexdigest()[:16]}")
"""

MISSING = """
from follow_env.envs.follow import FollowEnv
try:
    FollowEnv(engine="bullet").reset(seed=0)
except ImportError as error:
    assert "kinematic" in str(error), error
    print(f"without PyBullet: {error}")
else:
    raise AssertionError("engine='bullet' was made without PyBullet")
"""


def main() -> int:
    """Check the wheel on every Python that the command line names."""
    parser = argparse.ArgumentParser(description="Build the wheel, install it into an empty environment, play.")
    parser.add_argument("pythons", nargs="*", default=[sys.executable], metavar="PYTHON")
    parser.add_argument("--without-pybullet", action="store_true", help="remove PyBullet where it was installed")
    parsed = parser.parse_args()
    failed = []
    with tempfile.TemporaryDirectory() as folder:
        wheel = build(Path(folder))
        for number, python in enumerate(parsed.pythons):
            print(f"== {python}: {run([python, '--version']).strip()}", flush=True)
            try:
                check(python, wheel, Path(folder, f"venv{number}"), parsed.without_pybullet)
            except subprocess.CalledProcessError as error:
                failed.append(python)
                print(f"FAILED: {' '.join(map(str, error.cmd))[:200]}\n{error.stdout}{error.stderr}", flush=True)
    print(f"failed on {', '.join(failed)}" if failed else "all checks passed")
    return bool(failed)


def build(folder: Path) -> Path:
    """Return the wheel of the committed and uncommitted files that git knows or would add."""
    source = folder / "source"
    listed = run(["git", "ls-files", "--cached", "--others", "--exclude-standard", "-z"], cwd=ROOT).split("\0")
    for name in filter(None, listed):
        if (ROOT / name).is_file():
            (source / name).parent.mkdir(parents=True, exist_ok=True)
            (source / name).write_bytes((ROOT / name).read_bytes())
    run([sys.executable, "-m", "pip", "wheel", "-q", "--no-deps", "-w", folder, source])
    (wheel,) = folder.glob("*.whl")
    print(f"built {wheel.name}, {wheel.stat().st_size / 1e6:.1f} MB", flush=True)
    return wheel


def check(python: str, wheel: Path, venv: Path, without_pybullet: bool) -> None:
    """Install the wheel into an empty environment and run every check; raises CalledProcessError where one fails."""
    run([python, "-m", "venv", venv])
    inside = str(venv / "bin" / "python")
    constraints = venv / "constraints.txt"
    constraints.write_text((ROOT / "constraints.txt").read_text(encoding="utf-8"), encoding="utf-8")
    pip = [inside, "-m", "pip", "install", "-q", "--disable-pip-version-check"]
    while True:
        try:
            run([*pip, "-c", constraints, "--only-binary", ":all:", wheel])
            break
        except subprocess.CalledProcessError as error:
            unfit = re.search(r"No matching distribution found for ([\w.-]+)", error.stderr)
            kept = constraints.read_text(encoding="utf-8").splitlines(keepends=True)
            fewer = [line for line in kept if unfit is None or not line.lower().startswith(f"{unfit[1].lower()}==")]
            if len(fewer) == len(kept):
                raise
            print(f"constraints.txt names no release of {unfit and unfit[1]} for this Python: left open", flush=True)
            constraints.write_text("".join(fewer), encoding="utf-8")
    if without_pybullet:
        run([inside, "-m", "pip", "uninstall", "-q", "-y", "pybullet"])
    bullet = "pybullet" in run([inside, "-m", "pip", "list", "--format", "freeze"])
    scripts = [[IMPORTS], [EPISODE, "kinematic"], [EPISODE, "bullet"] if bullet else [MISSING], [BATCH], [PICTURES]]
    for script in scripts:
        print(run([inside, "-W", "error", "-c", *script], cwd=venv).strip(), flush=True)
    for words in (["--help"], ["list"], ["bench", "paper", "--episodes", "2", "--engine", "kinematic", "--jobs", "1"]):
        out = run([str(venv / "bin" / "follow"), *words], cwd=venv)
        print(f"follow {' '.join(words)}: {len(out.splitlines())} lines", flush=True)


def run(command: list[object], cwd: Path | None = None) -> str:
    """Return what a command prints; raise CalledProcessError with its output where it fails."""
    words = [str(word) for word in command]
    return subprocess.run(words, cwd=cwd, capture_output=True, text=True, check=True).stdout


if __name__ == "__main__":
    sys.exit(main())
