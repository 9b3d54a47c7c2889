"""What surrounds the robots in a PyBullet world: floor, terrain, pitch and ball."""

from collections.abc import Iterable, Sequence

import numpy as np
import pinocchio as pin

from robot_core.field import COLORS
from robot_core.types import Point2
from sim_bridge.ball import FRICTION, Ball
from sim_bridge.engines.pybullet.library import bullet
from sim_bridge.plant import Physics
from sim_bridge.surroundings import Fixture, Surroundings
from sim_bridge.terrain import Prism

FLOOR, LEFT_LEG, RIGHT_LEG, SOLE_POINTS, SHOES, BALL, FIXTURE, ROBOT = (
    1 << bit for bit in range(8)
)
"""Collision groups; `ROBOT` is that of the first robot, the next robots have the bits after it."""
_ALL_ROBOTS = 2**31 - ROBOT
_NET_STIFFNESS, _NET_DAMPING = 1e5, 50.0
"""[N/m] and [N s/m] of a net: it takes the speed of a ball."""
_SURFACE = 10.0
"""[m] of the surface around the carpet."""
_SURFACE_COLOR = (0.45, 0.45, 0.47)
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
    _set_ground(client, floor)
    return floor


def _set_ground(client: int, body: int) -> None:
    meets = _ALL_ROBOTS | SOLE_POINTS | BALL
    bullet.setCollisionFilterGroupMask(body, -1, FLOOR, meets, physicsClientId=client)


def add_terrain(client: int, ground: Iterable[Prism], *, visible: bool) -> list[int]:
    """Add each prism as a convex hull that does not move.

    Returns:
        Bodies of the prisms, in their order.
    """
    bodies = []
    for prism in ground:
        vertices = prism.vertices.tolist()
        collision = bullet.createCollisionShape(
            bullet.GEOM_MESH, vertices=vertices, physicsClientId=client
        )
        visual = -1
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
        bullet.changeDynamics(
            bodies[-1],
            -1,
            lateralFriction=1.0,
            restitution=0.0,
            collisionMargin=0.0,  # otherwise a prism is 1 mm higher than it looks
            physicsClientId=client,
        )
        _set_ground(client, bodies[-1])
    return bodies


def add_tiles(client: int) -> None:
    """A checkerboard on the floor, so that a walk can be seen; nothing collides with it."""
    edges = (np.arange(_TILES + 1) - _TILES / 2) * _TILE
    for parity, color in enumerate(_TILE_COLORS):
        tiles = [
            tuple(
                (float(edges[i + di]), float(edges[j + dj]))
                for di, dj in ((0, 0), (1, 0), (1, 1), (0, 1))
            )
            for i in range(_TILES)
            for j in range((i + parity) % 2, _TILES, 2)
        ]
        _add_quads(client, tiles, 0.0, color)


def _add_quads(
    client: int,
    quads: Iterable[Sequence[Point2]],
    height: float,
    color: tuple[float, float, float, float],
) -> None:
    """Add visible quadrangles that look upwards.

    Args:
        client: Of PyBullet.
        quads: x, y [m] of the four corners of each, counter-clockwise.
        height: [m] of all.
        color: Red, green, blue, alpha.
    """
    vertices: list[list[float]] = []
    indices: list[int] = []
    for quad in quads:
        first = len(vertices)
        vertices += [[x, y, height] for x, y in quad]
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


def add_pitch(client: int, surroundings: Surroundings) -> None:
    """Carpet and lines, which are only visible.

    The lines are at the height of the floor. Carpet and surface are drawn below it, so that they
    cover each other properly.
    """
    length, width = surroundings.carpet or (0.0, 0.0)
    for x, y, height, color in (
        (length / 2.0 + _SURFACE, width / 2.0 + _SURFACE, -0.004, _SURFACE_COLOR),
        (length / 2.0, width / 2.0, -0.002, COLORS["green"]),
    ):
        corners = ((-x, -y), (x, -y), (x, y), (-x, y))
        _add_quads(client, [corners], height, (*color, 1.0))
    lines = [marking.corners() for marking in surroundings.markings]
    _add_quads(client, lines, 0.0, (*COLORS["white"], 1.0))


def add_fixtures(client: int, fixtures: Iterable[Fixture], *, visible: bool) -> None:
    """Goals and poles."""
    for fixture in fixtures:
        shape, net = fixture.shape, fixture.kind == "net"
        size: dict[str, object]
        seen: dict[str, object]
        if shape.kind == "box":
            kind = bullet.GEOM_BOX
            size = {"halfExtents": [edge / 2.0 for edge in shape.size]}
            seen = size
        else:
            kind, (radius, length) = bullet.GEOM_CYLINDER, shape.size
            size = {"radius": radius, "height": length}
            seen = {"radius": radius, "length": length}
        collision = bullet.createCollisionShape(kind, physicsClientId=client, **size)
        visual = -1
        if visible:
            visual = bullet.createVisualShape(
                kind, rgbaColor=shape.color, physicsClientId=client, **seen
            )
        body = bullet.createMultiBody(
            0.0,
            collision,
            visual,
            basePosition=shape.position.tolist(),
            baseOrientation=pin.Quaternion(shape.rotation).coeffs().tolist(),
            physicsClientId=client,
        )
        soft = {"contactStiffness": _NET_STIFFNESS, "contactDamping": _NET_DAMPING} if net else {}
        bullet.changeDynamics(
            body, -1, lateralFriction=1.0, restitution=0.0, physicsClientId=client, **soft
        )
        bullet.setCollisionFilterGroupMask(
            body, -1, FIXTURE, _ALL_ROBOTS | BALL, physicsClientId=client
        )


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
        body, -1, BALL, FLOOR | _ALL_ROBOTS | SHOES | FIXTURE, physicsClientId=client
    )  # fmt: skip
    return body
