"""What every command of the tool needs that talks to running nodes: a node, names, `cmd_vel`.

rclpy is imported inside the functions: the ROS wheels restart the interpreter at the first import.
"""

import time
from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

from robot_core.errors import NaoGaitError
from robot_core.ros.process import start_rclpy, stop_on_signal
from robot_core.types import STANDSTILL, VelocityCommand

if TYPE_CHECKING:
    from rclpy.node import Node

STOP_COMMANDS, STOP_PERIOD = 3, 0.02
"""Number of stop commands at the end, and wall time [s] after each; DDS sends in the background."""
_ALLOWED = "letters, digits and _ between /, none of the parts beginning with a digit"


def checked_namespace(name: str) -> str:
    """Return a namespace, "" for none; NaoGaitError if it is not a valid one for ROS."""
    from rclpy.exceptions import NameValidationException
    from rclpy.validate_namespace import validate_namespace

    try:
        validate_namespace(name if name.startswith("/") else f"/{name}")
    except NameValidationException as error:
        raise NaoGaitError("namespace", name, _ALLOWED) from error
    return name


def checked_topics(names: tuple[str, ...]) -> tuple[str, ...]:
    """Return topics; NaoGaitError if one is not a valid name for ROS."""
    from rclpy.exceptions import NameValidationException
    from rclpy.validate_full_topic_name import validate_full_topic_name

    for name in names:
        try:
            validate_full_topic_name("/" + name.removeprefix("~").removeprefix("/"))
        except NameValidationException as error:
            raise NaoGaitError("topics", name, _ALLOWED) from error
    return names


@contextmanager
def ros_node(name: str, namespace: str = "", use_sim_time: bool = False) -> Iterator["Node"]:
    """Create a node for the time of a command.

    rclpy installs no signal handlers: Ctrl-C must not end ROS before the last messages are sent.

    Args:
        name: Name of the node.
        namespace: Namespace of the robot; "" for none.
        use_sim_time: Whether the clock of the node follows `/clock`.

    Yields:
        The node.

    Raises:
        NaoGaitError: If the namespace is not a valid one for ROS.
        KeyboardInterrupt: If a signal came during the start.
    """
    with stop_on_signal() as stop:
        import rclpy
        from rclpy.parameter import Parameter

        checked_namespace(namespace)
        start_rclpy()
        node = rclpy.create_node(
            name,
            namespace=namespace,
            parameter_overrides=[Parameter("use_sim_time", value=use_sim_time)],
        )
    try:
        if stop:
            raise KeyboardInterrupt
        yield node
    finally:
        rclpy.try_shutdown()


class VelocityPublisher:
    """Publishes velocity commands on `cmd_vel`, as Twist or as TwistStamped."""

    def __init__(self, node: "Node", *, stamped: bool = False, topic: str = "cmd_vel") -> None:
        from geometry_msgs.msg import Twist, TwistStamped

        self._node = node
        self._stamped = stamped
        self.message_type: Any = TwistStamped if stamped else Twist
        # With a queue of one message Fast DDS asks for each acknowledgement at once; with a longer
        # one `arrived` waits for its next heartbeat, up to 3 s.
        self._publisher = node.create_publisher(self.message_type, topic, 1)

    def publish(self, command: VelocityCommand) -> None:
        """Publish a command [m/s, m/s, rad/s]."""
        message = self.message_type()
        twist = message
        if self._stamped:
            message.header.stamp = self._node.get_clock().now().to_msg()
            message.header.frame_id = "base_footprint"
            twist = message.twist
        twist.linear.x, twist.linear.y, twist.angular.z = command.x, command.y, command.yaw
        self._publisher.publish(message)

    @property
    def subscribers(self) -> int:
        """Number of subscribers."""
        return int(self._publisher.get_subscription_count())

    def arrived(self) -> bool:
        """Wait until all subscribers have what was published; false if one is late by 10 s."""
        from rclpy.duration import Duration

        return bool(self._publisher.wait_for_all_acked(Duration(seconds=10)))

    def stop(self) -> None:
        """Command standstill, as the last thing before the process ends."""
        for _ in range(STOP_COMMANDS):
            self.publish(STANDSTILL)
            time.sleep(STOP_PERIOD)
