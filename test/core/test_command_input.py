"""Joint commands and pushes on their way to the simulated robot. No ROS, no physics."""

import math

import numpy as np
import pytest

from robot_core.command_input import TAKE_OVER, CommandInput, read_push
from robot_core.errors import NaoGaitError
from robot_core.robot import load_robot
from robot_core.types import JointTargets

ROBOT = load_robot()
NAMES = list(ROBOT.joint_names)
POSE = ROBOT.stand_pose.tolist()
MS = 1_000_000


def read(
    commands: CommandInput,
    names: list[str],
    position: list[float],
    effort: list[float] | None = None,
    stamp: int = 5,
) -> tuple[JointTargets, str | None]:
    """The targets and the warning of a command that must be accepted."""
    targets, warning = commands.read("gait", 0.0, stamp, names, position, effort or [])
    assert targets is not None
    return targets, warning


def send(
    commands: CommandInput, sender: str, now: float, stamp: int = 5, angle: float = 0.0
) -> bool:
    """Whether the head's target of this sender is taken at `now` [s]."""
    commands.admit(sender, now)
    return commands.read(sender, now, stamp, ["HeadYaw"], [angle], [])[0] is not None


def test_joints_come_in_any_order() -> None:
    wanted = np.clip(ROBOT.stand_pose + 0.05, ROBOT.lower, ROBOT.upper)
    names, position = NAMES[::-1], wanted[::-1].tolist()
    targets, warning = read(CommandInput(ROBOT), names, position)
    np.testing.assert_array_equal(targets.position, wanted)
    assert (targets.stamp, targets.stiffness, warning) == (5, 1.0, None)


def test_unnamed_joints_keep_their_targets() -> None:
    commands = CommandInput(ROBOT)
    first, _ = read(commands, ["HeadYaw"], [0.3])
    targets, _ = read(commands, ["HeadPitch"], [0.2])
    expected = ROBOT.stand_pose.copy()
    expected[[ROBOT.index("HeadYaw"), ROBOT.index("HeadPitch")]] = 0.3, 0.2
    np.testing.assert_array_equal(targets.position, expected)
    assert first.position[ROBOT.index("HeadPitch")] == POSE[ROBOT.index("HeadPitch")]


def test_stiffness_is_per_joint_where_it_differs() -> None:
    commands = CommandInput(ROBOT)
    targets, _ = read(commands, ["HeadYaw", "HeadPitch"], [0.0, 0.0], [1.0, 0.25])
    assert targets.stiffness == 0.25
    assert targets.joint_stiffness is not None
    assert targets.joint_stiffness[ROBOT.index("HeadYaw")] == 1.0
    assert targets.joint_stiffness[ROBOT.index("HeadPitch")] == 0.25
    targets, _ = read(commands, NAMES, POSE, [0.5] * len(NAMES))
    assert (targets.stiffness, targets.joint_stiffness) == (0.5, None)


def test_target_outside_its_limits_is_accepted_with_a_warning() -> None:
    _, warning = read(CommandInput(ROBOT), ["HeadYaw", "LKneePitch"], [0.0, 50.0])
    assert warning is not None
    assert warning.startswith("joint_command position[LKneePitch]: got 50; allowed:")


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
def test_bad_command_is_refused_and_changes_nothing(
    names: list[str], position: list[float], effort: list[float], message: str
) -> None:
    commands = CommandInput(ROBOT)
    read(commands, ["HeadYaw"], [0.3], [0.5])
    with pytest.raises(NaoGaitError, match=message):
        read(commands, names, position, effort)
    targets, _ = read(commands, ["HeadPitch"], [0.0], [0.5])
    assert targets.position[ROBOT.index("HeadYaw")] == 0.3


def test_reset_restores_the_stand_and_ignores_answers_to_earlier_sensors() -> None:
    commands = CommandInput(ROBOT)
    read(commands, ["HeadYaw"], [0.3], [0.0])
    commands.reset(500 * MS)
    assert not send(commands, "gait", 0.0, 490 * MS)
    assert not send(commands, "gait", 0.0, 500 * MS)
    targets, _ = read(commands, ["HeadPitch"], [0.0], stamp=510 * MS)
    assert targets.stiffness == 1.0
    assert targets.position[ROBOT.index("HeadYaw")] == POSE[ROBOT.index("HeadYaw")]


def test_one_gait_is_in_control_until_it_is_silent() -> None:
    commands = CommandInput(ROBOT)
    for now in (0.0, 0.05, 0.1, 0.15):
        assert send(commands, "first", now)
        with pytest.raises(NaoGaitError, match=r"frame_id: got 'second'.*'first' is in control"):
            send(commands, "second", now)
    assert send(commands, "second", 0.16 + TAKE_OVER)
    with pytest.raises(NaoGaitError, match="'second' is in control"):
        send(commands, "first", 0.17 + TAKE_OVER)


def test_control_can_be_released_while_time_stands_still() -> None:
    commands = CommandInput(ROBOT)
    assert send(commands, "first", 1.0)
    commands.release()
    assert send(commands, "second", 1.0)
    with pytest.raises(NaoGaitError, match="'second' is in control"):
        send(commands, "first", 1.0)


def test_sender_of_unusable_commands_gets_no_control() -> None:
    commands = CommandInput(ROBOT)
    with pytest.raises(NaoGaitError, match="position"):
        send(commands, "garbage", 0.0, angle=math.nan)
    assert send(commands, "gait", 0.01)
    with pytest.raises(NaoGaitError, match="'gait' is in control"):
        send(commands, "garbage", 0.02)


def test_push_is_a_force_in_the_world() -> None:
    np.testing.assert_array_equal(
        read_push((1.0, -2.0, 3.0), (0.0, 0.0, 0.0), "world"), (1.0, -2.0, 3.0)
    )


@pytest.mark.parametrize(
    ("force", "torque", "frame", "message"),
    [
        ((math.nan, 0.0, 0.0), (0.0, 0.0, 0.0), "", r"push wrench\.force\.x: got nan"),
        ((0.0, 0.0, 1e9), (0.0, 0.0, 0.0), "", r"push wrench\.force\.z: got"),
        ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), "", r"push wrench\.torque"),
        ((1.0, 0.0, 0.0), (0.0, 0.0, 0.0), "torso", r"push header\.frame_id: got 'torso'"),
    ],
)
def test_bad_push_is_refused(
    force: tuple[float, ...], torque: tuple[float, ...], frame: str, message: str
) -> None:
    with pytest.raises(NaoGaitError, match=message):
        read_push(force, torque, frame)
