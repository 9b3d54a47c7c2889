"""The ball in MuJoCo: a free sphere that meets the floor, the robot, and shoes around the feet."""

import mujoco
import numpy as np

from nao_lipm_gait.types import FloatArray
from sim_bridge.ball import FRICTION, Ball, BallState
from sim_bridge.engines.mujoco.springs import Spring

BALL = 4
"""Collision bit of the ball."""
DEGREES_OF_FREEDOM = 6
_NAME = "ball"
_SPINNING = 0.005
"""[m] resistance against turning on the spot; MuJoCo needs some."""


def add_ball(
    spec: mujoco.MjSpec, ball: Ball, *, step: float, gravity: float, meets: int, group: int
) -> None:
    """After the robot: its degrees of freedom come last. Its contact numbers go before others'."""
    body = spec.worldbody.add_body(name=_NAME, pos=ball.start)
    body.explicitinertial = True
    body.mass, body.ipos = ball.mass, np.zeros(3)
    body.inertia = [ball.inertia] * 3
    body.add_freejoint(name=_NAME)
    solref, solimp = Spring(ball.stiffness, ball.damping).compiled(1.0 / ball.mass, step)
    body.add_geom(
        type=mujoco.mjtGeom.mjGEOM_SPHERE,
        size=[ball.radius, 0.0, 0.0],
        contype=BALL,
        conaffinity=meets,
        condim=6,
        friction=[FRICTION, _SPINNING, ball.rolling_resistance(gravity)],
        priority=2,
        solref=solref,
        solimp=solimp,
        group=group,
        rgba=[0.95, 0.95, 0.95, 1.0],
    )


def ball_state(data: mujoco.MjData) -> BallState:
    joint = data.joint(_NAME)
    return BallState(joint.qpos[:3].copy(), joint.qvel[:3].copy())


def put_ball(data: mujoco.MjData, position: FloatArray) -> None:
    """At rest at (3,) [m]."""
    joint = data.joint(_NAME)
    joint.qpos[:] = (*position, 1.0, 0.0, 0.0, 0.0)
    joint.qvel[:] = 0.0
