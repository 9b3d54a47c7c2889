"""The pendulum origin and the step size: one line against the paper's linear system."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from nao_lipm_gait.walks.lipm.step_planning import plan_sagittal
from nao_lipm_gait.walks.pendulum import advance, natural_frequency
from oracles import linear_system, linear_system_for_step_size

K = natural_frequency(0.262)
states = {
    "x": st.floats(-0.06, 0.06),
    "v": st.floats(-0.5, 0.5),
    "time": st.floats(0.05, 0.3),
    "next_begin": st.floats(-0.2, -0.05),
}


def phase_tanh(next_begin: float) -> float:
    from math import tanh

    return tanh(K * next_begin)


@given(step=st.floats(-0.1, 0.1), **states)
def test_free_origin_equals_the_linear_system(
    x: float, v: float, time: float, next_begin: float, step: float
) -> None:
    plan = plan_sagittal(x, v, K, time, phase_tanh(next_begin), step, -10.0, 10.0, -10.0, 10.0)
    solution = linear_system(x, v, K, time, next_begin, step)
    assert plan.origin == pytest.approx(solution["r"], abs=1e-9)
    assert plan.step_size == step
    # What the equations promise: the CoM stands over the next origin in the middle of that phase.
    end_x, end_v = advance(x - plan.origin, v, K, time)
    middle = advance(end_x + plan.origin - step, end_v, K, -next_begin)
    assert middle[0] == pytest.approx(0.0, abs=1e-9)
    assert middle[1] == pytest.approx(solution["next_v0"], abs=1e-9)


@given(step=st.floats(-0.1, 0.1), **states)
def test_capped_origin_changes_the_step_size(
    x: float, v: float, time: float, next_begin: float, step: float
) -> None:
    plan = plan_sagittal(x, v, K, time, phase_tanh(next_begin), step, -0.004, 0.004, -10.0, 10.0)
    assert abs(plan.origin) <= 0.004
    wanted = linear_system_for_step_size(x, v, K, time, next_begin, plan.origin)
    assert plan.step_size == pytest.approx(wanted, abs=1e-9)


@pytest.mark.parametrize("side", [-1.0, 1.0])
def test_toes_and_heel_have_caps_of_their_own(side: float) -> None:
    plan = plan_sagittal(0.0, side * 0.9, K, 0.2, -0.6, 0.0, -0.02, 0.03, -10.0, 10.0)
    assert plan.origin == (0.03 if side > 0.0 else -0.02)


def test_step_size_stays_in_the_reach_of_the_legs() -> None:
    plan = plan_sagittal(0.05, 0.8, K, 0.2, -0.6, 0.0, -0.004, 0.004, -0.05, 0.07)
    assert plan.step_size == 0.07


@pytest.mark.parametrize("side", [-1.0, 1.0])
def test_with_no_time_left_the_origin_is_at_its_cap_as_just_before(side: float) -> None:
    """The lever of the origin is zero then."""
    step = side * 0.05
    at_the_end = plan_sagittal(0.0, 0.0, K, 0.0, -0.6, step, -0.004, 0.004, -1.0, 1.0)
    just_before = plan_sagittal(0.0, 0.0, K, 1e-6, -0.6, step, -0.004, 0.004, -1.0, 1.0)
    assert at_the_end.origin == just_before.origin == -side * 0.004
    assert at_the_end.step_size == pytest.approx(just_before.step_size, abs=1e-6)


def test_held_origin_is_kept() -> None:
    plan = plan_sagittal(0.02, 0.25, K, 0.02, -0.6, 0.05, -0.02, 0.02, -0.1, 0.1, held_origin=0.003)
    assert plan.origin == 0.003
    assert plan.step_size != 0.05


@given(speed=st.floats(0.1, 0.6), capture=st.floats(0.0, 1.0), next_begin=st.floats(-0.2, -0.08))
def test_a_steady_walk_needs_no_capture(speed: float, capture: float, next_begin: float) -> None:
    # Steps of equal length and duration: the CoM passes over r = 0 in mid-step.
    v = speed
    end_x, _ = advance(0.0, v, K, -next_begin)
    step = 2.0 * end_x
    plan = plan_sagittal(
        0.0,
        v,
        K,
        -next_begin,
        phase_tanh(next_begin),
        step,
        -0.02,
        0.02,
        -1.0,
        1.0,
        0.0,
        capture=capture,
        capture_back=1.0 - capture,
        passing=v / K,
    )
    assert plan.step_size == pytest.approx(step, abs=1e-9)


def test_full_capture_brings_the_wanted_speed_back_in_one_step() -> None:
    duration, wanted = 0.22, 0.05
    begin = -0.5 * duration
    x, v = 0.03, 0.5
    passing = 0.5 * wanted / math.sinh(-K * begin)
    plan = plan_sagittal(
        x,
        v,
        K,
        0.1,
        phase_tanh(begin),
        wanted,
        -0.02,
        0.02,
        -1.0,
        1.0,
        0.0,
        capture=1.0,
        passing=passing,
    )
    end_x, end_v = advance(x, v, K, 0.1)
    start = end_x - plan.step_size
    # At the end of the next, undisturbed phase the divergent component is that of steady walking.
    last_x, last_v = advance(start, end_v, K, duration)
    steady = wanted / (math.exp(K * duration) - 1.0) + wanted
    assert last_x + last_v / K == pytest.approx(steady, abs=1e-9)
    keeping = plan_sagittal(x, v, K, 0.1, phase_tanh(begin), wanted, -0.02, 0.02, -1.0, 1.0, 0.0)
    assert plan.step_size > keeping.step_size > wanted


def test_a_step_that_has_to_reach_back_has_a_capture_of_its_own() -> None:
    def step(v: float, capture: float, capture_back: float) -> float:
        return plan_sagittal(
            0.0,
            v,
            K,
            0.1,
            -0.6,
            0.0,
            -0.02,
            0.02,
            -1.0,
            1.0,
            capture=capture,
            capture_back=capture_back,
        ).step_size

    assert step(-0.5, 0.0, 1.0) == -step(0.5, 1.0, 0.0) < step(-0.5, 1.0, 0.0) < 0.0
    assert step(-0.5, 0.5, 0.2) == pytest.approx(step(-0.5, 0.0, 0.2))
    assert step(0.5, 0.5, 0.2) == pytest.approx(step(0.5, 0.5, 0.0))
