"""The pendulum's closed forms against integration, and its invariants."""

from math import asinh, exp

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.integrate import solve_ivp

from nao_lipm_gait.walks.pendulum import (
    advance,
    divergent_component,
    half_step_duration,
    natural_frequency,
    orbital_energy,
)

positions = st.floats(-0.2, 0.2)
velocities = st.floats(-1.0, 1.0)
times = st.floats(-0.5, 0.5)
heights = st.floats(0.15, 0.5)


@pytest.mark.parametrize(("x", "v"), [(0.04, 0.0), (-0.03, 0.2), (0.05, -0.31), (0.0, 0.4)])
def test_motion_solves_the_differential_equation(x: float, v: float) -> None:
    k = natural_frequency(0.262)
    solution = solve_ivp(
        lambda _, state: [state[1], k * k * state[0]], (0.0, 0.4), [x, v], rtol=1e-10, atol=1e-12
    )
    assert advance(x, v, k, 0.4) == pytest.approx(tuple(solution.y[:, -1]), abs=1e-8)


@given(positions, velocities, heights, times)
def test_time_can_be_split_and_run_back(x: float, v: float, height: float, t: float) -> None:
    k = natural_frequency(height)
    halfway = advance(x, v, k, 0.3 * t)
    assert advance(*halfway, k, 0.7 * t) == pytest.approx(advance(x, v, k, t), abs=1e-9)
    assert advance(*advance(x, v, k, t), k, -t) == pytest.approx((x, v), abs=1e-9)


@given(positions, velocities, heights, times)
def test_invariants(x: float, v: float, height: float, t: float) -> None:
    k = natural_frequency(height)
    later = advance(x, v, k, t)
    assert orbital_energy(*later, k) == pytest.approx(orbital_energy(x, v, k), abs=1e-9)
    grown = divergent_component(x, v, k) * exp(k * t)
    assert divergent_component(*later, k) == pytest.approx(grown, abs=1e-9)


def test_half_step_duration_is_the_time_from_the_turning_point() -> None:
    k = natural_frequency(0.262)
    x, v = advance(0.04, 0.0, k, half_step_duration(0.04, 0.055, k))
    assert x == pytest.approx(0.055)
    assert half_step_duration(0.04, 0.03, k) == 0.0
    assert np.isclose(asinh(v / (k * 0.04)) / k, half_step_duration(0.04, 0.055, k))
