"""How stamps are classified relative to those before them, and the age of a frame on arrival."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from nao_lipm_gait.runtime.stamps import AGE_MAX, SensorAge, StampMonitor, Step

MS = 1_000_000


def seen(*stamps: int) -> tuple[StampMonitor, list[Step]]:
    watch = StampMonitor(10 * MS)
    return watch, [take(watch, ms * MS) for ms in stamps]


def take(watch: StampMonitor, stamp: int) -> Step:
    step = watch.classify(stamp)
    watch.accept(stamp, step)
    return step


def test_stamps_are_told_apart_and_gaps_are_counted():
    watch, steps = seen(100, 110, 110, 150, 651, 661, 300, 310, 320)
    assert steps == [
        Step.FIRST, Step.NEXT, Step.REPEATED, Step.NEXT, Step.DOUBTFUL, Step.JUMP, Step.DOUBTFUL,
        Step.BACKWARDS, Step.NEXT,
    ]  # fmt: skip
    assert watch.missed == 3, "120, 130 and 140 ms; a jump is not a loss"


def test_one_stamp_alone_is_no_new_time():
    _, steps = seen(100, 110, 9_000_000, 120, 0, 130, 140)
    assert [s for s in steps if s is not Step.NEXT] == [Step.FIRST, Step.DOUBTFUL, Step.DOUBTFUL]


def test_an_overtaken_message_is_late_and_a_small_step_back_is_accepted_in_the_end():
    _, steps = seen(100, 120, 110, 130, 140)
    assert steps == [Step.FIRST, Step.NEXT, Step.LATE, Step.NEXT, Step.NEXT]
    _, steps = seen(1000, 950, 960, 970, 980, 990)
    assert steps[1:5] == [Step.LATE, Step.LATE, Step.LATE, Step.BACKWARDS]
    assert steps[5] is Step.NEXT


def test_the_same_new_stamp_again_is_a_proof():
    """In lockstep the robot repeats its frame until it has an answer."""
    assert seen(100, 900, 900)[1][-1] is Step.JUMP


@given(st.lists(st.integers(0, 2**62), max_size=60))
def test_any_stamps_have_a_step(stamps: list[int]):
    watch = StampMonitor(10 * MS)
    for stamp in stamps:
        before = watch.last
        step = take(watch, stamp)
        left_out = step in (Step.LATE, Step.DOUBTFUL, Step.REPEATED, Step.EARLY)
        assert watch.last == (before if left_out else stamp)
        if step is Step.NEXT and before is not None:
            assert 0 < stamp - before <= watch.longest_gap


def test_a_stamp_before_the_tick_is_due_is_left_out():
    watch, steps = seen(100, 104, 110, 115, 120, 125)
    assert steps == [Step.FIRST, Step.EARLY, Step.NEXT, Step.EARLY, Step.NEXT, Step.EARLY]
    assert watch.missed == 0
    assert watch.mean_step == 10 * MS


def test_the_mean_step_is_that_of_the_sender_and_not_of_what_was_lost():
    watch, _ = seen(*range(0, 8_000, 8))
    assert abs(watch.mean_step - 8 * MS) < 1000
    watch, _ = seen(*(ms for ms in range(0, 8_000, 10) if ms % 70))
    assert watch.mean_step == 10 * MS


# -- age -------------------------------------------------------------------------------------------


@pytest.fixture
def age() -> SensorAge:
    """For frames that are usually 40 ms old."""
    age = SensorAge(0.01)
    age.usual = 0.04
    return age


@pytest.mark.parametrize("older", [-40, -20, 0, 30, 60])
def test_a_constant_age_is_told_in_control_periods(age: SensorAge, older: int) -> None:
    found = {age.update(tick * 10 * MS, (tick * 10 + 40 + older) * MS) for tick in range(20)}
    assert found == {older // 10}


def test_arrivals_that_jitter_by_a_few_milliseconds_change_nothing(age: SensorAge) -> None:
    jitter = [7, 0, 3, 6, 1, 7, 2, 5, 0, 4]
    assert {age.update(tick * 10 * MS, (tick * 10 + 40 + ms) * MS)
            for tick, ms in enumerate(jitter)} == {0}  # fmt: skip


def test_an_age_that_grows_and_shrinks_is_followed_at_once(age: SensorAge) -> None:
    late = [0, 1, 2, 3, 2, 2, 0, -1]
    assert [age.update(tick * 10 * MS, (tick * 10 + 40 + 10 * each) * MS)
            for tick, each in enumerate(late)] == late  # fmt: skip


def test_the_age_is_bounded(age: SensorAge) -> None:
    assert age.update(0, 300 * MS) == round((AGE_MAX - 0.04) / 0.01)


@pytest.mark.parametrize("arrived", [None, -20 * MS, 1_500 * MS, 10**18])
def test_without_an_arrival_on_the_clock_of_the_stamps_the_age_is_the_usual_one(
    age: SensorAge, arrived: int | None
) -> None:
    assert age.update(0, 80 * MS) == 4
    assert age.update(10 * MS, arrived) == 0
    assert age.age is None
