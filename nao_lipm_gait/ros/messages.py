"""Conversion between the gait's own types and ROS messages.

`sim_bridge` and `lola_bridge` use parts of it for their own messages.
"""

from array import array
from collections.abc import Callable, Mapping, Sequence
from typing import Any, Protocol
from uuid import uuid4

from builtin_interfaces.msg import Duration
from geometry_msgs.msg import (
    Point,
    PointStamped,
    PoseStamped,
    TransformStamped,
    Twist,
    TwistStamped,
    Vector3,
    WrenchStamped,
)
from nav_msgs.msg import Odometry
from sensor_msgs.msg import Imu, JointState, Temperature
from std_msgs.msg import ColorRGBA, Float64MultiArray, MultiArrayDimension
from trajectory_msgs.msg import JointTrajectory, JointTrajectoryPoint
from visualization_msgs.msg import Marker, MarkerArray

from nao_lipm_gait.runtime.inputs import (
    ImuInput,
    JointInput,
    LoadInput,
    TemperatureInput,
    TwistInput,
    kick_goal,
)
from robot_core.geometry import compose, quaternion_from_rpy
from robot_core.ros.messages import (
    BASE_FOOTPRINT,
    ODOM,
    diagonal,
    set_planar,
    to_doubles,
    to_time,
)
from robot_core.types import GaitStatus, JointTargets, Point3, Pose2, Pose6

Q = "Q"
"""Frame of the CoM points: the paper's coordinate system of the current single support, z from the
ground. It jumps with each support change, so it is not published in TF."""

_LEFT = ColorRGBA(r=0.9, g=0.2, b=0.2, a=0.8)
_RIGHT = ColorRGBA(r=0.2, g=0.7, b=0.2, a=0.8)
_LEFT_UP = ColorRGBA(r=0.9, g=0.2, b=0.2, a=0.4)
_RIGHT_UP = ColorRGBA(r=0.2, g=0.7, b=0.2, a=0.4)
_ORIGIN = ColorRGBA(r=0.2, g=0.4, b=1.0, a=1.0)
_COM = ColorRGBA(r=1.0, g=0.8, b=0.1, a=1.0)
_SOLE = (0.16, 0.09, 0.005)
"""[m] Size of the soles in the picture."""


# -- from messages ---------------------------------------------------------------------------------


def twist_input(message: Twist | TwistStamped) -> TwistInput:
    """Contents of `cmd_vel`."""
    twist = message.twist if isinstance(message, TwistStamped) else message
    return TwistInput(_xyz(twist.linear), _xyz(twist.angular))


def imu_input(message: Imu) -> ImuInput:
    """Contents of `imu/data`."""
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


def joint_input(
    message: JointState, info: Mapping[str, int], now: int, arrived: int | None
) -> JointInput:
    """Contents of `joint_states`.

    Args:
        message: The message.
        info: What rclpy knows about it: when it was sent and received [ns of the system clock].
        now: The system clock [ns].
        arrived: Time of its arrival [ns] on the clock of the stamps; None if that is unknown.
    """
    stamp = message.header.stamp
    # Cyclone DDS does not say when a message was received.
    received = info["received_timestamp"] or info["source_timestamp"]
    return JointInput(
        stamp.sec, stamp.nanosec, message.name, message.position, message.effort,
        waited=(now - received) * 1e-9, arrived=arrived,
    )  # fmt: skip


def load_input(side: int, message: WrenchStamped) -> LoadInput:
    """Contents of a sole's wrench; side: 0 left, 1 right."""
    stamp = message.header.stamp
    return LoadInput(stamp.sec, stamp.nanosec, side, message.wrench.force.z)


def temperature_input(message: Temperature) -> TemperatureInput:
    """Contents of `temperature`; the frame_id names the joint."""
    stamp = message.header.stamp
    return TemperatureInput(
        stamp.sec, stamp.nanosec, message.header.frame_id, message.temperature
    )


def kick_of(message: PoseStamped, frame_id: str) -> Pose2:
    """Contents of `~/kick` in a frame without prefix; see `kick_goal`."""
    place, turn = message.pose.position, message.pose.orientation
    return kick_goal((place.x, place.y), (turn.x, turn.y, turn.z, turn.w), frame_id)


def _xyz(vector: Vector3) -> Point3:
    return vector.x, vector.y, vector.z


# -- to messages -----------------------------------------------------------------------------------


class CommandWriter(Protocol):
    """Writes joint targets as the message of one `command_interface`.

    Each is made with the joint names and the control period [s]. The message is reused.

    Attributes:
        message_type: Message type of `joint_command`.
    """

    message_type: type

    def write(self, targets: JointTargets) -> JointState | Float64MultiArray | JointTrajectory:
        """The targets as a message."""


class JointStateWriter:
    """`joint_state`: position [rad]; effort is the share of each motor's torque, 0 to 1.

    The frame_id is unique to this process, so that a robot can tell two gaits apart.
    """

    message_type = JointState

    def __init__(self, joint_names: Sequence[str], period: float) -> None:
        self._message = JointState(name=list(joint_names))
        self._message.header.frame_id = f"gait_{uuid4().hex[:12]}"
        self._count = len(joint_names)

    def write(self, targets: JointTargets) -> JointState:
        """The targets as a message."""
        self._message.header.stamp = to_time(targets.stamp)
        self._message.position = to_doubles(targets.position)
        each = targets.joint_stiffness
        shares = array("d", [targets.stiffness]) * self._count if each is None else to_doubles(each)
        self._message.effort = shares
        return self._message


class ForwardCommandWriter:
    """`forward_command`: for the forward and position group controllers of ros2_control.

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
        """The targets as a message."""
        self._message.data = to_doubles(targets.position)
        return self._message


class JointTrajectoryWriter:
    """`joint_trajectory`: one point, to be reached one control period after its arrival.

    The header stamp is zero, which ros2_control reads as "now". The stamp of the sensors lies in
    the past by the sensor delay, and a controller would discard the point.
    """

    message_type = JointTrajectory

    def __init__(self, joint_names: Sequence[str], period: float) -> None:
        self._message = JointTrajectory(joint_names=list(joint_names))
        self._point = JointTrajectoryPoint(
            time_from_start=Duration(sec=0, nanosec=round(period * 1e9))
        )
        self._message.points = [self._point]

    def write(self, targets: JointTargets) -> JointTrajectory:
        """The targets as a message."""
        self._point.positions = to_doubles(targets.position)
        return self._message


COMMAND_WRITERS: dict[str, Callable[[Sequence[str], float], CommandWriter]] = {
    "joint_state": JointStateWriter,
    "forward_command": ForwardCommandWriter,
    "joint_trajectory": JointTrajectoryWriter,
}
"""By the value of `command_interface`."""


SPEED_SIGMA = 0.05
"""[m/s] Deviation of the odometry's velocity."""


class StatusWriter:
    """Writes the status of a tick as odometry, transforms and points. The messages are reused.

    Args:
        base_frame: The root link of the robot.
        prefix: Before the names of all frames, as of robot_state_publisher.
    """

    def __init__(self, base_frame: str = "base_link", prefix: str = "") -> None:
        self._odometry = Odometry()
        self._odometry.header.frame_id = prefix + ODOM
        self._odometry.child_frame_id = prefix + BASE_FOOTPRINT
        # x, y, z, roll, pitch, yaw. Height, roll and pitch of base_footprint are 0 by definition.
        self._odometry.pose.covariance = diagonal(0.0, 0.0, 1e-6, 1e-6, 1e-6, 0.0)
        self._odometry.twist.covariance = diagonal(0.0, 0.0, 1e-6, 1e-6, 1e-6, 0.0)
        self._point = PointStamped()
        self._point.header.frame_id = prefix + Q
        self._transform = TransformStamped()
        self._transform.header.frame_id = prefix + ODOM
        self._transform.child_frame_id = prefix + BASE_FOOTPRINT
        self._base = TransformStamped()
        self._base.header.frame_id = prefix + BASE_FOOTPRINT
        self._base.child_frame_id = prefix + base_frame
        self._torso = PoseStamped()
        self._torso.header.frame_id = prefix + BASE_FOOTPRINT

    def odometry(self, status: GaitStatus) -> Odometry:
        """Pose of base_footprint in odom and its velocity in its own frame, with covariances."""
        message = self._odometry
        message.header.stamp = to_time(status.stamp)
        place = message.pose.pose
        set_planar(place.position, place.orientation, status.base_footprint_in_odom)
        twist = message.twist.twist
        twist.linear.x, twist.linear.y, twist.angular.z = status.velocity
        pose = status.pose_covariance
        covariance = message.pose.covariance
        covariance[0], covariance[7], covariance[35] = pose.xx, pose.yy, pose.yaw
        covariance[1] = covariance[6] = pose.xy
        covariance[5] = covariance[30] = pose.x_yaw
        covariance[11] = covariance[31] = pose.y_yaw
        vx, vy, _ = status.velocity
        for axis, speed in ((0, vx), (7, vy)):
            slip = speed if status.blocked else 0.0
            message.twist.covariance[axis] = SPEED_SIGMA**2 + slip * slip
        # A filter cannot use the 0 of a robot that stands.
        message.twist.covariance[35] = max(status.yaw_rate_variance, 1e-6)
        return message

    def transform(self, status: GaitStatus) -> TransformStamped:
        """The transform from odom to base_footprint."""
        message = self._transform
        message.header.stamp = to_time(status.stamp)
        place = message.transform
        set_planar(place.translation, place.rotation, status.base_footprint_in_odom)
        return message

    def base_transform(self, stamp: int, torso_pose: Pose6) -> TransformStamped:
        """The transform from base_footprint to the root link; see `Gait.torso_pose`."""
        message = self._base
        message.header.stamp = to_time(stamp)
        _set_pose(message.transform.translation, message.transform.rotation, torso_pose)
        return message

    def torso_pose(self, stamp: int, torso_pose: Pose6) -> PoseStamped:
        """The torso in base_footprint; see `Gait.torso_pose`."""
        message = self._torso
        message.header.stamp = to_time(stamp)
        _set_pose(message.pose.position, message.pose.orientation, torso_pose)
        return message

    def point_in_q(self, point: Point3, stamp: int) -> PointStamped:
        """A point [m] in Q at `stamp` [ns]."""
        message = self._point
        message.header.stamp = to_time(stamp)
        message.point.x, message.point.y, message.point.z = point
        return message


def support_text(status: GaitStatus) -> str:
    """State and support foot, as in `walk left`."""
    return f"{status.state.value} {status.support}"


def footsteps(status: GaitStatus, prefix: str = "") -> MarkerArray:
    """Soles, pendulum origin and CoM in `odom`; the sole of the swing foot is pale."""
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
        _set_pose(sole.pose.position, sole.pose.orientation, pose)
        markers.markers.append(sole)
    disc = (0.02, 0.02, 0.01)
    origin = _marker(status.stamp, 2, "pendulum origin", Marker.CYLINDER, _ORIGIN, disc)
    origin.pose.position = _from_q(status.q_in_odom, (*status.pendulum_origin_in_q, 0.0))
    com = _marker(status.stamp, 3, "com", Marker.SPHERE, _COM, (0.03, 0.03, 0.03))
    com.pose.position = _from_q(status.q_in_odom, status.com_estimated_in_q)
    markers.markers += [origin, com]
    for marker in markers.markers:
        marker.header.frame_id = prefix + ODOM
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
    marker.header.stamp = to_time(stamp)
    marker.scale.x, marker.scale.y, marker.scale.z = size
    return marker


def _set_pose(place: Any, turn: Any, pose: Pose6) -> None:
    """Set a position or translation, and an orientation or rotation."""
    place.x, place.y, place.z, roll, pitch, yaw = pose
    turn.x, turn.y, turn.z, turn.w = quaternion_from_rpy(roll, pitch, yaw)


def _from_q(q_in_odom: Pose2, point: Point3) -> Point:
    x, y, _ = compose(q_in_odom, (point[0], point[1], 0.0))
    return Point(x=x, y=y, z=point[2])
