"""A Gymnasium environment in which a differential-drive robot with an RGB-D camera follows a walking person.

Importing this package registers the environment ids and does nothing else: PyBullet and OpenCV are loaded when an
environment is made.
"""

from gymnasium.envs.registration import register

__version__ = "0.1.0"

IDS = {"corridor": "follow_env/Corridor-v0", "indoor": "follow_env/Indoor-v0"}
"""Scene name -> environment id."""

for _scene, _id in IDS.items():
    register(
        _id,
        entry_point="follow_env.envs.follow:FollowEnv",
        vector_entry_point="follow_env.envs.batch:FollowVectorEnv",
        kwargs={"scene": _scene},
    )
