"""Kicks in the walk: which ball lies on the way of a foot, and how far the foot swings."""

import pytest

from nao_lipm_gait.walks.base import BodyTargets, SoleTarget
from nao_lipm_gait.whole_body.step_kick import BALL, ENOUGH, HELD, REACH, StepKick
from robot_core.types import LEFT, RIGHT

FOOT = ((0.1, 0.03), (0.1, -0.03), (-0.06, -0.03), (-0.06, 0.03))
SPACING, STEP = 0.12, 0.25


def swing(x: float, radius: float = BALL, torque: float = ENOUGH) -> float:
    """How far [m] the left foot swings beyond its way to a ball x [m] before it."""
    kick = StepKick(FOOT, torque)
    kick.ask((x, 0.5 * SPACING, 0.0), radius)
    kick.begin_step(LEFT, (0.0, 0.0, 0.0), SPACING)
    left, right = (SoleTarget(0.0, 0.5 * side * SPACING, 0.0, 0.0) for side in (1, -1))
    body = BodyTargets((0.0, 0.0, 0.26), left, right, 0.0, 0.0, (0.0, 0.0, 0.0))
    ticks = 25
    return max(
        kick.apply(body, RIGHT, STEP * (1 - n / ticks), STEP / ticks).left_sole.x
        for n in range(1, ticks)
    )


def test_a_larger_ball_lies_farther_ahead() -> None:
    near, far = 0.1 + BALL, 0.1 + 0.11
    assert swing(near) == pytest.approx(REACH, rel=0.1)
    assert swing(far + 0.07) == 0.0
    assert swing(far + 0.07, radius=0.11) == pytest.approx(REACH, rel=0.1)
    assert swing(near, radius=0.11) == 0.0  # it would lie inside the foot


def test_weak_hips_swing_less_far() -> None:
    x = 0.1 + BALL
    assert swing(x, torque=2.0 * ENOUGH) == swing(x)
    assert swing(x, torque=0.5 * (HELD + ENOUGH)) == pytest.approx(0.5 * swing(x))
    assert swing(x, torque=0.5 * HELD) == 0.0
