"""A leg motor without torque is noticed in the walk; what only looks like one is not."""

from collections.abc import Callable

import numpy as np
import pytest

from gait_lab.faults.campaign import STOPPED, FaultRun, run_fault
from nao_lipm_gait.parameters import GaitParameters
from nao_lipm_gait.runtime.motor_watch import (
    BRIDGED,
    LEFT,
    NEWER,
    NO_TORQUE,
    OLDER,
    TICKS,
    UNSETTLED,
    MotorWatch,
)
from nao_lipm_gait.runtime.validation import CommandHistory
from robot_core.robot import load_robot
from robot_core.types import FloatArray, JointTargets

ROBOT = load_robot()
TOTAL, FAILS = 200, 120
KNEE = ROBOT.index("LKneePitch")
STALL = np.array([ROBOT.motors[name].stall_torque for name in ROBOT.joint_names])
IDLE, PULLING = 0.5 * NO_TORQUE * STALL, 2.0 * NO_TORQUE * STALL
UNKNOWN = np.full(len(STALL), np.nan)


def steps() -> FloatArray:
    """Targets of a walk: each joint moves in a phase of its own."""
    time = 0.01 * np.arange(TOTAL)[:, None]
    return 0.3 + 0.2 * np.sin(13.0 * time + 0.9 * np.arange(len(ROBOT.joint_names)))


def leaving(rate: float) -> FloatArray:
    """Readings of a knee that leaves its targets at a rate [rad/s] from `FAILS` on."""
    measured = steps()
    way = rate * 0.01 * np.arange(1, TOTAL - FAILS + 1)
    measured[FAILS:, KNEE] = measured[:, KNEE].max() + way
    return measured


def around(wanted: FloatArray, tick: int) -> Callable[[], list[FloatArray]]:
    """The targets about a tick."""
    return lambda: list(wanted[tick - OLDER : tick + NEWER + 1])


def found_at(
    measured: FloatArray, effort: FloatArray = IDLE, before: FloatArray = PULLING
) -> tuple[int, str] | None:
    """The tick at which the watch finds a joint, and what it says of it."""
    watch, wanted = MotorWatch(ROBOT, 0.01), steps()
    for tick in range(OLDER, TOTAL - NEWER):
        now = before if tick < FAILS else effort
        watch.update(measured[tick], now, wanted[tick], around(wanted, tick), 1)
        if watch.trouble:
            return tick, watch.trouble
    return None


def test_a_joint_that_leaves_its_targets_without_torque_is_named_at_once() -> None:
    rate = 2.0
    found = found_at(leaving(rate))
    assert found is not None
    tick, text = found
    assert FAILS <= tick <= FAILS + LEFT / rate / 0.01 + TICKS
    assert "effort[LKneePitch]" in text


def test_a_joint_that_is_forced_away_is_pulled_back() -> None:
    assert found_at(leaving(2.0), PULLING) is None
    assert found_at(leaving(2.0), -PULLING) is None


def test_a_robot_that_measures_no_torque_is_not_judged() -> None:
    assert found_at(leaving(2.0), UNKNOWN, UNKNOWN) is None
    assert found_at(leaving(2.0), 0.0 * STALL, 0.0 * STALL) is None


@pytest.mark.parametrize("late", [-NEWER, 0, OLDER])
def test_joints_that_follow_late_or_early_are_not_found(late: int) -> None:
    assert found_at(np.roll(steps(), late, axis=0)) is None


def test_a_motor_at_its_top_speed_gives_no_torque() -> None:
    measured = steps()
    measured[FAILS:, KNEE] = 2.0 - 0.07 * np.arange(TOTAL - FAILS)
    watch, wanted = MotorWatch(ROBOT, 0.01), steps()
    for tick in range(FAILS - 2 * UNSETTLED, FAILS + 20):
        now = PULLING if tick < FAILS else IDLE
        watch.update(measured[tick], now, wanted[tick], around(wanted, tick), 1)
    assert watch.trouble == ""


def test_an_encoder_that_is_stuck_is_no_motor() -> None:
    measured = steps()
    measured[FAILS:, KNEE] = measured[FAILS, KNEE] + 0.5
    assert found_at(measured) is None


def test_a_single_wrong_reading_is_no_motor() -> None:
    measured = steps()
    measured[FAILS, KNEE] += 1.0
    assert found_at(measured) is None


def test_after_a_gap_the_joints_may_be_anywhere() -> None:
    watch, wanted = MotorWatch(ROBOT, 0.01), steps()
    for tick in range(OLDER, FAILS):
        watch.update(wanted[tick], PULLING, wanted[tick], around(wanted, tick), 1)
    for more in range(UNSETTLED - 1):
        off = wanted[FAILS] + 0.5 + 0.001 * more
        ticks = 1 if more else BRIDGED + 1
        watch.update(off, IDLE, wanted[FAILS], around(wanted, FAILS), ticks)
    assert watch.trouble == ""


def test_a_leg_that_hangs_goes_where_its_torque_leads_it() -> None:
    """A soft motor turns its joint by what it is commanded beyond the pose, for a load."""
    history, lead = CommandHistory(), np.full(len(STALL), 0.1)
    history.add(JointTargets(0, ROBOT.stand_pose + lead, lead=lead))
    history.add(JointTargets(10_000_000, ROBOT.stand_pose))
    pose, loaded, unloaded = history.positions_between(0, 10_000_000)
    np.testing.assert_allclose(pose, ROBOT.stand_pose)
    np.testing.assert_allclose(loaded, ROBOT.stand_pose)
    np.testing.assert_allclose(unloaded, ROBOT.stand_pose + lead)


@pytest.mark.parametrize("seed", [1006, 1009, 1022])
def test_a_nao_whose_hip_goes_limp_stands_and_says_why(seed: int) -> None:
    pytest.importorskip("mujoco")
    result = run_fault(FaultRun("limp_motor", seed, parameters=GaitParameters()))
    assert result.outcome == STOPPED
    assert any("joint_states effort[" in line for line in result.explained)
