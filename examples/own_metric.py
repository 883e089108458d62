"""An own metric, asked of episodes that were kept before it was written: nothing is played again."""

import tempfile
from pathlib import Path

from baselines.benchmark.evaluate import evaluate
from baselines.benchmark.metrics.base import metric


@metric("hurry_share")
def hurry_share(trace):
    """Share of the moments in which the robot is faster than 1 m/s."""
    return float((trace.twist[:, 0] > 1.0).mean())


if __name__ == "__main__":
    with tempfile.TemporaryDirectory() as folder:
        settings = {"episodes": 3, "kept": Path(folder), "engine": "kinematic"}
        evaluate(["akf", "parked"], "paper", **settings)
        kept_before = sorted(Path(folder).iterdir())
        result = evaluate(["akf", "parked"], "paper", **settings)  # reads what was kept
        assert sorted(Path(folder).iterdir()) == kept_before
        print(result.markdown(["hurry_share", "success"]))
