"""Robots by name: `RobotConfig` records."""

from follow_env.config import RobotBody, RobotConfig
from follow_env.registry import Registry

ROBOTS: Registry[RobotConfig] = Registry("robot")
"""Robots; a mapping `{"preset": name, ...}` changes one."""
ROBOTS.register("dong2018")(RobotConfig())
ROBOTS.register("turtlebot3_burger")(
    RobotConfig(
        track_width=0.160,
        wheel_radius=0.033,
        max_speed=0.22,
        max_yaw_rate=2.84,
        max_wheel_speed=0.22 + 0.5 * 0.160 * 2.84,
        camera_forward=0.03,
        camera_height=0.20,
        hull_radius=0.13,
        body=RobotBody(
            chassis_middle=-0.032,
            chassis_length=0.14,
            chassis_width=0.14,
            chassis_low=0.010,
            chassis_height=0.10,
            chassis_mass=0.8,
            wheel_mass=0.03,
            wheel_inertia=0.0002,
            caster_offset=-0.049,
            caster_radius=0.01,
            caster_mass=0.01,
            mast_offset=0.0,
            mast_radius=0.02,
            mast_rise=0.092,
            mast_height=0.08,
            mast_mass=0.05,
        ),
    )
)
"""ROBOTIS' TurtleBot3 Burger: track, wheels, size, 1 kg, 0.22 m/s and 2.84 rad/s as the maker states them. The camera's
place is ours; acceleration and response are those of the default robot."""
