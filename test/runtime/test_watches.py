"""Hot motors, a robot that is lifted, and missing sensors."""

import numpy as np
import pytest

from nao_lipm_gait.runtime.diagnostics import Diagnostics
from nao_lipm_gait.runtime.watches import (
    GROUND_TIME,
    LIFT_TIME,
    LIGHT_TIME,
    LOAD_AGE,
    HeatWatch,
    LiftWatch,
    SoleLoads,
)
from robot_core.robot import RobotDescription, load_robot
from robot_core.types import GRAVITY, VelocityCommand

MS = 1_000_000
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
        assert not watch.update(0.0, down=False)
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
        found.append(watch.update(0.0, down=False))
    leg = "RKneePitch at 78 deg C"
    assert found == ["", leg, "", "", "", leg]


def test_a_leg_that_gets_too_hot_is_remembered_until_the_robot_can_sit_down(
    robot: RobotDescription,
) -> None:
    watch = HeatWatch(robot, Diagnostics(lambda: 0.0), 1.0)
    for degrees in (79.0, 88.0):
        watch.receive("RKneePitch", degrees, 0.0)
        assert not watch.update(0.0, down=True)
    assert watch.update(0.0, down=False) == "RKneePitch at 88 deg C"
    for degrees in (60.0, 79.0, 60.0):
        watch.receive("RKneePitch", degrees, 0.0)
    assert not watch.update(0.0, down=False), "it has cooled down before the robot could sit down"


def test_an_arm_does_not_make_it_sit(robot: RobotDescription) -> None:
    watch = HeatWatch(robot, Diagnostics(lambda: 0.0), 1.0)
    watch.receive("LElbowRoll", 95.0, 0.0)
    watch.receive("LWristYaw", 95.0, 0.0)  # a motor that the gait does not have
    assert not watch.update(0.0, down=False)


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
    for tick in range(1, 1000):
        watch.update(100.0 + 0.01 * tick, down=False)
        assert watch.hot
    diagnostics.take_log()
    for _ in range(3):
        watch.update(110.0, down=False)
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
    watch.update(new + 9.9, down=False)
    assert watch.hot
    watch.update(new + 10.0, down=False)
    assert not watch.hot


def test_a_robot_without_temperatures_lacks_none(robot: RobotDescription) -> None:
    diagnostics = Diagnostics(lambda: 0.0)
    watch = HeatWatch(robot, diagnostics, 1.0)
    watch.update(1e3, down=False)
    watch.restart(0.0)
    watch.update(1e3, down=False)
    assert not diagnostics.take_log()


# -- lifted ----------------------------------------------------------------------------------------

PERIOD = 10_000_000
HALF = 24.0
"""[N] Half the weight of a robot of 5 kg."""


class Watched:
    """A robot of 5 kg whose loads and specific force the test sets."""

    def __init__(self) -> None:
        self.loads = SoleLoads(5.0)
        self.watch = LiftWatch(self.loads)
        self.stamp = 0

    def lifted(
        self, nanoseconds: int, left: float | None, right: float, force: float = GRAVITY
    ) -> list[bool]:
        """What is found in each tick of a time [ns]; None = no message of that sole."""
        found = []
        for _ in range(nanoseconds // PERIOD):
            self.stamp += PERIOD
            if left is not None:
                self.loads.add(0, self.stamp, left)
            self.loads.add(1, self.stamp, right)
            found.append(self.watch.update(self.stamp, np.array((0.0, 0.0, force))))
        return found

    def walk(self) -> None:
        """Two steps, with a flight of 50 ms before each."""
        for left, right in ((2 * HALF, 0.0), (0.0, 2 * HALF)):
            assert not any(self.lifted(50_000_000, 0.0, 0.0))
            assert not any(self.lifted(200_000_000, left, right))


def test_a_robot_in_hands_is_lifted_until_both_soles_carry_it() -> None:
    robot = Watched()
    robot.walk()
    found = robot.lifted(2 * LIFT_TIME, 0.0, 0.0)
    assert not any(found[: LIFT_TIME // PERIOD])
    assert all(found[LIFT_TIME // PERIOD + 2 :])
    assert all(robot.lifted(2 * GROUND_TIME, 2 * HALF, 0.0)), "one sole on a table is not enough"
    assert robot.lifted(GROUND_TIME // 2, HALF, HALF)[-1]
    assert not robot.lifted(GROUND_TIME, HALF, HALF)[-1]


def test_a_robot_in_free_fall_is_not_in_hands() -> None:
    robot = Watched()
    robot.walk()
    assert not any(robot.lifted(3 * LIFT_TIME, 0.0, 0.0, force=1.0))
    assert robot.lifted(2 * LIFT_TIME, 0.0, 0.0)[-1]


def test_a_sole_that_never_carried_the_robot_has_no_sensors() -> None:
    robot = Watched()
    robot.lifted(PERIOD, 0.0, 2 * HALF)
    assert not any(robot.lifted(3 * LIFT_TIME, 0.0, 0.0))


def test_without_messages_nobody_is_lifted() -> None:
    robot = Watched()
    robot.walk()
    assert robot.lifted(2 * LIFT_TIME, 0.0, 0.0)[-1]
    assert not robot.lifted(LOAD_AGE + PERIOD, None, 0.0)[-1]


def test_a_clock_that_was_set_back_begins_anew() -> None:
    robot = Watched()
    robot.stamp = 10**12
    robot.walk()
    robot.lifted(2 * LIFT_TIME, 0.0, 0.0, force=1.0)
    robot.stamp = 0
    robot.watch.restart()
    robot.walk()
    assert robot.lifted(2 * LIFT_TIME, 0.0, 0.0)[-1]


def test_soles_that_carry_nothing_for_a_while_mean_a_fall() -> None:
    loads = SoleLoads(mass=5.0)
    assert loads.light_time(0) == 0, "no load is known"

    def add(ms: int, left: float, right: float) -> bool:
        loads.add(0, ms * MS, left)
        loads.add(1, ms * MS, right)
        return loads.light_time(ms * MS) >= LIGHT_TIME

    assert not any(add(ms, 25.0, 24.0) for ms in range(0, 200, 10))
    assert not any(add(ms, 0.0, 0.0) for ms in range(200, 250, 10)), "in the air between two steps"
    assert not add(250, 49.0, 0.0)
    assert [add(ms, 3.0, 2.0) for ms in range(260, 380, 10)].count(True) == 2
    assert loads.light_time(2_000 * MS) == 0, "old loads say nothing"
