"""What surrounds the robot in a MuJoCo world: floor, terrain, light and ball."""

from collections.abc import Iterable

import mujoco
import numpy as np

from nao_lipm_gait.types import FloatArray
from sim_bridge.ball import FRICTION, Ball, BallState
from sim_bridge.engines.mujoco.springs import Spring
from sim_bridge.terrain import Prism

FLOOR_BIT, LEFT_LEG_BIT, BALL_BIT = 1, 2, 4
"""Collision bits: of the floor, of the left leg, of the ball."""
BALL_DEGREES_OF_FREEDOM = 6
COLLIDING, VISIBLE = 3, 1
"""Groups of shapes; the window shows the second one only."""
_BALL = "ball"
_NO_FRICTION = [0.0, 0.0, 0.0]
"""Of the ground: MuJoCo takes the larger coefficient of the two bodies."""
_SPINNING = 0.005
"""[m] resistance of the ball against turning on the spot; MuJoCo needs some."""


def add_ground(spec: mujoco.MjSpec, ground: Iterable[Prism], *, visible: bool) -> None:
    """The floor at height 0, and each prism as a convex mesh.

    Args:
        spec: the model.
        ground: prisms that rise above the floor.
        visible: with light and a visible floor, for the window.
    """
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
    spec: mujoco.MjSpec, ball: Ball, *, step: float, gravity: float, visible: bool
) -> None:
    """The ball at its start. Added after the robot, so that its degrees of freedom come last.

    Args:
        spec: the model.
        ball: the ball.
        step: physics step [s].
        gravity: [m/s^2].
        visible: seen in the window.
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
        conaffinity=FLOOR_BIT,
        condim=6,
        friction=[FRICTION, _SPINNING, ball.rolling_resistance(gravity)],
        priority=2,  # its contact parameters count, not those of the other body
        solref=solref,
        solimp=solimp,
        group=VISIBLE if visible else COLLIDING,
        rgba=[0.95, 0.95, 0.95, 1.0],
    )


def ball_state(data: mujoco.MjData) -> BallState:
    """The ball now."""
    joint = data.joint(_BALL)
    return BallState(joint.qpos[:3].copy(), joint.qvel[:3].copy())


def put_ball(data: mujoco.MjData, position: FloatArray) -> None:
    """Put the ball at rest at (3,) [m]."""
    joint = data.joint(_BALL)
    joint.qpos[:] = (*position, 1.0, 0.0, 0.0, 0.0)
    joint.qvel[:] = 0.0
