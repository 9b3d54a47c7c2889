"""A robot that is lifted holds its stand in the air and walks on when it is put down."""


import numpy as np
import pytest

from obedient_robot import PARAMETERS, ObedientRobot
from robot_core.robot import load_robot
from robot_core.types import FALLEN, LIFTED, STAND, WALK, VelocityCommand

FORWARD = VelocityCommand(0.1, 0.0, 0.0)


def in_hands(nao: ObedientRobot, seconds: float) -> None:
    for _ in range(round(100 * seconds)):
        nao.tick(FORWARD, nao.frame()._replace(lifted=True))


def walking() -> ObedientRobot:
    nao = ObedientRobot(load_robot())
    nao.run(2.0)
    assert nao.states(2.0, FORWARD)[-1] is WALK
    return nao


def test_it_takes_no_steps_in_the_air_and_walks_on_afterwards() -> None:
    stands = ObedientRobot(load_robot())
    stands.run(2.0)
    nao = walking()
    in_hands(nao, 1.5)
    assert nao.gait.state is LIFTED
    assert nao.gait.status.step_count == 0
    assert nao.joints == pytest.approx(stands.joints, abs=0.02)
    before = nao.gait.status.base_footprint_in_odom
    in_hands(nao, 1.0)
    assert nao.gait.status.base_footprint_in_odom == pytest.approx(before)
    assert nao.states(3.0, FORWARD) == [STAND, WALK]


def test_its_targets_do_not_jump() -> None:
    nao = walking()
    limit = 0.01 * np.array(nao.gait.robot.velocity_limit)
    last = nao.joints
    for lifted in [True] * 150 + [False] * 150:
        targets = nao.tick(FORWARD, nao.frame()._replace(lifted=lifted)).position
        assert nao.gait.state is WALK or (np.abs(targets - last) <= limit + 1e-9).all()
        last = targets
    assert nao.gait.state is WALK


def test_hands_may_turn_it_fast_but_not_lay_it_down() -> None:
    nao = walking()
    in_hands(nao, 0.5)
    nao.rate = (0.0, 6.0, 0.0)
    in_hands(nao, 0.05)  # 0.3 rad, and three times the limit of a walk's rate
    assert nao.gait.state is LIFTED
    in_hands(nao, 0.1)
    assert nao.gait.state is FALLEN


def test_a_motion_that_waits_for_the_stand_is_dropped() -> None:
    nao = ObedientRobot(load_robot(), PARAMETERS)
    nao.run(2.0)
    nao.run(2.0, FORWARD)
    nao.gait.request_motion("sit")
    in_hands(nao, 0.5)
    assert not nao.gait.motion_waits
