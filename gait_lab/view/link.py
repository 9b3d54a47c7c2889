"""What the viewer hears from the robot, and what it says to it."""

from collections import deque
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from gait_lab.analysis.body import pose_of
from nao_lipm_gait.types import STANDSTILL, FloatArray, VelocityCommand

if TYPE_CHECKING:
    from rclpy.node import Node

HISTORY = 100
"""Ticks that are kept to find what belongs together: sensors are older than the truth."""
COMMAND_PERIOD = 0.1
"""[s] of wall time between two velocity commands."""
LAST_WORDS = 10
"""Times that a standstill is sent before the viewer leaves cmd_vel to others."""


@dataclass(slots=True)
class Heard:
    """The newest of everything."""

    joint_names: list[str] = field(default_factory=list)
    joints: list[float] = field(default_factory=list)
    stamp: int = -1
    """[ns] of the joints."""
    truth: dict[int, FloatArray] = field(default_factory=dict)
    """stamp -> pose (4, 4) of the torso in world."""
    odometry: dict[int, tuple[float, float, float]] = field(default_factory=dict)
    """stamp -> base_footprint in odom."""
    speed: tuple[float, float, float] = (0.0, 0.0, 0.0)
    """Odometry's velocity [m/s, m/s, rad/s]."""
    support: str = ""
    markers: dict[str, Any] = field(default_factory=dict)
    """name -> pose in odom."""
    urdf: str | None = None
    count: int = 0
    """Joint states so far."""


class RobotLink:
    """Subscriptions and publishers of the viewer, below the node's namespace."""

    def __init__(self, node: "Node", *, stamped: bool = False) -> None:
        from geometry_msgs.msg import Twist, TwistStamped, WrenchStamped
        from nav_msgs.msg import Odometry
        from rclpy.qos import DurabilityPolicy, QoSProfile, qos_profile_sensor_data
        from sensor_msgs.msg import JointState
        from std_msgs.msg import String
        from visualization_msgs.msg import MarkerArray

        latched = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
        self.heard = Heard()
        self._order: dict[str, deque[int]] = {"truth": deque(), "odometry": deque()}
        self._node = node
        self._stamped = stamped
        self._command_type = TwistStamped if stamped else Twist
        self._push_type = WrenchStamped
        self._commands = node.create_publisher(self._command_type, "cmd_vel", 10)
        self._pushes = node.create_publisher(WrenchStamped, "push", 10)
        self._standstills = LAST_WORDS
        for kind, topic, callback, qos in (
            (JointState, "joint_states", self._on_joints, qos_profile_sensor_data),
            (Odometry, "ground_truth/odom", self._on_truth, qos_profile_sensor_data),
            (Odometry, "odom", self._on_odometry, qos_profile_sensor_data),
            (MarkerArray, "gait/footsteps", self._on_footsteps, 10),
            (String, "gait/support", self._on_support, latched),
            (String, "robot_description", self._on_description, latched),
        ):
            node.create_subscription(kind, topic, callback, qos)

    # -- in ----------------------------------------------------------------------------------------

    def _on_joints(self, message: Any) -> None:
        heard = self.heard
        heard.joint_names, heard.joints = list(message.name), list(message.position)
        heard.stamp = _stamp(message)
        heard.count += 1

    def _on_truth(self, message: Any) -> None:
        p, q = message.pose.pose.position, message.pose.pose.orientation
        pose = pose_of(np.array([[p.x, p.y, p.z]]), np.array([[q.x, q.y, q.z, q.w]]))[0]
        self._remember("truth", self.heard.truth, _stamp(message), pose)

    def _on_odometry(self, message: Any) -> None:
        p, q = message.pose.pose.position, message.pose.pose.orientation
        yaw = float(np.arctan2(2 * (q.x * q.y + q.z * q.w), 1 - 2 * (q.y * q.y + q.z * q.z)))
        self._remember("odometry", self.heard.odometry, _stamp(message), (p.x, p.y, yaw))
        v = message.twist.twist
        self.heard.speed = v.linear.x, v.linear.y, v.angular.z

    def _remember(self, kind: str, values: dict[int, Any], stamp: int, value: Any) -> None:
        order = self._order[kind]
        if order and stamp < order[-1]:  # the clock began anew
            order.clear()
            values.clear()
        if stamp not in values:
            order.append(stamp)
        values[stamp] = value
        while len(order) > HISTORY:
            values.pop(order.popleft(), None)

    def _on_footsteps(self, message: Any) -> None:
        self.heard.markers = {marker.ns: marker.pose for marker in message.markers}

    def _on_support(self, message: Any) -> None:
        self.heard.support = message.data

    def _on_description(self, message: Any) -> None:
        self.heard.urdf = message.data

    # -- out ---------------------------------------------------------------------------------------

    def drive(self, command: VelocityCommand) -> None:
        """Send a command, every COMMAND_PERIOD. At rest it soon leaves cmd_vel to others."""
        if command != STANDSTILL:
            self._standstills = 0
        elif self._standstills >= LAST_WORDS:
            return
        else:
            self._standstills += 1
        message = self._command_type()
        twist = message.twist if self._stamped else message
        if self._stamped:
            message.header.stamp = self._node.get_clock().now().to_msg()
        twist.linear.x, twist.linear.y = command.x, command.y
        twist.angular.z = command.yaw
        self._commands.publish(message)

    def push(self, force: tuple[float, float]) -> None:
        """A push at the torso, x and y [N] in the world."""
        message = self._push_type()
        message.header.frame_id = "world"
        message.wrench.force.x, message.wrench.force.y = force
        self._pushes.publish(message)


def _stamp(message: Any) -> int:
    return int(message.header.stamp.sec) * 1_000_000_000 + int(message.header.stamp.nanosec)
