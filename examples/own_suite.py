"""An own suite and an own metric: a person who turns around, and how long the robot needed to be in front again."""

from baselines.benchmark.evaluate import evaluate
from baselines.benchmark.suite import Suite
from baselines.benchmark.trial import Scenario

U_TURN = {"name": "path", "points": [[3.0, 0.0], [3.0, 1.2], [0.0, 1.2]], "radius": 0.6}


def worst_bearing(trace):
    """Largest bearing of the person, rad."""
    return float(abs(trace.bearing).max())


SUITE = Suite(
    "turning_around",
    (
        Scenario("slow", {"scene": "corridor", "route": U_TURN, "walking_speed": 0.5}),
        Scenario("any_speed", {"scene": "corridor", "route": U_TURN, "walking_speed": {"uniform": [0.4, 0.8]}}),
    ),
    metrics=("success", "distance_tracking_rmse_m"),
    card="The person walks 3 m, turns around in an arc and comes back.",
)

if __name__ == "__main__":
    result = evaluate(["akf", "none", "ppo-0"], SUITE, episodes=3, engine="kinematic")
    print(result.markdown())
    for row in result.rows(["__main__:worst_bearing"]):  # asked afterwards: nothing is played again
        print(row["scenario"], row["follower"], row["seed"], row["__main__:worst_bearing"])
