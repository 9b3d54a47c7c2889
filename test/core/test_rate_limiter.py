"""A limited value reaches its goal at the given rate, and never jumps or overshoots."""

from itertools import pairwise

import pytest
from hypothesis import given
from hypothesis import strategies as st

from robot_core.rate_limiter import RateLimiter, limited_step

DT = 0.01
values = st.floats(-10.0, 10.0)


@given(current=values, wanted=values, step=st.floats(0.0, 5.0))
def test_a_step_ends_at_the_goal_or_as_far_as_it_may_go(
    current: float, wanted: float, step: float
) -> None:
    value = limited_step(current, wanted, step)
    assert abs(value - current) <= step + 1e-12
    assert value == wanted or abs(value - current) == pytest.approx(step)
    assert min(current, wanted) <= value <= max(current, wanted)


def test_it_goes_there_and_back_at_the_rate() -> None:
    limiter = RateLimiter(0.1, 0.0)
    there = [limiter.update(0.05, DT) for _ in range(100)]
    back = [limiter.update(0.0, DT) for _ in range(100)]
    assert max(abs(b - a) for a, b in pairwise([*there, *back])) == pytest.approx(0.1 * DT)
    assert there.index(0.05) == pytest.approx(0.05 / (0.1 * DT), abs=1)
    assert there[-1] == 0.05
    assert back[-1] == 0.0


def test_without_a_start_value_and_after_a_reset_the_first_value_is_taken() -> None:
    limiter = RateLimiter(0.1)
    assert limiter.update(3.0, DT) == 3.0
    assert limiter.update(4.0, DT) == pytest.approx(3.001)
    limiter.reset()
    assert limiter.update(-2.0, DT) == -2.0
