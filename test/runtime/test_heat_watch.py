"""What the gait does about hot motors."""

import pytest

from nao_lipm_gait.runtime.diagnostics import Diagnostics
from nao_lipm_gait.runtime.heat_watch import HeatWatch
from robot_core.robot import RobotDescription, load_robot
from robot_core.types import VelocityCommand

FORWARD = VelocityCommand(0.3, 0.1, 0.5)


@pytest.fixture
def robot() -> RobotDescription:
    return load_robot("nao_v6")


def test_a_hot_motor_is_reported_and_cools_down_with_hysteresis(robot: RobotDescription) -> None:
    diagnostics = Diagnostics(lambda: 0.0)
    watch = HeatWatch(robot, diagnostics, 1.0)
    for degrees, hot in ((69.0, False), (70.0, True), (66.0, True), (64.0, False), (69.0, False)):
        watch.receive("LElbowRoll", degrees, 0.0)
        assert watch.hot is hot
        assert not watch.leg_too_hot
    lines = [line.text for line in diagnostics.take_log()]
    assert lines == ["LElbowRoll is hot: 70 deg C", "the motors have cooled down"]


def test_the_walk_is_slower_only_if_asked(robot: RobotDescription) -> None:
    for slower in (1.0, 0.5):
        watch = HeatWatch(robot, Diagnostics(lambda: 0.0), slower)
        assert watch.limited(FORWARD) is FORWARD
        watch.receive("LKneePitch", 75.0, 0.0)
        assert watch.limited(FORWARD) == tuple(slower * each for each in FORWARD)


def test_a_leg_makes_it_sit_once_until_it_has_cooled_down(robot: RobotDescription) -> None:
    watch = HeatWatch(robot, Diagnostics(lambda: 0.0), 1.0)
    course = (77.0, 78.0, 79.0, 70.0, 64.0, 78.0)
    found = []
    for degrees in course:
        watch.receive("RKneePitch", degrees, 0.0)
        found.append(watch.leg_too_hot)
        if watch.leg_too_hot:
            assert watch.take_leg() == f"RKneePitch at {degrees:.0f} deg C"
    assert found == [False, True, False, False, False, True]


def test_a_leg_that_gets_too_hot_is_remembered_until_the_robot_can_sit_down(
    robot: RobotDescription,
) -> None:
    watch = HeatWatch(robot, Diagnostics(lambda: 0.0), 1.0)
    for degrees in (79.0, 88.0):
        watch.receive("RKneePitch", degrees, 0.0)
        assert watch.leg_too_hot
    watch.receive("RKneePitch", 60.0, 0.0)
    assert not watch.leg_too_hot


def test_an_arm_does_not_make_it_sit(robot: RobotDescription) -> None:
    watch = HeatWatch(robot, Diagnostics(lambda: 0.0), 1.0)
    watch.receive("LElbowRoll", 95.0, 0.0)
    watch.receive("LWristYaw", 95.0, 0.0)  # a motor that the gait does not have
    assert not watch.leg_too_hot


def test_old_temperatures_are_forgotten(robot: RobotDescription) -> None:
    watch = HeatWatch(robot, Diagnostics(lambda: 0.0), 1.0)
    watch.receive("LElbowRoll", 75.0, 0.0)
    watch.receive("LKneePitch", 40.0, 20.0)
    assert not watch.hot


def test_a_temperature_that_is_heard_once_is_forgotten_and_that_is_said(
    robot: RobotDescription,
) -> None:
    diagnostics = Diagnostics(lambda: 0.0)
    watch = HeatWatch(robot, diagnostics, 0.5)
    watch.receive("LKneePitch", 79.0, 100.0)
    assert watch.leg_too_hot
    for tick in range(1, 1000):
        watch.update(100.0 + 0.01 * tick)
        assert watch.hot
    diagnostics.take_log()
    for _ in range(3):
        watch.update(110.0)
        assert watch.limited(FORWARD) is FORWARD
    lines = [line.text for line in diagnostics.take_log()]
    assert lines == [
        "no temperature of a motor for 10 s: it is not known whether one is hot",
        "the last temperature, of a hot motor, is too old",
    ]
    watch.receive("LKneePitch", 60.0, 130.0)
    assert [line.text for line in diagnostics.take_log()] == [
        "temperatures of the motors arrive again"
    ]


@pytest.mark.parametrize("new", [5.0, 1e6])
def test_another_clock_neither_keeps_nor_drops_a_temperature(
    robot: RobotDescription, new: float
) -> None:
    watch = HeatWatch(robot, Diagnostics(lambda: 0.0), 1.0)
    watch.receive("LElbowRoll", 75.0, 1000.0)
    watch.restart(new)
    watch.update(new + 9.9)
    assert watch.hot
    watch.update(new + 10.0)
    assert not watch.hot


def test_a_robot_without_temperatures_lacks_none(robot: RobotDescription) -> None:
    diagnostics = Diagnostics(lambda: 0.0)
    watch = HeatWatch(robot, diagnostics, 1.0)
    watch.update(1e3)
    watch.restart(0.0)
    watch.update(1e3)
    assert not diagnostics.take_log()
