"""An own follower: anything with `predict` drives, here without memory, and is compared with the paper's."""

import numpy as np

from baselines.benchmark.evaluate import evaluate


class Pursuit:
    """Drives by the latest measurement alone: turns to the person and closes the gap."""

    observation = "measurement"  # the environment's mode that it reads

    def __init__(self, config):
        self.config = config  # of the environment: limits, set point, rate; another environment is refused

    def predict(self, observation, state=None, episode_start=None, deterministic=True):
        bearing, distance, valid, *_ = observation
        robot = self.config.robot
        v, omega = 4.0 * (distance - self.config.task.set_point), 2.0 * bearing
        action = np.array((v / robot.max_speed, omega / robot.max_yaw_rate), np.float32)
        return (np.clip(action, -1.0, 1.0) if valid else np.zeros(2, np.float32)), None


if __name__ == "__main__":
    followers = ["akf", f"{__name__}:Pursuit", "oracle"]
    print(evaluate(followers, "paper", episodes=2, engine="kinematic").markdown())
