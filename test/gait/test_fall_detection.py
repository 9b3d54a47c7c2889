"""Falls: detected early and only then; a stand that tips is saved by capture steps."""

import math

import pytest

from nao_lipm_gait.estimation.fall_detection import (
    FALL_BEYOND,
    FALL_HORIZON,
    FALL_TICKS,
    ComBeyondSoles,
    FallDetector,
    TippingDetector,
)
from nao_lipm_gait.parameters import GaitParameters
from nao_lipm_gait.walks.pendulum import advance
from robot_core.types import LEFT, RIGHT, STANDSTILL, Point2, VelocityCommand
from sim_bridge.trials.metrics import Metrics
from sim_bridge.trials.rollout import RolloutSpec, rollout
from sim_bridge.trials.tasks import STAND_TIME, Task, find_task
from sim_bridge.trials.trial import Push

PERIOD = 0.01
K = 6.4
"""Natural frequency [1/s] of the pendulum."""
OVER_SOLES = -1.0
"""[m] Of a CoM that is over the soles."""
OUTLINE = ((0.1, 0.05), (0.1, -0.04), (-0.05, -0.04), (-0.05, 0.05))
"""[m] Of the left sole."""
APART = 0.12
"""[m] Between the soles."""


def detected_tilt(tilt_rate: float, until: float, direction: float = 0.0) -> float | None:
    """The tilt [rad] at which a fall at a steady rate [rad/s] is detected."""
    detector = FallDetector()
    tilt = 0.0
    cos, sin = math.cos(direction), math.sin(direction)
    while tilt < until:
        # Forward for direction 0: the vertical leans back in the torso frame.
        up = (-math.sin(tilt) * cos, math.sin(tilt) * sin, math.cos(tilt))
        rate = (tilt_rate * sin, tilt_rate * cos, 0.0)
        if detector.update(up, tilt, rate, OVER_SOLES):
            return tilt
        tilt += tilt_rate * PERIOD
    return None


def test_a_fast_tilt_is_detected_long_before_45_degrees() -> None:
    for direction in (0.0, 0.5 * math.pi, math.pi, 4.0):
        found = detected_tilt(3.0, math.radians(45.0), direction)
        assert found is not None
        assert found < 0.45


def test_a_tilt_that_decreases_is_no_fall() -> None:
    detector = FallDetector()
    for tick in range(100):
        tilt = 0.45 * math.exp(-tick * PERIOD)
        up = (-math.sin(tilt), 0.0, math.cos(tilt))
        assert not detector.update(up, tilt, (0.0, -0.45, 0.0), OVER_SOLES)


def test_a_jerk_of_the_gyro_is_no_fall() -> None:
    detector = FallDetector()
    for tick in range(50):
        rate = 20.0 if tick % FALL_TICKS else 0.0
        up = (-math.sin(0.02), 0.0, math.cos(0.02))
        assert not detector.update(up, 0.02, (0.0, rate, 0.0), OVER_SOLES)


def beyond(
    com: list[Point2], support: int = LEFT, landing: Point2 | None = None
) -> list[float]:
    """What `ComBeyondSoles` says of a CoM, tick by tick, over soles side by side."""
    soles = ComBeyondSoles(OUTLINE)
    other = (0.0, -support * APART, 0.0)
    return [soles.update(support, (x, y, 0.25), other, landing, PERIOD) for x, y in com]


def test_a_com_at_rest_is_as_far_beyond_the_soles_as_it_is() -> None:
    middle = 0.5 * APART
    for (x, y), wanted in (
        ((0.0, -middle), -0.05), ((0.12, -middle), 0.02), ((-0.06, -middle), 0.01),
        ((0.0, 0.06), 0.01), ((0.0, -APART - 0.06), 0.01),
    ):  # fmt: skip
        assert beyond([(x, y)] * 10)[-1] == pytest.approx(wanted)
        assert beyond([(x, -y)] * 10, RIGHT)[-1] == pytest.approx(wanted)


def test_a_place_to_land_carries_as_a_sole_does() -> None:
    com = [(0.18, -0.06)] * 10
    assert beyond(com)[-1] == pytest.approx(0.08)
    assert beyond(com, landing=(0.1, -APART))[-1] == pytest.approx(-0.02)


def over_the_toes(divergent: float) -> list[Point2]:
    """A CoM 0.1 m behind the toes, on a pendulum over them, with x + v / k beyond them [m]."""
    x, v = -0.1, K * (divergent + 0.1)
    return [(0.1 + advance(x, v, K, PERIOD * tick)[0], -0.06) for tick in range(200)]


def test_a_pendulum_that_goes_over_the_toes_is_seen_before_it_does() -> None:
    """The CoM beyond them doubles in 0.11 s: 0.25 m, 45 degrees, is late."""
    com = over_the_toes(0.02)
    found = next(tick for tick, far in enumerate(beyond(com)) if far > FALL_BEYOND)
    over = next(tick for tick, (x, _) in enumerate(com) if x > 0.1 + FALL_BEYOND)
    down = next(tick for tick, (x, _) in enumerate(com) if x > 0.1 + 0.25)
    assert PERIOD * (over - found) > 0.5 * FALL_HORIZON
    assert PERIOD * (down - found) > 0.35


def test_a_pendulum_that_comes_back_from_the_toes_is_no_fall() -> None:
    assert max(beyond(over_the_toes(-0.005)[:50])) < FALL_BEYOND


def test_another_supporting_foot_is_no_motion() -> None:
    """Seen from the other sole a CoM at rest is elsewhere."""
    soles = ComBeyondSoles(OUTLINE)
    for tick in range(40):
        support = LEFT if tick // 5 % 2 else RIGHT
        far = soles.update(
            support, (0.0, -support * 0.06, 0.25), (0.0, -support * APART, 0.0), None, PERIOD
        )
        assert far == pytest.approx(-0.05)


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


def pushed_walk(
    speed: float, robot: int, noise: int, time: float, impulse: float, direction: float
) -> Metrics:
    knots = ((STAND_TIME, STANDSTILL), (STAND_TIME + 1.0, VelocityCommand(speed, 0.0, 0.0)))
    spec = RolloutSpec(
        Task("pushed", knots, 1.0, time + 2.6), robot_seed=robot, noise_seed=noise,
        engine="mujoco", push=Push(time, impulse, direction),
    )  # fmt: skip
    return rollout(spec).metrics


@pytest.mark.parametrize(
    ("speed", "robot", "noise", "time", "impulse", "direction"),
    [
        (0.45, 2, 218, 5.54, 2.344228621139119, 1.0662197384369454),
        (0.2, 29, 716, 5.95, 2.1662340671846376, 1.458602518120493),
        (0.2, 15, 433, 5.94, 2.5631734983593972, 1.7280464402566298),
    ],
)
def test_who_recovers_from_a_deep_tilt_is_not_dropped(
    speed: float, robot: int, noise: int, time: float, impulse: float, direction: float
) -> None:
    """These bend by over 20 degrees, and their next steps save them if they may make them."""
    pytest.importorskip("mujoco")
    metrics = pushed_walk(speed, robot, noise, time, impulse, direction)
    assert not metrics.fell
    assert metrics.alarm_time is None


@pytest.mark.parametrize(
    ("robot", "noise", "time", "impulse", "direction"),
    [
        (23, 544, 5.7, 2.969632390966099, 2.9189893086095795),
        (23, 867, 5.79, 2.451532860291317, 3.04687499949859),
        (19, 117, 5.53, 2.942697406624325, 3.9292861776095216),
    ],
)
def test_a_fall_is_seen_while_the_torso_is_still_upright(
    robot: int, noise: int, time: float, impulse: float, direction: float
) -> None:
    """The tilt alone shows these 0.02 to 0.06 s before they are down."""
    pytest.importorskip("mujoco")
    lead = pushed_walk(0.2, robot, noise, time, impulse, direction).fall_lead
    assert lead is not None
    assert lead > 0.12
