"""A clock that notices a control period without sensors."""

from collections.abc import Callable

from rclpy.clock import Clock, ClockType
from rclpy.node import Node

OVERDUE = 1.5
"""Control periods from an answer until the next one is overdue: messages jitter by a few ms."""
GRACE = 1_000_000
"""[ns] The executor serves timers before messages: those that have arrived get this long."""


class OverdueTimer:
    """Calls back once for each control period in which nothing has been answered.

    It runs on the wall clock: for a robot in real time.

    Args:
        node: The node of the gait.
        period: Control period [s].
        callback: What to do. It is called again after `period`, if nothing is answered before.
    """

    def __init__(self, node: Node, period: float, callback: Callable[[], None]) -> None:
        self._first, self._next = round(OVERDUE * period * 1e9), round(period * 1e9) - GRACE
        self._callback = callback
        self._graced = False
        self._wait = self._first
        self._timer = node.create_timer(
            OVERDUE * period, self._on_time, clock=Clock(clock_type=ClockType.STEADY_TIME)
        )

    def restart(self) -> None:
        """Begin a control period: sensors have been answered."""
        self._begin(self._first)

    def _begin(self, time: int) -> None:
        self._graced = False
        self._wait_for(time)

    def _wait_for(self, time: int) -> None:
        if time != self._wait:
            self._wait = self._timer.timer_period_ns = time
        self._timer.reset()

    def _on_time(self) -> None:
        if not self._graced:
            self._graced = True
            self._wait_for(GRACE)
            return
        try:
            self._callback()
        finally:
            self._begin(self._next)
