"""Yaw of a robot that falls, lies, rolls over and gets up, against rotation matrices."""

import math
from collections.abc import Iterable

import numpy as np
import pytest

from nao_lipm_gait.estimation.yaw_off_feet import RATE_MAX, YawOffFeet
from robot_core.geometry import as_point
from robot_core.types import FloatArray

DT = 0.01
Turn = tuple[tuple[float, float, float], float]
"""Axis in the torso frame and angle [rad]."""

FORWARD_FALL: Turn = ((0.0, 1.0, 0.0), math.pi / 2)
BACKWARD_RISE: Turn = ((0.0, 1.0, 0.0), math.pi / 2)
ROLL_OVER: Turn = ((0.0, 0.0, 1.0), math.pi)


def about(axis: tuple[float, float, float], angle: float) -> FloatArray:
    x, y, z = axis
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    turned: FloatArray = (
        np.eye(3) + math.sin(angle) * cross + (1.0 - math.cos(angle)) * cross @ cross
    )
    return turned


def turned(turns: Iterable[Turn], seconds: float = 0.6) -> float:
    """Sum of what the estimator returns over turns one after the other."""
    yaw, torso_in_world, estimator = 0.0, np.eye(3), YawOffFeet()
    estimator.update((0.0, 0.0, 1.0), (0.0, 0.0, 0.0), DT)
    for axis, angle in turns:
        ticks = round(seconds / DT)
        for _ in range(ticks):
            torso_in_world = torso_in_world @ about(axis, angle / ticks)
            rate = as_point(np.array(axis) * angle / seconds)
            change = estimator.update(as_point(torso_in_world[2]), rate, DT)
            assert abs(change) <= RATE_MAX * DT + 1e-12, "odom is continuous"
            yaw += change
    return yaw


def test_falling_and_rising_the_same_way_keeps_the_heading() -> None:
    back = (FORWARD_FALL[0], -FORWARD_FALL[1])
    assert turned([FORWARD_FALL, back]) == pytest.approx(0.0, abs=0.01)


def test_who_falls_on_the_front_rolls_over_and_sits_up_faces_the_other_way() -> None:
    yaw = turned([FORWARD_FALL, ROLL_OVER, BACKWARD_RISE])
    assert math.remainder(yaw - math.pi, math.tau) == pytest.approx(0.0, abs=0.02)


@pytest.mark.parametrize("angle", [0.7, -2.0])
def test_a_lying_robot_that_is_turned_knows_it_on_its_feet(angle: float) -> None:
    on_the_floor = ((-1.0, 0.0, 0.0), angle)  # the x axis points down
    back = (FORWARD_FALL[0], -FORWARD_FALL[1])
    assert turned([FORWARD_FALL, on_the_floor, back]) == pytest.approx(angle, abs=0.02)


def test_it_begins_anew_after_an_interruption() -> None:
    estimator = YawOffFeet()
    for _ in range(10):
        estimator.update((0.0, 0.0, 1.0), (0.0, 0.0, 1.0), DT)
    estimator.interrupt()
    assert estimator.update((0.0, 0.0, 1.0), (0.0, 0.0, 1.0), DT) == 0.0
    assert estimator.update((0.0, 0.0, 1.0), (0.0, 0.0, 1.0), DT) == pytest.approx(DT, rel=1e-3)
