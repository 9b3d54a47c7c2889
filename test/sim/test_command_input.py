"""The simulated robot takes commands of one gait at a time."""

import math

import pytest

from nao_lipm_gait.errors import NaoGaitError
from nao_lipm_gait.robot import load_robot
from sim_bridge.command_input import TAKE_OVER, CommandInput

ROBOT = load_robot()
MS = 1_000_000


def obeyed(
    ear: CommandInput, sender: str, now: float, stamp: int = 1, angle: float = 0.0
) -> bool:
    """Whether the robot takes a command of this sender; of a head that shall look to `angle`."""
    ear.admit(sender, now)
    return ear.read(sender, now, stamp, ["HeadYaw"], [angle], [])[0] is not None


def test_the_robot_obeys_one_gait_until_it_is_silent() -> None:
    ear = CommandInput(ROBOT)
    obeyed(ear, "first", 0.0)
    for now in (0.05, 0.1, 0.15):
        with pytest.raises(NaoGaitError, match=r"frame_id: got 'second'.*obeys 'first'"):
            obeyed(ear, "second", now)
        obeyed(ear, "first", now)
    obeyed(ear, "second", 0.16 + TAKE_OVER)
    with pytest.raises(NaoGaitError, match="obeys 'second'"):
        obeyed(ear, "first", 0.4)


def test_who_sends_nothing_but_nonsense_does_not_command() -> None:
    ear = CommandInput(ROBOT)
    for now in (0.0, 0.05, 0.1):
        with pytest.raises(NaoGaitError, match="position"):
            obeyed(ear, "garbage", now, angle=math.nan)
    assert obeyed(ear, "gait", 0.11)
    with pytest.raises(NaoGaitError, match="obeys 'gait'"):
        obeyed(ear, "garbage", 0.12)


def test_answers_to_what_was_before_a_reset_do_not_count() -> None:
    ear = CommandInput(ROBOT)
    ear.reset(500 * MS)
    assert not obeyed(ear, "gait", 0.0, 490 * MS)
    assert not obeyed(ear, "gait", 0.0, 500 * MS), "without a delay, of the old world too"
    assert obeyed(ear, "gait", 0.0, 510 * MS)
