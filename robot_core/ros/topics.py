"""Publishers, subscriptions and the log of the nodes; subscriptions that refuse bad messages."""

import time
from collections.abc import Callable
from functools import partial
from typing import Any

from rclpy.callback_groups import CallbackGroup
from rclpy.clock import Clock, ClockType
from rclpy.event_handler import PublisherEventCallbacks, SubscriptionEventCallbacks
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from rclpy.subscription import Subscription

from robot_core.errors import NaoGaitError, one_line
from robot_core.log import Level, LogLine, Throttle

LATCHED = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
RELIABLE = QoSProfile(depth=10, reliability=ReliabilityPolicy.RELIABLE)
MOTORS = QoSProfile(depth=50, reliability=ReliabilityPolicy.RELIABLE)
"""For one message of each motor at once."""
WATCH_PERIOD = 1.0
"""[s]"""
_LOSSY = (ReliabilityPolicy.BEST_EFFORT, ReliabilityPolicy.RELIABLE)
_FLEETING = (DurabilityPolicy.VOLATILE, DurabilityPolicy.TRANSIENT_LOCAL)


def publisher(node: Node, kind: type, topic: str, qos: QoSProfile = RELIABLE) -> Any:
    """A publisher without events of its middleware.

    rclpy waits for the events of each publisher one by one: with four robots they would take more
    time than all callbacks. A reliable publisher suits every subscriber but a latched one.
    """
    events = PublisherEventCallbacks(use_default_callbacks=False)
    return node.create_publisher(kind, topic, qos, event_callbacks=events)


def subscription(
    node: Node, kind: type, topic: str, callback: Any, qos: QoSProfile = RELIABLE,
    group: CallbackGroup | None = None,
) -> Subscription:  # fmt: skip
    """A subscription without events of its middleware, for the same reason.

    The sender of a message that does not fit logs that by itself. The callback may take the
    message info too.
    """
    events = SubscriptionEventCallbacks(use_default_callbacks=False)
    return node.create_subscription(
        kind, topic, callback, qos, callback_group=group, event_callbacks=events
    )


def transform_broadcaster(node: Node) -> Any:
    """A TF broadcaster, or None if tf2_ros is not installed (PyPI has no wheel of it)."""
    try:
        from tf2_ros import TransformBroadcaster
    except ImportError:
        return None
    return TransformBroadcaster(node)


def unheard_senders(node: Node, subscription: Subscription) -> list[str]:
    """Publishers of a topic whose type or quality of service keeps their messages away."""
    topic = subscription.topic_name
    if not node.count_publishers(topic):
        return []
    kind: Any = subscription.msg_type
    ours = f"{kind.__module__.split('.')[0]}/msg/{kind.__name__}"
    texts = []
    for sender in node.get_publishers_info_by_topic(topic):
        name, theirs, asked = sender.node_name, sender.qos_profile, subscription.qos_profile
        got, allowed = sender.topic_type, ours
        if got == ours:
            got, allowed = "", ""
            if (theirs.reliability, asked.reliability) == _LOSSY:
                got, allowed = "best effort", "reliable"
            elif (theirs.durability, asked.durability) == _FLEETING:
                got, allowed = "volatile", "transient local"
        if got:
            text = f"{topic.lstrip('/')}: got {got} from {name}, which is not received"
            texts.append(f"{text}; allowed: {allowed}")
    return texts


def watch_senders(node: Node) -> None:
    """Log the senders whose messages cannot be received, when that begins and when it ends."""
    said: set[str] = set()

    def look() -> None:
        found = {text for each in node.subscriptions for text in unheard_senders(node, each)}
        for text in sorted(found - said):
            node.get_logger().error(text)
        if said and not found:
            node.get_logger().info("every sender of an input is received")
        said.clear()
        said.update(found)

    node.create_timer(WATCH_PERIOD, look, clock=Clock(clock_type=ClockType.STEADY_TIME))


def write_log(node: Node, line: LogLine) -> None:
    """Write a line to the log of a node."""
    logger = node.get_logger()
    # One call each: rclpy allows one severity per place in the source.
    if line.level >= Level.ERROR:
        logger.error(line.text)
    elif line.level == Level.WARN:
        logger.warning(line.text)
    else:
        logger.info(line.text)


class Inputs:
    """Subscriptions whose bad messages cause a warning and nothing else."""

    def __init__(self, node: Node, name: str = "", burst: int = 5) -> None:
        """Prepare the log.

        Args:
            node: The node that subscribes.
            name: Of the robot that gets the messages; empty = the only one, or the world.
            burst: Number of refusals with the same reason before further ones are held back.
        """
        self._node = node
        self._prefix = f"{name}: " if name else ""
        self._burst = burst
        self._throttle = Throttle()

    def subscribe(
        self, kind: type, topic: str, callback: Callable[[Any], None], qos: QoSProfile = RELIABLE
    ) -> None:
        """Call back with each message; what the callback refuses is logged."""
        subscription(self._node, kind, topic, partial(self._guarded, callback), qos)

    def warn(self, key: str, message: str, burst: int = 1) -> None:
        """Log a warning; further ones with this key are held back for a while."""
        held_back = self._throttle.allow(key, time.monotonic(), burst)
        if held_back is not None:
            more = f" ({held_back} more like it)" if held_back else ""
            self._node.get_logger().warning(self._prefix + message + more)

    def _guarded(self, callback: Callable[[Any], None], message: Any) -> None:
        try:
            callback(message)
        except NaoGaitError as error:
            self.warn(error.field, f"{error}; message ignored", self._burst)
        except Exception as error:
            self.warn(type(error).__name__, f"{one_line(error)}; message ignored")
