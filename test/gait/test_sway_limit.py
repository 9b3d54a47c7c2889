"""Strides become shorter while the walk sways."""

import math

import pytest

from nao_lipm_gait.parameters import GaitParameters
from nao_lipm_gait.walks.lipm.extensions.sway_limit import (
    CALM_TIME,
    RECOVERY_TIME,
    SHARE_MIN,
    START_TIME,
    SwayLimit,
)
from nao_lipm_gait.walks.lipm.walk import LipmWalk
from robot_core.types import VelocityCommand

DT = 0.01
LIMIT = 0.002
FAST = VelocityCommand(0.4, 0.0, 0.0)


def swaying(
    limit: SwayLimit, deviation: float, seconds: float, offset: float = 0.0, forward: float = 1.0
) -> None:
    """A sway of 2.5 Hz, as that of the steps; its standard deviation and its mean [m]."""
    limit.watch(forward)
    for tick in range(round(seconds / DT)):
        swing = math.sqrt(2.0) * deviation * math.sin(math.tau * 2.5 * tick * DT)
        limit.update(offset + swing, DT)


@pytest.mark.parametrize("offset", [0.0, 0.01])
def test_a_calm_walk_may_use_all(offset: float) -> None:
    limit = SwayLimit(LIMIT)
    swaying(limit, 0.7 * LIMIT, 5.0, offset)
    assert limit.share == 1.0


def test_more_sway_leaves_less_and_never_nothing() -> None:
    shares = []
    for factor in (1.3, 1.6, 5.0):
        limit = SwayLimit(LIMIT)
        swaying(limit, factor * LIMIT, 4.0)
        shares.append(limit.share)
    assert 1.0 > shares[0] > shares[1] > shares[2] == SHARE_MIN


@pytest.mark.parametrize("sway", [0.0, 0.5, 0.9])
def test_it_is_taken_back_the_sooner_the_calmer_the_walk_is(sway: float) -> None:
    limit = SwayLimit(LIMIT)
    swaying(limit, 5.0 * LIMIT, 4.0)
    limit.begin()
    swaying(limit, sway * LIMIT, START_TIME - 2 * DT, forward=SHARE_MIN)
    before = limit.share
    swaying(limit, sway * LIMIT, 2.0, forward=SHARE_MIN)
    rate = 1.0 / RECOVERY_TIME + (1.0 - sway) / CALM_TIME
    assert limit.share - before == pytest.approx(2.0 * rate, abs=0.01)


def test_the_first_steps_do_not_count() -> None:
    limit = SwayLimit(LIMIT)
    swaying(limit, 5.0 * LIMIT, START_TIME - 2 * DT)
    assert limit.share == 1.0


def test_the_sway_of_steps_that_are_short_forward_does_not_count() -> None:
    limit = SwayLimit(LIMIT)
    swaying(limit, 5.0 * LIMIT, 4.0, forward=0.0)
    assert limit.share == 1.0
    swaying(limit, 5.0 * LIMIT, START_TIME - 2 * DT)  # nor do the first long ones after them
    assert limit.share == 1.0
    swaying(limit, 5.0 * LIMIT, 1.0)
    assert limit.share < 1.0


def test_a_share_is_taken_back_while_strides_are_short() -> None:
    limit = SwayLimit(LIMIT)
    swaying(limit, 5.0 * LIMIT, 4.0)
    swaying(limit, 5.0 * LIMIT, 4.0, forward=0.0)
    assert limit.share == pytest.approx(SHARE_MIN + 4.0 / RECOVERY_TIME, abs=0.01)


def test_strides_that_were_shortened_most_are_still_watched() -> None:
    limit = SwayLimit(LIMIT)
    swaying(limit, 5.0 * LIMIT, 4.0)
    swaying(limit, 5.0 * LIMIT, 4.0, forward=SHARE_MIN)
    assert limit.share == SHARE_MIN


def test_off_is_off() -> None:
    limit = SwayLimit(0.0)
    swaying(limit, 0.1, 4.0)
    assert limit.share == 1.0


def test_another_limit_keeps_what_was_found_and_none_ends_it() -> None:
    limit = SwayLimit(LIMIT)
    swaying(limit, 5.0 * LIMIT, 4.0)
    limit.set_limit(2.0 * LIMIT)
    assert limit.share == SHARE_MIN
    limit.set_limit(0.0)
    assert limit.share == 1.0


def walked(sway: float, command: VelocityCommand) -> LipmWalk:
    walk = LipmWalk(GaitParameters(), DT)
    walk.start(command)
    for tick in range(800):
        x, y = walk.expect().com_in_q
        walk.observe(x, y + sway * math.sin(math.tau * 1.25 * tick * DT))
        walk.plan(command)
    return walk


def test_a_walk_that_sways_takes_shorter_steps() -> None:
    calm, swayed = walked(0.0, FAST), walked(0.008, FAST)
    assert swayed.reserve == 0.0 < calm.reserve
    assert abs(swayed.step_size[0]) < 0.8 * abs(calm.step_size[0])


def test_steps_to_the_side_and_turns_are_not_limited() -> None:
    for command in (VelocityCommand(0.0, 0.2, 0.0), VelocityCommand(0.0, 0.0, 1.5)):
        assert walked(0.008, command).reserve < walked(0.0, command).reserve + 0.05


def test_a_walk_that_swayed_to_the_side_walks_fast_forward_afterwards() -> None:
    def forward_after(sway: float) -> float:
        walk = LipmWalk(GaitParameters(), DT)
        walk.start(VelocityCommand(0.0, 0.2, 0.0))
        for tick in range(1200):
            x, y = walk.expect().com_in_q
            beside = tick < 600
            walk.observe(x, y + (sway * math.sin(math.tau * 1.25 * tick * DT) if beside else 0.0))
            walk.plan(VelocityCommand(0.0, 0.2, 0.0) if beside else FAST)
        return walk.step_size[0]

    assert forward_after(0.008) == pytest.approx(forward_after(0.0), rel=0.02)
