"""The CoM observer, against an independent Kalman filter; offsets, pushes, another observer."""

import numpy as np
import pytest
from filterpy.kalman import KalmanFilter

from nao_lipm_gait import walk_engines
from nao_lipm_gait.parameters import GaitParameters
from nao_lipm_gait.walks.lipm.com_observer import ComCorrection, ComObserver
from nao_lipm_gait.walks.lipm.extensions.disturbances import MeasurementOffset, PushDetector
from nao_lipm_gait.walks.lipm.kalman_observer import KalmanObserver
from nao_lipm_gait.walks.lipm.state import WalkState
from nao_lipm_gait.walks.lipm.walk import LipmWalk
from robot_core.types import LEFT
from sim_bridge.trials.rollout import RolloutSpec, rollout
from sim_bridge.trials.tasks import find_task

DT = 0.01
SIGMAS = (0.0001, 0.003, 0.02)
STILL = WalkState(LEFT, 0.0, 0.0, 0.0, 0.0, (0.0, 0.05, 0.0), (0.0, 0.0, 0.0), 0)


def corrected(observer: ComObserver, dx: float, dy: float) -> ComCorrection:
    observer.predict(STILL, DT)
    return observer.correct(dx, dy)


# -- Kalman filter ---------------------------------------------------------------------------------


def test_equals_two_independent_filters_of_filterpy() -> None:
    rng = np.random.default_rng(1)
    observer = KalmanObserver(*SIGMAS)
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
        got = corrected(observer, *(measured - expected[:2]))
        for axis, kalman in enumerate(filters):
            kalman.predict()
            # The paper takes the predicted state from the pendulum, not from A (eq 12).
            kalman.x = np.array([[expected[axis]], [expected[2 + axis]]])
            kalman.update(measured[axis])
        x, y = (kalman.x[:, 0] for kalman in filters)
        assert (expected[0] + got.x, expected[2] + got.vx) == pytest.approx(tuple(x), abs=1e-12)
        assert (expected[1] + got.y, expected[3] + got.vy) == pytest.approx(tuple(y), abs=1e-12)


def test_a_perfect_prediction_is_left_alone() -> None:
    got = corrected(KalmanObserver(*SIGMAS), 0.0, 0.0)
    assert (got.x, got.y, got.vx, got.vy) == (0.0, 0.0, 0.0, 0.0)


def test_smaller_measurement_deviation_trusts_the_sensor_more() -> None:
    def gain(measurement_sigma: float) -> float:
        observer = KalmanObserver(0.0001, 0.003, measurement_sigma)
        for _ in range(50):
            correction = corrected(observer, 1.0, 0.0)
        return correction.x

    assert 0.0 < gain(0.05) < gain(0.02) < gain(0.002) < 1.0


# -- another observer ------------------------------------------------------------------------------


class AlphaBetaObserver:
    """An alpha-beta filter: constant gains."""

    ALPHA, BETA = 0.06, 0.002

    def __init__(self) -> None:
        self._dt = 0.0

    def predict(self, expected: WalkState, dt: float) -> None:
        self._dt = dt

    def correct(self, dx: float, dy: float) -> ComCorrection:
        gain = self.BETA / self._dt
        return ComCorrection(self.ALPHA * dx, self.ALPHA * dy, gain * dx, gain * dy)


def alpha_beta_walk(parameters: GaitParameters, control_period: float) -> LipmWalk:
    return LipmWalk(parameters, control_period, lambda _: AlphaBetaObserver())


def test_the_robot_walks_with_another_observer(monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip("mujoco")
    spec = RolloutSpec(find_task("forward=20").measured(5.0, 8.0), robot_seed=3, engine="mujoco")
    kalman = rollout(spec).metrics
    engine = walk_engines.WALKS["lipm"]._replace(engine=f"{__name__}.alpha_beta_walk")
    monkeypatch.setitem(walk_engines.WALKS, "lipm", engine)
    alpha_beta = rollout(spec).metrics
    assert not alpha_beta.fell
    assert alpha_beta.speed_x == pytest.approx(0.2, rel=0.2)
    assert alpha_beta.speed_x != kalman.speed_x


# -- sensor offsets --------------------------------------------------------------------------------


def test_a_constant_difference_is_learned_as_offset_and_a_short_one_is_not() -> None:
    offset = MeasurementOffset(3.0)
    first = offset.remove(0.01, -0.02, DT)
    assert first == pytest.approx((0.01, -0.02), rel=0.01)
    for _ in range(2000):
        last = offset.remove(0.01, -0.02, DT)
    assert last == pytest.approx((0.0, 0.0), abs=1e-4)


def test_no_offset_is_learned_without_a_time_constant() -> None:
    offset = MeasurementOffset(0.0)
    assert [offset.remove(0.01, 0.02, DT) for _ in range(3)] == [(0.01, 0.02)] * 3


# -- pushes ----------------------------------------------------------------------------------------


class Filter:
    """Observer and push detector together, as the walk combines them, for a CoM along y."""

    def __init__(self, push_velocity: float):
        self.observer = KalmanObserver(*SIGMAS)
        self.detector = PushDetector(push_velocity)
        self.y = self.vy = 0.0

    def tick(
        self, measured: float, acceleration: float | None = None, step: int = 0,
        missed: bool = False,
    ) -> float:
        """The push velocity [m/s] that is detected in one tick."""
        y = self.y + DT * self.vy
        dy = measured - y
        correction = corrected(self.observer, 0.0, dy)
        pushes = None if acceleration is None else (0.0, acceleration)
        push = self.detector.update((0.0, dy), correction, 0.0, DT, step, missed, pushes)[1]
        self.y, self.vy = y + correction.y, self.vy + correction.vy + push
        return push


def learned_velocity(push_velocity: float, jump: float, ticks: int, noise: float = 0.0) -> float:
    """The estimated velocity [m/s] after the CoM starts to move with `jump` [m/s] at once."""
    rng = np.random.default_rng(3)
    both = Filter(push_velocity)
    for tick in range(ticks):
        both.tick(jump * DT * (tick + 1) + noise * rng.standard_normal())
    return both.vy


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_push_is_detected_within_a_tenth_of_a_second(sign: float) -> None:
    assert sign * learned_velocity(0.1, 0.5 * sign, 10) > 0.35
    assert sign * learned_velocity(0.0, 0.5 * sign, 10) < 0.1


def test_noise_is_not_a_push() -> None:
    detected = learned_velocity(0.1, 0.0, 200, noise=0.001)
    assert detected == pytest.approx(learned_velocity(0.0, 0.0, 200, noise=0.001), abs=0.02)


def test_a_measurement_without_a_predecessor_is_not_a_push() -> None:
    assert Filter(0.05).tick(0.03) == 0.0, "the first one of a walk"
    for missed, step in ((True, 0), (False, 1)):
        both = Filter(0.1)
        both.tick(0.0)
        assert both.tick(0.03, step=step, missed=missed) == 0.0


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_the_accelerometer_shows_a_push_while_it_acts(sign: float) -> None:
    # 4 m/s^2 for 0.1 s; the CoM shows it as well: y = a t^2 / 2.
    def velocities(acceleration: float) -> list[float]:
        both, found = Filter(0.1), []
        for tick in range(10):
            both.tick(0.5 * 4.0 * sign * (DT * (tick + 1)) ** 2, acceleration)
            found.append(sign * both.vy)
        return found

    measured = velocities(4.0 * sign)
    assert measured[5] > 0.1
    assert measured[9] == pytest.approx(0.4, abs=0.15)
    assert velocities(0.0)[5] < 0.5 * measured[5]


@pytest.mark.parametrize("accelerations", [(0.0, 200.0, 0.0, 0.0), (0.0, 8.0, -8.0, 0.0)])
def test_a_single_acceleration_sample_is_not_a_push(accelerations: tuple[float, ...]) -> None:
    both = Filter(0.1)
    assert [both.tick(both.y, sample) for sample in accelerations] == [0.0] * 4


def test_a_push_lasts_only_as_long_as_its_acceleration() -> None:
    detector, none = PushDetector(0.1), ComCorrection(0.0, 0.0, 0.0, 0.0)

    def after(*accelerations: float) -> float:
        for acceleration in accelerations:
            detector.update((0.0, 0.0), none, 0.0, DT, 0, False, (0.0, acceleration))
        return detector.lateral_acceleration

    assert after(*[-4.0] * 6) == -4.0
    assert after(0.0, 0.0) == 0.0


def test_an_acceleration_is_used_through_a_support_change() -> None:
    detector, none = PushDetector(0.1), ComCorrection(0.0, 0.0, 0.0, 0.0)
    for step in range(8):
        push = detector.update((0.0, 0.0), none, 0.0, DT, step, False, (4.0, 0.0))
    assert push == pytest.approx((4.0 * DT, 0.0), abs=0.01)


def test_a_fast_walk_needs_a_stronger_push() -> None:
    none = ComCorrection(0.0, 0.0, 0.0, 0.0)

    def detected(forward_speed: float) -> float:
        detector = PushDetector(0.1)
        for _ in range(5):
            push = detector.update((0.0, 0.0), none, forward_speed, DT, 0, False, (4.0, 0.0))
        return push[0]

    assert detected(0.0) > 0.0
    assert detected(0.5) == 0.0
