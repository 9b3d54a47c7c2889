"""One robot in a PyBullet world: its links, joints, collisions and couplings."""

import tempfile
from pathlib import Path

import numpy as np

from sim_bridge.ball import shoe
from sim_bridge.body import SHOE
from sim_bridge.engines.backend import RobotModel
from sim_bridge.engines.pybullet.library import bullet
from sim_bridge.engines.pybullet.scene import (
    BALL,
    FLOOR,
    LEFT_LEG,
    RIGHT_LEG,
    ROBOT,
    SHOES,
    SOLE_POINTS,
)
from sim_bridge.engines.simulation_urdf import simulation_urdf
from sim_bridge.soles import contact_of

_GEAR_FORCE = 1e4
"""[N m] that holds joints of one motor together; far above what a leg can apply."""
_GEAR_ERP = 0.8
"""Share of an angle between coupled joints that is removed per step: 0.03 deg remain under the
largest loads. With a motor on each side the solver would need four times the iterations."""


class RobotBody:
    """One robot in a PyBullet world.

    Attributes:
        body: The body of the whole robot; its base is the torso.
        joints: (n) PyBullet's joints, in the order of the joint arrays.
        soles: left, right: links with the contact points of the soles.
        inertial_position: (3,) [m] of the base's inertial frame in the torso.
        inertial_rotation: Quaternion of the base's inertial frame in the torso.
        inertial_inverse: Quaternion of the torso in the base's inertial frame.
    """

    def __init__(
        self,
        client: int,
        robot: RobotModel,
        *,
        visible: bool,
        sole_friction: float,
        ball: bool,
        bit: int = ROBOT,
        meets: int = 0,
    ) -> None:
        """Load the robot.

        Args:
            client: Of PyBullet.
            robot: The individual.
            visible: With visual shapes.
            sole_friction: Coefficient of the soles on the floor.
            ball: There is a ball, which meets everything but the soles.
            bit: Collision group of this robot.
            meets: Groups of other robots and fixtures that it meets.
        """
        self._client = client
        self._robot = robot
        urdf = simulation_urdf(
            robot.body,
            visual=visible,
            shoes=tuple(shoe(sole) for sole in robot.body.soles) if ball else (),
        )
        flags = bullet.URDF_USE_INERTIA_FROM_FILE
        if robot.plant.physics.self_collision:
            flags |= bullet.URDF_USE_SELF_COLLISION
        if not visible:
            flags |= bullet.URDF_IGNORE_VISUAL_SHAPES
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder, "simulated.urdf")
            path.write_text(urdf, encoding="utf-8")
            self.body: int = bullet.loadURDF(
                str(path), useFixedBase=False, flags=flags, physicsClientId=client
            )
        joints: dict[str, int] = {}
        self._links = {robot.body.links[0].name: -1}
        for index in range(bullet.getNumJoints(self.body, physicsClientId=client)):
            info = bullet.getJointInfo(self.body, index, physicsClientId=client)
            joints[info[1].decode()] = index
            self._links[info[12].decode()] = index
        self.joints = [joints[name] for name in robot.description.joint_names]
        left, right = robot.body.soles
        self.soles = (self._links[left.name], self._links[right.name])
        base = bullet.getDynamicsInfo(self.body, -1, physicsClientId=client)
        self.inertial_position = np.array(base[3])
        self.inertial_rotation = base[4]
        _, self.inertial_inverse = bullet.invertTransform([0.0, 0.0, 0.0], base[4])
        self._set_dynamics(sole_friction)
        self._set_collisions(bit, meets | (BALL if ball else 0))
        self._couple_joints()

    def _set_dynamics(self, sole_friction: float) -> None:
        plant, individual = self._robot.plant, self._robot.individual
        count = len(self._robot.body.soles[0].points)
        stiffness, damping = contact_of(plant, individual, count, self._robot.body.mass)
        for index in self._links.values():
            options: dict[str, float] = {"lateralFriction": individual.friction}
            if index in self.soles:
                options["lateralFriction"] = sole_friction
                if not plant.contact.rigid:
                    options["contactStiffness"] = stiffness
                    options["contactDamping"] = damping
            bullet.changeDynamics(
                self.body,
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

    def set_sole_friction(self, friction: float) -> None:
        """Set the coefficient of both soles on the floor."""
        for index in self.soles:
            bullet.changeDynamics(
                self.body, index, lateralFriction=friction, physicsClientId=self._client
            )

    def _set_collisions(self, bit: int, meets: int) -> None:
        """Let the floor meet all but the plates of the feet, and each leg the other leg."""

        def mask(link: int, group: int, others: int) -> None:
            bullet.setCollisionFilterGroupMask(
                self.body, link, group, others, physicsClientId=self._client
            )

        feet = {sole.parent for sole in self._robot.body.soles}
        for link in self._robot.body.links:
            group, others = bit, meets
            if link.side:
                own, other = (LEFT_LEG, RIGHT_LEG)[:: 1 if link.side == "left" else -1]
                group, others = group | own, others | other
            others = others & ~BALL if link.name in feet else others | FLOOR
            mask(self._links[link.name], group, others)
        for index in self.soles:
            mask(index, SOLE_POINTS, FLOOR)
        for name, index in self._links.items():
            if name.endswith(SHOE):
                mask(index, SHOES, meets & BALL)
                bullet.changeDynamics(
                    self.body, index, lateralFriction=1.0, physicsClientId=self._client
                )

    def _couple_joints(self) -> None:
        """Hold joints that share a motor at the same angle."""
        description = self._robot.description
        for leader, follower in description.coupled_joints:
            first, second = (self.joints[description.index(name)] for name in (leader, follower))
            gear = bullet.createConstraint(
                self.body, first, self.body, second, bullet.JOINT_GEAR,
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
