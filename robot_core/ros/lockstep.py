"""Nodes besides the gait that a simulator in lockstep waits for: `/clock/until`.

Such a node publishes the time up to which simulated time may run, under its own name. A simulator
in lockstep publishes its clock, then waits at the smallest of these times, before it publishes the
sensors of that time. What a node has published before it lets time go on is thus served first.
"""

import os
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

from robot_core.ros.messages import stamp_in, to_time

if TYPE_CHECKING:
    from rclpy.node import Node

UNTIL = "/clock/until"
"""Topic of the times; std_msgs/Header with the name of the node as frame_id."""
AHEAD = 0.04
"""[s] that time may run ahead of a node that only listens: fewer readings than fit into a queue."""
_LEFT = 2**31 - 1


class LockstepPartner:
    """Lets time run while a node keeps up; without a simulator in lockstep it does nothing.

    Args:
        node: The node.
        name: The name under which the simulator may wait for the node from its start; None = one
            of this process.
    """

    def __init__(self, node: "Node", name: str | None = None) -> None:
        from rclpy.qos import QoSProfile, ReliabilityPolicy
        from std_msgs.msg import Header

        self._node = node
        reliable = QoSProfile(depth=10, reliability=ReliabilityPolicy.RELIABLE)
        self._publisher = node.create_publisher(Header, UNTIL, reliable)
        full_name = node.get_fully_qualified_name().lstrip("/")
        self._message = Header(frame_id=name or f"{full_name} ({os.getpid()})")
        self._until = 0

    @property
    def active(self) -> bool:
        """Whether a simulator in lockstep waits for this node."""
        return bool(self._publisher.get_subscription_count())

    def release(self, until: int) -> None:
        """Let time run up to `until` [ns]."""
        self._until = until
        self._message.stamp = to_time(until)
        self._publisher.publish(self._message)

    def keep_up(self) -> None:
        """Let time run `AHEAD` of the clock that this node has handled, from now on."""
        self._on_each_tick(self.follower())

    def hold(self, then: Callable[[], bool]) -> None:
        """Stop time, and keep up after that.

        Args:
            then: Called while time stands still, each time that the simulator repeats its clock;
                True lets time run again.
        """
        last, follow = -1, self.follower()
        held = True

        def on_tick(now: int) -> None:
            nonlocal last, held
            if held and now == last:
                held = not then()
            last = now
            if held:
                self.release(0)
            else:
                follow(now)

        self.release(0)
        self._on_each_tick(on_tick)

    def _on_each_tick(self, call: Callable[[int], None]) -> None:
        from rclpy.qos import QoSProfile, ReliabilityPolicy
        from rosgraph_msgs.msg import Clock

        reliable = QoSProfile(depth=1000, reliability=ReliabilityPolicy.RELIABLE)

        def on_clock(message: Any) -> None:
            call(message.clock.sec * 1_000_000_000 + message.clock.nanosec)

        self._node.create_subscription(Clock, "/clock", on_clock, reliable)

    def follower(self) -> Callable[[int], None]:
        """A function for each time [ns] of the clock that this node has handled."""
        margin, last = round(AHEAD * 1e9), -1

        def follow(now: int) -> None:
            nonlocal last
            # A simulator that waits repeats its clock.
            if self.active and (now <= last or 2 * (self._until - now) <= margin):
                self.release(now + margin)
            last = now

        return follow

    def leave(self) -> None:
        """The simulator waits for this node no longer."""
        self._message.stamp.sec, self._message.stamp.nanosec = _LEFT, 0
        self._publisher.publish(self._message)


class LockstepPartners:
    """The simulator's side: what time may run up to.

    Attributes:
        held: [ns] time at which the simulator waits; None while it does not.
    """

    def __init__(self, names: tuple[str, ...]) -> None:
        """Wait from the start for the nodes with these names."""
        self._until: dict[str, int] = dict.fromkeys(names, 0)
        self._absent = set(names)
        self.held: int | None = None

    def reach(self, now: int) -> bool:
        """Whether simulated time `now` [ns] can be left; if not, it is held."""
        self.held = now if self.missing(now) else None
        return self.held is None

    def receive(self, message: Any) -> bool:
        """Take a message of `/clock/until`; whether it ends the wait."""
        name = message.frame_id
        awaited = name.partition(" (")[0]  # "node (process)"
        if awaited in self._absent:
            self._absent.remove(awaited)
            del self._until[awaited]
        self._until[name] = stamp_in(message, "until")
        return self.held is not None and self.reach(self.held)

    def missing(self, now: int) -> list[str]:
        """Names of the nodes that do not let time run on at `now` [ns]."""
        return [name for name, until in self._until.items() if until <= now]

    def forget_vanished(self, publishers: int) -> bool:
        """Forget nodes that hold and have ended; whether that ends the wait.

        Args:
            publishers: Number of publishers on the topic.
        """
        if self.held is None:
            return False
        present = len(self._until) - len(self._absent)
        for name in self.missing(self.held):
            if name not in self._absent and present > publishers:
                del self._until[name]
                present -= 1
        return self.reach(self.held)
