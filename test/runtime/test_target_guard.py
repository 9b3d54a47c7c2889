"""Whatever the gait does, the targets that are sent are finite and inside the joint limits."""

import math
from collections.abc import Callable

import numpy as np
import pytest

from nao_lipm_gait.runtime.target_guard import SPEED_SHARE, TargetGuard
from robot_core.robot import load_robot
from robot_core.types import STANDSTILL, JointTargets, SensorFrame, VelocityCommand

ROBOT = load_robot()
GOOD = np.clip(ROBOT.stand_pose + 0.01, ROBOT.lower, ROBOT.upper)


class ScriptedGait:
    """Gives the scripted answers."""

    def __init__(self, *answers: Callable[[int], JointTargets]) -> None:
        self._answers = list(answers)

    def step(self, frame: SensorFrame, command: VelocityCommand) -> JointTargets:
        return self._answers.pop(0)(frame.stamp)


def frame(stamp: int) -> SensorFrame:
    return SensorFrame(
        stamp, ROBOT.stand_pose, np.zeros(3), np.zeros(3)
    )


def good(stamp: int) -> JointTargets:
    return JointTargets(stamp, GOOD, 0.7)


def with_target(index: int, value: float) -> Callable[[int], JointTargets]:
    position = GOOD.copy()
    position[index] = value
    return lambda stamp: JointTargets(stamp, position)


def raising(_stamp: int) -> JointTargets:
    raise ZeroDivisionError("pendulum without a length")


def test_good_targets_pass_unchanged():
    answer = TargetGuard(ScriptedGait(good), ROBOT).step(frame(10), STANDSTILL)
    np.testing.assert_array_equal(answer.targets.position, GOOD)
    assert (answer.targets.stiffness, answer.held, answer.fault) == (0.7, False, None)


@pytest.mark.parametrize(
    ("bad", "evidence"),
    [
        (raising, "ZeroDivisionError: pendulum without a length"),
        (with_target(3, math.nan), f"target nan for {ROBOT.joint_names[3]}"),
        (with_target(0, math.inf), f"target inf for {ROBOT.joint_names[0]}"),
        (lambda stamp: JointTargets(stamp, GOOD[:5]), "shape"),
        (lambda stamp: JointTargets(stamp, GOOD, math.nan), "stiffness nan"),
    ],
)
def test_last_good_targets_are_held_and_the_evidence_is_reported(
    bad: Callable[[int], JointTargets], evidence: str
):
    guarded = TargetGuard(ScriptedGait(good, bad, good), ROBOT)
    guarded.step(frame(10), STANDSTILL)
    answer = guarded.step(frame(20), STANDSTILL)
    assert answer.held
    assert answer.fault is not None
    assert evidence in answer.fault
    assert answer.targets.stamp == 20, "the answer belongs to the new frame"
    np.testing.assert_array_equal(answer.targets.position, GOOD)
    assert answer.targets.stiffness == 0.7
    assert not guarded.step(frame(30), STANDSTILL).held


def test_without_good_targets_the_measured_pose_is_held():
    answer = TargetGuard(ScriptedGait(raising), ROBOT).step(frame(10), STANDSTILL)
    np.testing.assert_array_equal(answer.targets.position, ROBOT.stand_pose)


def test_targets_beyond_a_limit_are_clipped_and_reported():
    knee = ROBOT.index("LKneePitch")
    beyond = ROBOT.upper[knee] + 0.01
    guarded = TargetGuard(ScriptedGait(with_target(knee, beyond)), ROBOT)
    bent = ROBOT.stand_pose.copy()
    bent[knee] = ROBOT.upper[knee]
    answer = guarded.step(frame(10)._replace(joint_position=bent), STANDSTILL)
    assert answer.targets.position[knee] == ROBOT.upper[knee]
    assert not answer.held
    assert answer.fault is not None
    assert "LKneePitch" in answer.fault


def test_targets_move_no_faster_than_allowed():
    knee = ROBOT.index("LKneePitch")
    stride = SPEED_SHARE * 0.01 * ROBOT.velocity_limit[knee]
    far = GOOD[knee] + 1.0
    answers = (good, with_target(knee, far), with_target(knee, far), with_target(knee, far))
    guarded = TargetGuard(ScriptedGait(*answers), ROBOT)
    moved = []
    for tick in (1, 2, 3, 6):  # two frames were lost: three periods' worth
        answer = guarded.step(frame(tick * 10_000_000), STANDSTILL)
        moved.append(float(answer.targets.position[knee] - GOOD[knee]))
    assert moved == pytest.approx([0.0, stride, 2 * stride, min(1.0, 5 * stride)])
    assert answer.fault is None or "LKneePitch" in answer.fault


def test_a_limp_robot_may_be_moved_as_its_joints_are():
    knee = ROBOT.index("LKneePitch")

    def limp(stamp: int) -> JointTargets:
        return JointTargets(stamp, with_target(knee, GOOD[knee] + 1.0)(stamp).position, 0.0)

    guarded = TargetGuard(ScriptedGait(good, limp), ROBOT)
    guarded.step(frame(10), STANDSTILL)
    answer = guarded.step(frame(20), STANDSTILL)
    assert answer.fault is None
    assert answer.targets.position[knee] == GOOD[knee] + 1.0


def test_targets_without_a_frame_are_checked_too() -> None:
    gait = ScriptedGait(good)
    guard = TargetGuard(gait, ROBOT)
    assert guard.coast() is None, "nothing has been sent yet"
    guard.step(frame(10_000_000), STANDSTILL)
    gait.coast = lambda: None  # type: ignore[attr-defined]
    assert guard.coast() is None
    gait.coast = lambda: with_target(2, math.nan)(20_000_000)  # type: ignore[attr-defined]
    answer = guard.coast()
    assert answer is not None
    assert answer.held
    np.testing.assert_array_equal(answer.targets.position, GOOD)
    gait.coast = lambda: raising(0)  # type: ignore[attr-defined]
    answer = guard.coast()
    assert answer is not None
    assert "Gait.coast raised ZeroDivisionError" in str(answer.fault)
