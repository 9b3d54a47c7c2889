"""Subscriptions of which only now and then a message is needed."""

from typing import Any

from rclpy.callback_groups import MutuallyExclusiveCallbackGroup
from rclpy.qos import HistoryPolicy, QoSProfile, ReliabilityPolicy

NEWEST = QoSProfile(
    depth=1, history=HistoryPolicy.KEEP_LAST, reliability=ReliabilityPolicy.BEST_EFFORT
)
"""Of several messages that wait, only the newest one is served."""


class SampledGroup(MutuallyExclusiveCallbackGroup):
    """Serves one message of each subscription per sample; the others wake no executor.

    Args:
        every: Calls of `count` between two samples.
    """

    def __init__(self, every: int) -> None:
        super().__init__()
        self._every = every
        self._count = 0
        self._served: set[int] = set()

    def count(self) -> None:
        """Begin a new sample if it is time."""
        self._count += 1
        if self._count >= self._every:
            self._count = 0
            self._served.clear()

    def can_execute(self, entity: Any) -> bool:
        """Whether this subscription has not been served in this sample."""
        return id(entity) not in self._served and bool(super().can_execute(entity))

    def ending_execution(self, entity: Any) -> None:
        """This subscription has been served."""
        super().ending_execution(entity)
        self._served.add(id(entity))
