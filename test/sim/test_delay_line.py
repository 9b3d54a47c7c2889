"""The delay line against its definition: the newest item that is old enough, unchanged."""

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from robot_core.errors import NaoGaitError
from sim_bridge.delay_line import DelayLine

MS = 1_000_000
PERIOD = 10 * MS


def ages(delay: int, ticks: int = 12) -> list[int | None]:
    """[ns] age of the newest item after each put, one per period."""
    line: DelayLine[int] = DelayLine(delay)
    seen: list[int | None] = []
    for tick in range(ticks):
        line.put(tick * PERIOD, tick * PERIOD)
        newest = line.newest(tick * PERIOD)
        seen.append(None if newest is None else tick * PERIOD - newest)
    return seen


def test_multiples_of_the_period_are_exact() -> None:
    for periods in (0, 1, 4, 7):
        delay = periods * PERIOD
        assert ages(delay) == [None] * periods + [delay] * (12 - periods)


@pytest.mark.parametrize(
    ("delay", "age"), [(25 * MS, 30 * MS), (1, 10 * MS), (40 * MS + 1, 50 * MS)]
)
def test_others_wait_for_the_next_period(delay: int, age: int) -> None:
    late = age // PERIOD
    assert ages(delay) == [None] * late + [age] * (12 - late)


def test_reading_between_samples_gives_the_last_one_old_enough() -> None:
    line: DelayLine[str] = DelayLine(25 * MS)
    line.put(0, "first")
    line.put(PERIOD, "second")
    assert line.newest(25 * MS - 1) is None
    assert line.newest(25 * MS) == "first"
    assert line.newest(35 * MS - 1) == "first"
    assert line.newest(35 * MS) == "second"
    assert line.newest(10_000 * MS) == "second", "the last one stays until there is a newer one"


@settings(max_examples=200)
@given(
    delay=st.integers(0, 100),
    gaps=st.lists(st.tuples(st.integers(1, 30), st.integers(0, 30)), min_size=1, max_size=40),
)
def test_newest_old_enough_whatever_the_times(delay: int, gaps: list[tuple[int, int]]) -> None:
    line: DelayLine[tuple[int]] = DelayLine(delay)
    stamps: list[int] = []
    items: dict[int, tuple[int]] = {}
    now = 0
    for to_put, to_read in gaps:
        stamp = (stamps[-1] if stamps else 0) + to_put
        stamps.append(stamp)
        items[stamp] = (stamp,)
        line.put(stamp, items[stamp])
        now = max(now + to_read, stamp)
        old_enough = [s for s in stamps if s <= now - delay]
        newest = line.newest(now)
        if old_enough:
            assert newest is items[old_enough[-1]]  # the item itself, not a copy
        else:
            assert newest is None


def test_stamps_must_increase() -> None:
    line: DelayLine[str] = DelayLine(0)
    line.put(5, "a")
    for stamp in (5, 4):
        with pytest.raises(NaoGaitError, match=r"stamp: got .*later than 5 ns"):
            line.put(stamp, "b")
    assert line.newest(5) == "a", "a refused item is not stored"


def test_clear_forgets_and_lets_time_start_over() -> None:
    line: DelayLine[str] = DelayLine(0)
    line.put(5, "a")
    line.clear()
    assert line.newest(10) is None
    line.put(1, "b")
    assert line.newest(1) == "b"


def test_a_delay_into_the_future_is_refused() -> None:
    with pytest.raises(NaoGaitError, match="delay: got -1; allowed: at least 0 ns"):
        DelayLine(-1)


@given(st.integers(0, 100 * MS), st.integers(1, 15))
def test_coming_items_are_the_later_newest_ones(delay: int, asked: int) -> None:
    line: DelayLine[int] = DelayLine(delay)
    coming: list[int | None] = []
    for tick in range(asked + 12):
        now = tick * PERIOD
        line.put(now, now)
        if tick == asked:
            coming = line.coming(now, PERIOD)
        elif asked < tick < asked + len(coming):
            assert line.newest(now) == coming[tick - asked]
    assert len(coming) == -(-delay // PERIOD) + 1
