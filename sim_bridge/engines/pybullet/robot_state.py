"""State and inputs of one robot in a PyBullet world."""

import math
from collections.abc import Iterable
from typing import Any

import numpy as np

from robot_core.errors import NaoGaitError
from robot_core.geometry import as_point, cross, rotation_matrix
from robot_core.robot import RobotDescription
from robot_core.types import FloatArray
from sim_bridge.body import BodyPose
from sim_bridge.engines.backend import RobotModel
from sim_bridge.engines.pybullet.library import bullet
from sim_bridge.engines.pybullet.robot import RobotBody
from sim_bridge.motors import TorqueLimits
from sim_bridge.plant import Plant
from sim_bridge.state import StartState, StepInput, TrueState

_POSITION, _VELOCITY, _TORQUE = 0, 1, 3
"""Fields of a joint state."""


class PyBulletRobot:
    """One robot of a simulation that may be built several times."""

    def __init__(self, client: int, robot: RobotModel) -> None:
        """Prepare the servos; `build` loads the robot.

        Args:
            client: Of PyBullet.
            robot: The individual.
        """
        self._client, self._robot, self._plant = client, robot, robot.plant
        plant = robot.plant
        self._limits = TorqueLimits(robot.description, plant, robot.individual)
        step, lag = plant.physics.step, plant.motor.lag
        # PyBullet's gain is per step; this one is exact for a first-order lag sampled every step
        gain = 1.0 - math.exp(-step / lag) if lag > 0.0 else 1.0
        self._rate = gain / step
        self._reach = self._limits.top_speed / self._rate
        count = len(robot.description.joint_names)
        self._gains, self._ones = [gain] * count, [1.0] * count
        self._sole_friction = robot.individual.friction

    def build(
        self, floor: int, terrain: list[int], *, visible: bool, ball: bool, bit: int, meets: int
    ) -> None:
        """Load the robot into an empty world; `RobotBody` explains the other arguments.

        Args:
            floor: Body of the floor.
            terrain: Bodies of the terrain.
            visible: With visual shapes.
            ball: There is a ball.
            bit: Collision group of this robot.
            meets: Groups that it meets.
        """
        self._floor, self._terrain = floor, terrain
        self._model = RobotBody(
            self._client,
            self._robot,
            visible=visible,
            sole_friction=self._sole_friction,
            ball=ball,
            bit=bit,
            meets=meets,
        )

    @property
    def body(self) -> int:
        """Its number in PyBullet."""
        return self._model.body

    def place(self, start: StartState) -> None:
        """Put the robot at its start, at rest."""
        client = self._client
        torso = rotation_matrix(start.torso_rotation)
        position = start.torso_position + torso @ self._model.inertial_position
        _, rotation = bullet.multiplyTransforms(
            [0.0, 0.0, 0.0],
            start.torso_rotation.tolist(),
            [0.0, 0.0, 0.0],
            self._model.inertial_rotation,
        )
        body = self._model.body
        bullet.resetBasePositionAndOrientation(
            body, position.tolist(), rotation, physicsClientId=client
        )
        for joint, angle in zip(self._model.joints, start.joint_position.tolist(), strict=True):
            bullet.resetJointState(body, joint, angle, 0.0, physicsClientId=client)
        still = [0.0, 0.0, 0.0]
        bullet.resetBaseVelocity(body, still, still, physicsClientId=client)
        self._states: tuple[tuple[float, ...], ...] | None = None
        self._torque_limits = np.zeros(len(self._model.joints))
        self._legs_touch = False

    def apply(self, given: StepInput) -> None:
        """Set what acts on the robot in the next physics step."""
        setpoint, torque_scale, push_force = given
        client, body = self._client, self._model.body
        states = self._joint_states()
        position, velocity, torque = (
            np.array([state[field] for state in states])
            for field in (_POSITION, _VELOCITY, _TORQUE)
        )
        # a target further away would only ask for more than the motor's top speed
        way = np.clip(setpoint - position, -self._reach, self._reach)
        limits = torque_scale * self._limits.now(velocity, torque, way * self._rate)
        bullet.setJointMotorControlArray(
            body,
            self._model.joints,
            bullet.POSITION_CONTROL,
            targetPositions=(position + way).tolist(),
            positionGains=self._gains,
            velocityGains=self._ones,
            forces=limits.tolist(),
            physicsClientId=client,
        )
        self._torque_limits = limits
        if push_force.any():
            centre, _ = bullet.getBasePositionAndOrientation(body, physicsClientId=client)
            bullet.applyExternalForce(
                body, -1, push_force.tolist(), centre, bullet.WORLD_FRAME, physicsClientId=client
            )

    def watch(self) -> None:
        """Take note of a physics step: joint states are new, legs may have touched."""
        self._states = None
        if not self._legs_touch and self._plant.physics.self_collision:
            body = self._model.body
            points = bullet.getContactPoints(body, body, physicsClientId=self._client)
            self._legs_touch = any(point[9] > 0.0 for point in points)

    def observe(self) -> TrueState:
        """The state now."""
        client, body = self._client, self._model.body
        centre, inertial = bullet.getBasePositionAndOrientation(body, physicsClientId=client)
        linear, angular = bullet.getBaseVelocity(body, physicsClientId=client)
        spin = np.array(angular)
        _, quaternion = bullet.multiplyTransforms(
            [0.0, 0.0, 0.0], inertial, [0.0, 0.0, 0.0], self._model.inertial_inverse
        )
        rotation = rotation_matrix(np.array(quaternion))
        offset = rotation @ self._model.inertial_position
        position = np.array(centre) - offset
        states = self._joint_states()
        angles = np.array([state[_POSITION] for state in states])
        pose = self._robot.body.pose(position, rotation, angles)
        torque = np.array([state[_TORQUE] for state in states])
        touch, self._legs_touch = self._legs_touch, False
        return TrueState(
            torso_position=position,
            torso_rotation=np.array(quaternion),
            torso_matrix=rotation,
            torso_linear_velocity=np.array(linear) - cross(angular, as_point(offset)),
            torso_angular_velocity=rotation.T @ spin,
            joint_position=angles,
            joint_velocity=np.array([state[_VELOCITY] for state in states]),
            pose=pose,
            # a motor with limit 0 keeps reporting its last torque
            joint_torque=np.clip(torque, -self._torque_limits, self._torque_limits),
            sole_wrench=self._sole_wrenches(pose),
            legs_touch=touch,
        )

    def disturb(self, torque_share: FloatArray, friction: float | None) -> None:
        """Set the faults; see `Backend.disturb`."""
        individual = self._robot.individual
        self._limits.weaken(torque_share)
        self._sole_friction = individual.friction if friction is None else friction
        self._model.set_sole_friction(self._sole_friction)

    def _joint_states(self) -> tuple[tuple[float, ...], ...]:
        """Position, velocity, reaction forces and motor torque per joint; read once per step."""
        if self._states is None:
            self._states = bullet.getJointStates(
                self._model.body, self._model.joints, physicsClientId=self._client
            )
        return self._states

    def _sole_wrenches(self, pose: BodyPose) -> tuple[FloatArray, FloatArray]:
        """Left, right (6,): sum of the contact forces [N] and torques [N m] in the sole frame."""
        wrenches = []
        for side, link in enumerate(self._model.soles):
            ox, oy, oz = pose.sole_position[side].tolist()
            force, torque = [0.0, 0.0, 0.0], [0.0, 0.0, 0.0]
            for point in self._contacts_with_ground(link):
                fx, fy, fz = (
                    point[9] * point[7][i] + point[10] * point[11][i] + point[12] * point[13][i]
                    for i in range(3)
                )
                x, y, z = point[5][0] - ox, point[5][1] - oy, point[5][2] - oz
                force = [force[0] + fx, force[1] + fy, force[2] + fz]
                torque[0] += y * fz - z * fy
                torque[1] += z * fx - x * fz
                torque[2] += x * fy - y * fx
            to_sole = pose.sole_rotation[side].T
            wrenches.append(np.concatenate([to_sole @ force, to_sole @ torque]))
        return wrenches[0], wrenches[1]

    def _contacts_with_ground(self, link: int) -> tuple[tuple[Any, ...], ...]:
        """PyBullet's contact points of a sole, which meets only the ground."""
        if not self._terrain:
            points = bullet.getContactPoints(
                self._model.body, self._floor, link, -1, physicsClientId=self._client
            )
        else:
            points = bullet.getContactPoints(
                bodyA=self._model.body, linkIndexA=link, physicsClientId=self._client
            )
        return points  # type: ignore[no-any-return]


def refuse(plant: Plant, robots: Iterable[RobotDescription]) -> None:
    """Raise NaoGaitError for the first option or motor that PyBullet cannot honour."""
    for robot in robots:
        if joint := robot.soft_joint:
            allowed = f"mujoco, since {joint} of {robot.name} has a motor that gives way"
            raise NaoGaitError("engine", "pybullet", allowed)
    servo = plant.motor
    for key, honoured, allowed in (
        ("stiffness", servo.stiffness is None, "null"),
        ("armature", servo.armature is None, "null"),
        ("friction", servo.friction == 0.0, "0"),
        ("play", servo.play == 0.0, "0"),
        ("encoder_feedback", not servo.encoder_feedback, "false"),
    ):
        if not honoured:
            allowed += " with engine pybullet; any other value needs engine:=mujoco"
            raise NaoGaitError(f"{plant.name}: motor.{key}", getattr(servo, key), allowed)
