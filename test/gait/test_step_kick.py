"""Kicks in the walk: which ball lies on the way of a foot, and how far the foot swings."""

import math

import pytest

from nao_lipm_gait.walks.base import BodyTargets, SoleTarget
from nao_lipm_gait.whole_body.step_kick import BALL, LONGER, StepKick
from robot_core.types import LEFT, RIGHT, Pose2

FOOT = ((0.1, 0.03), (0.1, -0.03), (-0.06, -0.03), (-0.06, 0.03))
SPACING, STEP, REACH = 0.12, 0.25, 0.08


def swing(x: float, radius: float = BALL, reach: float = REACH) -> float:
    """How far [m] the left foot swings beyond its way to a ball x [m] before it."""
    return max(sole.x for sole in way(x, radius, reach))


def way(
    x: float, radius: float = BALL, reach: float = REACH, lift: float = 0.0, low: float = 0.0
) -> list[SoleTarget]:
    """The left sole in the step to a ball x [m] before it; the walk has it `low` [m] high."""
    kick = StepKick(FOOT)
    kick.ask((x, 0.5 * SPACING, 0.0), radius)
    kick.begin_step(LEFT, (0.0, 0.0, 0.0), SPACING, reach, lift)
    left, right = (SoleTarget(0.0, 0.5 * side * SPACING, low, 0.0) for side in (1, -1))
    body = BodyTargets((0.0, 0.0, 0.26), left, right, 0.0, (0.0, 0.0, 0.0))
    ticks = 25
    return [
        kick.apply(body, RIGHT, STEP * (1 - n / ticks), STEP / ticks).left_sole
        for n in range(1, ticks)
    ]


def test_a_larger_ball_lies_farther_ahead() -> None:
    near, far = 0.1 + BALL, 0.1 + 0.11
    assert swing(near) == pytest.approx(REACH, rel=0.1)
    assert swing(far + 0.07) == 0.0
    assert swing(far + 0.07, radius=0.11) == pytest.approx(REACH, rel=0.1)
    assert swing(near, radius=0.11) == 0.0  # it would lie inside the foot


def test_it_swings_by_its_reach() -> None:
    x = 0.1 + BALL
    assert swing(x, reach=0.5 * REACH) == pytest.approx(0.5 * swing(x))
    assert swing(x, reach=0.0) == 0.0


def test_the_foot_is_back_a_fifth_of_the_step_before_it_lands() -> None:
    late = way(0.1 + BALL)[20:]  # a robot's joints follow by so much later
    assert [sole.x for sole in late] == [0.0] * len(late)


def test_the_step_of_a_kick_is_longer() -> None:
    straight, aside = 0.5 * SPACING, math.pi / 2.0
    assert longer((0.1 + BALL, straight, 0.0)) == pytest.approx(LONGER * REACH)
    assert longer((0.0, straight + 0.03 + BALL, aside)) == pytest.approx(0.0)
    assert longer((0.3 + BALL, straight, 0.0)) == 0.0  # nothing to kick


def longer(ball: Pose2) -> float:
    """By how much [m] the step of the left foot to a ball gets longer."""
    kick = StepKick(FOOT)
    kick.ask(ball, BALL)
    return kick.begin_step(LEFT, (0.0, 0.0, 0.0), SPACING, REACH, 0.0)


def test_a_foot_that_kicks_is_lifted_as_usual() -> None:
    x, low, lift = 0.1 + BALL, 0.015, 0.03
    heights = [sole.z for sole in way(x, lift=lift, low=low)]
    assert max(heights) == pytest.approx(lift, rel=0.05)
    assert min(heights) == low
    assert {sole.z for sole in way(x + 0.3, lift=lift, low=low)} == {low}  # nothing to kick
    assert {sole.z for sole in way(x, lift=low, low=lift)} == {lift}  # never lower than the walk
