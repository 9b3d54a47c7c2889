"""What surrounds the robot in a MuJoCo world: floor, terrain, light and ball."""

import math
from collections.abc import Iterable

import mujoco
import numpy as np

from robot_core.field import COLORS
from robot_core.types import FloatArray
from sim_bridge.ball import FRICTION, Ball, BallState
from sim_bridge.engines.mujoco.springs import Spring
from sim_bridge.shapes import Shape
from sim_bridge.surroundings import Surroundings
from sim_bridge.terrain import Prism

FLOOR_BIT, LEFT_LEG_BIT, BALL_BIT, FIXTURE_BIT, ROBOT_BIT = (1 << bit for bit in range(5))
"""Collision bits: of the floor, of left legs, of the ball, of fixtures, of the first robot; the
next robots have the bits after it."""
COLLIDING, VISIBLE = 3, 1
"""Groups of shapes; the window shows the second one only."""
_BALL = "ball"
_NO_FRICTION = [0.0, 0.0, 0.0]
"""Of the ground: MuJoCo takes the larger coefficient of the two bodies."""
_SPINNING = 0.005
"""[m] resistance of the ball against turning on the spot; MuJoCo needs some."""


_GEOMS = {
    "box": mujoco.mjtGeom.mjGEOM_BOX,
    "sphere": mujoco.mjtGeom.mjGEOM_SPHERE,
    "cylinder": mujoco.mjtGeom.mjGEOM_CYLINDER,
}
_NET = [0.01, 2.0]
"""Time constant [s] and damping ratio of a net: it takes the speed of a ball."""
_CARPET_DEPTH, _SURFACE_DEPTH = 0.002, 0.004
"""[m] by which the carpet and the surface around it are drawn below the floor, on which the lines
are, so that they cover each other properly."""
_PAINT = 0.0005
"""[m] thickness of what is painted."""
_SURFACE_COLOR = [0.45, 0.45, 0.47, 1.0]


def add_surroundings(
    spec: mujoco.MjSpec, surroundings: Surroundings, *, step: float, visible: bool
) -> None:
    """All but the ball.

    Args:
        spec: The model.
        surroundings: What to add.
        step: Physics step [s].
        visible: With light and visible shapes.
    """
    pitch = surroundings.carpet is not None
    add_ground(spec, surroundings.ground, visible=visible and not pitch)
    fixtures = surroundings.fixtures
    if fixtures:
        # Not in the world's own body, whose contacts with the feet are those of the floor.
        body = spec.worldbody.add_body(name="fixtures")
    for fixture in fixtures:
        soft = fixture.kind == "net"
        add_shape(
            body,
            fixture.shape,
            name=fixture.name,
            contype=FIXTURE_BIT,
            conaffinity=0,
            condim=3,
            friction=_NO_FRICTION,
            priority=3 if soft else 0,
            solref=_NET if soft else [2.5 * step, 1.0],
            group=VISIBLE if visible else COLLIDING,
            rgba=fixture.shape.color,
        )
    if visible and pitch:
        _add_pitch(spec, surroundings)


def _add_pitch(spec: mujoco.MjSpec, surroundings: Surroundings) -> None:
    """Carpet and lines; nothing collides with them."""
    body = spec.worldbody.add_body(name="pitch")
    spec.worldbody.add_light(
        type=mujoco.mjtLightType.mjLIGHT_DIRECTIONAL,
        pos=[0.0, 0.0, 5.0],
        dir=[0.2, 0.1, -1.0],
        diffuse=[0.6, 0.6, 0.6],
        ambient=[0.3, 0.3, 0.3],
    )
    body.add_geom(
        name="surface",
        type=mujoco.mjtGeom.mjGEOM_PLANE,
        size=[0.0, 0.0, 0.25],
        pos=[0.0, 0.0, -_SURFACE_DEPTH],
        contype=0,
        conaffinity=0,
        group=VISIBLE,
        rgba=_SURFACE_COLOR,
    )
    length, width = surroundings.carpet or (0.0, 0.0)
    flat = [("carpet", 0.0, 0.0, length, width, 0.0, -_CARPET_DEPTH, COLORS["green"])]
    flat += [
        (f"line_{i}", m.x, m.y, m.length, m.width, m.heading, 0.0, COLORS["white"])
        for i, m in enumerate(surroundings.markings)
    ]
    for name, x, y, along, across, heading, top, color in flat:
        body.add_geom(
            name=name,
            type=mujoco.mjtGeom.mjGEOM_BOX,
            size=[along / 2.0, across / 2.0, _PAINT / 2.0],
            pos=[x, y, top - _PAINT / 2.0],
            quat=[math.cos(heading / 2.0), 0.0, 0.0, math.sin(heading / 2.0)],
            contype=0,
            conaffinity=0,
            group=VISIBLE,
            rgba=[*color, 1.0],
        )


def add_ground(spec: mujoco.MjSpec, ground: Iterable[Prism], *, visible: bool) -> None:
    """The floor at height 0, and each prism as a convex mesh."""
    spec.worldbody.add_geom(
        name="floor",
        type=mujoco.mjtGeom.mjGEOM_PLANE,
        size=[0.0, 0.0, 0.05],
        contype=FLOOR_BIT,
        conaffinity=0,
        condim=3,
        friction=_NO_FRICTION,
        group=COLLIDING,
    )
    for index, prism in enumerate(ground):
        name = f"terrain_{index}"
        spec.add_mesh(name=name, uservert=prism.vertices.ravel().tolist())
        spec.worldbody.add_geom(
            name=name,
            type=mujoco.mjtGeom.mjGEOM_MESH,
            meshname=name,
            contype=FLOOR_BIT,
            conaffinity=0,
            condim=3,
            friction=_NO_FRICTION,
            group=VISIBLE if visible else COLLIDING,
            rgba=prism.color,
        )
    if visible:
        spec.worldbody.add_light(pos=[0.0, 0.0, 3.0], dir=[0.0, 0.0, -1.0])
        spec.worldbody.add_geom(
            type=mujoco.mjtGeom.mjGEOM_PLANE,
            size=[0.0, 0.0, 0.25],
            contype=0,
            conaffinity=0,
            group=VISIBLE,
            rgba=[0.66, 0.72, 0.78, 1.0],
        )


def add_ball(
    spec: mujoco.MjSpec,
    ball: Ball,
    *,
    step: float,
    gravity: float,
    visible: bool,
    meets: int = 0,
) -> None:
    """The ball at its start. Added after the robot, so that its degrees of freedom come last.

    Args:
        spec: The model.
        ball: The ball.
        step: Physics step [s].
        gravity: [m/s^2].
        visible: Seen in the window.
        meets: Collision bits of what it meets beside floor and robots.
    """
    body = spec.worldbody.add_body(name=_BALL, pos=ball.start)
    body.explicitinertial = True
    body.mass, body.ipos = ball.mass, np.zeros(3)
    body.inertia = [ball.inertia] * 3
    body.add_freejoint(name=_BALL)
    solref, solimp = Spring(ball.stiffness, ball.damping).compiled(1.0 / ball.mass, step)
    body.add_geom(
        type=mujoco.mjtGeom.mjGEOM_SPHERE,
        size=[ball.radius, 0.0, 0.0],
        contype=BALL_BIT,
        conaffinity=FLOOR_BIT | meets,
        condim=6,
        friction=[FRICTION, _SPINNING, ball.rolling_resistance(gravity)],
        priority=2,  # its contact parameters count, not those of the other body
        solref=solref,
        solimp=solimp,
        group=VISIBLE if visible else COLLIDING,
        rgba=[*ball.color, 1.0],
    )


def ball_body(model: mujoco.MjModel) -> int:
    """The number of its body."""
    return int(model.body(_BALL).id)


class MujocoBall:
    """The ball of a running simulation, in views of MuJoCo's own memory."""

    def __init__(self, ball: Ball, data: mujoco.MjData) -> None:
        joint = data.joint(_BALL)
        self._ball, self._position, self._velocity = ball, joint.qpos, joint.qvel

    @property
    def state(self) -> BallState:
        """The ball now."""
        return BallState(self._position[:3].copy(), self._velocity[:3].copy())

    def reset(self) -> None:
        """Put the ball at its start, at rest."""
        self.put(self._ball.start, np.zeros(3))

    def put(self, position: FloatArray, velocity: FloatArray) -> None:
        """Put the ball at (3,) [m], with (3,) [m/s] and no spin."""
        self._position[:] = (*position, 1.0, 0.0, 0.0, 0.0)
        self._velocity[:] = (*velocity, 0.0, 0.0, 0.0)


def quaternion(rotation: FloatArray) -> FloatArray:
    """(4,) w x y z of a (3, 3) rotation."""
    quaternion = np.zeros(4)
    mujoco.mju_mat2Quat(quaternion, np.ascontiguousarray(rotation).ravel())
    return quaternion


def add_shape(body: mujoco.MjsBody, shape: Shape, **options: object) -> None:
    """Add a shape to a body, with these options of a geom."""
    size = shape.size
    if shape.kind == "box":
        size = tuple(edge / 2.0 for edge in size)
    elif shape.kind == "cylinder":
        size = (size[0], size[1] / 2.0)
    body.add_geom(
        type=_GEOMS[shape.kind],
        size=[*size, *(0.0,) * (3 - len(size))],
        pos=shape.position,
        quat=quaternion(shape.rotation),
        **options,
    )
