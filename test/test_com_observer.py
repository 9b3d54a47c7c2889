"""The observer against a Kalman filter of somebody else."""

import numpy as np
import pytest
from filterpy.kalman import KalmanFilter

from nao_lipm_gait.lipm_walk.com_observer import ComObserver
from nao_lipm_gait.lipm_walk.walk_state import LEFT, WalkState

DT = 0.01
SIGMAS = (0.0001, 0.003, 0.02)


def state(x: float, y: float, vx: float, vy: float) -> WalkState:
    return WalkState(LEFT, x, y, vx, vy, (0.0, 0.05, 0.0), (0.0, 0.0, 0.0), 0)


def test_equals_two_independent_filters_of_filterpy() -> None:
    rng = np.random.default_rng(1)
    observer = ComObserver(*SIGMAS)
    filters = []
    for _ in range(2):
        kalman = KalmanFilter(dim_x=2, dim_z=1)
        kalman.F = np.array([[1.0, DT], [0.0, 1.0]])
        kalman.H = np.array([[1.0, 0.0]])
        kalman.Q = np.diag([SIGMAS[0] ** 2, SIGMAS[1] ** 2])
        kalman.R = np.array([[SIGMAS[2] ** 2]])
        kalman.P = kalman.Q.copy()
        filters.append(kalman)
    for _ in range(300):
        expected = rng.normal(0.0, 0.05, 4)
        measured = rng.normal(0.0, 0.05, 2)
        got = observer.correct(state(*expected), measured[0], measured[1], DT)
        for axis, kalman in enumerate(filters):
            kalman.predict()
            # The paper takes the predicted state from the pendulum, not from A (eq 12).
            kalman.x = np.array([[expected[axis]], [expected[2 + axis]]])
            kalman.update(measured[axis])
        assert (got.x, got.vx) == pytest.approx(tuple(filters[0].x[:, 0]), abs=1e-12)
        assert (got.y, got.vy) == pytest.approx(tuple(filters[1].x[:, 0]), abs=1e-12)


def test_a_perfect_prediction_is_left_alone() -> None:
    expected = state(0.01, -0.02, 0.2, 0.1)
    assert ComObserver(*SIGMAS).correct(expected, 0.01, -0.02, DT) == expected


def test_smaller_measurement_deviation_trusts_the_sensor_more() -> None:
    def pulled(measurement_sigma: float) -> float:
        observer = ComObserver(0.0001, 0.003, measurement_sigma)
        for _ in range(50):
            corrected = observer.correct(state(0.0, 0.0, 0.0, 0.0), 0.01, 0.0, DT)
        return corrected.x

    assert 0.0 < pulled(0.05) < pulled(0.02) < pulled(0.002) < 0.01


def learned_velocity(push_velocity: float, jump: float, ticks: int, noise: float = 0.0) -> float:
    """What the observer adds to the velocity when the CoM moves `jump` [m/s] faster at once."""
    rng = np.random.default_rng(3)
    observer = ComObserver(*SIGMAS, push_velocity=push_velocity)
    estimate = state(0.0, 0.0, 0.0, 0.0)
    for tick in range(ticks):
        expected = estimate.moved(estimate.x + DT * estimate.vx, 0.0, estimate.vx, 0.0)
        measured = jump * DT * (tick + 1) + noise * rng.standard_normal()
        estimate = observer.correct(expected, measured, 0.0, DT)
    return estimate.vx


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_push_is_heard_within_a_tenth_of_a_second(sign: float) -> None:
    assert sign * learned_velocity(0.1, 0.5 * sign, 10) > 0.35
    assert sign * learned_velocity(0.0, 0.5 * sign, 10) < 0.1


def test_noise_is_no_push() -> None:
    heard = learned_velocity(0.1, 0.0, 200, noise=0.001)
    assert heard == pytest.approx(learned_velocity(0.0, 0.0, 200, noise=0.001), abs=0.02)


def test_another_foot_or_a_gap_is_no_push() -> None:
    for missed, step_count in ((True, 0), (False, 1)):
        observer = ComObserver(*SIGMAS, push_velocity=0.1)
        paper = ComObserver(*SIGMAS)
        observer.correct(state(0.0, 0.0, 0.0, 0.0), 0.0, 0.0, DT)
        paper.correct(state(0.0, 0.0, 0.0, 0.0), 0.0, 0.0, DT)
        landed = WalkState(LEFT, 0.0, 0.0, 0.0, 0.0, (0.0, 0.05, 0.0), (0.0, 0.0, 0.0), step_count)
        one = observer.correct(landed, 0.03, 0.0, DT, missed)
        assert one.vx == pytest.approx(paper.correct(landed, 0.03, 0.0, DT).vx)
