"""A person who walks slower and faster than paper B's, up to near the robot's own limit of 1.2 m/s."""

from baselines.benchmark.suite import SUITES, Suite
from baselines.benchmark.trial import Scenario

CARD = "Follow at 1.5 m a person who walks paper B's routes at another speed; the robot's limit is 1.2 m/s."
SPEEDS = SUITES.register("speeds")(
    Suite(
        "speeds",
        tuple(Scenario(f"walk_{v:g}", {"walking_speed": v}, tags=("speed",), card=CARD) for v in (0.5, 0.7, 0.9, 1.1)),
        card=CARD,
    )
)
