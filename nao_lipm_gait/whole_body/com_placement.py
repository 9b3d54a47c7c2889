"""The torso placed so that the CoM of the whole body is where the pendulum wants it.

Moving the torso moves the legs, and with them the CoM, so this is an iteration. The CoM seen from
the torso changes smoothly from tick to tick, so that its first guess is good enough for three ticks
of four; the others take a second round.
"""

from typing import NamedTuple

import numpy as np

from nao_lipm_gait.geometry import Rotation, float_view, rotate_planar, rotation_from_rpy
from nao_lipm_gait.robot import RobotDescription
from nao_lipm_gait.types import FloatArray, Point3
from nao_lipm_gait.walks.base import BodyTargets, SoleTarget
from nao_lipm_gait.whole_body.body_model import BodyModel, SolePose
from nao_lipm_gait.whole_body.leg_kinematics import (
    LegAngles,
    LegColumns,
    LegKinematics,
    LegSolution,
    leg_columns,
)

COM_TOLERANCE = 1e-4
"""[m]"""
OVERSHOOT = 1.4
"""A torso placed by a CoM that is off by 1 puts the CoM off by about 0.3, and so on: 1 / (1 - 0.3)
of the difference is where this ends."""
MAX_ITERATIONS = 5
LOWER_STEP = 0.004
"""[m] by which the torso goes down for each round in which a sole is out of reach."""
RISE_STEP = 0.0005
"""[m] per tick by which it comes up again."""
LOWEST = 0.06
"""[m] no lower than this below the wanted CoM height."""


class PlacedBody(NamedTuple):
    """Joint angles for a body target."""

    position: FloatArray
    """(n,) [rad], not yet cut at the joint limits."""
    residual: float
    """[m] by which a sole is out of reach."""


class ComPlacement:
    """Turns body targets into joint angles."""

    def __init__(self, robot: RobotDescription, body: BodyModel, legs: LegKinematics):
        self._body = body
        self._legs = legs
        self._position = np.array(robot.stand_pose, dtype=float)
        self._left_leg = leg_columns(robot, robot.left_leg)
        self._right_leg = leg_columns(robot, robot.right_leg)
        self._left_shoulder, self._right_shoulder = map(robot.index, robot.shoulder_pitch)
        self._left_hang = float(self._position[self._left_shoulder])
        self._right_hang = float(self._position[self._right_shoulder])
        body.set_joints(self._position)
        com = body.com_in_torso()
        self._com_in_torso = (com, com, com)
        self._torso_yaw = (0.0, 0.0, 0.0)
        self._lowered = 0.0

    def place(self, targets: BodyTargets, arm_swing: float = 0.0) -> PlacedBody:
        """Joint angles that put the soles and the CoM at their targets in Q.

        arm_swing [rad/m]: each arm swings with the opposite foot, against the turning moment of
        the swing leg that the stance sole would have to hold by friction. Ahead is where both soles
        look on average: a turn on the spot puts no foot ahead.
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
        joints = float_view(self._position)
        joints[self._left_shoulder] = self._left_hang - arm_swing * ahead
        joints[self._right_shoulder] = self._right_hang + arm_swing * ahead
        solution: LegSolution
        last, before, first = self._com_in_torso
        cx = _continued(last[0], before[0], first[0])
        cy = _continued(last[1], before[1], first[1])
        cz = _continued(last[2], before[2], first[2])
        last_yaw, yaw_before, first_yaw = self._torso_yaw
        torso_yaw = _continued(last_yaw, yaw_before, first_yaw)
        for attempt in range(MAX_ITERATIONS):
            rows = rotation_from_rpy(targets.torso_roll, targets.torso_pitch, mean_yaw + torso_yaw)
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
            _put(joints, self._left_leg, solution.left)
            _put(joints, self._right_leg, solution.right)
            self._body.set_joints(self._position)
            x, y, z = self._body.com_in_torso()
            off_x, off_y, off_z = x - cx, y - cy, z - cz
            cx, cy, cz = cx + OVERSHOOT * off_x, cy + OVERSHOOT * off_y, cz + OVERSHOOT * off_z
            torso_yaw += 0.5 * (solution.left_yaw_error + solution.right_yaw_error)
            if solution.reach_error > 0.0 and self._lowered < LOWEST:
                self._lowered += LOWER_STEP
                continue
            if max(abs(off_x), abs(off_y), abs(off_z)) < COM_TOLERANCE:
                break
        self._com_in_torso = ((cx, cy, cz), last, before)
        self._torso_yaw = (torso_yaw, last_yaw, yaw_before)
        return PlacedBody(self._position.copy(), solution.reach_error)


def _put(joints: "memoryview[float]", columns: LegColumns, leg: LegAngles) -> None:
    joints[columns.hip_yaw] = leg.hip_yaw
    joints[columns.hip_roll] = leg.hip_roll
    joints[columns.hip_pitch] = leg.hip_pitch
    joints[columns.knee_pitch] = leg.knee_pitch
    joints[columns.ankle_pitch] = leg.ankle_pitch
    joints[columns.ankle_roll] = leg.ankle_roll


def _continued(last: float, before: float, first: float) -> float:
    """The next value of three, first to last, on the parabola through them."""
    return 3.0 * (last - before) + first


def _sole_axes(sole: SoleTarget) -> tuple[Point3, Point3]:
    """Forward axis and normal of a sole in Q."""
    rows = rotation_from_rpy(sole.roll, sole.pitch, sole.yaw)
    return (rows[0][0], rows[1][0], rows[2][0]), (rows[0][2], rows[1][2], rows[2][2])


def _in_torso(
    rows: Rotation, torso: Point3, sole: SoleTarget, axes: tuple[Point3, Point3]
) -> SolePose:
    """A sole of Q seen from a torso at `torso`, which the rotation of `rows` turns into Q."""
    (ax, ay, az), (bx, by, bz), (cx, cy, cz) = rows
    (fx, fy, fz), (nx, ny, nz) = axes
    x, y, z = sole.x - torso[0], sole.y - torso[1], sole.z - torso[2]
    return SolePose(
        (ax * x + bx * y + cx * z, ay * x + by * y + cy * z, az * x + bz * y + cz * z),
        (ax * fx + bx * fy + cx * fz, ay * fx + by * fy + cy * fz, az * fx + bz * fy + cz * fz),
        (ax * nx + bx * ny + cx * nz, ay * nx + by * ny + cy * nz, az * nx + bz * ny + cz * nz),
    )
