"""Inverse kinematics of legs of six joints in any order and with any offsets, by Gauss-Newton.

The error of a sole is the screw that moves it to its target, the logarithm of their relative pose.
Pinocchio gives it and the Jacobian; one step of the damped least squares problem is

    (J^T J + d I) dq = J^T e,    d = DAMPING |e|^2.

The damping vanishes with the error, so the steps converge quadratically, and is large where the
target is out of reach. A tick starts from the extrapolated angles of the last two and needs one or
two steps.
"""

from math import copysign, sqrt

import numpy as np
import pinocchio as pin

from nao_lipm_gait.whole_body.body_model import SolePose
from nao_lipm_gait.whole_body.leg_kinematics import LegAngles, LegSolution
from robot_core.robot import LegJoints, RobotDescription
from robot_core.types import FloatArray

LOCAL = pin.ReferenceFrame.LOCAL
DAMPING = 0.1
TOLERANCE = 1e-6
"""Error [m, rad] of a sole that is small enough."""
MAX_STEPS = 8
REACH_TOLERANCE = 1e-4
"""[m] A sole that stays farther from its target is out of reach."""
STRIDE = 0.5
"""[rad] Largest change of a joint in one step."""
KNEE_MIN = 0.02
"""[rad] The knee stays bent: a straight one could bend to the wrong side. It is hardly longer."""


class NumericLegs:
    """Both legs of a robot whose hips are independent.

    Args:
        robot: The robot; joints outside the legs, such as a waist, stay in the stand pose.
    """

    def __init__(self, robot: RobotDescription):
        self._left = _Leg(robot, robot.left_leg, robot.sole_frames[0])
        self._right = _Leg(robot, robot.right_leg, robot.sole_frames[1])

    def solve(self, left: SolePose, right: SolePose, *, again: bool = False) -> LegSolution:
        """See `LegKinematics`; the rotation of each sole about its normal is exact too."""
        left_angles, left_miss = self._left.solve(left, again=again)
        right_angles, right_miss = self._right.solve(right, again=again)
        return LegSolution(left_angles, right_angles, 0.0, 0.0, max(left_miss, right_miss))


class _Leg:
    """One leg, with the joints of the whole robot around it."""

    def __init__(self, robot: RobotDescription, leg: LegJoints, sole: str) -> None:
        self._model = model = pin.buildModelFromXML(robot.urdf)
        self._data = model.createData()
        self._q = pin.neutral(model)
        for name, angle in zip(robot.joint_names, robot.stand_pose.tolist(), strict=True):
            self._q[model.joints[model.getJointId(name)].idx_q] = angle
        roles = leg.as_dict().values()
        self._columns = np.array([model.joints[model.getJointId(name)].idx_v for name in roles])
        self._rest: FloatArray = self._q[self._columns].copy()
        self._last = self._before = self._rest
        knee = robot.limits[leg.knee_pitch]
        self._bends = copysign(1.0, knee.upper + knee.lower)
        self._frame = model.getFrameId(sole, pin.FrameType.BODY)
        torso = model.getFrameId(robot.torso_frame, pin.FrameType.BODY)
        pin.framesForwardKinematics(model, self._data, self._q)
        self._torso = self._data.oMf[torso].copy()
        self._place = self._data.oMf[self._frame]  # a view of Pinocchio's memory

    def solve(self, sole: SolePose, *, again: bool) -> tuple[LegAngles, float]:
        """Joint angles, and the distance [m] by which the sole is out of reach."""
        target = self._target(sole)
        start = self._last
        if not again:
            start = 2.0 * self._last - self._before
            self._before = self._last
        angles, miss = self._iterate(start, target)
        if miss > REACH_TOLERANCE:
            other, missed = self._iterate(self._rest, target)
            if missed < miss:
                angles, miss = other, missed
        self._last = angles
        return LegAngles(*angles.tolist()), miss if miss > REACH_TOLERANCE else 0.0

    def _iterate(self, start: FloatArray, target: pin.SE3) -> tuple[FloatArray, float]:
        """The angles by role after some steps, and the distance of the sole from its target [m]."""
        model, data, q, columns = self._model, self._data, self._q, self._columns
        angles = start
        for step in range(MAX_STEPS + 1):
            q[columns] = angles
            pin.computeJointJacobians(model, data, q)
            pin.updateFramePlacement(model, data, self._frame)
            error = pin.log6(self._place.actInv(target)).vector
            size = float(error @ error)
            if size < TOLERANCE * TOLERANCE or step == MAX_STEPS:
                break
            j = pin.getFrameJacobian(model, data, self._frame, LOCAL)[:, columns]
            normal = j.T @ j
            normal.flat[::7] += DAMPING * size + 1e-12
            change = np.linalg.solve(normal, j.T @ error)
            largest = float(np.abs(change).max())
            angles = angles + (change if largest < STRIDE else STRIDE / largest * change)
            if self._bends * angles[3] < KNEE_MIN:
                angles[3] = self._bends * KNEE_MIN
        x, y, z = (target.translation - self._place.translation).tolist()
        return angles, sqrt(x * x + y * y + z * z)

    def _target(self, sole: SolePose) -> pin.SE3:
        """The sole's wanted pose in the frame of the root link."""
        (fx, fy, fz), (nx, ny, nz) = sole.forward, sole.normal
        rotation = np.array((
            (fx, ny * fz - nz * fy, nx), (fy, nz * fx - nx * fz, ny), (fz, nx * fy - ny * fx, nz),
        ))  # fmt: skip
        return self._torso * pin.SE3(rotation, np.array(sole.position))
