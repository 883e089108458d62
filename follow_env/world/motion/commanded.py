"""`Commanded`: a person who walks as somebody outside says, step by step."""

import math

import numpy as np

from follow_env.world.motion.base import MOTIONS, Pose
from follow_env.world.motion.profile import FASTEST, PAPER_SPEED
from follow_env.world.people.dimensions import RADIUS
from follow_env.world.scene import Scene

ACCELERATION, YAW_ACCELERATION = 1.5, 6.0
"""How fast a walking person changes speed and turning, m/s^2 and rad/s^2."""
FASTEST_TURN = 3.0
"""rad/s."""


class Commanded:
    """A person led by commands. Walls stop, and so does whoever gives no command.

    Args:
        scene: what is solid.
        start: (x, y, heading) at t = 0, m and rad.
        duration: of the episode, s.

    Attributes:
        duration: of the episode, s.
    """

    def __init__(self, scene: Scene, start: Pose, duration: float = 60.0) -> None:
        if not 0.0 < duration < math.inf:
            raise ValueError(f"duration is {duration!r}; expected seconds > 0")
        self.duration = float(duration)
        self._scene, self._pose = scene, start
        self._time = self._speed = self._turning = self._walked = 0.0
        self._wanted = (0.0, 0.0)

    def command(self, speed: float, turning: float) -> None:
        """Walk from now on at a speed (m/s, from 0) while turning (rad/s, ccw), as fast as a person can change."""
        if not (0.0 <= speed <= FASTEST and abs(turning) <= FASTEST_TURN):
            raise ValueError(
                f"the person's command is ({speed!r}, {turning!r}); expected m/s from 0 to {FASTEST} and rad/s up to "
                f"{FASTEST_TURN} either way"
            )
        self._wanted = float(speed), float(turning)

    def advance(self, t: float) -> None:
        """Walk until time t, s; time does not go back."""
        dt = t - self._time
        if dt <= 0.0:
            return
        self._time = t
        self._speed = _toward(self._speed, self._wanted[0], ACCELERATION * dt)
        self._turning = _toward(self._turning, self._wanted[1], YAW_ACCELERATION * dt)
        x, y, heading = self._pose
        heading += self._turning * dt
        step = self._speed * dt
        place = x + step * math.cos(heading), y + step * math.sin(heading)
        if step > 0.0 and self._scene.clearance(np.array([place])) < RADIUS:
            place, step, self._speed = (x, y), 0.0, 0.0
        self._pose = (*place, heading)
        self._walked += step

    def pose(self, t: float) -> Pose:
        """Return (x, y, heading) at the latest time, m and rad."""
        return self._pose

    def velocity(self, t: float) -> tuple[float, float]:
        """Return the velocity at the latest time, m/s."""
        return self._speed * math.cos(self._pose[2]), self._speed * math.sin(self._pose[2])

    def speed(self, t: float) -> float:
        """Return the walking speed at the latest time, m/s."""
        return self._speed

    def walked(self, t: float) -> float:
        """Return the way walked until the latest time, m."""
        return self._walked


def _toward(value: float, wanted: float, step: float) -> float:
    return min(max(wanted, value - step), value + step)


@MOTIONS.register("commanded")
def commanded(
    scene: Scene, start: Pose, rng: np.random.Generator, speed: float = PAPER_SPEED, duration: float = 60.0
) -> Commanded:
    """Return a person who stands until commanded; see `Commanded`."""
    return Commanded(scene, start, duration)
