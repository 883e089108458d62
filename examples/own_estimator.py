"""An own estimator: an alpha-beta filter on the distance, compared with the paper's filters."""

from baselines import FollowerSpec, evaluate
from tracker import Estimate


class AlphaBeta:
    """A constant-velocity filter with fixed gains."""

    def __init__(self, noise, alpha=0.3, beta=0.02):
        self.alpha, self.beta = alpha, beta
        self.reset()

    def reset(self):
        self.distance, self.speed, self.bearing = None, 0.0, 0.0

    def predict(self, twist, dt):
        self.dt = dt
        if self.distance is not None:
            self.distance += (self.speed - twist[0]) * dt

    def update(self, measurement):
        if measurement is not None:
            self.bearing, distance = measurement
            self.distance = distance if self.distance is None else self.distance
            error = distance - self.distance
            self.distance += self.alpha * error
            self.speed += self.beta * error / self.dt
        if self.distance is None:
            return None
        return Estimate(
            self.bearing, self.distance, (0.0, 0.0), (0.0, 0.0), (0.0, 0.0), (1.0, 1.0), ("accept", "accept")
        )


if __name__ == "__main__":
    followers = ["none", "akf", FollowerSpec(estimator=AlphaBeta, kind="own")]
    result = evaluate(followers, "paper", episodes=3, engine="kinematic")
    print(result.markdown(["distance_rmse_m", "distance_bias_m", "distance_tracking_rmse_m"]))
