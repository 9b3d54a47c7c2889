"""Falls: detected early and only then; a stand that tips is saved by capture steps."""

import math

import pytest

from nao_lipm_gait.estimation.fall_detection import FALL_TICKS, FallDetector, TippingDetector
from nao_lipm_gait.parameters import GaitParameters
from sim_bridge.trials.rollout import RolloutSpec, rollout
from sim_bridge.trials.tasks import STAND_TIME, find_task
from sim_bridge.trials.trial import Push

PERIOD = 0.01
K = 6.4
"""Natural frequency [1/s] of the pendulum."""


def detected_tilt(tilt_rate: float, until: float, direction: float = 0.0) -> float | None:
    """The tilt [rad] at which a fall at a steady rate [rad/s] is detected."""
    detector = FallDetector()
    tilt = 0.0
    cos, sin = math.cos(direction), math.sin(direction)
    while tilt < until:
        # Forward for direction 0: the vertical leans back in the torso frame.
        up = (-math.sin(tilt) * cos, math.sin(tilt) * sin, math.cos(tilt))
        rate = (tilt_rate * sin, tilt_rate * cos, 0.0)
        if detector.update(up, tilt, rate):
            return tilt
        tilt += tilt_rate * PERIOD
    return None


def test_a_fast_tilt_is_detected_long_before_45_degrees() -> None:
    for direction in (0.0, 0.5 * math.pi, math.pi, 4.0):
        found = detected_tilt(3.0, math.radians(45.0), direction)
        assert found is not None
        assert found < 0.35


def test_a_tilt_that_decreases_is_no_fall() -> None:
    detector = FallDetector()
    for tick in range(100):
        tilt = 0.45 * math.exp(-tick * PERIOD)
        up = (-math.sin(tilt), 0.0, math.cos(tilt))
        assert not detector.update(up, tilt, (0.0, -0.45, 0.0))


def test_a_jerk_of_the_gyro_is_no_fall() -> None:
    detector = FallDetector()
    for tick in range(50):
        rate = 20.0 if tick % FALL_TICKS else 0.0
        up = (-math.sin(0.02), 0.0, math.cos(0.02))
        assert not detector.update(up, 0.02, (0.0, rate, 0.0))


def test_a_com_at_rest_beside_the_middle_does_not_tip() -> None:
    tipping = TippingDetector()
    assert all(
        tipping.update((0.03, -0.02, 0.24), K, 0.05, PERIOD) is None for _ in range(1000)
    )


def test_a_fast_com_tips_before_it_is_far() -> None:
    tipping = TippingDetector()
    tipping.update((0.01, 0.0, 0.24), K, 0.05, PERIOD)
    for tick in range(1, 100):
        found = tipping.update((0.01 + 0.5 * tick * PERIOD, 0.0, 0.24), K, 0.05, PERIOD)
        if found is not None:
            break
    assert found is not None
    assert 0.0 < found[0] < 0.03
    x, y, vx, vy = found
    assert x + vx / K > 0.05
    assert (y, vy) == (0.0, 0.0)
    tipping.reset()
    assert tipping.update((0.2, 0.0, 0.24), K, 0.05, PERIOD) is None


@pytest.mark.parametrize("catch", [True, False])
@pytest.mark.parametrize("direction", [0.0, math.pi])
def test_steps_save_a_pushed_stand(direction: float, catch: bool) -> None:
    pytest.importorskip("mujoco")
    parameters = GaitParameters() if catch else GaitParameters(stand_catch=0.0)
    spec = RolloutSpec(
        find_task("stand").lasting(5.0), robot_seed=20, parameters=parameters, engine="mujoco",
        push=Push(STAND_TIME + 1.0, 2.2, direction),
    )  # fmt: skip
    metrics = rollout(spec).metrics
    assert metrics.fell != catch
    assert (metrics.support_changes > 0) == catch


@pytest.mark.parametrize("plant", ["reference", "worn"])
def test_an_undisturbed_stand_stays_one(plant: str) -> None:
    pytest.importorskip("mujoco")
    spec = RolloutSpec(
        find_task("stand").lasting(10.0), robot_seed=21, plant=plant, engine="mujoco"
    )
    metrics = rollout(spec).metrics
    assert not metrics.fell
    assert metrics.support_changes == 0
