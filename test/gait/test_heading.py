"""Heading hold and yaw slip by a yaw gyro: laws, and a robot that walks straight with them."""

import math
from pathlib import Path

import numpy as np
import pytest

from nao_lipm_gait.estimation.com_measurement import LevelFrame, level_frame
from nao_lipm_gait.estimation.odometry import Odometry
from nao_lipm_gait.estimation.yaw_slip import YawSlipFromYawGyro
from nao_lipm_gait.estimation.yaw_slip_from_lean import HEADING_LEAN
from nao_lipm_gait.parameters import GaitParameters
from nao_lipm_gait.velocity_control import SETTLING_TIME, YAW_RATE_MAX, HeadingHold
from nao_lipm_gait.whole_body.body_model import SolePose
from robot_core.types import VelocityCommand
from sim_bridge.trials.rollout import RolloutSpec, rollout
from sim_bridge.trials.tasks import Task, find_task

DT = 0.01
UP = (0.0, 0.0, 1.0)
FORWARD = VelocityCommand(0.2, 0.0, 0.0)


def sole(yaw: float, y: float = 0.05) -> SolePose:
    """A level sole under a torso, turned by yaw [rad] in its frame."""
    return SolePose((0.0, y, -0.3), (math.cos(yaw), math.sin(yaw), 0.0), UP)


def level(yaw: float) -> LevelFrame:
    return level_frame(sole(yaw), UP)


def settled(heading: float = 0.0) -> HeadingHold:
    hold = HeadingHold()
    for _ in range(round(SETTLING_TIME / DT) + 1):
        hold.correct(FORWARD, heading, 1.0, DT)
    return hold


@pytest.mark.parametrize(("error", "rate"), [(0.1, -0.1), (-0.2, 0.2), (3.0, -YAW_RATE_MAX)])
def test_the_hold_turns_back_to_the_heading_it_began_with(error: float, rate: float) -> None:
    steered = settled(0.5).correct(FORWARD, 0.5 + error, 1.0, DT)
    assert steered == VelocityCommand(0.2, 0.0, pytest.approx(rate))


def test_the_hold_takes_the_short_way_round() -> None:
    assert settled(3.1).correct(FORWARD, -3.1, 1.0, DT).yaw == pytest.approx(
        math.remainder(6.2, math.tau)
    )


def test_a_commanded_turn_and_a_stand_are_not_corrected() -> None:
    hold = settled(0.0)
    turn = VelocityCommand(0.1, 0.0, 0.4)
    assert hold.correct(turn, 1.0, 1.0, DT) == turn
    # The steps of that turn still turn the robot; a new heading is held after them.
    assert hold.correct(FORWARD, 1.2, 1.0, DT) == FORWARD
    for _ in range(round(SETTLING_TIME / DT)):
        hold.correct(FORWARD, 1.3, 1.0, DT)
    assert hold.correct(FORWARD, 1.4, 1.0, DT).yaw == pytest.approx(-0.1)
    still = VelocityCommand(0.0, 0.0, 0.0)
    assert hold.correct(still, 2.0, 1.0, DT) == still
    assert settled(0.0).correct(FORWARD, 1.0, 0.0, DT) == FORWARD


def test_a_constant_slip_leaves_no_error() -> None:
    """A gain alone would leave the slip rate divided by the gain: 3.8 deg."""
    hold, heading, slip = settled(), 0.0, 0.1
    for _ in range(round(30.0 / DT)):
        heading += (hold.correct(FORWARD, heading, 1.5, DT).yaw + slip) * DT
    assert abs(heading) < math.radians(0.1)


def test_a_heading_that_cannot_be_held_does_not_wind_up_the_hold() -> None:
    hold = settled()
    for _ in range(round(30.0 / DT)):
        assert hold.correct(FORWARD, 1.0, 1.0, DT).yaw == -YAW_RATE_MAX
    assert hold.correct(FORWARD, 0.0, 1.0, DT).yaw == pytest.approx(0.0, abs=0.01)


def test_a_walk_from_a_stand_holds_the_heading_of_the_stand() -> None:
    hold = HeadingHold()
    assert hold.correct(FORWARD, 0.3, 1.0, DT) == FORWARD
    assert hold.correct(FORWARD, 0.4, 1.0, DT).yaw == pytest.approx(-0.1)


def test_a_heading_is_held_until_a_turn_is_commanded() -> None:
    assert not HeadingHold().holds
    hold = settled()
    assert hold.holds
    hold.correct(VelocityCommand(0.2, 0.0, 0.3), 0.0, 1.0, DT)
    assert not hold.holds


@pytest.mark.parametrize(("yaw", "leans"), [(0.0, True), (0.4, False)])
def test_only_a_robot_that_walks_straight_leans(yaw: float, leans: bool) -> None:
    def pitch(yaw_from_lean: bool) -> float:
        knots = ((0.5, VelocityCommand(0.0, 0.0, 0.0)), (1.0, VelocityCommand(0.15, 0.0, yaw)))
        spec = RolloutSpec(
            Task("lean", knots, 4.0, 5.0), keep_trace=True, engine="mujoco",
            parameters=GaitParameters(yaw_from_lean=yaw_from_lean),
        )  # fmt: skip
        trace = rollout(spec).trace
        assert trace is not None
        x, y, z, w = trace.torso_quaternion[-100:].T
        return float(np.mean(np.arcsin(2.0 * (w * y - z * x))))

    pytest.importorskip("mujoco")
    assert pitch(True) - pitch(False) == pytest.approx(HEADING_LEAN if leans else 0.0, abs=0.03)


def test_the_yaw_slip_is_the_gyros_rotation_without_that_over_the_sole() -> None:
    turn = YawSlipFromYawGyro()
    bias, slip, over_sole = 0.02, 0.3, 0.5
    unknown = turn.bias_sigma
    for _ in range(1000):
        assert turn.update(0.0, UP, (0.0, 0.0, bias), DT, at_rest=True, quiet=True) == 0.0
    assert turn.bias_sigma < 0.1 * unknown
    for _ in range(20):
        rate = (0.0, 0.0, over_sole + slip + bias)
        slipped = turn.update(over_sole * DT, UP, rate, DT, at_rest=False, quiet=False)
        assert slipped == pytest.approx(slip * DT, rel=1e-3)


def test_a_torso_that_rolls_and_pitches_does_not_turn() -> None:
    """Roll and pitch a quarter of a period apart: the rate about the vertical is not 0."""
    turn = YawSlipFromYawGyro()
    frequency, amplitude = 15.0, 0.1
    seen = 0.0
    for tick in range(1000):
        phase = frequency * tick * DT
        roll, pitch = amplitude * math.sin(phase), amplitude * math.cos(phase)
        roll_rate = amplitude * frequency * math.cos(phase)
        pitch_rate = -amplitude * frequency * math.sin(phase)
        up = (-math.sin(pitch), math.cos(pitch) * math.sin(roll), math.cos(pitch) * math.cos(roll))
        rate = (roll_rate, pitch_rate * math.cos(roll), -pitch_rate * math.sin(roll))
        seen += turn.update(0.0, up, rate, DT, at_rest=False, quiet=False)
        if tick == 999:
            vertical = sum(a * b for a, b in zip(rate, up, strict=True))
            assert abs(vertical) > 0.01
    assert abs(seen) < 1e-6


def test_odometry_turns_with_the_support_sole() -> None:
    odometry = Odometry()
    odometry.update(1, level(0.0), sole(0.0, -0.05), DT)
    odometry.update(1, level(0.0), sole(0.0, -0.05), DT, yaw_slip=0.2)
    assert odometry.base_footprint_in_odom[2] == pytest.approx(0.2)


def test_a_robot_with_a_yaw_gyro_keeps_its_heading_on_a_slippery_floor(tmp_path: Path) -> None:
    robot = tmp_path / "with_yaw_gyro.yaml"
    robot.write_text("base: nao_h21\nname: with_yaw_gyro\nurdf: nao_h21_v33\ngyro_axes: 3\n")

    def drift(urdf: str, parameters: GaitParameters) -> float:
        spec = RolloutSpec(
            find_task("forward").lasting(5.0), robot_seed=0, parameters=parameters, engine="mujoco",
            urdf=urdf, plant_options=(("variation.friction", (0.4, 0.4)),),
        )  # fmt: skip
        metrics = rollout(spec).metrics
        assert not metrics.fell
        return math.degrees(abs(metrics.turn_rate))

    pytest.importorskip("mujoco")
    gyro = drift(str(robot), GaitParameters())
    assert gyro < 2.0
    assert gyro < 0.5 * drift("nao_h21_v33", GaitParameters(yaw_from_lean=False))
