"""A clock that notices a control period without sensors."""

from collections.abc import Callable

from rclpy.clock import Clock, ClockType
from rclpy.node import Node

OVERDUE = 1.5
"""Control periods from an answer until the next one is overdue: messages jitter by a few ms."""


class OverdueTimer:
    """Calls back once for each control period in which nothing has been answered.

    It runs on the wall clock: for a robot in real time.

    Args:
        node: The node of the gait.
        period: Control period [s].
        callback: What to do; it may call `restart`.
    """

    def __init__(self, node: Node, period: float, callback: Callable[[], None]) -> None:
        self._first, self._next = round(OVERDUE * period * 1e9), round(period * 1e9)
        self._callback = callback
        self._fires = False
        self._wait = self._first
        self._timer = node.create_timer(
            OVERDUE * period, self._on_time, clock=Clock(clock_type=ClockType.STEADY_TIME)
        )

    def restart(self) -> None:
        """Begin a control period: sensors have been answered."""
        wait = self._next if self._fires else self._first
        if wait != self._wait:
            self._wait = self._timer.timer_period_ns = wait
        self._timer.reset()

    def _on_time(self) -> None:
        self._fires = True
        try:
            self._callback()
        finally:
            self._fires = False
