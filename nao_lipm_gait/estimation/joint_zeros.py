"""Which leg joint has a wrong zero, by how a robot rests and steps in several poses.

In one pose a wrong zero, an IMU that is mounted askew and a floor that slopes look the same. Over
several poses they do not: IMU and floor add the same angle to all of them, while a zero of the knee
lifts a hip by the more, the further the knee is bent, one of the hip pitch by the more, the further
the foot stands ahead of the hip, one of the hip roll by the more, the wider the feet stand; a hip
yaw rolls the soles where the torso leans.

The measurements are linear in the zeros z and in the rotation m of the IMU and the floor:

    stand:  vertical by the accelerometer - that of a robot on springs under the corners of both
            soles with the measured joint angles = H z + M m + e
    steps:  vertical by the accelerometer - mean normal of both soles = H z + M m + e
            tilt of the left sole relative to the right one (`SoleLevelling`) = H z + e

All zeros have the deviation `ZERO_SIGMA`. Each joint in turn gets `WRONG_SIGMA` in addition; the
logarithm of how much likelier the measurements then are is the evidence that its zero is wrong.
"""

from collections.abc import Callable, Sequence
from math import degrees, sqrt
from typing import NamedTuple

import numpy as np

from nao_lipm_gait.calibration import Calibration
from nao_lipm_gait.estimation.sole_levelling import CORNER_STIFFNESS, TILT_MAX
from nao_lipm_gait.whole_body.body_model import BodyModel
from robot_core.robot import RobotDescription
from robot_core.types import GRAVITY, LEFT, RIGHT, FloatArray

FLOOR_MASS = 6.0
"""[kg] The floor under heavier robots is stiffer in proportion."""
ZERO_SIGMA = 0.0087
"""[rad] Deviation of a zero that is right."""
WRONG_SIGMA = 0.06
"""[rad] Deviation of a wrong one."""
IMU_SIGMA = (0.012, 0.012, 0.0087)
"""[rad] Deviations of the rotation of IMU and floor: mounting, bias of the accelerometer, slope."""
STAND_SIGMA = (0.002, 0.0027)
"""Deviation of the vertical in a stand, forward and to the left: what the springs leave out."""
STEPS_SIGMA = (0.004, 0.0047)
"""The same in steps."""
TILT_SIGMA = (0.0033, 0.0053)
"""[rad] Deviation of the measured pitch and roll of the soles."""
SATURATED, SATURATED_SIGMA = 1.25, 0.05
"""A tilt at the limit of what is learned is larger by this factor on average; its deviation."""
EVIDENCE = 2.0
"""Evidence from which on a joint is named."""
CLOSE = 3.0
"""A joint whose evidence is less by this cannot be excluded: it is 20 times less likely."""
MISFIT = 14.0
"""Mean squared error beyond which the measurements say nothing: soles on their edges."""
STEP = 0.01
"""[rad] Change of a joint for the derivatives."""


class Means(NamedTuple):
    """Means over a quiet stand on both soles, or over steps on the spot.

    Attributes:
        position: (n,) [rad] measured joint angles.
        force: (3,) [m/s^2] specific force in the torso frame.
    """

    position: FloatArray
    force: FloatArray


class Pose(NamedTuple):
    """What was measured in a pose; None where it was not.

    Attributes:
        steps: Means over steps on the spot.
        tilt: Pitch and roll [rad] of the left sole relative to the right one, when the measured
            joint angles say parallel, at the end of the steps.
        stand: Means over the stand after them.
    """

    steps: Means | None = None
    tilt: tuple[float, float] | None = None
    stand: Means | None = None


class Zero(NamedTuple):
    """The zero of a joint, if all others are right.

    Attributes:
        joint: Its name; of joints with one motor the leader.
        zero: [rad] True minus measured angle.
        sigma: [rad] Its standard deviation.
        evidence: Logarithm of the likelihood that this zero is wrong over that of none.
        misfit: Mean squared error that is left, in deviations; about 1 if the model holds.
    """

    joint: str
    zero: float
    sigma: float
    evidence: float
    misfit: float


class _Row(NamedTuple):
    """One measurement: value = zeros @ z + imu @ m + a deviation."""

    value: float
    zeros: FloatArray
    imu: FloatArray
    sigma: float


def joint_zeros(robot: RobotDescription, poses: Sequence[Pose]) -> list[Zero]:
    """Judge each leg joint.

    Args:
        robot: The robot.
        poses: What was measured, in two poses or more.

    Returns:
        The joints, the one with the most evidence first.
    """
    legs = _Legs(robot)
    rows = [row for pose in poses for row in legs.rows(pose)]
    value = np.array([row.value for row in rows])
    zeros = np.array([row.zeros for row in rows]).reshape(len(rows), len(legs.joints))
    imu = np.array([row.imu for row in rows]).reshape(len(rows), 3)
    covariance = np.diag([row.sigma * row.sigma for row in rows])
    covariance += ZERO_SIGMA**2 * zeros @ zeros.T + (imu * np.square(IMU_SIGMA)) @ imu.T
    none = _log_likelihood(value, covariance)
    found = []
    variance = ZERO_SIGMA**2 + WRONG_SIGMA**2
    for joint, column in zip(legs.joints, zeros.T, strict=True):
        wrong = covariance + WRONG_SIGMA**2 * np.outer(column, column)
        gain = variance * np.linalg.solve(wrong, column)
        sigma = sqrt(max(variance * (1.0 - float(gain @ column)), 0.0))
        evidence = _log_likelihood(value, wrong) - none
        misfit = float(value @ np.linalg.solve(wrong, value)) / len(value)
        found.append(Zero(joint, float(gain @ value), sigma, evidence, misfit))
    return sorted(found, key=lambda each: -each.evidence)


def judged_joints(robot: RobotDescription) -> list[str]:
    """The leg joints of a robot; of those with one motor the leader."""
    followers = {follower for _, follower in robot.coupled_joints}
    legs = (robot.left_leg, robot.right_leg)
    return [joint for leg in legs for joint in leg.names if joint not in followers]


def wrong_zeros(found: Sequence[Zero]) -> list[Zero]:
    """The joints of which one has a wrong zero, by `joint_zeros`; empty if all are right."""
    best = found[0]
    if best.evidence <= EVIDENCE or best.misfit > MISFIT:
        return []
    return [each for each in found if each.evidence > best.evidence - CLOSE]


def corrected(
    robot: RobotDescription, calibration: Calibration, wrong: Zero, position: FloatArray
) -> Calibration:
    """A calibration that corrects a zero, too.

    Args:
        robot: The robot.
        calibration: What was measured with the wrong zero.
        wrong: The zero.
        position: (n,) [rad] measured joint angles of the stand in which it was measured.
    """
    legs = _Legs(robot)
    zeros = dict(calibration.joint_zero)
    zeros[wrong.joint] = zeros.get(wrong.joint, 0.0) + wrong.zero
    turned = legs.turned(position, wrong)
    pitch, roll = legs.tilt(turned) - legs.tilt(position)
    up = legs.resting(turned) - legs.resting(position)
    return calibration.replace(
        joint_zero=zeros,
        sole_pitch=_left(calibration.sole_pitch, pitch),
        sole_roll=_left(calibration.sole_roll, roll),
        # Whether the zero makes the torso lean, the next steps show.
        lean=0.0,
        imu_roll=calibration.imu_roll + calibration.lean - float(up[1]),
        imu_pitch=calibration.imu_pitch + float(up[0]),
    )


def _left(tilt: float, explained: float) -> float:
    """What is left of a learned tilt [rad]; nothing is known of one at the limit."""
    return tilt - float(explained) if abs(tilt) < TILT_MAX else 0.0


def in_words(wrong: Sequence[Zero]) -> str:
    """What `wrong_zeros` has found, as a line."""
    if not wrong:
        return "no leg joint stands out by a wrong zero"
    best, *others = (f"{each.joint} by {degrees(each.zero):+.1f} deg" for each in wrong)
    also = "".join(f", or that of {each}" for each in others)
    return f"a zero is wrong: that of {best}{also} (true minus measured angle)"


class _Legs:
    """What the soles of a robot say for given joint angles, and its derivatives.

    Attributes:
        joints: The joints that are judged.
    """

    def __init__(self, robot: RobotDescription) -> None:
        self._body = BodyModel(robot)
        corners = np.array(robot.sole_corners)
        self._corners = (LEFT, corners), (RIGHT, corners * (1.0, -1.0))
        stiffness = CORNER_STIFFNESS * max(1.0, self._body.total_mass / FLOOR_MASS)
        self._give = self._body.total_mass * GRAVITY / stiffness
        self.joints = judged_joints(robot)
        self._columns = [
            [robot.index(joint), *(robot.index(f) for lead, f in robot.coupled_joints
                                   if lead == joint)]
            for joint in self.joints
        ]  # fmt: skip

    def turned(self, position: FloatArray, wrong: Zero) -> FloatArray:
        """The true joint angles (n,) [rad] for measured ones, if a zero is wrong."""
        true: FloatArray = position.copy()
        true[self._columns[self.joints.index(wrong.joint)]] += wrong.zero
        return true

    def rows(self, pose: Pose) -> list[_Row]:
        """The measurements of a pose."""
        rows = []
        for means, vertical, sigma in (
            (pose.steps, self.mean_normal, STEPS_SIGMA), (pose.stand, self.resting, STAND_SIGMA),
        ):  # fmt: skip
            if means is not None:
                up = means.force / np.linalg.norm(means.force)
                imu = np.cross(np.eye(3), up).T
                expected, zeros = self._derived(vertical, means.position)
                rows += [
                    _Row(up[axis] - expected[axis], zeros[axis], imu[axis], sigma[axis])
                    for axis in (0, 1)
                ]
        if pose.steps is not None and pose.tilt is not None:
            _, zeros = self._derived(self.tilt, pose.steps.position)
            for axis, tilt in enumerate(pose.tilt):
                learned = abs(tilt) < TILT_MAX
                value = tilt if learned else SATURATED * tilt
                error = TILT_SIGMA[axis] if learned else SATURATED_SIGMA
                rows.append(_Row(value, zeros[axis], np.zeros(3), error))
        return rows

    def _derived(
        self, function: Callable[[FloatArray], FloatArray], position: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        """A function of joint angles there, and its derivatives by the joints that are judged."""
        derivatives = []
        for columns in self._columns:
            change = np.zeros(len(position))
            change[columns] = STEP
            difference = function(position + change) - function(position - change)
            derivatives.append(difference / (2.0 * STEP))
        return function(position), np.array(derivatives).T

    def tilt(self, position: FloatArray) -> FloatArray:
        """Pitch and roll (2,) [rad] of the left sole relative to the right one."""
        self._body.set_joints(position)
        left, right = (self._body.sole_in_torso(side).normal for side in (LEFT, RIGHT))
        return np.array((left[0] - right[0], right[1] - left[1]))

    def mean_normal(self, position: FloatArray) -> FloatArray:
        """Mean normal (3,) of the soles in the torso frame."""
        self._body.set_joints(position)
        normals = [self._body.sole_in_torso(side).normal for side in (LEFT, RIGHT)]
        mean: FloatArray = np.mean(normals, axis=0)
        return mean

    def resting(self, position: FloatArray) -> FloatArray:
        """Vertical (3,) in the torso frame of a robot that rests on springs under all corners.

        The floor is the plane through the corners that makes the forces of the springs balance the
        weight, which acts at the CoM: a least-squares plane, tilted by the weight's moment.
        """
        com = np.array(self._body.set_joints(position))
        points, normal = [], np.zeros(3)
        for side, corners in self._corners:
            sole = self._body.sole_in_torso(side)
            points.append(sole.points(corners))
            normal += sole.normal
        corners = np.concatenate(points)
        center = corners.mean(axis=0)
        z = normal / np.linalg.norm(normal)
        x = np.cross((0.0, 1.0, 0.0), z)
        x /= np.linalg.norm(x)
        axes = np.array((x, np.cross(z, x), z))
        flat = (corners - center) @ axes.T
        across, heights = flat[:, :2], flat[:, 2]
        moment = across.T @ heights + self._give * (axes @ (com - center))[:2]
        slope = np.linalg.solve(across.T @ across, moment)
        up = np.array((-slope[0], -slope[1], 1.0)) @ axes
        vertical: FloatArray = up / np.linalg.norm(up)
        return vertical


def _log_likelihood(value: FloatArray, covariance: FloatArray) -> float:
    """Of a value with mean 0, but for a constant."""
    root = np.linalg.cholesky(covariance)
    scaled = np.linalg.solve(root, value)
    return -0.5 * float(scaled @ scaled) - float(np.log(np.diag(root)).sum())
