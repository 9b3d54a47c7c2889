"""Durations of ticks are summarized; a missed deadline is late only if the robot did not wait."""

import pytest

from nao_lipm_gait.runtime.reports import TickTimes


def test_a_summary_is_of_the_time_since_the_last_one() -> None:
    ticks = TickTimes(period=0.01)
    assert ticks.summarize() is None
    for duration in range(100, 0, -1):
        ticks.add(0.0, duration * 1e-6)
    summary = ticks.summarize()
    assert summary is not None
    assert (summary.count, summary.p50, summary.p99) == pytest.approx((100, 50.0, 99.0))
    assert summary.maximum == pytest.approx(100.0)
    assert ticks.summarize() is None


def test_a_tick_is_late_if_the_next_joint_state_came_before_its_end() -> None:
    ticks = TickTimes(period=0.01)
    ticks.add(1.0, 1.02)
    assert ticks.was_late(arrived=1.01)
    assert not ticks.was_late(arrived=1.015), "told once"


def test_a_tick_is_not_late_if_the_robot_waited_for_its_answer() -> None:
    ticks = TickTimes(period=0.01)
    ticks.add(1.0, 1.5)
    assert not ticks.was_late(arrived=1.501)
    assert ticks.misses == 1


def test_a_tick_within_the_period_is_never_late() -> None:
    ticks = TickTimes(period=0.01)
    ticks.add(1.0, 1.009)
    assert not ticks.was_late(arrived=1.001)
    assert ticks.misses == 0
