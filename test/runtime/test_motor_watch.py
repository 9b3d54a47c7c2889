"""A leg motor without torque is noticed in the walk; what only looks like one is not."""

import numpy as np
import pytest

from gait_lab.faults.campaign import STOPPED, FaultRun, run_fault
from nao_lipm_gait.parameters import GaitParameters
from nao_lipm_gait.runtime.motor_watch import LEFT, NEWER, OLDER, TICKS, UNSETTLED, MotorWatch
from robot_core.robot import load_robot
from robot_core.types import FloatArray

ROBOT = load_robot()
TOTAL, FAILS = 200, 120
KNEE, ANKLE = ROBOT.index("LKneePitch"), ROBOT.index("RAnklePitch")


def steps() -> FloatArray:
    """Targets of a walk: each joint moves in a phase of its own."""
    time = 0.01 * np.arange(TOTAL)[:, None]
    return 0.3 + 0.2 * np.sin(13.0 * time + 0.9 * np.arange(len(ROBOT.joint_names)))


def found_at(measured: FloatArray, wanted: FloatArray, ticks: int = 1) -> int | None:
    """The tick at which the watch finds a joint; `ticks`: control periods between readings."""
    watch = MotorWatch(ROBOT, 0.01)
    for tick in range(OLDER, TOTAL - NEWER, ticks):
        watch.update(measured[tick], list(wanted[tick - OLDER : tick + NEWER + 1]), ticks)
        if watch.trouble:
            return tick
    return None


def leaving(joints: list[int], rate: float) -> FloatArray:
    """Readings of joints that leave their targets at a rate [rad/s] from `FAILS` on."""
    measured = steps()
    way = rate * 0.01 * np.arange(1, TOTAL - FAILS + 1)
    measured[FAILS:, joints] = measured[:, joints].max(axis=0) + way[:, None]
    return measured


def test_a_joint_that_leaves_its_targets_is_named_at_once() -> None:
    rate = 2.0
    found = found_at(leaving([KNEE], rate), steps())
    assert found is not None
    assert found <= FAILS + LEFT / rate / 0.01 + TICKS
    watch = MotorWatch(ROBOT, 0.01)
    measured, wanted = leaving([KNEE], rate), steps()
    for tick in range(OLDER, found + 1):
        watch.update(measured[tick], list(wanted[tick - OLDER : tick + NEWER + 1]), 1)
    assert "LKneePitch" in watch.trouble


@pytest.mark.parametrize("late", [-NEWER, 0, OLDER])
def test_joints_that_follow_late_or_early_are_not_found(late: int) -> None:
    assert found_at(np.roll(steps(), late, axis=0), steps()) is None


def test_a_slip_of_an_encoder_is_no_motor() -> None:
    measured = steps()
    measured[FAILS:, KNEE] += 0.052
    assert found_at(measured, steps()) is None


def test_an_encoder_that_is_stuck_is_no_motor() -> None:
    measured = steps()
    measured[FAILS:, KNEE] = measured[FAILS, KNEE]
    assert found_at(measured, steps()) is None


def test_a_single_wrong_reading_is_no_motor() -> None:
    measured = steps()
    measured[FAILS, KNEE] += 1.0
    assert found_at(measured, steps()) is None


def test_two_joints_that_leave_together_are_overloaded() -> None:
    assert found_at(leaving([KNEE, ANKLE], 2.0), steps()) is None


def test_after_a_gap_the_joints_may_be_anywhere() -> None:
    watch, wanted = MotorWatch(ROBOT, 0.01), steps()
    for tick in range(OLDER, FAILS):
        watch.update(wanted[tick], list(wanted[tick - OLDER : tick + NEWER + 1]), 1)
    for more in range(UNSETTLED - 1):
        off = wanted[FAILS] + 0.5 + 0.001 * more
        watch.update(off, [wanted[FAILS]] * 3, 1 if more else 10)
    assert watch.trouble == ""


def test_motors_that_give_way_are_not_judged() -> None:
    assert not MotorWatch(load_robot("booster_t1"), 0.01).needed


@pytest.mark.parametrize("seed", [1006, 1009, 1022])
def test_a_nao_whose_hip_goes_limp_stands_and_says_why(seed: int) -> None:
    pytest.importorskip("mujoco")
    result = run_fault(FaultRun("limp_motor", seed, parameters=GaitParameters()))
    assert result.outcome == STOPPED
    assert any("without torque" in line for line in result.explained)
