"""The instant of the support change: closed form against the paper's iteration, and its safety."""

import math

import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from nao_lipm_gait.walks.lipm.extensions.recovery import catching_stride, outward_origin_shift
from nao_lipm_gait.walks.lipm.support_change import plan_support_change
from nao_lipm_gait.walks.pendulum import advance, natural_frequency, orbital_energy
from oracles import iterated_support_change, redetermined

K = natural_frequency(0.262)


@given(
    width=st.floats(0.02, 0.06),
    next_width=st.floats(0.02, 0.06),
    stride=st.floats(0.08, 0.25),
    t=st.floats(-0.14, 0.05),  # before, the narrowest swing is below REACH_MIN
)
def test_equals_the_papers_iteration(
    width: float, next_width: float, stride: float, t: float
) -> None:
    assume(stride > width + next_width + 0.005)
    t_e, t_b = iterated_support_change(width, K, next_width, K, stride)
    assume(t < t_e - 0.01)
    x, v = advance(width, 0.0, K, t)
    # (19), (20): the state alone determines the pendulum that the plan continues.
    assert redetermined(x, v, K) == pytest.approx((width, t), abs=1e-9)
    change = plan_support_change(x, v, K, stride, next_width, 0.0, 10.0)
    assert change.feasible
    assert change.time == pytest.approx(t_e - t, abs=1e-6)
    # Eqs (4) and (5): the CoM is at the same place with the same velocity for both pendulums.
    next_position, next_velocity = advance(next_width, 0.0, K, t_b)
    assert change.position + next_position == pytest.approx(stride, abs=1e-6)
    assert change.velocity == pytest.approx(-next_velocity, abs=1e-5)


@given(
    x=st.floats(-0.3, 0.3),
    v=st.floats(-2.0, 2.0),
    stride=st.floats(0.02, 0.3),
    width=st.floats(0.005, 0.1),
    earliest=st.floats(0.0, 0.2),
    more=st.floats(0.0, 0.4),
)
def test_any_state_gives_a_finite_plan_inside_the_bounds(
    x: float, v: float, stride: float, width: float, earliest: float, more: float
) -> None:
    change = plan_support_change(x, v, K, stride, width, earliest, earliest + more)
    assert earliest <= change.time <= earliest + more
    assert all(map(math.isfinite, (change.time, change.position, change.velocity)))


def test_reports_if_the_equations_have_no_solution() -> None:
    falling_outward = plan_support_change(-0.02, -0.1, K, 0.1, 0.04, 0.0, 0.4)
    assert not falling_outward.feasible
    too_narrow = plan_support_change(0.05, -0.05, K, 0.06, 0.04, 0.0, 0.4)
    assert not too_narrow.feasible


@given(
    x=st.floats(0.005, 0.03), v=st.floats(-0.15, -0.02), width=st.floats(0.03, 0.045)
)
def test_the_shifted_origin_brings_a_late_com_back_in_time(
    x: float, v: float, width: float
) -> None:
    stride, time = 0.1, 0.3
    shift = outward_origin_shift(x, v, K, stride, width, time, 1.0)
    assume(shift > 0.0)
    unshifted = plan_support_change(x, v, K, stride, width, 0.0, 10.0)
    change = plan_support_change(x + shift, v, K, stride + shift, width, 0.0, 10.0)
    assert change.time < unshifted.time or not unshifted.feasible
    # L is that of the undisturbed support change, so the time is met approximately.
    assert change.time == pytest.approx(time, abs=0.1)


def test_a_com_in_time_needs_no_shift() -> None:
    x, v = advance(0.038, 0.0, K, -0.1)
    assert outward_origin_shift(x, v, K, 0.1, 0.038, 0.4, 0.03) == 0.0


@given(position=st.floats(0.0, 0.08), velocity=st.floats(-0.1, 0.6), width=st.floats(0.02, 0.05))
def test_the_catching_stride_turns_the_com_back_at_its_width(
    position: float, velocity: float, width: float
) -> None:
    stride = catching_stride(position, velocity, K, width)
    assert orbital_energy(stride - position, velocity, K) == pytest.approx(width**2, abs=1e-12)
    assert stride - position >= width - 1e-12
