"""Paper B's two scenes: 12 m in 14 s with one or two turns, the environments as they come."""

from baselines.benchmark.suite import SUITES, Suite
from baselines.benchmark.trial import Scenario

CARD = "Follow at 1.5 m a person who walks 12 m in 14 s with one or two turns of 20 to 50 degrees."
PAPER = SUITES.register("paper")(
    Suite(
        "paper",
        (
            Scenario("corridor", {"scene": "corridor"}, tags=("paper",), card=f"{CARD} A corridor."),
            Scenario("indoor", {"scene": "indoor"}, tags=("paper",), card=f"{CARD} A furnished room."),
        ),
        card=CARD,
    )
)
