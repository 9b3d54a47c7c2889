"""The age of the sensors on arrival, in control periods beyond the usual one."""

import pytest

from nao_lipm_gait.runtime.sensor_age import AGE_MAX, SensorAge

MS = 1_000_000


@pytest.fixture
def age() -> SensorAge:
    """For frames that are usually 40 ms old."""
    age = SensorAge(0.01)
    age.set_usual(0.04)
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
