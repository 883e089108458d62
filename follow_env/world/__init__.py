"""The world without Gymnasium: scenes, people, robots, and the two engines that move them."""

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

from follow_env.registry import Registry

if TYPE_CHECKING:
    from follow_env.config import RobotConfig
    from follow_env.world.scene import Scene

ENGINES: "Registry[Callable[[Scene, RobotConfig], Any]]" = Registry("engine")
"""Functions (scene, robot) that make a world with the interface of `follow_env.world.bullet.World`."""


@ENGINES.register("bullet")
def bullet(scene: "Scene", robot: "RobotConfig") -> Any:
    """Return PyBullet's world: rigid bodies, contacts, friction.

    Raises:
        ImportError: where PyBullet is not installed; the message says what to do.
    """
    try:
        from follow_env.world.bullet import World
    except ModuleNotFoundError as error:
        if error.name != "pybullet":
            raise
        raise ImportError(
            "engine='bullet' needs PyBullet, which is not installed (it has wheels for Python 3.10 and 3.11); "
            "take engine='kinematic', or run `pip install pybullet`"
        ) from error
    return World(scene, robot)


@ENGINES.register("kinematic")
def kinematic(scene: "Scene", robot: "RobotConfig") -> Any:
    """Return the kinematic world: exact arcs, no slip, no push; what is touched is known."""
    from follow_env.world.kinematic.world import KinematicWorld

    return KinematicWorld(scene, robot)
