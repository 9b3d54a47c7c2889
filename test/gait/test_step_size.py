"""Step sizes: the steady walk has the commanded velocity, within the step limits."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from nao_lipm_gait.parameters import GaitParameters
from nao_lipm_gait.walks.lipm.steady_walk import (
    Pace,
    double_step_duration,
    limit_share,
    passing_speed,
    stride_for,
)
from nao_lipm_gait.walks.pendulum import advance, half_step_duration, natural_frequency
from nao_lipm_gait.walks.steps import (
    SIDE_RATE,
    STEP_IN_PLACE,
    Stride,
    approach,
    asked_stride,
    ellipsoid_share,
    exchange_distances,
    within_limits,
)
from robot_core.geometry import compose
from robot_core.types import LEFT, RIGHT, VelocityCommand

P = GaitParameters()


def zmp_stride(command: VelocityCommand, double_step: float, p: GaitParameters = P) -> Stride:
    asked = asked_stride(command, double_step, p)
    return within_limits(asked, ellipsoid_share(asked, p))


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_both_feet_together_make_the_commanded_velocity(sign: float) -> None:
    command = VelocityCommand(0.05 * sign, 0.03 * sign, 0.0)
    stride = stride_for(command, P)
    steps = [stride.of_step(side, P) for side in (LEFT, RIGHT)]
    duration = double_step_duration(abs(stride.y), P)
    total = [sum(values) / duration for values in zip(*steps, strict=True)]
    assert total == pytest.approx([command.x, command.y, command.yaw], rel=1e-3)


@pytest.mark.parametrize("yaw", [0.5, -0.5])
def test_the_steps_of_a_curve_follow_its_arc(yaw: float) -> None:
    stride = stride_for(VelocityCommand(0.1, 0.0, yaw), P)
    pose = (0.0, 0.0, 0.0)
    for step in range(20):
        pose = compose(pose, stride.of_step(LEFT if step % 2 else RIGHT, P))
    turn = 10.0 * stride.yaw
    radius = 2.0 * stride.x / stride.yaw
    arc = (radius * math.sin(turn), radius * (1.0 - math.cos(turn)), turn)
    assert pose == pytest.approx(arc, rel=0.02, abs=0.001)


@pytest.mark.parametrize("side", [0.02, 0.06, 0.1])
def test_a_diagonal_walk_passes_both_origins_with_the_same_speed(side: float) -> None:
    stride = Stride(0.05, side, 0.0)
    k = natural_frequency(P.pendulum_height)
    speed = k * passing_speed(stride, P)
    for leg, distance in zip((LEFT, RIGHT), exchange_distances(side, P), strict=True):
        # from the turning point to the exchange on this side, and as far again on the next one
        time = half_step_duration(P.pendulum_width, distance, k)
        ahead, _ = advance(0.0, speed, k, time)
        assert stride.of_step(leg, P)[0] == pytest.approx(2.0 * ahead, abs=1e-12)


def test_the_foot_on_the_side_of_the_motion_leads() -> None:
    stride = Stride(0.0, 0.04, 0.3)
    uneven = P.replace(step_side_share=0.9, step_turn_share=0.7)
    assert stride.of_step(LEFT, uneven)[1] > stride.of_step(RIGHT, uneven)[1]
    assert stride.of_step(LEFT, uneven)[2] > stride.of_step(RIGHT, uneven)[2]
    mirrored = Stride(0.0, -0.04, -0.3)
    left = stride.of_step(LEFT, uneven)
    assert mirrored.of_step(RIGHT, uneven) == pytest.approx((left[0], -left[1], -left[2]))


@given(st.floats(-2, 2), st.floats(-2, 2), st.floats(-8, 8))
def test_never_beyond_the_limits_and_never_another_direction(
    x: float, y: float, yaw: float
) -> None:
    stride = stride_for(VelocityCommand(x, y, yaw), P)
    limit = P.step_forward_max if x >= 0 else P.step_backward_max
    parts = (stride.x / limit, stride.y / P.step_side_max, stride.yaw / P.step_turn_max)
    assert math.hypot(*parts) <= 1.0 + 1e-9
    assert stride.x * x >= 0
    assert stride.y * y >= 0
    assert stride.yaw * yaw >= 0


def test_a_curve_bears_less_than_a_diagonal() -> None:
    x, y, yaw = 0.5 * P.step_forward_max, 0.5 * P.step_side_max, 0.5 * P.step_turn_max
    curve, diagonal = Stride(x, 0.0, yaw), Stride(x, y, 0.0)
    around_ahead, around_behind = Stride(0.0, y, -yaw), Stride(0.0, y, yaw)
    shares = [limit_share(each, P) for each in (around_behind, diagonal, around_ahead, curve)]
    assert shares == sorted(shares)
    assert shares[2] == pytest.approx(1.0)
    assert limit_share(Stride(-0.5 * P.step_backward_max, y, 0.0), P) == pytest.approx(shares[3])


@given(st.floats(-0.1, 0.1), st.floats(-0.1, 0.1), st.floats(-1.0, 1.0))
def test_the_limits_are_the_same_to_both_sides(x: float, y: float, yaw: float) -> None:
    assert limit_share(Stride(x, y, yaw), P) == limit_share(Stride(x, -y, -yaw), P)


def test_a_closed_axis_stays_closed() -> None:
    closed = P.replace(step_side_max=0.0)
    assert stride_for(VelocityCommand(0.1, 0.5, 0.0), closed).y == 0.0


@pytest.mark.parametrize("closed", ["step_forward_max", "step_side_max", "step_turn_max"])
def test_a_closed_axis_does_not_close_the_others(closed: str) -> None:
    """The heading hold may command a turn that is not allowed: the robot walks on."""
    command = VelocityCommand(0.1, 0.05, 0.2)
    stride = stride_for(command, P.replace(**{closed: 0.0}))
    names = ("step_forward_max", "step_side_max", "step_turn_max")
    for name, value in zip(names, stride, strict=True):
        assert (value == 0.0) == (name == closed)
    walked = zmp_stride(command, 0.5, P.replace(**{closed: 0.0}))
    assert [v == 0.0 for v in walked] == [name == closed for name in names]


@given(st.floats(0.02, 0.6), st.floats(0.02, 0.6), st.floats(-1.0, 1.0))
def test_a_command_beyond_the_limits_keeps_its_direction(
    x: float, y: float, yaw: float
) -> None:
    stride = stride_for(VelocityCommand(x, y, yaw), P)
    assert 2.0 * stride.x / stride.y == pytest.approx(x / y)
    assert stride.yaw / stride.y == pytest.approx(yaw / y)
    assert limit_share(stride, P) <= 1.0 + 1e-9


def test_the_limits_of_the_second_paper_form_an_ellipsoid() -> None:
    stride = zmp_stride(VelocityCommand(0.2, 0.0, 0.0), 0.7)
    assert stride == Stride(pytest.approx(0.07), 0.0, 0.0)
    fast = zmp_stride(VelocityCommand(9.0, 9.0, 9.0), 0.7)
    limits = P.step_forward_max, P.step_side_max, P.step_turn_max
    assert math.hypot(*(v / limit for v, limit in zip(fast, limits, strict=True))) == (
        pytest.approx(1.0)
    )
    back = zmp_stride(VelocityCommand(-9.0), 0.7)
    assert back.x == pytest.approx(-P.step_backward_max)


def test_changes_are_rate_limited() -> None:
    stride = approach(STEP_IN_PLACE, Stride(0.09, -0.06, 0.5), P)
    assert stride == Stride(P.step_forward_rate, -SIDE_RATE, P.step_turn_rate)


def test_steps_are_smaller_if_they_are_shorter_in_time() -> None:
    pace = Pace()
    stride = stride_for(VelocityCommand(0.1, 0.02, 0.2), P)
    nominal = double_step_duration(abs(stride.y), P)
    for _ in range(60):
        pace.add(0.45 * nominal, stride, P)
    assert pace.share == pytest.approx(0.9, abs=1e-3)
    faster = stride_for(VelocityCommand(0.1, 0.0, 0.2), P, pace.share)
    plain = stride_for(VelocityCommand(0.1, 0.0, 0.2), P)
    assert faster.x == pytest.approx(0.9 * plain.x, rel=2e-3)
    assert faster.yaw == pytest.approx(0.9 * plain.yaw, rel=2e-3)
    for _ in range(60):
        pace.add(5.0, stride, P)
    assert pace.share == pytest.approx(Pace.LIMITS[1], abs=1e-3)


@pytest.mark.parametrize("extensions", [True, False])
def test_a_tiny_limit_is_a_limit(extensions: bool) -> None:
    """The powers of the shares of the limits stay finite."""
    narrow = P.replace(step_turn_max=1e-300, step_side_max=5e-324, extensions=extensions)
    stride = stride_for(VelocityCommand(0.1, 0.1, 0.2), narrow)
    assert abs(stride.yaw) < 1e-70
    assert abs(stride.y) < 1e-70
