"""Constant errors of one robot's sensors, and their correction."""

from typing import Any

import attrs
import numpy as np

from robot_core.geometry import as_point, float_view, rotate, rotation_from_rpy
from robot_core.motion.joints import joint_signs
from robot_core.robot import RobotDescription
from robot_core.schema import Kind, Number, Settings, Table, field, number
from robot_core.types import FloatArray, SensorFrame

Zeros = tuple[tuple[str, float], ...]
"""Joints with their zeros [rad]: true minus measured angle."""

_TABLE = Table(Number(-0.35, 0.35, "rad"))


@attrs.frozen
class _ZerosKind(Kind):
    """A mapping of joints to zeros, held as pairs, so that a calibration can be hashed."""

    @property
    def allowed(self) -> str:
        return _TABLE.allowed

    def check(self, where: str, value: Any) -> Zeros:
        pairs = isinstance(value, tuple) and all(isinstance(each, tuple) for each in value)
        given = dict(value) if pairs else value
        return tuple(sorted(_TABLE.check(where, given).items()))


@attrs.frozen
class Calibration(Settings):
    """Constant errors of the sensors of one robot; all 0 for a robot that was not calibrated."""

    sole_pitch: float = number(
        0.0,
        -0.2,
        0.2,
        "rad",
        "Pitch of the left sole relative to the right one when the joint angles say parallel.",
    )
    sole_roll: float = number(
        0.0, -0.2, 0.2, "rad", "Roll of the left sole relative to the right one, in the same way."
    )
    lean: float = number(
        0.0,
        -0.2,
        0.2,
        "rad",
        "Roll of the torso over level soles when the joint angles say upright.",
    )
    imu_roll: float = number(
        0.0,
        -0.2,
        0.2,
        "rad",
        "Roll of the torso by the IMU minus that by the joint angles over level soles.",
    )
    imu_pitch: float = number(0.0, -0.2, 0.2, "rad", "The same for the pitch.")
    gyro_bias_x: float = number(0.0, -0.5, 0.5, "rad/s", "Gyro about x at rest.")
    gyro_bias_y: float = number(0.0, -0.5, 0.5, "rad/s", "Gyro about y at rest.")
    gyro_bias_z: float = number(0.0, -0.5, 0.5, "rad/s", "Gyro about z at rest.")
    joint_zero: Zeros = field(
        _ZerosKind(), (), "Wrong zeros of single joints; the other values are what they leave."
    )


NOT_CALIBRATED = Calibration()


class SensorCorrection:
    """Takes constant errors out of the sensors and puts them into the joint targets.

    A relative tilt of the soles is shared by both ankles, because which joint causes it is unknown.
    """

    def __init__(self, robot: RobotDescription, calibration: Calibration) -> None:
        left, right = robot.left_leg, robot.right_leg
        self._pitch = robot.index(left.ankle_pitch), robot.index(right.ankle_pitch)
        self._roll = robot.index(left.ankle_roll), robot.index(right.ankle_roll)
        self._signs = joint_signs(robot)
        c = calibration
        self._zeros = np.zeros(len(robot.joint_names))
        for joint, zero in c.joint_zero:
            self._zeros[robot.index(joint)] = zero
        for leader, follower in robot.coupled_joints:
            self._zeros[robot.index(follower)] = self._zeros[robot.index(leader)]
        self._offset = self._zeros.copy()
        self._imu = None
        if (c.imu_roll, c.imu_pitch, c.gyro_bias_x, c.gyro_bias_y, c.gyro_bias_z) != (0.0,) * 5:
            self._imu = rotation_from_rpy(c.imu_roll, c.imu_pitch, 0.0)
        self._gyro_bias = np.array((c.gyro_bias_x, c.gyro_bias_y, c.gyro_bias_z))
        self._soles = 0.0, 0.0, 0.0
        self.set_soles(c.sole_pitch, c.sole_roll, c.lean)

    def set_soles(self, pitch: float, roll: float, lean: float) -> None:
        """Set the errors of the ankles.

        Args:
            pitch: Pitch [rad] of the left sole relative to the right one.
            roll: The same for the roll [rad].
            lean: Roll [rad] of the torso over both soles.
        """
        if (pitch, roll, lean) == self._soles:
            return
        self._soles = pitch, roll, lean
        offset, zeros = float_view(self._offset), float_view(self._zeros)
        for (left, right), tilt, both in ((self._pitch, pitch, 0.0), (self._roll, roll, lean)):
            offset[left] = zeros[left] + self._signs[left] * (0.5 * tilt - both)
            offset[right] = zeros[right] - self._signs[right] * (0.5 * tilt + both)

    def sensed(self, frame: SensorFrame) -> SensorFrame:
        """The frame without the constant errors."""
        rate, force = frame.angular_velocity, frame.linear_acceleration
        mean_rate = frame.mean_angular_velocity
        imu, bias = self._imu, self._gyro_bias
        if imu is not None:
            rate = np.array(rotate(imu, as_point(rate - bias)))
            force = np.array(rotate(imu, as_point(force)))
            if mean_rate is not None:
                mean_rate = np.array(rotate(imu, as_point(mean_rate - bias)))
        position = frame.joint_position + self._offset
        return SensorFrame(
            frame.stamp, position, rate, force, frame.late, frame.lifted, mean_rate
        )

    def for_motors(self, position: FloatArray) -> FloatArray:
        """Joint targets (n,) [rad] as the motors take them."""
        return position - self._offset

    def for_model(self, position: FloatArray) -> FloatArray:
        """Joint targets (n,) [rad] of the motors as joint angles."""
        return position + self._offset
