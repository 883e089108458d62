"""`follow watch --lead`: lead the person by the arrow keys in a window, while a follower drives the robot."""

from __future__ import annotations

from typing import Any

from baselines.benchmark.build import policy_of, settings_of
from baselines.benchmark.trial import Trial
from follow_env.envs.dashboard import import_pygame
from follow_env.envs.follow import FollowEnv
from follow_env.world.motion.profile import PAPER_SPEED

FAST = 1.5
"""Walking speed with the shift key, m/s."""
TURNING = 1.2
"""Turning rate of the left and right keys, rad/s."""


def command_of(forward: bool, left: bool, right: bool, fast: bool) -> tuple[float, float]:
    """Return the person's command (speed m/s, turning rad/s, ccw) for the keys that are held down."""
    speed = (FAST if fast else PAPER_SPEED) if forward else 0.0
    return speed, TURNING * (int(left) - int(right))


def lead(trial: Trial, seed: int) -> str:
    """Open a window, let the arrow keys lead the person until Escape or the episode's end, and return a summary.

    Args:
        trial: who follows, and the scenario whose route is replaced.
        seed: of the episode.

    Raises:
        ValueError: without pygame, or for a follower that cannot drive here.
    """
    pygame = import_pygame()
    env = FollowEnv(**{**settings_of(trial), "route": "commanded"}, render_mode="human")
    try:
        observation, info = env.reset(seed=seed)
        policy, state, ended = policy_of(trial, env), None, False
        while not (ended or _wants_out(pygame)):
            keys = pygame.key.get_pressed()
            fast = keys[pygame.K_LSHIFT] or keys[pygame.K_RSHIFT]
            env.command_person(*command_of(keys[pygame.K_UP], keys[pygame.K_LEFT], keys[pygame.K_RIGHT], fast))
            action, state = policy.predict(observation, state)
            observation, _, terminated, truncated, info = env.step(action)
            ended = terminated or truncated
        walked = env.motion.walked(env.time) if env.motion is not None else 0.0
    finally:
        env.close()
    return f"{info['time']:.1f} s, the person walked {walked:.1f} m, success {'yes' if info['is_success'] else 'no'}"


def _wants_out(pygame: Any) -> bool:
    return any(
        event.type == pygame.QUIT or (event.type == pygame.KEYDOWN and event.key == pygame.K_ESCAPE)
        for event in pygame.event.get()
    )
