"""`World`: the PyBullet simulation. The scene is built once; a reset restores a saved state.

Bodies: floor, the scene's solid primitives, the robot (chassis, two driven wheels, a frictionless rear caster, a
camera mast) and the person as one kinematic capsule. Nothing is drawn here.
"""

import math

import numpy as np
import pybullet

from follow_env.config import RobotConfig
from follow_env.world.clock import PHYSICS_HZ
from follow_env.world.people import dimensions
from follow_env.world.robots.diff_drive import DiffDrive
from follow_env.world.scene import Box, Capsule, Cylinder, Primitive, Scene, Sphere

SOLVER_ITERATIONS = 10
"""Of the contact solver in each physics step; `follow speed` shows what fewer and more of them cost and give."""
CONTACT_BREAKING = 0.0005
"""Contact points farther apart than this are dropped, m: a rolling wheel keeps one point instead of a trail of four."""
WHEEL_JOINTS = (0, 1)
SHAPES = {
    Box: pybullet.GEOM_BOX,
    Cylinder: pybullet.GEOM_CYLINDER,
    Sphere: pybullet.GEOM_SPHERE,
    Capsule: pybullet.GEOM_CAPSULE,
}
"""PyBullet's shape of each primitive, in the order in which a compound body holds them."""
COMPOUND_LIMIT = 16
"""Most shapes PyBullet takes in one compound body."""


class World:
    """One physics client with the robot, the person and the scene.

    Args:
        scene: the place.
        config: the robot.
        solver_iterations: of the contact solver in each physics step.

    Raises:
        ValueError: if `solver_iterations` is not a whole number from 1.
    """

    def __init__(self, scene: Scene, config: RobotConfig, solver_iterations: int = SOLVER_ITERATIONS) -> None:
        if type(solver_iterations) is not int or solver_iterations < 1:
            raise ValueError(f"solver_iterations is {solver_iterations!r}; expected a whole number from 1")
        self.drive = DiffDrive(config)
        self.config = config
        self._client = pybullet.connect(pybullet.DIRECT)
        client = self._client
        pybullet.setGravity(0, 0, -9.81, physicsClientId=client)
        pybullet.setPhysicsEngineParameter(
            fixedTimeStep=1.0 / PHYSICS_HZ,
            numSolverIterations=solver_iterations,
            contactBreakingThreshold=CONTACT_BREAKING,
            deterministicOverlappingPairs=1,
            physicsClientId=client,
        )
        floor = pybullet.createCollisionShape(pybullet.GEOM_PLANE, physicsClientId=client)
        self._floor = pybullet.createMultiBody(0, floor, physicsClientId=client)
        pybullet.changeDynamics(self._floor, -1, lateralFriction=1.0, physicsClientId=client)
        obstacles = scene.obstacles()
        for first in range(0, len(obstacles), COMPOUND_LIMIT):
            self._add_static(obstacles[first : first + COMPOUND_LIMIT])
        self.person = self._add_person()
        self.robot = self._add_robot()
        self._gain = self.drive.servo_gain(1.0 / PHYSICS_HZ)
        self._torques = [config.max_wheel_torque] * 2
        self._command = (0.0, 0.0)
        self._angles = (0.0, 0.0)
        self._settle()
        self._saved = pybullet.saveState(physicsClientId=client)
        position, _ = pybullet.getBasePositionAndOrientation(self.robot, physicsClientId=client)
        self._rest = self._axle(position)

    def reset(self, robot_pose: tuple[float, float, float], person_pose: tuple[float, float, float]) -> None:
        """Put the world back to rest with the robot and the person at these poses (x, y, yaw; m, rad)."""
        client = self._client
        pybullet.restoreState(self._saved, physicsClientId=client)
        x, y, yaw = robot_pose
        com_x, com_y, com_z = self._rest
        cosine, sine = math.cos(yaw), math.sin(yaw)
        pybullet.resetBasePositionAndOrientation(
            self.robot,
            (x + cosine * com_x - sine * com_y, y + sine * com_x + cosine * com_y, com_z),
            (0.0, 0.0, math.sin(0.5 * yaw), math.cos(0.5 * yaw)),
            physicsClientId=client,
        )
        self.place_person(person_pose)
        self._command = (0.0, 0.0)
        self._drive_wheels()
        self._angles = self._wheel_angles()

    def place_person(self, pose: tuple[float, float, float]) -> None:
        """Move the person's collision capsule to the pose (x, y, heading)."""
        pybullet.resetBasePositionAndOrientation(
            self.person, (pose[0], pose[1], 0.5 * dimensions.HEIGHT), (0.0, 0.0, 0.0, 1.0), physicsClientId=self._client
        )

    def step(self, left: float, right: float, substeps: int) -> tuple[float, float]:
        """Advance by `substeps` physics steps with rim-speed commands (m/s); return the odometry twist.

        The commands pass the drive's limits first. The odometry (v, omega) is the mean over the period, from the
        wheels' angles, as encoders give it.
        """
        dt = substeps / PHYSICS_HZ
        self._command = self.drive.limit(left, right, self._command, dt)
        self._drive_wheels()
        self.simulate(substeps)
        before, self._angles = self._angles, self._wheel_angles()
        scale = self.config.wheel_radius / dt
        return self.drive.twist((self._angles[0] - before[0]) * scale, (self._angles[1] - before[1]) * scale)

    def simulate(self, substeps: int) -> None:
        """Advance by `substeps` bare physics steps with the wheel commands that stand."""
        step, client = pybullet.stepSimulation, self._client
        for _ in range(substeps):
            step(client)

    @property
    def wheel_command(self) -> tuple[float, float]:
        """The rim speeds (left, right) commanded now, after all limits, m/s."""
        return self._command

    @property
    def command(self) -> tuple[float, float]:
        """The twist (v, omega) commanded now, after all limits."""
        return self.drive.twist(*self._command)

    def robot_pose(self) -> tuple[float, float, float]:
        """Pose (x, y, yaw) of the axle's middle in the world frame, m and rad."""
        position, (qx, qy, qz, qw) = pybullet.getBasePositionAndOrientation(self.robot, physicsClientId=self._client)
        yaw = math.atan2(2.0 * (qw * qz + qx * qy), 1.0 - 2.0 * (qy * qy + qz * qz))
        cosine, sine = math.cos(yaw), math.sin(yaw)
        com_x, com_y, _ = self._rest
        return position[0] - cosine * com_x + sine * com_y, position[1] - sine * com_x - cosine * com_y, yaw

    def collision(self) -> str:
        """What the robot touches: "none", "wall" (anything of the scene) or "person"."""
        touched = "none"
        for contact in pybullet.getContactPoints(bodyA=self.robot, physicsClientId=self._client):
            other = contact[2]
            if other == self.person:
                return "person"
            if other not in (self._floor, self.robot):
                touched = "wall"
        return touched

    def line_of_sight(self, eye: tuple[float, float, float], point: tuple[float, float, float]) -> bool:
        """Whether nothing of the scene stands between the two points (m); robot and person do not count."""
        hit = pybullet.rayTest(eye, point, physicsClientId=self._client)[0][0]
        return hit in (-1, self.person, self.robot)

    def close(self) -> None:
        """Disconnect from PyBullet; a second call does nothing."""
        if self._client >= 0:
            pybullet.disconnect(self._client)
            self._client = -1

    def _axle(self, position: tuple[float, float, float]) -> tuple[float, float, float]:
        """Return the base's center of mass seen from the axle's middle; z is its height at rest."""
        wheels = [
            np.asarray(pybullet.getLinkState(self.robot, j, physicsClientId=self._client)[4]) for j in WHEEL_JOINTS
        ]
        middle = 0.5 * (wheels[0] + wheels[1])
        return float(position[0] - middle[0]), float(position[1] - middle[1]), float(position[2])

    def _drive_wheels(self) -> None:
        radius = self.config.wheel_radius
        pybullet.setJointMotorControlArray(
            self.robot,
            WHEEL_JOINTS,
            pybullet.VELOCITY_CONTROL,
            targetVelocities=[speed / radius for speed in self._command],
            velocityGains=[self._gain] * 2,
            forces=self._torques,
            physicsClientId=self._client,
        )

    def _wheel_angles(self) -> tuple[float, float]:
        left, right = pybullet.getJointStates(self.robot, WHEEL_JOINTS, physicsClientId=self._client)
        return left[0], right[0]

    def _settle(self) -> None:
        """Let the robot come to rest on its wheels, far from everything, then stop it."""
        self._drive_wheels()
        for _ in range(PHYSICS_HZ):
            pybullet.stepSimulation(self._client)

    def _add_static(self, primitives: tuple[Primitive, ...]) -> None:
        """Add fixed primitives as one compound body: fewer bodies to visit in each physics step."""
        client, kinds = self._client, list(SHAPES)
        placed = sorted(primitives, key=lambda p: kinds.index(type(p)))
        yaws = [p.yaw if isinstance(p, Box) else 0.0 for p in placed]
        shape = pybullet.createCollisionShapeArray(
            shapeTypes=[SHAPES[type(p)] for p in placed],
            halfExtents=[[0.5 * s for s in p.size] if isinstance(p, Box) else [0.0] * 3 for p in placed],
            radii=[0.0 if isinstance(p, Box) else p.radius for p in placed],
            lengths=[
                p.height if isinstance(p, Cylinder) else p.straight if isinstance(p, Capsule) else 0.0 for p in placed
            ],
            collisionFramePositions=[p.center for p in placed],
            collisionFrameOrientations=[(0.0, 0.0, math.sin(0.5 * yaw), math.cos(0.5 * yaw)) for yaw in yaws],
            physicsClientId=client,
        )
        pybullet.createMultiBody(0, shape, physicsClientId=client)

    def _add_person(self) -> int:
        shape = pybullet.createCollisionShape(
            pybullet.GEOM_CAPSULE,
            radius=dimensions.RADIUS,
            height=dimensions.STRAIGHT,
            physicsClientId=self._client,
        )
        return pybullet.createMultiBody(
            0, shape, basePosition=(5.0, 0.0, 0.5 * dimensions.HEIGHT), physicsClientId=self._client
        )

    def _add_robot(self) -> int:
        """Build the robot; base frame = the chassis' center of mass, the middle of its box."""
        client, radius, half_track = self._client, self.config.wheel_radius, 0.5 * self.config.track_width
        body = self.config.body
        middle, center = body.chassis_middle, body.chassis_center
        half = (0.5 * body.chassis_length, 0.5 * body.chassis_width, 0.5 * body.chassis_height)
        chassis = pybullet.createCollisionShape(pybullet.GEOM_BOX, halfExtents=half, physicsClientId=client)
        wheel = pybullet.createCollisionShape(pybullet.GEOM_SPHERE, radius=radius, physicsClientId=client)
        caster = pybullet.createCollisionShape(pybullet.GEOM_SPHERE, radius=body.caster_radius, physicsClientId=client)
        mast = pybullet.createCollisionShape(
            pybullet.GEOM_CYLINDER, radius=body.mast_radius, height=body.mast_height, physicsClientId=client
        )
        upright = (0.0, 0.0, 0.0, 1.0)
        robot = pybullet.createMultiBody(
            baseMass=body.chassis_mass,
            baseCollisionShapeIndex=chassis,
            basePosition=(middle, 0.0, center),
            linkMasses=[body.wheel_mass, body.wheel_mass, body.caster_mass, body.mast_mass],
            linkCollisionShapeIndices=[wheel, wheel, caster, mast],
            linkVisualShapeIndices=[-1] * 4,
            linkPositions=[
                (-middle, half_track, radius - center),
                (-middle, -half_track, radius - center),
                (body.caster_offset, 0.0, body.caster_radius - center),
                (body.mast_offset, 0.0, body.mast_rise),
            ],
            linkOrientations=[upright] * 4,
            linkInertialFramePositions=[(0.0, 0.0, 0.0)] * 4,
            linkInertialFrameOrientations=[upright] * 4,
            linkParentIndices=[0] * 4,
            linkJointTypes=[pybullet.JOINT_REVOLUTE] * 2 + [pybullet.JOINT_FIXED] * 2,
            linkJointAxis=[(0.0, 1.0, 0.0)] * 4,
            physicsClientId=client,
        )
        still = dict(linearDamping=0.0, angularDamping=0.0, jointDamping=0.0, restitution=0.0, physicsClientId=client)
        for link in (-1, 0, 1, 2, 3):
            friction = 1.2 if link in WHEEL_JOINTS else 0.0
            pybullet.changeDynamics(
                robot, link, lateralFriction=friction, rollingFriction=0.0, spinningFriction=0.0, **still
            )
        for link in WHEEL_JOINTS:
            inertia = (0.1 * body.wheel_inertia, body.wheel_inertia, 0.1 * body.wheel_inertia)
            pybullet.changeDynamics(robot, link, localInertiaDiagonal=inertia, physicsClientId=client)
        return robot
