"""The clock of a gait that walks on without sensors: when it calls back, on a timer by hand."""

from typing import Any

import pytest

pytest.importorskip("rclpy")

from nao_lipm_gait.ros.overdue_timer import GRACE, OVERDUE, OverdueTimer

PERIOD = 10_000_000
"""[ns]"""


class Timer:
    """A timer, and the node that makes it; it fires by hand.

    Attributes:
        timer_period_ns: As of a timer of rclpy.
        calls: Number of control periods without an answer.
        answers: The callback answers, as `coast` does.
    """

    def __init__(self) -> None:
        self.timer_period_ns = 0
        self.calls = 0
        self.answers = True
        self.overdue = OverdueTimer(self, PERIOD * 1e-9, self._on_overdue)  # type: ignore[arg-type]

    def create_timer(self, seconds: float, callback: Any, clock: object) -> "Timer":
        """As of a node."""
        self.timer_period_ns, self.fire = round(seconds * 1e9), callback
        return self

    def reset(self) -> None:
        """Begin to wait again."""

    def _on_overdue(self) -> None:
        self.calls += 1
        if self.answers:
            self.overdue.restart()


def test_messages_that_have_arrived_come_before_a_period_without_sensors() -> None:
    timer = Timer()
    assert timer.timer_period_ns == OVERDUE * PERIOD
    timer.fire()
    assert (timer.calls, timer.timer_period_ns) == (0, GRACE)
    timer.overdue.restart()  # a message was waiting
    assert (timer.calls, timer.timer_period_ns) == (0, OVERDUE * PERIOD)


def test_each_further_period_without_sensors_is_called_back_once() -> None:
    timer = Timer()
    for calls in (1, 2, 3):
        timer.fire()
        assert (timer.calls, timer.timer_period_ns) == (calls - 1, GRACE)
        timer.fire()
        assert (timer.calls, timer.timer_period_ns) == (calls, PERIOD)
    timer.overdue.restart()
    assert timer.timer_period_ns == OVERDUE * PERIOD


def test_a_gait_that_does_not_answer_is_asked_once_in_each_period() -> None:
    timer = Timer()
    timer.answers = False
    for calls in (1, 2):
        timer.fire()
        timer.fire()
        assert (timer.calls, timer.timer_period_ns) == (calls, PERIOD)
