"""Yaw slip by the roll gyro of a leaning torso: the law, and a simulated walk."""

import math
from collections.abc import Callable

import numpy as np
import pytest

from nao_lipm_gait.estimation.com_measurement import level_frame
from nao_lipm_gait.estimation.yaw_slip import YawOverSole
from nao_lipm_gait.estimation.yaw_slip_from_lean import YawSlipFromLean
from nao_lipm_gait.parameters import GaitParameters
from nao_lipm_gait.whole_body.body_model import SolePose
from robot_core.types import Point3
from sim_bridge.trials.rollout import RolloutSpec, rollout
from sim_bridge.trials.tasks import find_task

DT = 0.01
STEP = 0.2
"""Duration [s] of a step."""
NOISE = 0.005
"""Deviation [rad/s] of the gyro."""


class SwayingTorso:
    """A torso that sways over flat soles, leans forward, and whose soles slip.

    Args:
        lean: Pitch [rad] over the soles.
        bias: Bias [rad/s] of the roll gyro.
        joints: Yaw rate [rad/s] over the soles, by the joint angles.
        slope: Slope [rad] of the ground, downwards ahead.
        lean_error: Error [rad] of the lean by the joint angles.
        seed: Seed of the gyro's noise.

    Attributes:
        joints: Yaw rate [rad/s] over the soles, by the joint angles.
        filter: The estimator under test.
        seen: Yaw slip [rad] that it has estimated so far.
        tipping: Roll rate [rad/s] that lifts the soles off the ground.
        bias: Bias [rad/s] of the roll gyro.
    """

    def __init__(
        self, lean: float, bias: float, joints: float = 0.0, slope: float = 0.0,
        lean_error: float = 0.0, seed: int = 0,
    ) -> None:  # fmt: skip
        self.filter = YawSlipFromLean()
        self.seen = 0.0
        self.tipping = 0.0
        self.bias = bias
        self.joints = joints
        self._lean, self._lean_error, self._slope = lean, lean_error, slope
        self._noise = np.random.default_rng(seed)
        self._time = 0.0
        self._over_sole = 0.0
        self._yaw_over_sole = YawOverSole()

    def stand(self, seconds: float, rocking: Callable[[float], float] = lambda time: 0.0) -> None:
        """Stand for some time [s]; rocking: roll rate [rad/s] over time."""
        for _ in range(round(seconds / DT)):
            self._time += DT
            self._tick(0.0, rocking(self._time), 0.0, (0.0, 0.0), 1, at_rest=True)

    def walk(
        self, seconds: float, turn: float, velocity: tuple[float, float] = (0.35, 0.0)
    ) -> None:
        """Walk for some time [s]; turn: yaw slip rate [rad/s] of the soles."""
        for _ in range(round(seconds / DT)):
            self._time += DT
            phase = math.pi * self._time / STEP
            roll, roll_rate = 0.05 * math.sin(phase), 0.05 * math.pi / STEP * math.cos(phase)
            self._over_sole += self.joints * DT
            support = 1 if math.sin(phase) > 0.0 else -1
            self._tick(roll, roll_rate, self.joints + turn, velocity, support, at_rest=False)

    def _tick(
        self, roll: float, roll_rate: float, yaw_rate: float, velocity: tuple[float, float],
        support: int, at_rest: bool,
    ) -> None:  # fmt: skip
        gyro = roll_rate - yaw_rate * math.sin(self._lean) + self.bias + self.tipping
        measured = self._lean + self._lean_error
        sin, cos = math.sin(measured), math.cos(measured)
        up = (-sin, cos * math.sin(roll), cos * math.cos(roll))
        gyro += self._noise.normal(0.0, NOISE)
        sole = flat_sole(up, -self._over_sole)
        # The slope in the frame of the turning torso.
        lean = self._lean + self._slope * math.cos(self._over_sole)
        tilted = roll - self._slope * math.sin(self._over_sole)
        vertical = (
            -math.sin(lean), math.cos(lean) * math.sin(tilted), math.cos(lean) * math.cos(tilted)
        )
        over_sole = self._yaw_over_sole.update(support, level_frame(sole, vertical), sole)
        self.seen += self.filter.update(
            support, over_sole, sole.normal, vertical, gyro, velocity, DT, at_rest=at_rest
        )


def flat_sole(up: Point3, heading: float) -> SolePose:
    """A flat sole with this heading [rad] under a torso with this vertical."""
    z = np.array(up)
    x = np.array((1.0, 0.0, 0.0)) - z[0] * z
    x /= np.linalg.norm(x)
    forward = math.cos(heading) * x + math.sin(heading) * np.cross(z, x)
    return SolePose((0.0, 0.0, -0.3), tuple(forward), up)


@pytest.mark.parametrize("turn", [0.15, -0.1, 0.0])
@pytest.mark.parametrize("held", [False, True])
def test_a_leaning_torso_measures_the_yaw_slip(turn: float, held: bool) -> None:
    """Also while the joints turn the torso back, as they do while a heading is held."""
    torso = SwayingTorso(lean=0.1, bias=0.008)
    torso.stand(3.0)
    torso.walk(8.0, turn)
    torso.joints = -turn if held else 0.0
    before = torso.seen
    torso.walk(10.0, turn)
    assert torso.seen - before == pytest.approx(10.0 * turn, abs=math.radians(10.0))


@pytest.mark.parametrize("lean_error", [-0.03, 0.03])
def test_a_curve_is_not_taken_for_slip(lean_error: float) -> None:
    """With this error of the lean, each radian of the curve looks like 0.75 rad of slip."""
    torso = SwayingTorso(lean=0.04, bias=0.0, joints=0.35, lean_error=lean_error)
    torso.stand(3.0)
    torso.walk(10.0, 0.0, velocity=(0.15, 0.0))
    assert abs(torso.seen) < math.radians(5.0)
    # A slip of 5 % would not be seen either, and the variance says so.
    assert torso.filter.yaw_variance > (0.05 * 3.5) ** 2
    assert torso.filter.rate_variance((0.15, 0.0, 0.35)) > (0.05 * 0.35) ** 2


def test_a_slip_that_is_found_late_corrects_the_heading_back() -> None:
    """The slip begins with the walk; the first strides do not show it."""

    def missed(seconds: float) -> float:
        torso = SwayingTorso(lean=0.12, bias=0.0)
        torso.stand(5.0)
        torso.walk(seconds, 0.2)
        return 0.2 * seconds - torso.seen

    assert missed(1.0) > 0.1
    assert abs(missed(12.0)) < 0.08


def test_the_heading_is_known_worse_without_lean() -> None:
    def variance(lean: float) -> float:
        torso = SwayingTorso(lean=lean, bias=0.0)
        torso.stand(5.0)
        torso.walk(10.0, 0.0)
        return torso.filter.yaw_variance

    assert variance(0.15) < 0.25 * variance(0.01)
    assert variance(0.15) < 0.25 * variance(0.0)


def test_a_robot_that_still_rocks_learns_its_bias_from_the_later_samples() -> None:
    torso = SwayingTorso(lean=0.1, bias=0.002)
    torso.stand(4.0, lambda time: -0.016 * math.exp(-time / 0.2))
    assert torso.filter.bias_sigma < 5e-4
    torso.walk(20.0, 0.0)
    assert abs(torso.seen) < math.radians(10.0)


def test_left_and_right_are_alike() -> None:
    def seen(turn: float) -> float:
        torso = SwayingTorso(lean=0.1, bias=0.0)
        torso.stand(3.0)
        torso.walk(20.0, turn)
        return torso.seen

    # The noise is the same in both and cancels.
    assert seen(0.1) - seen(0.0) == pytest.approx(seen(0.0) - seen(-0.1), abs=1e-6)


def test_an_upright_torso_measures_no_yaw_slip() -> None:
    torso = SwayingTorso(lean=0.0, bias=0.0)
    torso.stand(3.0)
    torso.walk(20.0, 0.15)
    assert torso.seen == 0.0


def test_a_gyro_whose_bias_is_unknown_has_less_weight() -> None:
    """Bias and slip have the same effect then; the filter splits it by their variances."""
    rested, unrested = (SwayingTorso(lean=0.1, bias=0.01) for _ in range(2))
    rested.stand(3.0)
    for torso in (rested, unrested):
        torso.walk(20.0, 0.0)
    assert abs(rested.seen) < math.radians(20.0)
    assert abs(unrested.seen) > abs(rested.seen)
    # If all of it were taken for slip, it would be 0.1 rad/s.
    assert abs(unrested.seen) < 0.95 * 20.0 * 0.01 / math.sin(0.1)


@pytest.mark.parametrize(
    "rocking", [lambda time: 0.05 * math.sin(18.0 * time), lambda time: 0.05 * math.exp(-time)]
)
def test_a_robot_that_rocks_or_sinks_is_not_at_rest(rocking: Callable[[float], float]) -> None:
    torso = SwayingTorso(lean=0.1, bias=0.0)
    torso.stand(1.0, rocking)
    torso.stand(2.0)
    torso.walk(20.0, 0.0)
    assert abs(torso.seen) < math.radians(20.0)


def test_a_robot_that_tipped_has_not_turned() -> None:
    def seen(tipping: float) -> float:
        """Estimated slip [rad] after a roll at this rate [rad/s] that lifts the soles."""
        torso = SwayingTorso(lean=0.1, bias=0.0)
        torso.stand(3.0)
        torso.walk(10.0, 0.0)
        torso.tipping = tipping
        torso.walk(2.0 * STEP, 0.0)
        torso.tipping = 0.0
        torso.walk(5.0, 0.0)
        return torso.seen

    # A slip that explained all of it would be 2.4 rad.
    assert seen(0.3) == pytest.approx(seen(0.0), abs=0.25)


def test_a_large_bias_is_learned_when_it_stays() -> None:
    torso = SwayingTorso(lean=0.12, bias=0.03)
    torso.stand(4.0)
    torso.walk(20.0, 0.0)
    assert abs(torso.seen) < math.radians(20.0)


def test_a_bias_that_drifts_at_rest_is_followed() -> None:
    torso = SwayingTorso(lean=0.12, bias=0.0)
    drift = 0.004 / 300.0
    torso.stand(300.0, lambda time: drift * time)
    torso.bias = 0.004
    torso.walk(20.0, 0.0)
    assert abs(torso.seen) < math.radians(20.0)


@pytest.mark.parametrize("slope", [-0.1, 0.1])
def test_a_slope_is_not_a_turn(slope: float) -> None:
    """The soles lie on the slope; the torso turns over them by its joints."""
    torso = SwayingTorso(lean=0.12, bias=0.0, joints=0.3, slope=slope)
    torso.stand(3.0)
    torso.walk(8.0, 0.0, velocity=(0.2, 0.0))
    assert abs(torso.seen) < math.radians(10.0)


def test_a_diagonal_walk_has_one_direction() -> None:
    torso = SwayingTorso(lean=0.12, bias=0.0)
    torso.stand(3.0)
    for _ in range(20):
        torso.walk(0.5, 0.15, velocity=(0.2, 0.19))
        torso.walk(0.5, 0.15, velocity=(0.2, 0.21))
    before = torso.seen
    torso.walk(5.0, 0.15, velocity=(0.2, 0.21))
    assert torso.seen - before == pytest.approx(5.0 * 0.15, abs=math.radians(7.0))


def test_the_learned_yaw_slip_outlasts_a_stop() -> None:
    torso = SwayingTorso(lean=0.12, bias=0.0)
    torso.stand(3.0)
    torso.walk(15.0, 0.2)
    torso.stand(1.0)
    before = torso.seen
    torso.walk(1.0, 0.2)
    assert torso.seen - before == pytest.approx(0.2, abs=0.05)


def test_each_walking_direction_has_its_own_yaw_slip() -> None:
    torso = SwayingTorso(lean=0.1, bias=0.0)
    torso.stand(3.0)
    torso.walk(15.0, 0.2)
    before = torso.seen
    torso.walk(3.0, 0.0, velocity=(-0.3, 0.0))
    # With the slip of the walk forward it would be 0.5 rad.
    assert abs(torso.seen - before) < 0.2


def test_the_torso_turns_left_over_a_sole_that_turns_right_in_its_frame() -> None:
    turn = YawOverSole()
    up = (0.0, 0.0, 1.0)

    def turn_of(support: int, heading: float, other: float) -> float:
        sole = flat_sole(up, heading)
        return turn.update(support, level_frame(sole, up), flat_sole(up, other))

    assert turn_of(1, 0.0, 0.5) == 0.0
    assert turn_of(1, -0.1, 0.5) == pytest.approx(0.1)
    # The other sole becomes the support sole; the torso has turned over the first one.
    assert turn_of(-1, 0.5, -0.3) == pytest.approx(0.2)
    turn.interrupt()
    assert turn_of(-1, 0.8, 0.0) == 0.0


def test_a_robot_without_yaw_gyro_keeps_its_heading() -> None:
    """Robot 41 of the reference plant has one foot that slips far more than the other."""

    def drift(yaw_from_lean: bool) -> float:
        spec = RolloutSpec(
            find_task("forward").lasting(10.0), robot_seed=41, engine="mujoco",
            parameters=GaitParameters(yaw_from_lean=yaw_from_lean),
        )  # fmt: skip
        metrics = rollout(spec).metrics
        assert not metrics.fell
        return math.degrees(abs(metrics.turn_rate))

    pytest.importorskip("mujoco")
    seen = drift(True)
    assert seen < 2.5
    assert seen < 0.5 * drift(False)
