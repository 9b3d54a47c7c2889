"""Between the gait's own types and ROS messages."""

import math
from array import array
from collections.abc import Sequence
from uuid import uuid4

from builtin_interfaces.msg import Duration, Time
from geometry_msgs.msg import (
    Point,
    PointStamped,
    TransformStamped,
    Twist,
    TwistStamped,
    Vector3,
    WrenchStamped,
)
from nav_msgs.msg import Odometry
from sensor_msgs.msg import Imu, JointState
from std_msgs.msg import ColorRGBA, Float64MultiArray, MultiArrayDimension
from trajectory_msgs.msg import JointTrajectory, JointTrajectoryPoint
from visualization_msgs.msg import Marker, MarkerArray

from nao_lipm_gait.geometry import compose, quaternion_from_rpy
from nao_lipm_gait.runtime.inputs import ImuInput, JointInput, LoadInput, TwistInput
from nao_lipm_gait.types import FloatArray, GaitStatus, JointTargets, Point3, Pose2

ODOM = "odom"
BASE_FOOTPRINT = "base_footprint"
Q = "Q"
"""Frame of the CoM points: the paper's coordinate system of the running single support, z from the
ground. It jumps with each support change, so it is not a frame of TF."""

_NANOSECONDS = 1_000_000_000
_LEFT = ColorRGBA(r=0.9, g=0.2, b=0.2, a=0.8)
_RIGHT = ColorRGBA(r=0.2, g=0.7, b=0.2, a=0.8)
_LEFT_UP = ColorRGBA(r=0.9, g=0.2, b=0.2, a=0.4)
_RIGHT_UP = ColorRGBA(r=0.2, g=0.7, b=0.2, a=0.4)
_ORIGIN = ColorRGBA(r=0.2, g=0.4, b=1.0, a=1.0)
_COM = ColorRGBA(r=1.0, g=0.8, b=0.1, a=1.0)
_SOLE = (0.16, 0.09, 0.005)
"""[m] Size of the drawn soles; only a picture."""


def to_time(stamp: int) -> Time:
    """Stamp [ns]"""
    sec, nanosec = divmod(stamp, _NANOSECONDS)
    return Time(sec=sec, nanosec=nanosec)


def twist_input(message: Twist | TwistStamped) -> TwistInput:
    twist = message.twist if isinstance(message, TwistStamped) else message
    return TwistInput(_xyz(twist.linear), _xyz(twist.angular))


def imu_input(message: Imu) -> ImuInput:
    stamp, turn = message.header.stamp, message.orientation
    return ImuInput(
        stamp.sec,
        stamp.nanosec,
        _xyz(message.angular_velocity),
        _xyz(message.linear_acceleration),
        (turn.x, turn.y, turn.z, turn.w),
        float(message.orientation_covariance[0]),
        float(message.angular_velocity_covariance[0]),
        float(message.linear_acceleration_covariance[0]),
    )


def joint_input(message: JointState) -> JointInput:
    stamp = message.header.stamp
    return JointInput(
        stamp.sec, stamp.nanosec, message.name, message.position, message.velocity
    )


def load_input(side: int, message: WrenchStamped) -> LoadInput:
    """side: 0 left, 1 right."""
    stamp = message.header.stamp
    return LoadInput(stamp.sec, stamp.nanosec, side, message.wrench.force.z)


def _xyz(vector: Vector3) -> Point3:
    return vector.x, vector.y, vector.z


def to_doubles(values: FloatArray) -> array:
    """A float64 array in the type that ROS messages take without looking at each element."""
    doubles = array("d")
    doubles.frombytes(values.tobytes())
    return doubles


class CommandWriter:
    """Joint targets as a message of one `command_interface`."""

    message_type: type

    def write(self, targets: JointTargets) -> JointState | Float64MultiArray | JointTrajectory:
        raise NotImplementedError


class JointStateWriter(CommandWriter):
    """`joint_state`: position [rad]; effort is the share of each motor's torque, 0 to 1.

    The frame_id is a name of this process alone, so that a robot can tell two gaits apart.
    """

    message_type = JointState

    def __init__(self, joint_names: Sequence[str], period: float) -> None:
        self._message = JointState(name=list(joint_names))
        self._message.header.frame_id = f"gait_{uuid4().hex[:12]}"
        self._count = len(joint_names)

    def write(self, targets: JointTargets) -> JointState:
        self._message.header.stamp = to_time(targets.stamp)
        self._message.position = to_doubles(targets.position)
        each = targets.joint_stiffness
        shares = array("d", [targets.stiffness]) * self._count if each is None else to_doubles(each)
        self._message.effort = shares
        return self._message


class ForwardCommandWriter(CommandWriter):
    """`forward_command`: for ros2_control's forward and position group controllers.

    Positions [rad] in the order of the robot's joint names; no stamp, no stiffness.
    """

    message_type = Float64MultiArray

    def __init__(self, joint_names: Sequence[str], period: float) -> None:
        self._message = Float64MultiArray()
        self._message.layout.dim = [
            MultiArrayDimension(
                label=",".join(joint_names), size=len(joint_names), stride=len(joint_names)
            )
        ]

    def write(self, targets: JointTargets) -> Float64MultiArray:
        self._message.data = to_doubles(targets.position)
        return self._message


class JointTrajectoryWriter(CommandWriter):
    """`joint_trajectory`: one point, to be reached one control period after it arrives.

    The header stamp is zero, which ros2_control reads as "now": the stamp of the sensors lies in
    the past by the sensor delay, and a controller would throw the point away.
    """

    message_type = JointTrajectory

    def __init__(self, joint_names: Sequence[str], period: float) -> None:
        self._message = JointTrajectory(joint_names=list(joint_names))
        self._point = JointTrajectoryPoint(
            time_from_start=Duration(sec=0, nanosec=round(period * 1e9))
        )
        self._message.points = [self._point]

    def write(self, targets: JointTargets) -> JointTrajectory:
        self._point.positions = to_doubles(targets.position)
        return self._message


COMMAND_WRITERS: dict[str, type] = {
    "joint_state": JointStateWriter,
    "forward_command": ForwardCommandWriter,
    "joint_trajectory": JointTrajectoryWriter,
}


class StatusWriter:
    """The status of a tick as odometry, transform and points. Messages are used again each tick."""

    def __init__(self) -> None:
        self._odometry = Odometry()
        self._odometry.header.frame_id = ODOM
        self._odometry.child_frame_id = BASE_FOOTPRINT
        # x, y, z, roll, pitch, yaw. Dead reckoning over the feet drifts; these are orders of
        # magnitude for a fusion, not a model.
        self._odometry.pose.covariance = _diagonal(0.01, 0.01, 1e-6, 1e-6, 1e-6, 0.05)
        self._odometry.twist.covariance = _diagonal(0.0025, 0.0025, 1e-6, 1e-6, 1e-6, 0.04)
        self._point = PointStamped()
        self._point.header.frame_id = Q
        self._transform = TransformStamped()
        self._transform.header.frame_id = ODOM
        self._transform.child_frame_id = BASE_FOOTPRINT

    def odometry(self, status: GaitStatus) -> Odometry:
        x, y, yaw = status.base_footprint_in_odom
        message = self._odometry
        message.header.stamp = to_time(status.stamp)
        message.pose.pose.position.x = x
        message.pose.pose.position.y = y
        message.pose.pose.orientation.z = math.sin(0.5 * yaw)
        message.pose.pose.orientation.w = math.cos(0.5 * yaw)
        twist = message.twist.twist
        twist.linear.x, twist.linear.y, twist.angular.z = status.velocity
        return message

    def transform(self, status: GaitStatus) -> TransformStamped:
        x, y, yaw = status.base_footprint_in_odom
        message = self._transform
        message.header.stamp = to_time(status.stamp)
        message.transform.translation.x = x
        message.transform.translation.y = y
        message.transform.rotation.z = math.sin(0.5 * yaw)
        message.transform.rotation.w = math.cos(0.5 * yaw)
        return message

    def point_in_q(self, point: Point3, stamp: int) -> PointStamped:
        message = self._point
        message.header.stamp = to_time(stamp)
        message.point.x, message.point.y, message.point.z = point
        return message


def support_text(status: GaitStatus) -> str:
    """State and support foot in two words, as in `walk left`."""
    return f"{status.state.value} {status.support}"


def footsteps(status: GaitStatus) -> MarkerArray:
    """Soles, pendulum origin and CoM in `odom`; a sole that does not carry the robot is pale."""
    left = _LEFT_UP if status.support == "right" else _LEFT
    right = _RIGHT_UP if status.support == "left" else _RIGHT
    markers = MarkerArray()
    for index, (pose, color, name) in enumerate(
        (
            (status.left_sole_in_odom, left, "left sole"),
            (status.right_sole_in_odom, right, "right sole"),
        )
    ):
        sole = _marker(status.stamp, index, name, Marker.CUBE, color, _SOLE)
        sole.pose.position = Point(x=pose[0], y=pose[1], z=pose[2])
        x, y, z, w = quaternion_from_rpy(pose[3], pose[4], pose[5])
        orientation = sole.pose.orientation
        orientation.x, orientation.y, orientation.z, orientation.w = x, y, z, w
        markers.markers.append(sole)
    disc = (0.02, 0.02, 0.01)
    origin = _marker(status.stamp, 2, "pendulum origin", Marker.CYLINDER, _ORIGIN, disc)
    origin.pose.position = _from_q(status.q_in_odom, (*status.pendulum_origin_in_q, 0.0))
    com = _marker(status.stamp, 3, "com", Marker.SPHERE, _COM, (0.03, 0.03, 0.03))
    com.pose.position = _from_q(status.q_in_odom, status.com_estimated_in_q)
    markers.markers += [origin, com]
    return markers


def _marker(
    stamp: int,
    identity: int,
    name: str,
    kind: int,
    color: ColorRGBA,
    size: tuple[float, float, float],
) -> Marker:
    marker = Marker(ns=name, id=identity, type=kind, action=Marker.ADD, color=color)
    marker.header.frame_id = ODOM
    marker.header.stamp = to_time(stamp)
    marker.scale.x, marker.scale.y, marker.scale.z = size
    return marker


def _from_q(q_in_odom: Pose2, point: Point3) -> Point:
    x, y, _ = compose(q_in_odom, (point[0], point[1], 0.0))
    return Point(x=x, y=y, z=point[2])


def _diagonal(*values: float) -> list[float]:
    size = len(values)
    matrix = [0.0] * (size * size)
    matrix[:: size + 1] = values
    return matrix
