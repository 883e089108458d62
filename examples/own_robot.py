"""An own robot: a TurtleBot3 Burger with a RealSense's field of view follows a slow walker; nothing is guessed."""

import math

from baselines.followers.build import build_follower
from follow_env.envs.follow import FollowEnv

env = FollowEnv(
    robot={"preset": "turtlebot3_burger", "camera_height": 0.25},
    camera={"width": 320, "height": 180, "hfov_deg": 69.0},
    walking_speed=0.2,
    task={"set_point": 1.5},
)
follower, state = build_follower("akf", env), None
observation, info = env.reset(seed=0)
errors = []
terminated = truncated = False
while not (terminated or truncated):
    action, state = follower.predict(observation, state)
    observation, reward, terminated, truncated, info = env.step(action)
    errors.append((info["bearing"], info["distance"] - env.config.task.set_point))
bearing, distance = (math.sqrt(math.fsum(e * e for e in column) / len(errors)) for column in zip(*errors, strict=True))
print(f"{info['time']:.0f} s, RMSE {bearing:.3f} rad and {100.0 * distance:.1f} cm, success: {info['is_success']}")
