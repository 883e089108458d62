"""Build the wheel, install it into an empty environment of a Python, and use it there as a newcomer would.

    python tools/check_wheel.py python3.13 [--core]

`--core` installs no extra. Nothing of this checkout is on the path; what is printed is what ran there.
"""

import argparse
import subprocess
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).parents[1]
PROGRAM = """
import sys
import numpy as np
import gymnasium as gym
import follow_env
from baselines import build_follower

try:
    import pybullet
    engines = ("bullet", "kinematic")
except ImportError:
    engines = ("kinematic",)
for engine in engines:
    env = gym.make("follow_env/Corridor-v0", engine=engine)
    policy, state = build_follower("akf", env), None
    obs, info = env.reset(seed=0)
    terminated = truncated = False
    while not (terminated or truncated):
        action, state = policy.predict(obs, state)
        obs, reward, terminated, truncated, info = env.step(action)
    print(f"{engine}: {info['time']:.1f} s, distance {info['distance']!r} m, success: {info['is_success']}")
envs = gym.make_vec("follow_env/Indoor-v0", num_envs=256)
observations, _ = envs.reset(seed=0)
for _ in range(100):
    observations, rewards, *_ = envs.step(np.zeros((256, 2), np.float32))
print(f"batch of 256: mean reward {rewards.mean()!r}")
if "bullet" not in engines:
    try:
        gym.make("follow_env/Corridor-v0").reset(seed=0)
    except ImportError as error:
        print(error)
"""


def main() -> None:
    """Run the check."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("python")
    parser.add_argument("--core", action="store_true")
    parsed = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        room = Path(folder)
        run(sys.executable, "-m", "pip", "wheel", "-q", "--no-deps", "--no-build-isolation", "-w", folder, str(ROOT))
        (wheel,) = room.glob("*.whl")
        run(parsed.python, "-m", "venv", str(room / "venv"))
        python = str(room / "venv/bin/python")
        run(python, "-m", "pip", "install", "-q", str(wheel) if parsed.core else f"{wheel}[bench]")
        print(f"{wheel.name} on", run(python, "--version").strip())
        print(run(python, "-c", PROGRAM, cwd=room).strip())
        bench = (
            "bench",
            "speeds",
            "--follower",
            "akf",
            "--follower",
            "none",
            "--engine",
            "kinematic",
            "--episodes",
            "2",
        )
        print(run(str(room / "venv/bin/follow"), *bench, "--jobs", "2", "--out", str(room / "run"), cwd=room).strip())


def run(*command: str, cwd: Path | None = None) -> str:
    """Return what a command printed; if it fails, end with what it said."""
    done = subprocess.run(command, capture_output=True, text=True, cwd=cwd, check=False)
    if done.returncode:
        raise SystemExit(f"{' '.join(command[:4])} ... failed:\n{done.stdout}{done.stderr}")
    return done.stdout


if __name__ == "__main__":
    main()
