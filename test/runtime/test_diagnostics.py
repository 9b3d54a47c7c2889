"""What is logged, and how often."""

import pytest

from nao_lipm_gait.runtime.diagnostics import SENSORS, Diagnostics
from robot_core.log import Level, Throttle


class Clock:
    """Wall time [s], set by the test."""

    def __init__(self) -> None:
        self.now = 0.0

    def __call__(self) -> float:
        return self.now


def lines(diagnostics: Diagnostics) -> list[str]:
    return [line.text for line in diagnostics.take_log()]


# -- events ----------------------------------------------------------------------------------------


def test_of_messages_that_continue_fewer_and_fewer_are_shown() -> None:
    throttle = Throttle()
    shown = [t for t in range(1800) if throttle.allow("a", float(t)) is not None]
    assert shown[:3] == [0, 2, 12]
    assert len(shown) < 10


def test_the_ones_that_are_held_back_are_counted() -> None:
    throttle = Throttle()
    assert throttle.allow("a", 0.0) == 0
    assert throttle.allow("a", 0.5) is None
    assert throttle.allow("b", 0.5) == 0, "another key"
    assert throttle.allow("a", 1.9) is None
    assert throttle.allow("a", 2.0) == 2
    assert throttle.allow("a", 1000.0) == 0, "a new beginning"


def test_the_first_message_of_each_new_burst_is_shown() -> None:
    throttle = Throttle()
    for start in (0.0, 25.0, 50.0, 75.0):
        times = [start + 0.1 * i for i in range(100)]
        shown = [time for time in times if throttle.allow("a", time) is not None]
        assert shown[0] == start
        assert len(shown) == 2
        assert throttle.ended(start + 20.0) == [("a", 100, pytest.approx(9.9))]


@pytest.mark.parametrize("every", [1.0, 9.0, 12.0, 40.0, 250.0])
def test_what_comes_back_for_hours_does_not_fill_the_log(every: float) -> None:
    throttle = Throttle()
    times = [every * i for i in range(round(8 * 3600 / every))]
    shown, ends = 0, 0
    for time in times:
        shown += throttle.allow("a", time) is not None
        ends += len(throttle.ended(time + 0.99 * every))
    assert shown < 45, "in eight hours"
    assert not ends, "no message is a burst"


def test_throttle_lets_a_burst_through() -> None:
    throttle = Throttle()
    assert [throttle.allow("a", 0.1 * i, burst=3) for i in range(5)] == [0, 0, 0, None, None]
    assert throttle.allow("a", 2.0, burst=3) == 2


def test_throttle_does_not_grow_with_hostile_keys() -> None:
    throttle = Throttle()
    for i in range(100_000):
        throttle.allow(str(i), 0.0)
    assert throttle.allow("0", 0.0) == 0, "forgotten"


def test_the_end_of_events_of_which_few_were_held_back_is_no_line() -> None:
    clock = Clock()
    diagnostics = Diagnostics(clock)
    for _ in range(3):
        diagnostics.event(SENSORS, Level.WARN, "spike", "a spike")
    clock.now += 2 * Throttle.QUIET
    diagnostics.watch()
    assert lines(diagnostics) == ["a spike"]
    diagnostics.event(SENSORS, Level.WARN, "spike", "a spike")
    assert lines(diagnostics) == ["a spike (2 more like it)"]


def test_events_that_were_held_back_are_reported_as_over_once() -> None:
    clock = Clock()
    diagnostics = Diagnostics(clock)
    for _ in range(11):
        diagnostics.event(SENSORS, Level.WARN, "spike", "a spike")
        clock.now += 0.1
    diagnostics.watch()
    assert lines(diagnostics) == ["a spike"]
    clock.now += Throttle.QUIET
    diagnostics.watch()
    assert lines(diagnostics) == ["spike: 11 warnings in 1.0 s, none for 10 s"]
    clock.now += Throttle.QUIET
    diagnostics.watch()
    assert lines(diagnostics) == []


# -- conditions ------------------------------------------------------------------------------------


def test_a_condition_is_logged_when_it_begins_gets_worse_and_ends() -> None:
    diagnostics = Diagnostics(Clock())
    for level, text in (
        (Level.WARN, "warm"), (Level.WARN, "warmer"), (Level.ERROR, "hot"), (Level.WARN, "warm"),
    ):  # fmt: skip
        diagnostics.begin(SENSORS, level, "heat", text)
    diagnostics.end("heat", "cool")
    diagnostics.end("heat", "cool")
    assert lines(diagnostics) == ["warm", "hot", "cool"]


def test_a_condition_is_in_every_report_while_it_holds() -> None:
    diagnostics = Diagnostics(Clock())
    diagnostics.begin(SENSORS, Level.WARN, "heat", "warm")
    diagnostics.take_remarks()
    assert [remark.text for remark in diagnostics.take_remarks()[SENSORS]] == ["warm"]
    diagnostics.end("heat", "cool")
    assert diagnostics.take_remarks()[SENSORS] == ()


def test_a_condition_that_ends_within_a_second_is_in_one_report() -> None:
    diagnostics = Diagnostics(Clock())
    diagnostics.begin(SENSORS, Level.WARN, "heat", "warm")
    diagnostics.end("heat", "cool")
    assert [remark.text for remark in diagnostics.take_remarks()[SENSORS]] == ["warm"]
