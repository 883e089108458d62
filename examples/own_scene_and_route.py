"""An own scene and an own route: a hall with a pillar, and a person who walks around it and stops halfway."""

import numpy as np

from follow_env.envs.batch import FollowVectorEnv
from follow_env.envs.follow import FollowEnv
from follow_env.world.scene import Box, Cylinder, Light, Material, Scene

PLASTER, WOOD = Material((0.8, 0.8, 0.75)), Material((0.5, 0.35, 0.2), texture="planks")


def hall(pillar=0.4):
    """Return a hall of 20 m x 8 m with a pillar of a radius (m) in the middle."""
    walls = [Box((6.0, side * 4.05, 1.5), (20.0, 0.1, 3.0), PLASTER) for side in (1, -1)]
    middle = Cylinder((6.0, 0.0, 1.5), pillar, 3.0, PLASTER)
    return Scene("hall", (*walls, middle), WOOD, (Light((6.0, 2.0, 2.9), 1.0),), 0.4, (-4.0, 16.0, -4.0, 4.0))


ROUTE = {"name": "path", "points": [[3.0, 0.0], [3.0, 2.0], [7.0, 2.0]], "stops": [[4.0, 1.5]], "radius": 0.6}

env = FollowEnv(scene=hall(), route=ROUTE, walking_speed=0.8, engine="kinematic")
observation, info = env.reset(seed=0)
terminated = truncated = False
while not (terminated or truncated):
    drive = np.clip([2.0 * (info["distance"] - 1.5), info["bearing"]], -1.0, 1.0)  # by the truth
    observation, reward, terminated, truncated, info = env.step(drive)
print(f"followed for {info['time']:.1f} s, success: {info['is_success']}")

batch = FollowVectorEnv(64, scene=hall(pillar=0.6), route=ROUTE)
observations, infos = batch.reset(seed=0)
print(f"{batch.num_envs} worlds, the persons {infos['distance'].mean():.2f} m ahead")
