"""Control periods without a frame: the walk goes on as if the frame had arrived."""

import numpy as np
import pytest

from nao_lipm_gait.gait import Gait
from obedient_robot import PARAMETERS, PERIOD, ObedientRobot
from robot_core.types import FloatArray, GaitState, JointTargets, VelocityCommand
from sim_bridge.trials.trial import loaded_robot

FORWARD = VelocityCommand(0.15, 0.02, 0.1)
OPEN_LOOP = PARAMETERS.replace(feedback=False)
"""Without feedback the targets do not depend on the frames at all."""


def walking(parameters=OPEN_LOOP) -> ObedientRobot:
    nao = ObedientRobot(loaded_robot("nao_h21_v33"), parameters)
    nao.run(1.0)
    nao.run(1.0, FORWARD)
    assert nao.gait.state is GaitState.WALK
    return nao


def coast(nao: ObedientRobot) -> JointTargets:
    """A control period without a frame; the robot follows the targets that come nevertheless."""
    targets = nao.gait.coast()
    assert targets is not None
    assert targets.stamp == nao.stamp
    nao.stamp += PERIOD
    nao.shown = [*nao.shown[1:], targets.position]
    return targets


@pytest.mark.parametrize("lost", [{3}, {3, 4}, {5, 6, 7}, {2, 9, 11, 12, 30}])
def test_lost_frames_leave_no_trace_in_the_targets(lost: set[int]) -> None:
    complete, nao = walking(), walking()
    for tick in range(80):
        wanted = complete.tick(FORWARD)
        targets = coast(nao) if tick in lost else nao.tick(FORWARD)
        assert targets.stamp == wanted.stamp
        np.testing.assert_allclose(targets.position, wanted.position, atol=1e-12)


@pytest.mark.parametrize("periods", [1, 2, 3])
def test_late_frames_leave_no_trace_in_the_targets(periods: int) -> None:
    """Frames that come `periods` later from now on, which the gait is told by `late`."""
    complete, nao = walking(), walking()
    wanted: list[FloatArray] = [complete.tick(FORWARD).position for _ in range(60)]
    for tick in range(60):
        if tick < periods:
            targets = coast(nao)
        else:
            frame = nao.frame()._replace(stamp=nao.stamp - periods * PERIOD, late=periods)
            targets = nao.gait.step(frame, FORWARD)
            nao.stamp += PERIOD
        np.testing.assert_allclose(targets.position, wanted[tick], atol=1e-12)


def test_with_feedback_a_lost_frame_changes_the_targets_little() -> None:
    complete, nao = walking(PARAMETERS), walking(PARAMETERS)
    for tick in range(100):
        wanted = complete.tick(FORWARD)
        targets = coast(nao) if tick % 7 == 3 else nao.tick(FORWARD)
        np.testing.assert_allclose(targets.position, wanted.position, atol=0.01)


def test_a_robot_that_stands_waits_for_its_sensors() -> None:
    nao = ObedientRobot(loaded_robot("nao_h21_v33"))
    assert nao.gait.coast() is None
    nao.run(1.5)
    assert nao.gait.state is GaitState.STAND
    assert nao.gait.coast() is None


def test_before_the_first_frame_there_is_nothing_to_go_on_from() -> None:
    assert Gait(loaded_robot("nao_h21_v33"), PARAMETERS).coast() is None
