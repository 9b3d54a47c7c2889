"""Catching steps out of a stand: when they begin, and that they save the robot."""

import math

import pytest

from gait_lab.trials.rollout import RolloutSpec, rollout
from gait_lab.trials.tasks import STAND_TIME, find_task
from gait_lab.trials.trial import Push
from nao_lipm_gait.estimation.tipping import Tipping
from nao_lipm_gait.parameters import GaitParameters

K, DT = 6.4, 0.01


def test_what_stands_still_beside_the_middle_does_not_tip() -> None:
    tipping = Tipping()
    assert all(
        tipping.update((0.03, -0.02, 0.24), K, 0.05, DT) is None for _ in range(1000)
    )


def test_a_fast_com_tips_before_it_is_far() -> None:
    tipping = Tipping()
    tipping.update((0.01, 0.0, 0.24), K, 0.05, DT)
    for tick in range(1, 100):
        found = tipping.update((0.01 + 0.5 * tick * DT, 0.0, 0.24), K, 0.05, DT)
        if found is not None:
            break
    assert found is not None
    assert 0.0 < found[0] < 0.03
    x, y, vx, vy = found
    assert x + vx / K > 0.05
    assert (y, vy) == (0.0, 0.0)
    tipping.forget()
    assert tipping.update((0.2, 0.0, 0.24), K, 0.05, DT) is None


@pytest.mark.parametrize("catch", [True, False])
@pytest.mark.parametrize("direction", [0.0, math.pi])
def test_steps_save_a_pushed_stand(direction: float, catch: bool) -> None:
    pytest.importorskip("mujoco")
    parameters = GaitParameters() if catch else GaitParameters(stand_catch=0.0)
    spec = RolloutSpec(
        find_task("stand").lasting(5.0), robot_seed=20, parameters=parameters, engine="mujoco",
        push=Push(STAND_TIME + 1.0, 2.2, direction),
    )  # fmt: skip
    metrics = rollout(spec).metrics
    assert metrics.fell != catch
    assert (metrics.support_changes > 0) == catch


@pytest.mark.parametrize("plant", ["reference", "worn"])
def test_an_undisturbed_stand_stays_one(plant: str) -> None:
    pytest.importorskip("mujoco")
    spec = RolloutSpec(
        find_task("stand").lasting(10.0), robot_seed=21, plant=plant, engine="mujoco"
    )
    metrics = rollout(spec).metrics
    assert not metrics.fell
    assert metrics.support_changes == 0
