"""An own estimator: an alpha-beta filter with fixed gains, compared with the paper's adaptive Kalman filter."""

import numpy as np

from baselines.benchmark.evaluate import evaluate
from tracker.estimators import Estimate


class AlphaBeta:
    """Value and rate of bearing and distance; made with what is known of the noise, and settings of its own."""

    def __init__(self, noise, alpha=0.3, beta=0.02):
        self.alpha, self.beta = alpha, beta
        self.reset()

    def reset(self):
        self.value, self.rate = None, np.zeros(2)

    def predict(self, twist, dt):
        self.dt, (v, omega) = dt, twist
        if self.value is not None:  # turning and driving bring the person nearer
            self.value = self.value + (self.rate - (omega, v)) * dt

    def update(self, measurement):
        error, action = np.zeros(2), "miss"
        if measurement is not None:
            error, action = (0.0 if self.value is None else np.subtract(measurement, self.value)), "accept"
            self.value = np.array(measurement) if self.value is None else self.value + self.alpha * error
            self.rate = self.rate + self.beta / self.dt * error
        if self.value is None:
            return None
        return Estimate(*self.value.tolist(), (0.0, 0.0), (0.0, 0.0), (0.0, 0.0), (1.0, 1.0), (action, action))


if __name__ == "__main__":
    own = {"estimator": f"{__name__}:AlphaBeta", "label": "alpha-beta"}
    jumpy = {**own, "estimator": {"name": f"{__name__}:AlphaBeta", "alpha": 0.9}, "label": "alpha-beta 0.9"}
    print(evaluate(["akf", own, jumpy], "paper", episodes=2, engine="kinematic").markdown())
