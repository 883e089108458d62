"""An own controller: an LQR on (distance, integral of its error), compared with the paper's PI."""

import control
import numpy as np

from baselines.followers.build import build_follower
from follow_env.envs.follow import FollowEnv


class LQR:
    """Distance by LQR, bearing proportional; the speed of the person is what the integral has learned."""

    def __init__(self, config, weight=4.0):
        gain, _, _ = control.lqr([[0.0, 0.0], [1.0, 0.0]], [[-1.0], [0.0]], np.diag([weight, 1.0]), [[1.0]])
        self.gain, self.set_point = -gain[0], config.task.set_point
        self.reset()

    def reset(self):
        self.integral = 0.0

    def command(self, bearing, distance, dt):
        error = distance - self.set_point
        self.integral = min(max(self.integral + error * dt, -1.5), 1.5)
        return float(self.gain @ (error, self.integral)), 2.0 * bearing


env = FollowEnv(engine="kinematic")
for controller in ("pi", LQR):
    follower = build_follower({"estimator": "akf_cv", "controller": controller}, env)
    (observation, info), state, ended, errors = env.reset(seed=0), None, False, []
    while not ended:
        action, state = follower.predict(observation, state)
        observation, reward, terminated, truncated, info = env.step(action)
        ended = terminated or truncated
        errors.append(info["distance"] - env.config.task.set_point)
    print(f"{getattr(controller, '__name__', controller)}: RMSE {100.0 * np.sqrt(np.mean(np.square(errors))):.1f} cm")
