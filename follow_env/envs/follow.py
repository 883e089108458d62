"""`FollowEnv`: composes world, person, camera and sensors; owns the clock and the one random generator."""

import math
from collections import deque
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import gymnasium
import numpy as np
from gymnasium import spaces

from follow_env.camera import CameraPose, PinholeCamera, Renderer, RGBDFrame, make_renderer
from follow_env.camera.measurement import MeasurementModel
from follow_env.config import EnvConfig
from follow_env.domain import Domain
from follow_env.envs import task
from follow_env.envs.dashboard import Dashboard, import_pygame, show_window
from follow_env.envs.observations import (
    largest_twist,
    measurement_values,
    no_measurement_values,
    observation_space,
    state_values,
)
from follow_env.envs.task import REWARD_TERMS
from follow_env.envs.truth import in_view, seen_from_robot, surface_distance
from follow_env.registry import choose
from follow_env.world import ENGINES
from follow_env.world.motion.base import Motion, check_motion, make_motion
from follow_env.world.people.bodies import load_body
from follow_env.world.people.mesh import Placed
from follow_env.world.people.walker import Walker
from follow_env.world.robots.diff_drive import is_saturated
from follow_env.world.scenes import make_scene

if TYPE_CHECKING:
    from follow_env.camera.sensor.sensing import RGBDSensing

FIXED = ("obs", "action", "camera", "renderer", "control_hz", "engine")
"""Settings that all episodes of an environment have in common."""
OPTIONS = ("route", "person", "outfit", "sensor", "walking_speed", "latency_s", "robot", "task")
"""Settings that `reset(options=...)` can replace for one episode."""
MOST_CHECKED = 16
"""So many pairs of scene and route are remembered as walkable."""


class FollowEnv(gymnasium.Env):
    """A differential-drive robot with an RGB-D camera follows a walking person.

    Frames are REP-103: robot x forward, y left, origin at the axle's middle; bearing positive to the left. `bearing`
    (rad) and `distance` (m, along x) are those of the person's pelvis axis.

    **Action** `Box(-1, 1, (2,))`: `action="twist"` is (v, omega) as shares of the robot's `max_speed` and
    `max_yaw_rate`; `"wheels"` is (left, right) as shares of `max_wheel_speed`. Larger values are clipped.

    **Observation** by `obs`:

    - `"measurement"` float32 (8,): bearing, distance, validity (1 or 0), age of the latest measurement in s, odometry
      v and omega, last action. Without a new measurement bearing, distance and validity are 0, and the age counts on
      from the latest one (from the start while there was none).
    - `"state"` float32 (8,): true bearing, true distance, person's velocity in the robot frame (x, y), odometry v and
      omega, last action.
    - `"rgbd"` Dict: `rgb` uint8 (H, W, 3), `depth` float32 (H, W) m (0 = no reading), `twist` float32 (2,) odometry.
    - `"rgbd_box"`: the same and `box` float32 (4,) = (u0, v0, u1, v1) px, the person's visible box with the stated
      jitter; zeros when the person is not detected. What `mask` sees in the benchmark.
    - `"rgbd_uint8"`: uint8 (H, W, 4), the depth as 255 (1 - z / 8 m), 0 = no reading or beyond; the metric depth
      stays in `info["depth"]`.

    With pictures, `info["frame_time"]` (s) is when the observed one was taken. When a frame is dropped, the one before
    stands with its time, without a box; so does the first one, with latency, until it is old enough.

    **Reward**: sum of the bounded terms in `info["rewards"]` (`follow_env.envs.task`).

    **Ends**: a collision or a person out of view for more than 5 s terminates; the route's end truncates.

    Args:
        config: an `EnvConfig`, a mapping of its settings, or a `Domain`, of which every episode draws its settings from
            its seed; `env.config` are those of the running episode.
        render_mode: None, `"rgb_array"` (dashboard), `"rgbd_tuple"` ((rgb, depth) of the robot) or `"human"`.
        settings: of `EnvConfig`, which says what each means; any may be a distribution (`follow_env.domain`).

    Version history:
        v0: first; since 0.2.0 settings are one record, any of them may be drawn, and `engine="kinematic"` needs no
            PyBullet. Episodes with fixed settings are the same, bit for bit.

    Raises:
        ValueError: for an unknown name or an impossible value, in one sentence.
    """

    metadata = {"render_modes": ["rgb_array", "rgbd_tuple", "human"], "render_fps": 30, "engine": "pybullet"}  # noqa: RUF012

    def __init__(
        self,
        config: EnvConfig | Domain | Mapping[str, Any] | None = None,
        render_mode: str | None = None,
        **settings: Any,
    ) -> None:
        self.domain = Domain.of(config, **settings)
        self.config = self.domain.nominal
        self.render_mode = (
            None if render_mode is None else choose("render_mode", render_mode, self.metadata["render_modes"])
        )
        if self.render_mode == "human":
            import_pygame()
        self.dt = self.config.dt
        self.metadata = {**self.metadata, "render_fps": self.config.control_hz, "engine": self.config.engine}
        self.camera = PinholeCamera(self.config.camera)
        self._half_field = math.tan(0.5 * self.camera.hfov)
        self.scene = make_scene(self.config.scene, self.config.light)
        self._walkable: list[tuple[Any, Any]] = []
        self._check(self.config)
        self._world: Any = None
        self._built: Any = None
        self._renderer: Renderer | None = None
        self._dashboard: Dashboard | None = None
        self.action_space = spaces.Box(-1.0, 1.0, (2,), np.float32)
        self.observation_space = observation_space(self.config.obs, self.camera, self.config.robot)
        self.motion: Motion | None = None
        self.observed: RGBDFrame | None = None
        self._sensing: RGBDSensing | None = None
        self._dressed: Any = None
        self._walker: Walker | None = None

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> tuple[Any, dict[str, Any]]:
        """Start an episode.

        Args:
            seed: seeds the environment's generator; one seed gives one episode, bit for bit.
            options: `robot_pose` ((x, y, yaw), m and rad) and the settings of `OPTIONS`: for this episode only.
        """
        super().reset(seed=seed)
        options = dict(options or {})
        for key in options:
            choose("reset option", key, ("robot_pose", *OPTIONS))
        pose = options.pop("robot_pose", None)
        config = self.domain.sample(self.np_random)
        if options:
            config = EnvConfig.of(config, **options)
        if config is not self.domain.nominal:
            self._check(config)
        self._build(config)

        x, y, yaw = self.scene.start
        y += float(self.np_random.uniform(-1.0, 1.0)) * self.scene.start_width
        away = config.task.set_point
        ahead = (x + away * math.cos(yaw), y + away * math.sin(yaw), yaw)
        self.motion = make_motion(config.route, self.scene, ahead, self.np_random, config.walking_speed)
        self._advance = getattr(self.motion, "advance", None)
        robot_pose = (x, y, yaw) if pose is None else _pose(pose)
        self._steps = 0
        self._person_pose = self.motion.pose(0.0)
        self._world.reset(robot_pose, self._person_pose)

        self._twist = (0.0, 0.0)
        self._last_action: np.ndarray = np.zeros(2, np.float32)
        self._out_of_view = self._longest_out_of_view = 0
        self._in_band = 0
        self._last_measured: float | None = None
        if self._dashboard is not None:
            self._dashboard.reset()
        self._look()
        self._rewards = dict.fromkeys(REWARD_TERMS, 0.0)
        self._saturated = False
        self._collision = "none"
        observation = self._observe()
        info = self._info()
        self._show(info)
        return observation, info

    def step(self, action: np.ndarray) -> tuple[Any, float, bool, bool, dict[str, Any]]:
        """Drive for one control period; see the class for action, observation, reward and ends."""
        if self.motion is None or self._world is None:
            raise gymnasium.error.ResetNeeded("step() was called before reset(); call reset() first")
        command = np.asarray(action, np.float64)
        if command.shape != (2,):
            raise ValueError(f"the action has shape {command.shape}; expected (2,): {self.config.action} in [-1, 1]")
        first, second = float(command[0]), float(command[1])
        if not (math.isfinite(first) and math.isfinite(second)):
            raise ValueError(f"the action is {[first, second]}; expected two finite numbers in [-1, 1]")
        first, second = min(max(first, -1.0), 1.0), min(max(second, -1.0), 1.0)
        robot = self.config.robot
        if self.config.action == "twist":
            wheels = self._world.drive.wheels(first * robot.max_speed, second * robot.max_yaw_rate)
        else:
            wheels = first * robot.max_wheel_speed, second * robot.max_wheel_speed

        self._steps += 1
        if self._advance is not None:
            self._advance(self.time)
        self._person_pose = self.motion.pose(self.time)
        self._world.place_person(self._person_pose)
        self._twist = self._world.step(*wheels, self.config.substeps)
        self._saturated = is_saturated(*wheels, *self._world.wheel_command)
        self._collision = self._world.collision()
        self._look()
        effort = task.effort(first, second, *self._last_action.tolist())
        self._last_action = np.array((first, second), np.float32)
        collided = self._collision != "none"
        terms = task.reward_terms(self.config.task, self._bearing, self._distance, self._visible, effort, collided)
        self._rewards = dict(zip(REWARD_TERMS, terms, strict=True))
        terminated, truncated = task.ends(
            self.config.task, collided, self._out_of_view * self.dt, self.time, self.motion.duration
        )
        observation = self._observe()
        info = self._info()
        self._show(info)
        return observation, task.total(terms), terminated, truncated, info

    def render(self) -> Any:
        """Return the dashboard (H, W, 3) uint8, or the robot's (rgb, depth), or None in `human` mode."""
        if self.render_mode is None or self.motion is None:
            raise gymnasium.error.ResetNeeded(
                "nothing to render; make the environment with render_mode='rgb_array' and call reset() first"
            )
        if self.render_mode == "rgbd_tuple":
            frame = self.frame()
            return frame.rgb, frame.depth
        if self.render_mode == "human":
            return None
        assert self._dashboard is not None
        return self._dashboard.image()

    def frame(self) -> RGBDFrame:
        """Return the camera's picture of this moment without sensor errors: the truth, for pictures and tests."""
        if self.motion is None:
            raise gymnasium.error.ResetNeeded("frame() was called before reset(); call reset() first")
        assert self._world is not None
        if self._renderer is None:
            self._renderer = make_renderer(self.config.renderer, self.scene, self.camera)
        return self._renderer.render(self.camera_pose(), self.people())

    def people(self) -> tuple[Placed, ...]:
        """Return the people as they stand at this moment, for another camera to draw."""
        if self.motion is None:
            raise gymnasium.error.ResetNeeded("people() was called before reset(); call reset() first")
        if self._walker is None:
            self._walker = Walker(load_body(*self._dressed))
        t = self.time
        return (self._walker.place(*self.motion.pose(t), self.motion.walked(t), self.motion.speed(t)),)

    def camera_pose(self) -> CameraPose:
        """Pose of the camera in the world frame."""
        x, y, yaw = self._robot_pose
        forward = self.config.robot.camera_forward
        return CameraPose(
            x + forward * math.cos(yaw), y + forward * math.sin(yaw), self.config.robot.camera_height, yaw
        )

    @property
    def time(self) -> float:
        """Seconds since the episode's start."""
        return self._steps * self.dt

    def close(self) -> None:
        """Free the physics and the renderer; a second call does nothing."""
        for part in (self._world, self._renderer):
            if part is not None:
                part.close()
        self._world = self._built = self._renderer = self.motion = None

    def command_person(self, speed: float, turning: float) -> None:
        """Let the person of `route="commanded"` walk at a speed (m/s) while turning (rad/s, ccw) from now on.

        Raises:
            ValueError: if the person walks by itself, or the command is beyond what a person can do.
        """
        if self.motion is None:
            raise gymnasium.error.ResetNeeded("command_person() was called before reset(); call reset() first")
        if not hasattr(self.motion, "command"):
            raise ValueError(f"the person walks the route {self.config.route!r}; expected route='commanded'")
        self.motion.command(speed, turning)

    def _check(self, config: EnvConfig) -> None:
        """Raise a ValueError for what cannot be played, or cannot change from one episode to the next."""
        for name in FIXED:
            one, other = getattr(config, name), getattr(self.config, name)
            if one != other:
                raise ValueError(
                    f"{name} is {one!r} in one episode and {other!r} in another; an environment keeps it: "
                    "give one value, or make several environments"
                )
        largest, (v, omega) = largest_twist(config.robot), largest_twist(self.config.robot)
        if largest[0] > v or largest[1] > omega:
            raise ValueError(
                f"a robot with max_wheel_speed {config.robot.max_wheel_speed!r} and track_width "
                f"{config.robot.track_width!r} is faster than the observations hold ({v:.3g} m/s, {omega:.3g} rad/s); "
                "give the domain a faster nominal robot"
            )
        if (config.scene, config.route) not in self._walkable:
            check_motion(config.route, make_scene(config.scene), config.task.set_point, config.walking_speed)
            self._walkable.append((config.scene, config.route))
            del self._walkable[:-MOST_CHECKED]

    def _build(self, config: EnvConfig) -> None:
        """Make what this episode's settings need and the last one's had not."""
        self.config, self._delay = config, config.delay
        built = config.scene, config.light, config.robot
        if self._world is not None and built != self._built:
            self.close()
            self._dashboard = None
        if self._world is None:
            self.scene = make_scene(config.scene, config.light)
            self._world, self._built = ENGINES.get(config.engine)(self.scene, config.robot), built
            self._sight = type(self._world).line_of_sight
        if self._dressed != (config.person, config.outfit):
            self._dressed, self._walker = (config.person, config.outfit), None
        if config.renderer == "tiny" and self._renderer is not None:
            self._renderer.close()  # its rigid people keep the posture of the last episode
            self._renderer = None
        self._measurement = MeasurementModel(config.sensor.measurement, self.dt)
        self._queue: deque[Any] = deque()
        if not config.obs.startswith("rgbd"):
            return
        if self._sensing is None or self._sensing.config != config.sensor:
            from follow_env.camera.sensor.sensing import RGBDSensing  # compiled: only for those who look at pictures

            self._sensing = RGBDSensing(config.sensor, self.camera, self.dt, boxes=config.obs == "rgbd_box")
        self._sensing.restart()

    def _look(self) -> None:
        """Update the truth: poses, bearing, distance, visibility and what is counted from them."""
        assert self.motion is not None
        assert self._world is not None
        self._robot_pose = self._world.robot_pose()
        self._person_velocity = self.motion.velocity(self.time)
        x, y, yaw = self._robot_pose
        cosine, sine = math.cos(yaw), math.sin(yaw)
        person_x, person_y, _ = self._person_pose
        self._bearing, self._distance, left = seen_from_robot(x, y, cosine, sine, person_x, person_y)
        robot = self.config.robot
        self._surface_distance = surface_distance(x, y, person_x, person_y, robot.hull_radius)
        forward = robot.camera_forward
        eye = x + forward * cosine, y + forward * sine, robot.camera_height
        person, direction, depth = (person_x, person_y), (cosine, sine), self._distance - forward
        self._visible = in_view(self._sight, self._world, eye, person, direction, depth, left, self._half_field)
        self._out_of_view = 0 if self._visible else self._out_of_view + 1
        self._longest_out_of_view = max(self._longest_out_of_view, self._out_of_view)
        self._in_band += task.in_band(self.config.task, self._bearing, self._distance)

    def _observe(self) -> Any:
        """Return the observation, `latency_s` old in what was seen, current in odometry and action."""
        own = (*self._twist, *self._last_action.tolist())
        if self.config.obs == "state":
            yaw = self._robot_pose[2]
            direction = math.cos(yaw), math.sin(yaw)
            values = state_values(self._bearing, self._distance, self._person_velocity, direction, own)
            return np.array(values, np.float32)
        if self.config.obs == "measurement":
            seen = self._delayed(
                self._measurement.measure(self._bearing, self._distance, self._visible, self.np_random)
            )
            if seen is None:
                since = 0.0 if self._last_measured is None else self._last_measured
                return np.array(no_measurement_values(self.time - since, own), np.float32)
            age = self._delay * self.dt
            self._last_measured = self.time - age
            return np.array(measurement_values(seen[0], seen[1], age, own), np.float32)
        assert self._sensing is not None
        seen = self._delayed(self._sensing.sense(self.frame, self.time, self.np_random))
        if seen is None:
            first, _, taken = self._queue[0]
            seen = first, np.zeros(4, np.float32), taken
        self.observed, box, self._frame_time = seen
        if self.config.obs == "rgbd_uint8":
            from follow_env.camera.sensor.errors import packed

            return packed(self.observed.rgb, self.observed.depth)
        twist = np.array(self._twist, np.float32)
        observation = {"rgb": self.observed.rgb, "depth": self.observed.depth, "twist": twist}
        if self.config.obs == "rgbd_box":
            observation["box"] = box
        return observation

    def _delayed(self, value: Any) -> Any:
        """Return what was seen `latency_s` ago, or None while that was before the start."""
        self._queue.append(value)
        return self._queue.popleft() if len(self._queue) > self._delay else None

    def _info(self) -> dict[str, Any]:
        assert self._world is not None
        longest, collided = self._longest_out_of_view * self.dt, self._collision != "none"
        success = task.succeeds(self.config.task, collided, longest, self._in_band, self._steps + 1)
        info = {
            "time": self.time,
            "bearing": self._bearing,
            "distance": self._distance,
            "visible": self._visible,
            "collision": collided,
            "collision_with": self._collision,
            "surface_distance": self._surface_distance,
            "robot_pose": np.array(self._robot_pose),
            "person_pose": np.array(self._person_pose),
            "person_velocity": np.array(self._person_velocity),
            "twist": np.array(self._twist),
            "command": np.array(self._world.command),
            "saturated": self._saturated,
            "rewards": dict(self._rewards),
            "is_success": success,
        }
        if self.config.obs.startswith("rgbd"):
            info["frame_time"] = self._frame_time
        if self.config.obs == "rgbd_uint8":
            assert self.observed is not None
            info["depth"] = self.observed.depth
        return info

    def _show(self, info: dict[str, Any]) -> None:
        """Feed the dashboard when somebody looks; open or refresh the window in `human` mode."""
        if self.render_mode not in ("rgb_array", "human"):
            return
        if self._dashboard is None:
            self._dashboard = Dashboard(self.scene, self.camera, self.config.robot.camera_forward)
        self._dashboard.update(info, self.observed or self.frame())
        if self.render_mode == "human":
            show_window(self._dashboard.image(), 1.0 / self.dt)


def _pose(value: Any) -> tuple[float, float, float]:
    try:
        x, y, yaw = (float(number) for number in value)
    except (TypeError, ValueError):
        x = y = yaw = math.nan
    if not (math.isfinite(x) and math.isfinite(y) and math.isfinite(yaw)):
        raise ValueError(f"robot_pose is {value!r}; expected three finite numbers (x, y, yaw)")
    return x, y, yaw
