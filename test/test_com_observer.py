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
