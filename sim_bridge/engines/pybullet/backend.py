"""The plant in PyBullet."""

import contextlib
import ctypes
import math
import os
import sys
import tempfile
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from nao_lipm_gait.errors import NaoGaitError
from nao_lipm_gait.geometry import cross, rotation_matrix
from nao_lipm_gait.types import FloatArray
from sim_bridge.ball import FRICTION, Ball, BallState, shoe
from sim_bridge.body import SHOE, BodyPose
from sim_bridge.engines.backend import RobotModel, StartState, StepInput, TrueState, only_one
from sim_bridge.engines.pybullet.terrain import lay_terrain
from sim_bridge.engines.simulation_urdf import simulation_urdf
from sim_bridge.motors import TorqueLimits
from sim_bridge.plant import Plant
from sim_bridge.soles import contact_of
from sim_bridge.terrain import Prism

_C_LIBRARY = ctypes.CDLL(None)
"""For its output buffers."""


@contextlib.contextmanager
def _silenced() -> Iterator[None]:
    """PyBullet's C code prints to the file descriptors 1 and 2, past Python."""
    sys.stdout.flush()
    sys.stderr.flush()
    with contextlib.ExitStack() as undo, open(os.devnull, "wb") as null:
        for descriptor in (1, 2):
            with contextlib.suppress(OSError):  # a closed one needs no silence
                saved = os.dup(descriptor)
                undo.callback(os.close, saved)
                undo.callback(os.dup2, saved, descriptor)
                os.dup2(null.fileno(), descriptor)
        undo.callback(_C_LIBRARY.fflush, None)
        yield


with _silenced():
    import pybullet as bullet

_FLOOR, _UPPER_BODY, _LEFT_LEG, _RIGHT_LEG, _SOLE_POINTS, _SHOE, _BALL = (
    1 << bit for bit in range(7)
)
"""Collision groups."""
_POSITION, _VELOCITY, _TORQUE = 0, 1, 3
"""Fields of a joint state."""
_GEAR_FORCE = 1e4
"""[N m] that holds joints of one motor together; far above what a leg can apply."""
_GEAR_ERP = 0.8
"""Share of an angle between coupled joints that is taken back per step: 0.03 deg remain under the
largest loads. With a motor on each side the solver would need four times the iterations."""
_TILE = 0.25
"""[m] edge of the floor's tiles in the window; they are laid around the robot where it starts."""
_TILES = 24
"""Number of tiles in each direction."""
_TILE_COLORS = ((0.78, 0.82, 0.86, 1.0), (0.55, 0.62, 0.70, 1.0))


class PyBulletBackend:
    """PyBullet behind the four methods of `Backend`.

    A position servo is here a constraint on the joint's velocity with a torque limit: it has no
    stiffness of its own, so stiffness, rotor inertia, dry friction and play are refused.
    """

    def __init__(
        self,
        robots: Sequence[RobotModel],
        ground: tuple[Prism, ...] = (),
        *,
        gui: bool = False,
        ball: Ball | None = None,
    ) -> None:
        model = only_one(robots, "pybullet")
        robot, plant, individual, body = (
            model.description, model.plant, model.individual, model.body
        )  # fmt: skip
        _refuse(plant)
        self._ball = ball
        self._ball_body = -1
        self._robot = robot
        self._plant = plant
        self._individual = individual
        self._body = body
        self._visual = gui
        self._limits = TorqueLimits(robot, plant, individual)
        step, lag = plant.physics.step, plant.motor.lag
        # PyBullet's gain is per step; this one is exact for a first-order lag sampled every step
        self._gain = 1.0 - math.exp(-step / lag) if lag > 0.0 else 1.0
        self._rate = self._gain / step
        self._reach = self._limits.top_speed / self._rate
        self._gains = [self._gain] * len(robot.joint_names)
        self._ones = [1.0] * len(robot.joint_names)
        shoes = () if ball is None else tuple(shoe(sole) for sole in body.soles)
        self._urdf = simulation_urdf(body, visual=self._visual, shoes=shoes)
        with _silenced():
            self._client = bullet.connect(bullet.GUI if gui else bullet.DIRECT)
        if self._client < 0:
            raise NaoGaitError("gui", gui, "false where there is no display")
        self._ground = ground
        self._floor = self._model = -1
        self._terrain: list[int] = []
        self._joints: list[int] = []
        self._soles = (-1, -1)
        self._states: tuple[tuple[float, ...], ...] | None = None
        self._torque_limits = np.zeros(len(robot.joint_names))
        self._legs_touch = False
        self._sole_friction = individual.friction

    def reset(self, starts: Sequence[StartState]) -> None:
        (start,) = starts
        # A new world: PyBullet keeps contacts and solver caches when bodies are only moved.
        with _silenced():
            bullet.resetSimulation(physicsClientId=self._client)
            self._build()
        torso = rotation_matrix(start.torso_rotation)
        position = start.torso_position + torso @ self._inertial_position
        _, rotation = bullet.multiplyTransforms(
            [0.0, 0.0, 0.0],
            start.torso_rotation.tolist(),
            [0.0, 0.0, 0.0],
            self._inertial_rotation,
        )
        bullet.resetBasePositionAndOrientation(
            self._model, position.tolist(), rotation, physicsClientId=self._client
        )
        for joint, angle in zip(self._joints, start.joint_position.tolist(), strict=True):
            bullet.resetJointState(self._model, joint, angle, 0.0, physicsClientId=self._client)
        self._states = None
        self._torque_limits = np.zeros(len(self._joints))
        self._legs_touch = False

    def step(self, inputs: Sequence[StepInput]) -> None:
        ((setpoint, torque_scale, push_force),) = inputs
        client, model = self._client, self._model
        states = self._joint_states()
        position, velocity, torque = (
            np.array([state[field] for state in states])
            for field in (_POSITION, _VELOCITY, _TORQUE)
        )
        # a target further off would only ask for more than the motor's top speed
        way = np.clip(setpoint - position, -self._reach, self._reach)
        limits = torque_scale * self._limits.now(velocity, torque, way * self._rate)
        bullet.setJointMotorControlArray(
            model,
            self._joints,
            bullet.POSITION_CONTROL,
            targetPositions=(position + way).tolist(),
            positionGains=self._gains,
            velocityGains=self._ones,
            forces=limits.tolist(),
            physicsClientId=client,
        )
        self._torque_limits = limits
        if push_force.any():
            centre, _ = bullet.getBasePositionAndOrientation(model, physicsClientId=client)
            bullet.applyExternalForce(
                model, -1, push_force.tolist(), centre, bullet.WORLD_FRAME, physicsClientId=client
            )
        bullet.stepSimulation(physicsClientId=client)
        self._states = None
        if not self._legs_touch and self._plant.physics.self_collision:
            points = bullet.getContactPoints(model, model, physicsClientId=client)
            self._legs_touch = any(point[9] > 0.0 for point in points)

    def observe(self) -> list[TrueState]:
        client, model = self._client, self._model
        centre, inertial = bullet.getBasePositionAndOrientation(model, physicsClientId=client)
        linear, angular = bullet.getBaseVelocity(model, physicsClientId=client)
        spin = np.array(angular)
        _, quaternion = bullet.multiplyTransforms(
            [0.0, 0.0, 0.0], inertial, [0.0, 0.0, 0.0], self._inertial_inverse
        )
        rotation = rotation_matrix(np.array(quaternion))
        offset = rotation @ self._inertial_position
        position = np.array(centre) - offset
        states = self._joint_states()
        angles = np.array([state[_POSITION] for state in states])
        pose = self._body.pose(position, rotation, angles)
        torque = np.array([state[_TORQUE] for state in states])
        touch, self._legs_touch = self._legs_touch, False
        state = TrueState(
            torso_position=position,
            torso_rotation=np.array(quaternion),
            torso_matrix=rotation,
            torso_linear_velocity=np.array(linear) - cross(angular, offset.tolist()),
            torso_angular_velocity=rotation.T @ spin,
            joint_position=angles,
            joint_velocity=np.array([state[_VELOCITY] for state in states]),
            pose=pose,
            # a motor with limit 0 keeps reporting its last torque
            joint_torque=np.clip(torque, -self._torque_limits, self._torque_limits),
            sole_wrench=self._sole_wrenches(pose),
            legs_touch=touch,
        )
        return [state]

    def disturb(self, robot: int, torque_share: FloatArray, friction: float | None) -> None:
        self._limits.weaken(torque_share)
        self._sole_friction = self._individual.friction if friction is None else friction
        for index in self._soles:
            bullet.changeDynamics(
                self._model,
                index,
                lateralFriction=self._sole_friction,
                physicsClientId=self._client,
            )

    def ball(self) -> BallState | None:
        if self._ball is None:
            return None
        body, client = self._ball_body, self._client
        position, _ = bullet.getBasePositionAndOrientation(body, physicsClientId=client)
        velocity, _ = bullet.getBaseVelocity(body, physicsClientId=client)
        return BallState(np.array(position), np.array(velocity))

    def put_ball(self, position: FloatArray) -> None:
        still = [0.0, 0.0, 0.0]
        body, client = self._ball_body, self._client
        bullet.resetBasePositionAndOrientation(
            body, position.tolist(), [*still, 1.0], physicsClientId=client
        )
        bullet.resetBaseVelocity(body, still, still, physicsClientId=client)

    def close(self) -> None:
        if self._client >= 0:
            with contextlib.suppress(bullet.error):
                bullet.disconnect(physicsClientId=self._client)
            self._client = -1

    def __del__(self) -> None:
        if getattr(self, "_client", -1) >= 0:
            self.close()

    def _joint_states(self) -> tuple[tuple[float, ...], ...]:
        """Position, velocity, reaction forces and motor torque per joint; read once per step."""
        if self._states is None:
            self._states = bullet.getJointStates(
                self._model, self._joints, physicsClientId=self._client
            )
        return self._states

    def _sole_wrenches(self, pose: BodyPose) -> tuple[FloatArray, FloatArray]:
        wrenches = []
        for side, link in enumerate(self._soles):
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
        """PyBullet's contact points of a sole, which meets nothing but the ground."""
        if not self._terrain:
            points = bullet.getContactPoints(
                self._model, self._floor, link, -1, physicsClientId=self._client
            )
        else:
            points = bullet.getContactPoints(
                bodyA=self._model, linkIndexA=link, physicsClientId=self._client
            )
        return points  # type: ignore[no-any-return]

    def _build(self) -> None:
        client, physics = self._client, self._plant.physics
        bullet.setPhysicsEngineParameter(
            fixedTimeStep=physics.step,
            numSolverIterations=physics.iterations,
            numSubSteps=0,
            deterministicOverlappingPairs=1,
            enableFileCaching=0,
            collisionFilterMode=0,
            physicsClientId=client,
        )
        bullet.setGravity(0.0, 0.0, -physics.gravity, physicsClientId=client)
        plane = bullet.createCollisionShape(bullet.GEOM_PLANE, physicsClientId=client)
        self._floor = bullet.createMultiBody(0.0, plane, physicsClientId=client)
        # PyBullet multiplies the coefficients of the two bodies
        bullet.changeDynamics(
            self._floor, -1, lateralFriction=1.0, restitution=0.0, physicsClientId=client
        )
        self._terrain = lay_terrain(
            bullet, client, self._ground, collides=True, visible=self._visual
        )
        if self._visual:
            self._lay_tiles()
        self._load_robot()
        self._set_dynamics()
        self._set_collisions()
        self._couple_joints()
        if self._ball is not None:
            self._add_ball(self._ball)

    def _add_ball(self, ball: Ball) -> None:
        client = self._client
        sphere = bullet.createCollisionShape(
            bullet.GEOM_SPHERE, radius=ball.radius, physicsClientId=client
        )
        self._ball_body = bullet.createMultiBody(
            ball.mass, sphere, basePosition=ball.start.tolist(), physicsClientId=client
        )
        bullet.changeDynamics(
            self._ball_body,
            -1,
            # PyBullet multiplies it with what it meets: the floor has 1, and the shoes
            lateralFriction=FRICTION,
            # and rolls with resistance x friction of the floor
            rollingFriction=ball.rolling_resistance(self._plant.physics.gravity),
            spinningFriction=0.0,
            restitution=0.0,
            linearDamping=0.0,
            angularDamping=0.0,
            contactStiffness=ball.stiffness,
            contactDamping=ball.damping,
            localInertiaDiagonal=[ball.inertia] * 3,
            physicsClientId=client,
        )
        bullet.setCollisionFilterGroupMask(
            self._ball_body, -1, _BALL, _FLOOR | _UPPER_BODY | _LEFT_LEG | _RIGHT_LEG | _SHOE,
            physicsClientId=client,
        )  # fmt: skip

    def _load_robot(self) -> None:
        flags = bullet.URDF_USE_INERTIA_FROM_FILE
        if self._plant.physics.self_collision:
            flags |= bullet.URDF_USE_SELF_COLLISION
        if not self._visual:
            flags |= bullet.URDF_IGNORE_VISUAL_SHAPES
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder, "simulated.urdf")
            path.write_text(self._urdf, encoding="utf-8")
            self._model = bullet.loadURDF(
                str(path), useFixedBase=False, flags=flags, physicsClientId=self._client
            )
        joints: dict[str, int] = {}
        self._links = {self._body.links[0].name: -1}
        for index in range(bullet.getNumJoints(self._model, physicsClientId=self._client)):
            info = bullet.getJointInfo(self._model, index, physicsClientId=self._client)
            joints[info[1].decode()] = index
            self._links[info[12].decode()] = index
        self._joints = [joints[name] for name in self._robot.joint_names]
        left, right = self._body.soles
        self._soles = (self._links[left.name], self._links[right.name])
        base = bullet.getDynamicsInfo(self._model, -1, physicsClientId=self._client)
        self._inertial_position = np.array(base[3])
        self._inertial_rotation = base[4]
        _, self._inertial_inverse = bullet.invertTransform([0.0, 0.0, 0.0], base[4])

    def _lay_tiles(self) -> None:
        """Something to see the walk by; nothing collides with it."""
        edges = (np.arange(_TILES + 1) - _TILES / 2) * _TILE
        for parity, color in enumerate(_TILE_COLORS):
            vertices: list[list[float]] = []
            indices: list[int] = []
            for i in range(_TILES):
                for j in range((i + parity) % 2, _TILES, 2):
                    first = len(vertices)
                    vertices += [
                        [float(edges[i + di]), float(edges[j + dj]), 0.0]
                        for di, dj in ((0, 0), (1, 0), (1, 1), (0, 1))
                    ]
                    indices += [first + corner for corner in (0, 1, 2, 0, 2, 3)]
            shape = bullet.createVisualShape(
                bullet.GEOM_MESH,
                vertices=vertices,
                indices=indices,
                rgbaColor=color,
                specularColor=[0.0, 0.0, 0.0],
                physicsClientId=self._client,
            )
            bullet.createMultiBody(0.0, baseVisualShapeIndex=shape, physicsClientId=self._client)

    def _set_dynamics(self) -> None:
        contact = self._plant.contact
        count = len(self._body.soles[0].points)
        stiffness, damping = contact_of(self._plant, self._individual, count)
        for index in self._links.values():
            options: dict[str, float] = {"lateralFriction": self._individual.friction}
            if index in self._soles:
                options["lateralFriction"] = self._sole_friction
                if not contact.rigid:
                    options["contactStiffness"] = stiffness
                    options["contactDamping"] = damping
            bullet.changeDynamics(
                self._model,
                index,
                spinningFriction=0.0,
                rollingFriction=0.0,
                restitution=0.0,
                linearDamping=0.0,
                angularDamping=0.0,
                jointDamping=0.0,
                physicsClientId=self._client,
                **options,
            )

    def _set_collisions(self) -> None:
        """The floor meets everything but the plates of the feet; a leg also meets the other leg."""

        def mask(body: int, link: int, group: int, others: int) -> None:
            bullet.setCollisionFilterGroupMask(
                body, link, group, others, physicsClientId=self._client
            )

        ball = 0 if self._ball is None else _BALL
        meets_floor = _UPPER_BODY | _LEFT_LEG | _RIGHT_LEG | _SOLE_POINTS | ball
        for ground in (self._floor, *self._terrain):
            mask(ground, -1, _FLOOR, meets_floor)
        feet = {sole.parent for sole in self._body.soles}
        for link in self._body.links:
            if not link.side:
                group, others = _UPPER_BODY, _FLOOR | ball
            else:
                own, other = (
                    (_LEFT_LEG, _RIGHT_LEG) if link.side == "left" else (_RIGHT_LEG, _LEFT_LEG)
                )
                group, others = own, other if link.name in feet else other | _FLOOR | ball
            mask(self._model, self._links[link.name], group, others)
        for index in self._soles:
            mask(self._model, index, _SOLE_POINTS, _FLOOR)
        for name, index in self._links.items():
            if name.endswith(SHOE):
                mask(self._model, index, _SHOE, ball)
                bullet.changeDynamics(
                    self._model, index, lateralFriction=1.0, physicsClientId=self._client
                )

    def _couple_joints(self) -> None:
        for leader, follower in self._robot.coupled_joints:
            first, second = (self._joints[self._robot.index(name)] for name in (leader, follower))
            gear = bullet.createConstraint(
                self._model, first, self._model, second, bullet.JOINT_GEAR,
                [0.0, 0.0, 1.0], [0.0, 0.0, 0.0], [0.0, 0.0, 0.0], physicsClientId=self._client,
            )  # fmt: skip
            bullet.changeConstraint(
                gear,
                gearRatio=-1.0,
                relativePositionTarget=0.0,
                erp=_GEAR_ERP,
                maxForce=_GEAR_FORCE,
                physicsClientId=self._client,
            )


def _refuse(plant: Plant) -> None:
    """NaoGaitError for options that PyBullet cannot honour."""
    motor = plant.motor
    for key, honoured, allowed in (
        ("stiffness", motor.stiffness is None, "null with engine pybullet"),
        ("armature", motor.armature is None, "null with engine pybullet"),
        ("friction", motor.friction == 0.0, "0 with engine pybullet"),
        ("play", motor.play == 0.0, "0 with engine pybullet"),
        ("encoder_feedback", not motor.encoder_feedback, "false with engine pybullet"),
    ):
        if not honoured:
            raise NaoGaitError(f"{plant.name}: motor.{key}", getattr(motor, key), allowed)
