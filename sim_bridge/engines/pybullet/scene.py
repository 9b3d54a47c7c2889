"""Contents of a PyBullet world: floor, terrain, tiles, ball and robot, and their collisions."""

import tempfile
from collections.abc import Iterable
from pathlib import Path

import numpy as np

from sim_bridge.ball import FRICTION, Ball, shoe
from sim_bridge.body import SHOE
from sim_bridge.engines.backend import RobotModel
from sim_bridge.engines.pybullet.library import bullet
from sim_bridge.engines.simulation_urdf import simulation_urdf
from sim_bridge.plant import Physics
from sim_bridge.soles import contact_of
from sim_bridge.terrain import Prism

_FLOOR, _UPPER_BODY, _LEFT_LEG, _RIGHT_LEG, _SOLE_POINTS, _SHOE, _BALL = (
    1 << bit for bit in range(7)
)
"""Collision groups."""
_GEAR_FORCE = 1e4
"""[N m] that holds joints of one motor together; far above what a leg can apply."""
_GEAR_ERP = 0.8
"""Share of an angle between coupled joints that is removed per step: 0.03 deg remain under the
largest loads. With a motor on each side the solver would need four times the iterations."""
_TILE = 0.25
"""[m] edge of the floor's tiles, which are only visible."""
_TILES = 24
"""Number of tiles in each direction, around the origin."""
_TILE_COLORS = ((0.78, 0.82, 0.86, 1.0), (0.55, 0.62, 0.70, 1.0))


def set_physics(client: int, physics: Physics) -> None:
    """Step, solver and gravity of an empty world."""
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


def add_floor(client: int) -> int:
    """An unbounded plane at height 0; its body."""
    plane = bullet.createCollisionShape(bullet.GEOM_PLANE, physicsClientId=client)
    floor: int = bullet.createMultiBody(0.0, plane, physicsClientId=client)
    # PyBullet multiplies the coefficients of the two bodies
    bullet.changeDynamics(floor, -1, lateralFriction=1.0, restitution=0.0, physicsClientId=client)
    return floor


def add_terrain(
    client: int, ground: Iterable[Prism], *, collides: bool, visible: bool
) -> list[int]:
    """Add each prism as a convex hull that does not move.

    Args:
        client: of PyBullet.
        ground: the prisms.
        collides: with a collision shape.
        visible: with a visual shape.

    Returns:
        Bodies of the prisms, in their order.
    """
    bodies = []
    for prism in ground:
        vertices = prism.vertices.tolist()
        collision = visual = -1
        if collides:
            collision = bullet.createCollisionShape(
                bullet.GEOM_MESH, vertices=vertices, physicsClientId=client
            )
        if visible:
            # Each triangle has corners of its own: shared ones would blur the edges.
            corners = [vertices[i] for triangle in prism.triangles for i in triangle]
            visual = bullet.createVisualShape(
                bullet.GEOM_MESH,
                vertices=corners,
                indices=list(range(len(corners))),
                rgbaColor=prism.color,
                specularColor=[0.0, 0.0, 0.0],
                physicsClientId=client,
            )
        bodies.append(bullet.createMultiBody(0.0, collision, visual, physicsClientId=client))
        if collides:
            bullet.changeDynamics(
                bodies[-1],
                -1,
                lateralFriction=1.0,
                restitution=0.0,
                collisionMargin=0.0,  # otherwise a prism is 1 mm higher than it looks
                physicsClientId=client,
            )
    return bodies


def add_tiles(client: int) -> None:
    """A checkerboard on the floor, so that a walk can be seen; nothing collides with it."""
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
            physicsClientId=client,
        )
        bullet.createMultiBody(0.0, baseVisualShapeIndex=shape, physicsClientId=client)


def add_ball(client: int, ball: Ball, gravity: float) -> int:
    """The ball at its start; its body."""
    sphere = bullet.createCollisionShape(
        bullet.GEOM_SPHERE, radius=ball.radius, physicsClientId=client
    )
    body: int = bullet.createMultiBody(
        ball.mass, sphere, basePosition=ball.start.tolist(), physicsClientId=client
    )
    bullet.changeDynamics(
        body,
        -1,
        # PyBullet multiplies it by the other body's: floor and shoes have 1
        lateralFriction=FRICTION,
        # and multiplies the rolling friction by the floor's friction
        rollingFriction=ball.rolling_resistance(gravity),
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
        body, -1, _BALL, _FLOOR | _UPPER_BODY | _LEFT_LEG | _RIGHT_LEG | _SHOE,
        physicsClientId=client,
    )  # fmt: skip
    return body


class RobotBody:
    """One robot in a PyBullet world.

    Attributes:
        body: the body of the whole robot; its base is the torso.
        joints: (n) PyBullet's joints, in the order of the joint arrays.
        soles: left, right: links with the contact points of the soles.
        inertial_position: (3,) [m] of the base's inertial frame in the torso.
        inertial_rotation: quaternion of the base's inertial frame in the torso.
        inertial_inverse: quaternion of the torso in the base's inertial frame.
    """

    def __init__(
        self, client: int, robot: RobotModel, *, visible: bool, sole_friction: float, ball: bool
    ) -> None:
        """Load the robot.

        Args:
            client: of PyBullet.
            robot: the individual.
            visible: with visual shapes.
            sole_friction: coefficient of the soles on the floor.
            ball: with shoes that the ball meets.
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

    def _set_dynamics(self, sole_friction: float) -> None:
        plant, individual = self._robot.plant, self._robot.individual
        count = len(self._robot.body.soles[0].points)
        stiffness, damping = contact_of(plant, individual, count)
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

    def set_collisions(self, floor: Iterable[int], *, ball: bool) -> None:
        """Let the floor meet all but the plates of the feet, and each leg the other leg.

        Args:
            floor: bodies of the floor and the terrain.
            ball: there is a ball, which meets everything but the soles.
        """

        def mask(body: int, link: int, group: int, others: int) -> None:
            bullet.setCollisionFilterGroupMask(
                body, link, group, others, physicsClientId=self._client
            )

        of_ball = _BALL if ball else 0
        meets_floor = _UPPER_BODY | _LEFT_LEG | _RIGHT_LEG | _SOLE_POINTS | of_ball
        for ground in floor:
            mask(ground, -1, _FLOOR, meets_floor)
        feet = {sole.parent for sole in self._robot.body.soles}
        for link in self._robot.body.links:
            if not link.side:
                group, others = _UPPER_BODY, _FLOOR | of_ball
            else:
                own, other = (
                    (_LEFT_LEG, _RIGHT_LEG) if link.side == "left" else (_RIGHT_LEG, _LEFT_LEG)
                )
                group, others = own, other if link.name in feet else other | _FLOOR | of_ball
            mask(self.body, self._links[link.name], group, others)
        for index in self.soles:
            mask(self.body, index, _SOLE_POINTS, _FLOOR)
        for name, index in self._links.items():
            if name.endswith(SHOE):
                mask(self.body, index, _SHOE, of_ball)
                bullet.changeDynamics(
                    self.body, index, lateralFriction=1.0, physicsClientId=self._client
                )

    def couple_joints(self) -> None:
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
