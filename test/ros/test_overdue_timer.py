"""The clock of a gait that walks on without sensors: when it calls back, on a timer by hand."""

from typing import Any

import pytest

pytest.importorskip("rclpy")

from nao_lipm_gait.ros.overdue_timer import GRACE, OVERDUE, OverdueTimer

PERIOD = 10_000_000
"""[ns]"""


class Timer:
    """A timer of rclpy, and the node that makes it, on a clock by hand.

    Attributes:
        timer_period_ns: As of a timer of rclpy.
        now: [ns]
        calls: Times [ns] at which the gait was asked for a period without sensors.
        answers: The gait answers, as it does while it walks.
    """

    def __init__(self) -> None:
        self.timer_period_ns = self.now = self._began = 0
        self.calls: list[int] = []
        self.answers = True
        self.overdue = OverdueTimer(self, PERIOD * 1e-9, self._on_overdue)  # type: ignore[arg-type]

    def create_timer(self, seconds: float, callback: Any, clock: object) -> "Timer":
        """As of a node."""
        self.timer_period_ns, self._fire = round(seconds * 1e9), callback
        return self

    def reset(self) -> None:
        """Begin to wait again."""
        self._began = self.now

    def wait(self, time: int) -> None:
        """Let time pass [ns]."""
        end = self.now + time
        while self._began + self.timer_period_ns <= end:
            self.now = self._began = self._began + self.timer_period_ns
            self._fire()
        self.now = end

    def _on_overdue(self) -> None:
        self.calls.append(self.now)
        if self.answers:
            self.overdue.restart()


def test_nothing_is_overdue_while_sensors_are_answered() -> None:
    timer = Timer()
    for _ in range(20):
        timer.wait(round(1.4 * PERIOD))
        timer.overdue.restart()
    assert timer.calls == []


def test_messages_that_have_arrived_come_before_a_period_without_sensors() -> None:
    timer = Timer()
    timer.wait(round(OVERDUE * PERIOD) + GRACE // 2)
    timer.overdue.restart()  # a message was waiting
    timer.wait(round(OVERDUE * PERIOD))
    assert timer.calls == []
    timer.wait(GRACE)
    assert len(timer.calls) == 1


@pytest.mark.parametrize("answers", [True, False])
def test_a_gait_is_asked_once_in_each_period_without_sensors(answers: bool) -> None:
    timer = Timer()
    timer.answers = answers
    timer.wait(10 * PERIOD)
    first = round(OVERDUE * PERIOD) + GRACE
    assert timer.calls == list(range(first, 10 * PERIOD + 1, PERIOD))
