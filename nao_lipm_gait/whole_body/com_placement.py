"""Places the torso so that the CoM of the whole body is at its target.

Moving the torso moves the legs, and with them the CoM, so this is an iteration. The CoM in the
torso frame changes smoothly from tick to tick. Extrapolated from the last ticks, it is a good
enough first guess in three of four ticks; the others need a second iteration.
"""

from math import cos, sin
from typing import final

import numpy as np

from nao_lipm_gait.walks.base import BodyTargets, SoleTarget
from nao_lipm_gait.whole_body.body_model import BodyModel, SolePose
from nao_lipm_gait.whole_body.leg_kinematics import (
    LegColumns,
    LegKinematics,
    LegSolution,
)
from robot_core.geometry import Rotation, float_view, rotate_planar, rotation_from_rpy
from robot_core.motion.joints import joint_signs
from robot_core.robot import RobotDescription
from robot_core.types import FloatArray, Point3

COM_TOLERANCE = 1e-4
"""Largest error of the CoM along an axis [m]."""
OVERSHOOT = 1.4
"""Over-relaxation: an error e of the assumed CoM leaves about 0.3 e; 1 / (1 - 0.3) corrects it."""
MAX_ITERATIONS = 5
LOWER_STEP = 0.004
"""How far the torso goes down per iteration in which a sole is out of reach [m]."""
RISE_STEP = 0.0005
"""How far it rises again per tick [m]."""
LOWERED_MAX = 0.06
"""Largest distance below the wanted CoM height [m]."""


@final
class PlacedBody:
    """Joint angles for body targets.

    Attributes:
        position: Joint angles (n,) [rad], not yet limited.
        residual: Distance by which a sole is out of reach [m].
    """

    __slots__ = ("position", "residual")

    def __init__(self, position: FloatArray, residual: float):
        self.position = position
        self.residual = residual


class ComPlacement:
    """Turns body targets into joint angles.

    Args:
        robot: The robot.
        body: Its model; joint angles are set in it.
        legs: Its leg kinematics.
    """

    def __init__(self, robot: RobotDescription, body: BodyModel, legs: LegKinematics):
        self._body = body
        self._legs = legs
        self._position = np.array(robot.stand_pose, dtype=float)
        self._joints = float_view(self._position)
        self._left_leg = LegColumns(robot, robot.left_leg)
        self._right_leg = LegColumns(robot, robot.right_leg)
        signs = joint_signs(robot)
        shoulders = robot.shoulder_pitch or ()
        self._shoulders = tuple(
            (joint, float(self._position[joint]), side * signs[joint])
            for side, joint in zip((-1.0, 1.0), map(robot.index, shoulders), strict=False)
        )
        com = body.set_joints(self._position)
        self._com_in_torso = (com, com, com)
        hips = {robot.left_leg.hip_yaw, robot.right_leg.hip_yaw}
        self._turns_freely = all(set(pair) != hips for pair in robot.coupled_joints)
        self._torso_yaw = (0.0, 0.0, 0.0)
        self._lowered = 0.0

    def place(self, targets: BodyTargets, arm_swing: float = 0.0) -> PlacedBody:
        """Joint angles that put the soles and the CoM at their targets in Q.

        Each arm swings with the opposite foot, against the yaw moment of the swing leg that the
        friction of the support sole has to bear. Forward is the mean direction of both soles, so a
        turn on the spot swings no arm.

        Args:
            targets: Targets of the body.
            arm_swing: Shoulder pitch per distance that a foot is ahead of the other [rad/m].

        Returns:
            The joint angles.
        """
        self._lowered = max(0.0, self._lowered - RISE_STEP)
        com_x, com_y, com_z = targets.com_in_q
        left_axes = _sole_axes(targets.left_sole)
        right_axes = _sole_axes(targets.right_sole)
        mean_yaw = 0.5 * (targets.left_sole.yaw + targets.right_sole.yaw)
        ahead, _ = rotate_planar(
            targets.right_sole.x - targets.left_sole.x,
            targets.right_sole.y - targets.left_sole.y,
            -mean_yaw,
        )
        joints = self._joints
        for shoulder, hang, sign in self._shoulders:
            joints[shoulder] = hang + sign * arm_swing * ahead
        solution: LegSolution
        last, before, first = self._com_in_torso
        cx = _extrapolated(last[0], before[0], first[0])
        cy = _extrapolated(last[1], before[1], first[1])
        cz = _extrapolated(last[2], before[2], first[2])
        last_yaw, yaw_before, first_yaw = self._torso_yaw
        torso_yaw = _extrapolated(last_yaw, yaw_before, first_yaw)
        ahead_yaw = targets.torso_yaw if self._turns_freely else 0.0
        for attempt in range(MAX_ITERATIONS):
            yaw = mean_yaw + torso_yaw + ahead_yaw
            rows = rotation_from_rpy(0.0, targets.torso_pitch, yaw)
            a, b, c = rows
            torso_x = com_x - (a[0] * cx + a[1] * cy + a[2] * cz)
            torso_y = com_y - (b[0] * cx + b[1] * cy + b[2] * cz)
            torso_z = com_z - self._lowered - (c[0] * cx + c[1] * cy + c[2] * cz)
            torso = (torso_x, torso_y, torso_z)
            solution = self._legs.solve(
                _in_torso(rows, torso, targets.left_sole, left_axes),
                _in_torso(rows, torso, targets.right_sole, right_axes),
                again=attempt > 0,
            )
            self._left_leg.write(solution.left, joints)
            self._right_leg.write(solution.right, joints)
            x, y, z = self._body.set_joints(self._position)
            off_x, off_y, off_z = x - cx, y - cy, z - cz
            cx, cy, cz = cx + OVERSHOOT * off_x, cy + OVERSHOOT * off_y, cz + OVERSHOOT * off_z
            torso_yaw += 0.5 * (solution.left_yaw_error + solution.right_yaw_error)
            if solution.reach_error > 0.0 and self._lowered < LOWERED_MAX:
                self._lowered += LOWER_STEP
                continue
            if max(abs(off_x), abs(off_y), abs(off_z)) < COM_TOLERANCE:
                break
        self._com_in_torso = ((cx, cy, cz), last, before)
        self._torso_yaw = (torso_yaw, last_yaw, yaw_before)
        return PlacedBody(self._position.copy(), solution.reach_error)


def _extrapolated(last: float, before: float, first: float) -> float:
    """The next value on the parabola through three values; `last` is the newest."""
    return 3.0 * (last - before) + first


def _sole_axes(sole: SoleTarget) -> tuple[Point3, Point3]:
    """Forward axis and normal of a sole in Q."""
    # The first and the last column of `rotation_from_rpy`.
    cr, sr = cos(sole.roll), sin(sole.roll)
    cp, sp = cos(sole.pitch), sin(sole.pitch)
    cy, sy = cos(sole.yaw), sin(sole.yaw)
    forward = cy * cp, sy * cp, -sp
    return forward, (cy * sp * cr + sy * sr, sy * sp * cr - cy * sr, cp * cr)


def _in_torso(
    rows: Rotation, torso: Point3, sole: SoleTarget, axes: tuple[Point3, Point3]
) -> SolePose:
    """A sole of Q in the frame of a torso at `torso` in Q [m] with the rotation `rows`."""
    (ax, ay, az), (bx, by, bz), (cx, cy, cz) = rows
    (fx, fy, fz), (nx, ny, nz) = axes
    x, y, z = sole.x - torso[0], sole.y - torso[1], sole.z - torso[2]
    return SolePose(
        (ax * x + bx * y + cx * z, ay * x + by * y + cy * z, az * x + bz * y + cz * z),
        (ax * fx + bx * fy + cx * fz, ay * fx + by * fy + cy * fz, az * fx + bz * fy + cz * fz),
        (ax * nx + bx * ny + cx * nz, ay * nx + by * ny + cy * nz, az * nx + bz * ny + cz * nz),
    )
