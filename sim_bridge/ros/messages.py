"""Readings and ground truth as ROS messages.

Each writer reuses its message objects: publish one before the next call.
"""

import math

from geometry_msgs.msg import PointStamped, Vector3, WrenchStamped
from nav_msgs.msg import Odometry
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import BatteryState, Imu, JointState

from robot_core.command_input import read_push
from robot_core.robot import RobotDescription
from robot_core.ros.messages import diagonal, to_doubles, to_time
from robot_core.types import FloatArray
from sim_bridge.heat import MotorState
from sim_bridge.plant import Sensors
from sim_bridge.robot import GroundTruth, Reading

WORLD = "world"
_UNKNOWN = 1e6
"""[(rad/s)^2] variance of a gyro axis that the robot does not have."""


class ReadingWriter:
    """Messages of one delayed reading, with the stamp of its sampling."""

    def __init__(self, robot: RobotDescription, sensors: Sensors) -> None:
        """Prepare the messages: names and frames of `robot`, covariances of `sensors`."""
        self._joints = JointState(name=list(robot.joint_names))
        self._imu = Imu()
        # Readings are given along the axes of the torso, whatever the IMU's mounting.
        self._imu.header.frame_id = robot.torso_frame
        self._imu.orientation_covariance[0] = -1.0  # REP-145: no orientation
        gyro, accel = sensors.gyro_noise**2, sensors.accel_noise**2
        yaw = gyro if sensors.gyro_axes == 3 else _UNKNOWN
        self._imu.angular_velocity_covariance = diagonal(gyro, gyro, yaw)
        self._imu.linear_acceleration_covariance = diagonal(accel, accel, accel)
        self._wrenches = (WrenchStamped(), WrenchStamped())
        for wrench, frame in zip(self._wrenches, robot.sole_frames, strict=True):
            wrench.header.frame_id = frame

    def imu(self, reading: Reading) -> Imu:
        """`imu/data`."""
        message = self._imu
        message.header.stamp = to_time(reading.frame.stamp)
        _fill(message.angular_velocity, reading.frame.angular_velocity)
        _fill(message.linear_acceleration, reading.frame.linear_acceleration)
        return message

    def joints(self, reading: Reading) -> JointState:
        """`joint_states`."""
        message = self._joints
        message.header.stamp = to_time(reading.frame.stamp)
        message.position = to_doubles(reading.frame.joint_position)
        message.velocity = to_doubles(reading.joint_velocity)
        message.effort = to_doubles(reading.joint_effort)
        return message

    def wrench(self, reading: Reading, side: int) -> WrenchStamped:
        """Wrench of the floor on a sole; side 0 = left, 1 = right."""
        message = self._wrenches[side]
        message.header.stamp = to_time(reading.frame.stamp)
        _fill(message.wrench.force, reading.sole_wrench[side][:3])
        _fill(message.wrench.torque, reading.sole_wrench[side][3:])
        return message


def battery_state(stamp: int, motors: MotorState) -> BatteryState:
    """`battery`."""
    unknown = math.nan
    message = BatteryState(
        voltage=motors.voltage, current=-motors.power / motors.voltage, temperature=unknown,
        charge=unknown, capacity=unknown, design_capacity=unknown, percentage=motors.charge,
        power_supply_status=BatteryState.POWER_SUPPLY_STATUS_DISCHARGING, present=True,
    )  # fmt: skip
    message.header.stamp = to_time(stamp)
    return message


class WorldWriter:
    """Messages of the world, without delay."""

    def __init__(self) -> None:
        """Prepare the messages."""
        self._clock = Clock()
        self._point = PointStamped()
        self._point.header.frame_id = WORLD

    def clock(self, stamp: int) -> Clock:
        """`/clock` at `stamp` [ns]."""
        self._clock.clock = to_time(stamp)
        return self._clock

    def point(self, stamp: int, position: FloatArray) -> PointStamped:
        """A point (3,) [m] in the world at `stamp` [ns]."""
        message = self._point
        message.header.stamp = to_time(stamp)
        message.point.x, message.point.y, message.point.z = position.tolist()
        return message


class TruthWriter(WorldWriter):
    """Messages of the ground truth of a robot, without delay."""

    def __init__(self, robot: RobotDescription) -> None:
        """Prepare the messages with the frames of `robot`."""
        super().__init__()
        self._odometry = Odometry()
        self._odometry.header.frame_id = WORLD
        self._odometry.child_frame_id = robot.torso_frame

    def odometry(self, truth: GroundTruth) -> Odometry:
        """`ground_truth/odom`: pose of the torso in the world, twist in the torso frame."""
        message = self._odometry
        message.header.stamp = to_time(truth.stamp)
        pose, twist = message.pose.pose, message.twist.twist
        x, y, z = truth.torso_position.tolist()
        pose.position.x, pose.position.y, pose.position.z = x, y, z
        x, y, z, w = truth.torso_quaternion.tolist()
        orientation = pose.orientation
        orientation.x, orientation.y, orientation.z, orientation.w = x, y, z, w
        _fill(twist.linear, truth.torso_linear_velocity_in_torso)
        _fill(twist.angular, truth.torso_angular_velocity_in_torso)
        return message

    def com(self, truth: GroundTruth) -> PointStamped:
        """`ground_truth/com`."""
        return self.point(truth.stamp, truth.com)


def push_of(message: WrenchStamped) -> FloatArray:
    """The force (3,) [N] of `push`, in the world; NaoGaitError if it is not usable."""
    force, torque = message.wrench.force, message.wrench.torque
    return read_push(
        (force.x, force.y, force.z), (torque.x, torque.y, torque.z), message.header.frame_id
    )


def _fill(vector: Vector3, values: FloatArray) -> None:
    vector.x, vector.y, vector.z = values.tolist()
