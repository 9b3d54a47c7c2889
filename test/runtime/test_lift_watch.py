"""A robot that something else than its soles carries has been lifted."""

import numpy as np

from nao_lipm_gait.runtime.lift_watch import GROUND_TIME, LIFT_TIME, LiftWatch
from nao_lipm_gait.runtime.sole_loads import LOAD_AGE, SoleLoads
from robot_core.types import GRAVITY

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
