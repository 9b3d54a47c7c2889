"""The observer against a Kalman filter of somebody else."""

import numpy as np
import pytest
from filterpy.kalman import KalmanFilter

from nao_lipm_gait.types import LEFT
from nao_lipm_gait.walks.lipm.com_observer import ComObserver
from nao_lipm_gait.walks.lipm.walk_state import WalkState

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


def test_what_the_com_is_off_by_when_the_first_walk_begins_is_no_push() -> None:
    for velocity in (0.05, 0.14):
        estimate = ComObserver(*SIGMAS, push_velocity=velocity).correct(
            state(0.0, 0.0, 0.0, 0.0), 0.03, 0.0, DT
        )
        paper = ComObserver(*SIGMAS).correct(state(0.0, 0.0, 0.0, 0.0), 0.03, 0.0, DT)
        assert estimate.vx == pytest.approx(paper.vx)


def test_another_foot_or_a_gap_is_no_push() -> None:
    for missed, step_count in ((True, 0), (False, 1)):
        observer = ComObserver(*SIGMAS, push_velocity=0.1)
        paper = ComObserver(*SIGMAS)
        observer.correct(state(0.0, 0.0, 0.0, 0.0), 0.0, 0.0, DT)
        paper.correct(state(0.0, 0.0, 0.0, 0.0), 0.0, 0.0, DT)
        landed = WalkState(LEFT, 0.0, 0.0, 0.0, 0.0, (0.0, 0.05, 0.0), (0.0, 0.0, 0.0), step_count)
        one = observer.correct(landed, 0.03, 0.0, DT, missed)
        assert one.vx == pytest.approx(paper.correct(landed, 0.03, 0.0, DT).vx)


def felt_velocity(accelerations: list[float], positions: list[float] | None = None) -> list[float]:
    """What the observer adds to the velocity in y while the accelerometer says this [m/s^2]."""
    observer = ComObserver(*SIGMAS, push_velocity=0.1)
    estimate, heard = state(0.0, 0.0, 0.0, 0.0), []
    for tick, acceleration in enumerate(accelerations):
        expected = estimate.moved(0.0, estimate.y + DT * estimate.vy, 0.0, estimate.vy)
        measured = expected.y if positions is None else positions[tick]
        estimate = observer.correct(expected, 0.0, measured, DT, felt=(0.0, acceleration))
        heard.append(estimate.vy)
    return heard


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_push_that_is_felt_is_known_while_it_acts(sign: float) -> None:
    # 4 m/s^2 for 0.1 s; the CoM shows it as well: y = a t^2 / 2.
    accelerations = [4.0 * sign] * 10
    positions = [0.5 * 4.0 * sign * (DT * (tick + 1)) ** 2 for tick in range(10)]
    felt = felt_velocity(accelerations, positions)
    assert sign * felt[5] > 0.1
    assert sign * felt[9] == pytest.approx(0.4, abs=0.15)
    unfelt = felt_velocity([0.0] * 10, positions)
    assert sign * unfelt[5] < 0.5 * sign * felt[5]


def test_one_hard_sample_is_no_push() -> None:
    assert felt_velocity([0.0, 200.0, 0.0, 0.0]) == [0.0] * 4
    assert felt_velocity([0.0, 8.0, -8.0, 0.0]) == [0.0] * 4


def test_a_push_goes_on_only_as_long_as_it_is_felt() -> None:
    observer = ComObserver(*SIGMAS, push_velocity=0.1)
    still = state(0.0, 0.0, 0.0, 0.0)
    for acceleration in [-4.0] * 6:
        observer.correct(still, 0.0, 0.0, DT, felt=(0.0, acceleration))
    assert observer.push_acceleration_y == -4.0
    for acceleration in (0.0, 0.0):
        observer.correct(still, 0.0, 0.0, DT, felt=(0.0, acceleration))
    assert observer.push_acceleration_y == 0.0


def test_an_acceleration_is_heard_through_a_support_change() -> None:
    observer = ComObserver(*SIGMAS, push_velocity=0.1)
    for count in range(8):
        landed = WalkState(LEFT, 0.0, 0.0, 0.0, 0.0, (0.0, 0.05, 0.0), (0.0, 0.0, 0.0), count)
        heard = observer.correct(landed, 0.0, 0.0, DT, felt=(4.0, 0.0)).vx
    assert heard == pytest.approx(4.0 * DT, abs=0.01)
