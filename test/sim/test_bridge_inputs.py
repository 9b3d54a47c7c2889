"""Commands and pushes to the simulated robot, and its pacing. No ROS, no physics."""

import math

import numpy as np
import pytest

from nao_lipm_gait.errors import NaoGaitError
from nao_lipm_gait.robot import load_robot
from sim_bridge.command_input import CommandReader, read_push
from sim_bridge.ros.pacing import BACKLOG, Pacer

ROBOT = load_robot()
NAMES = list(ROBOT.joint_names)
POSE = ROBOT.stand_pose.tolist()
MS = 1_000_000


def test_whole_command_in_any_order():
    command = CommandReader(ROBOT)
    wanted = np.clip(ROBOT.stand_pose + 0.05, ROBOT.lower, ROBOT.upper)
    order = list(reversed(range(len(NAMES))))
    targets, remark = command.read(
        5, [NAMES[i] for i in order], [float(wanted[i]) for i in order], []
    )
    np.testing.assert_array_equal(targets.position, wanted)
    assert (targets.stamp, targets.stiffness, remark) == (5, 1.0, None)


def test_joints_that_are_not_named_keep_their_targets():
    command = CommandReader(ROBOT)
    command.read(0, ["HeadYaw"], [0.3], [])
    targets, _ = command.read(0, ["HeadPitch"], [0.2], [])
    assert targets.position[ROBOT.index("HeadYaw")] == 0.3
    assert targets.position[ROBOT.index("HeadPitch")] == 0.2
    rest = [i for i, name in enumerate(NAMES) if not name.startswith("Head")]
    np.testing.assert_array_equal(targets.position[rest], ROBOT.stand_pose[rest])


def test_earlier_targets_are_not_changed_by_later_commands():
    command = CommandReader(ROBOT)
    first, _ = command.read(0, ["HeadYaw"], [0.3], [])
    command.read(0, ["HeadYaw"], [0.1], [])
    assert first.position[ROBOT.index("HeadYaw")] == 0.3


def test_smallest_share_of_torque_counts():
    command = CommandReader(ROBOT)
    targets, _ = command.read(0, ["HeadYaw", "HeadPitch"], [0.0, 0.0], [1.0, 0.25])
    assert targets.stiffness == 0.25


def test_target_beyond_a_limit_is_cut_and_told():
    targets, remark = CommandReader(ROBOT).read(0, ["LKneePitch"], [50.0], [])
    knee = ROBOT.index("LKneePitch")
    assert targets.position[knee] == ROBOT.upper[knee]
    assert remark is not None
    assert "LKneePitch" in remark
    assert "50" in remark


@pytest.mark.parametrize(
    ("names", "position", "effort", "message"),
    [
        (NAMES, POSE[:-1], [], r"position: got '21 values'; allowed: 22"),
        (NAMES, POSE, [1.0], r"effort: got '1 values'"),
        (["Tail"], [0.0], [], r"name: got 'Tail'; allowed: joints of"),
        (["HeadYaw", "HeadYaw"], [0.0, 0.0], [], r"HeadYaw more than once"),
        ([], [], [], r"name: got 'no joints'"),
        (["HeadYaw"], [math.nan], [], r"position\[HeadYaw\]: got nan"),
        (["HeadYaw"], [-math.inf], [], r"position\[HeadYaw\]: got -inf"),
        (["HeadYaw"], [0.0], [1.5], r"effort\[HeadYaw\]: got 1.5"),
        (["HeadYaw"], [0.0], [math.nan], r"effort\[HeadYaw\]: got nan"),
    ],
)
def test_bad_command_is_refused_and_changes_nothing(names, position, effort, message):
    command = CommandReader(ROBOT)
    command.read(0, ["HeadYaw"], [0.3], [0.5])
    with pytest.raises(NaoGaitError, match=message):
        command.read(0, names, position, effort)
    targets, _ = command.read(0, ["HeadPitch"], [0.0], [0.5])
    assert targets.position[ROBOT.index("HeadYaw")] == 0.3


def test_reset_goes_back_to_the_stand():
    command = CommandReader(ROBOT)
    command.read(0, ["HeadYaw"], [0.3], [0.0])
    command.reset()
    targets, _ = command.read(0, ["HeadYaw"], [0.0], [])
    assert targets.stiffness == 1.0
    assert targets.position[ROBOT.index("HeadYaw")] == 0.0


def test_push_is_a_force_in_the_world():
    np.testing.assert_array_equal(
        read_push((1.0, -2.0, 3.0), (0.0, 0.0, 0.0), "world"), (1.0, -2.0, 3.0)
    )


@pytest.mark.parametrize(
    ("force", "torque", "frame", "message"),
    [
        ((math.nan, 0, 0), (0, 0, 0), "", r"push wrench\.force\.x: got nan"),
        ((0, 0, 1e9), (0, 0, 0), "", r"push wrench\.force\.z: got"),
        ((1, 0, 0), (0, 1.0, 0), "", r"push wrench\.torque"),
        ((1, 0, 0), (0, 0, 0), "torso", r"push header\.frame_id: got 'torso'"),
    ],
)
def test_bad_push_is_refused(force, torque, frame, message):
    with pytest.raises(NaoGaitError, match=message):
        read_push(force, torque, frame)


class WallClock:
    def __init__(self) -> None:
        self.now = 0

    def __call__(self) -> int:
        return self.now


def test_pacing_does_not_drift():
    clock = WallClock()
    pacer = Pacer(10 * MS, 3.0, clock)  # 3.33.. ms of wall time per step: no whole number
    for _ in range(300_000):
        clock.now += max(0, round(pacer.wait() * 1e9))
        pacer.stepped()
    assert clock.now == pytest.approx(1000e9, abs=10 * MS)
    assert pacer.lost == 0


def test_small_backlog_is_made_up():
    clock = WallClock()
    pacer = Pacer(10 * MS, 1.0, clock)
    clock.now += 100 * MS
    behind = 0
    while pacer.wait() <= 0.0:
        pacer.stepped()
        behind += 1
    assert behind == 11
    assert pacer.lost == 0


def test_large_backlog_is_let_go():
    clock = WallClock()
    pacer = Pacer(10 * MS, 1.0, clock)
    clock.now += 5_000 * MS
    steps = 0
    while pacer.wait() <= 0.0:
        pacer.stepped()
        steps += 1
    assert steps <= BACKLOG * 100 + 2
    assert pacer.lost == pytest.approx(5e9 - BACKLOG * 1e9, abs=20 * MS)


def test_factor_zero_never_waits():
    pacer = Pacer(10 * MS, 0.0, WallClock())
    for _ in range(10):
        assert pacer.wait() <= 0.0
        pacer.stepped()
    assert pacer.lost == 0
