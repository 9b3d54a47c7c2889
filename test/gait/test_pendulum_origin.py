"""The pendulum origin and the step size in x, against the linear system (9) of the paper."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from nao_lipm_gait.walks.lipm.extensions.recovery import capture_shift
from nao_lipm_gait.walks.lipm.pendulum_origin import plan_pendulum_origin
from nao_lipm_gait.walks.pendulum import advance, natural_frequency
from oracles import linear_system, linear_system_for_step_size

K = natural_frequency(0.262)
states = {
    "x": st.floats(-0.06, 0.06),
    "v": st.floats(-0.5, 0.5),
    "time": st.floats(0.05, 0.3),
    "next_begin": st.floats(-0.2, -0.05),
}


def next_tanh(next_begin: float) -> float:
    return math.tanh(K * next_begin)


@given(step=st.floats(-0.1, 0.1), **states)
def test_free_origin_equals_the_linear_system(
    x: float, v: float, time: float, next_begin: float, step: float
) -> None:
    plan = plan_pendulum_origin(x, v, K, time, next_tanh(next_begin), step, -10.0, 10.0)
    solution = linear_system(x, v, K, time, next_begin, step)
    assert plan.r_x == pytest.approx(solution["r"], abs=1e-9)
    assert plan.s_x == step
    assert not plan.limited
    # What the equations promise: the CoM is over the next origin in the middle of that step.
    end_x, end_v = advance(x - plan.r_x, v, K, time)
    middle = advance(end_x + plan.r_x - step, end_v, K, -next_begin)
    assert middle[0] == pytest.approx(0.0, abs=1e-9)
    assert middle[1] == pytest.approx(solution["next_v0"], abs=1e-9)


@given(step=st.floats(-0.1, 0.1), **states)
def test_limited_origin_changes_the_step_size(
    x: float, v: float, time: float, next_begin: float, step: float
) -> None:
    plan = plan_pendulum_origin(x, v, K, time, next_tanh(next_begin), step, -0.004, 0.004)
    assert abs(plan.r_x) <= 0.004
    wanted = linear_system_for_step_size(x, v, K, time, next_begin, plan.r_x)
    assert plan.s_x == pytest.approx(wanted, abs=1e-9)


@pytest.mark.parametrize("side", [-1.0, 1.0])
def test_toes_and_heel_have_separate_limits(side: float) -> None:
    plan = plan_pendulum_origin(0.0, side * 0.9, K, 0.2, -0.6, 0.0, -0.02, 0.03)
    assert plan.limited
    assert plan.r_x == (0.03 if side > 0.0 else -0.02)


@pytest.mark.parametrize("side", [-1.0, 1.0])
def test_without_time_left_the_origin_is_at_its_limit_as_just_before(side: float) -> None:
    """The lever of the origin is zero then."""
    step = side * 0.05
    at_the_end = plan_pendulum_origin(0.0, 0.0, K, 0.0, -0.6, step, -0.004, 0.004)
    just_before = plan_pendulum_origin(0.0, 0.0, K, 1e-6, -0.6, step, -0.004, 0.004)
    assert at_the_end.r_x == just_before.r_x == -side * 0.004
    assert at_the_end.s_x == pytest.approx(just_before.s_x, abs=1e-6)


def test_held_origin_is_kept_and_the_step_size_follows() -> None:
    plan = plan_pendulum_origin(0.02, 0.25, K, 0.02, -0.6, 0.05, -0.02, 0.02, 0.003)
    assert plan.r_x == 0.003
    assert plan.s_x != 0.05


@given(speed=st.floats(0.1, 0.6), next_begin=st.floats(-0.2, -0.08))
def test_a_steady_walk_needs_no_capture(speed: float, next_begin: float) -> None:
    # Steps of equal length and duration: the CoM passes over r = 0 in mid-step.
    step = 2.0 * advance(0.0, speed, K, -next_begin)[0]
    tanh = next_tanh(next_begin)
    shift = capture_shift(0.0, speed, K, -next_begin, tanh, 0.0, step, speed / K)
    assert shift == pytest.approx(0.0, abs=1e-9)


def test_full_capture_restores_the_wanted_speed_in_one_step() -> None:
    duration, wanted = 0.22, 0.05
    begin = -0.5 * duration
    x, v = 0.03, 0.5
    passing = 0.5 * wanted / math.sinh(-K * begin)
    tanh = next_tanh(begin)
    keeping = plan_pendulum_origin(x, v, K, 0.1, tanh, wanted, -0.02, 0.02, 0.0).s_x
    shift = capture_shift(x, v, K, 0.1, tanh, 0.0, keeping, passing)
    assert shift > 0.0
    assert keeping > wanted
    end_x, end_v = advance(x, v, K, 0.1)
    # At the end of the next, undisturbed step the divergent component is that of steady walking.
    last_x, last_v = advance(end_x - (keeping + shift), end_v, K, duration)
    steady = wanted / (math.exp(K * duration) - 1.0) + wanted
    assert last_x + last_v / K == pytest.approx(steady, abs=1e-9)
