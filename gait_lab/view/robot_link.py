"""The connection of the viewer to the robot: newest messages in, commands and pushes out."""

from collections import deque
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from gait_lab.analysis.body import pose_of
from gait_lab.ros_session import VelocityPublisher
from robot_core.geometry import yaw_of_quaternion
from robot_core.message_checks import finite, read_array
from robot_core.types import STANDSTILL, FloatArray, VelocityCommand

if TYPE_CHECKING:
    from rclpy.node import Node

HISTORY = 100
"""Number of stamps kept, to match delayed sensors with the ground truth of the same stamp."""
COMMAND_PERIOD = 0.1
"""Wall time between two velocity commands [s]."""
MARKERS = ("com", "pendulum origin")
"""Those of `gait/footsteps` that are shown."""
FAR, FAST = 1e4, 1e3
"""[m] and [m/s, rad/s] beyond which nothing is shown."""
STOP_COMMANDS = 10
"""Number of standstill commands before the viewer stops publishing on cmd_vel."""


@dataclass(slots=True)
class RobotState:
    """The newest message of every topic.

    Attributes:
        joint_names: Names of the joints.
        joints: Joint angles [rad].
        stamp: Stamp of the joints [ns]; -1 before the first message.
        truth: Torso pose (4, 4) in the world by stamp [ns].
        odometry: Pose (x, y, yaw) of base_footprint in odom [m, m, rad] by stamp [ns].
        speed: Velocity of the odometry [m/s, m/s, rad/s].
        support: State and support foot of the gait.
        markers: Poses of the footstep markers in odom by name.
        urdf: The robot description; None before it arrives.
        count: Number of joint states so far.
    """

    joint_names: list[str] = field(default_factory=list)
    joints: list[float] = field(default_factory=list)
    stamp: int = -1
    truth: dict[int, FloatArray] = field(default_factory=dict)
    odometry: dict[int, tuple[float, float, float]] = field(default_factory=dict)
    speed: tuple[float, float, float] = (0.0, 0.0, 0.0)
    support: str = ""
    markers: dict[str, Any] = field(default_factory=dict)
    urdf: str | None = None
    count: int = 0


class RobotLink:
    """Subscriptions and publishers of the viewer, in the namespace of its node.

    Args:
        node: The node that subscribes and publishes.
        name: Of a robot out of several, below which its topics are; "" for the only one.
        stamped: Whether to publish TwistStamped.
    """

    def __init__(self, node: "Node", name: str = "", *, stamped: bool = False) -> None:
        from geometry_msgs.msg import WrenchStamped
        from nav_msgs.msg import Odometry
        from rclpy.qos import qos_profile_sensor_data
        from sensor_msgs.msg import JointState
        from std_msgs.msg import String
        from visualization_msgs.msg import MarkerArray

        from robot_core.ros.topics import LATCHED, RELIABLE, Inputs

        inputs = Inputs(node, name, burst=1)
        below = f"{name}/" if name else ""
        self.state = RobotState()
        self._order: dict[str, deque[int]] = {"truth": deque(), "odometry": deque()}
        self._velocity = VelocityPublisher(node, stamped=stamped, topic=f"{below}cmd_vel")
        self._push_type = WrenchStamped
        self._pushes = node.create_publisher(WrenchStamped, f"{below}push", 10)
        self.standstills = STOP_COMMANDS
        for kind, topic, callback, qos in (
            (JointState, "joint_states", self._on_joints, qos_profile_sensor_data),
            (Odometry, "ground_truth/odom", self._on_truth, qos_profile_sensor_data),
            (Odometry, "odom", self._on_odometry, qos_profile_sensor_data),
            (MarkerArray, "gait/footsteps", self._on_footsteps, RELIABLE),
            (String, "gait/support", self._on_support, LATCHED),
            (String, "robot_description", self._on_description, LATCHED),
        ):
            inputs.subscribe(kind, below + topic, callback, qos)

    # -- in ----------------------------------------------------------------------------------------

    def _on_joints(self, message: Any) -> None:
        state = self.state
        state.joint_names, state.joints = list(message.name), list(message.position)
        state.stamp = _stamp(message)
        state.count += 1

    def _on_truth(self, message: Any) -> None:
        place, turn = _pose(message.pose.pose, "ground_truth/odom")
        pose = pose_of(place[None], turn[None])[0]
        self._remember("truth", self.state.truth, _stamp(message), pose)

    def _on_odometry(self, message: Any) -> None:
        (x, y, _), turn = _pose(message.pose.pose, "odom")
        v = message.twist.twist
        speed = v.linear.x, v.linear.y, v.angular.z
        read_array(speed, "odom twist", (3,), FAST, "m/s, rad/s", "xyz")
        pose = float(x), float(y), yaw_of_quaternion(*turn.tolist())
        self._remember("odometry", self.state.odometry, _stamp(message), pose)
        self.state.speed = speed

    def _remember(self, kind: str, values: dict[int, Any], stamp: int, value: Any) -> None:
        order = self._order[kind]
        if order and stamp < order[-1]:  # the clock was reset
            order.clear()
            values.clear()
        if stamp not in values:
            order.append(stamp)
        values[stamp] = value
        while len(order) > HISTORY:
            values.pop(order.popleft(), None)

    def _on_footsteps(self, message: Any) -> None:
        shown = [marker for marker in message.markers if marker.ns in MARKERS]
        for marker in shown:
            _pose(marker.pose, f"gait/footsteps {marker.ns}")
        self.state.markers = {marker.ns: marker.pose for marker in shown}

    def _on_support(self, message: Any) -> None:
        self.state.support = message.data

    def _on_description(self, message: Any) -> None:
        self.state.urdf = message.data

    # -- out ---------------------------------------------------------------------------------------

    def drive(self, command: VelocityCommand) -> None:
        """Publish a command; at standstill, stop publishing after `STOP_COMMANDS`."""
        if command != STANDSTILL:
            self.standstills = 0
        elif self.standstills >= STOP_COMMANDS:
            return
        else:
            self.standstills += 1
        self._velocity.publish(command)

    def push(self, force: tuple[float, float]) -> None:
        """Push the torso with a force (x, y) [N] in the world."""
        message = self._push_type()
        message.header.frame_id = "world"
        message.wrench.force.x, message.wrench.force.y = force
        self._pushes.publish(message)


def _pose(pose: Any, topic: str) -> tuple[FloatArray, FloatArray]:
    """Place (3,) [m] and quaternion (4,) xyzw of a pose; NaoGaitError if one cannot be drawn."""
    p, q = pose.position, pose.orientation
    turn = q.x, q.y, q.z, q.w
    for value in turn:
        finite(value, f"{topic} orientation", 1.1, "of a unit quaternion")
    return read_array((p.x, p.y, p.z), f"{topic} position", (3,), FAR, "m", "xyz"), np.array(turn)


def _stamp(message: Any) -> int:
    return int(message.header.stamp.sec) * 1_000_000_000 + int(message.header.stamp.nanosec)
