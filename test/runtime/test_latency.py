"""The first tick is warm, and garbage is collected between the ticks."""

import gc
import weakref
from collections.abc import Iterator

import pytest

from nao_lipm_gait.gait import Gait
from nao_lipm_gait.parameters import GaitParameters
from nao_lipm_gait.runtime.controller import ControllerSettings
from nao_lipm_gait.runtime.latency import (
    COLLECT_RESTING,
    COLLECT_WALKING,
    GarbageScheduler,
    warm_up,
)
from robot_core.robot import RobotDescription
from robot_core.types import GaitState, JointTargets


@pytest.fixture
def keeper() -> Iterator[GarbageScheduler]:
    keeper = GarbageScheduler()
    gc.collect()
    yield keeper
    keeper.close()
    assert gc.isenabled()


class Knot:
    def __init__(self) -> None:
        self.me = self


def test_nothing_is_collected_between_two_ticks(keeper: GarbageScheduler) -> None:
    assert not gc.isenabled()
    keeper.after_tick(resting=False)
    before = sum(each["collections"] for each in gc.get_stats())
    kept = [Knot() for _ in range(COLLECT_RESTING // 2)]
    keeper.after_tick(resting=False)
    assert sum(each["collections"] for each in gc.get_stats()) == before
    assert keeper.collections == 0
    assert kept


def test_a_resting_gait_collects_everything(keeper: GarbageScheduler) -> None:
    knots = [weakref.ref(Knot()) for _ in range(2 * COLLECT_RESTING)]
    assert all(knot() for knot in knots)
    keeper.after_tick(resting=True)
    assert keeper.collections == 1
    assert not any(knot() for knot in knots)


def test_a_walking_gait_collects_before_it_is_too_much(keeper: GarbageScheduler) -> None:
    for _ in range(10):
        for _ in range(COLLECT_WALKING // 4):
            Knot()
        keeper.after_tick(resting=False)
    assert 1 <= keeper.collections <= 5
    assert gc.get_count()[0] <= COLLECT_WALKING + COLLECT_WALKING // 4


def test_the_warm_up_stands_and_walks(
    robot: RobotDescription, monkeypatch: pytest.MonkeyPatch
) -> None:
    step = Gait.step
    states = []

    def counted(gait: Gait, *arguments: object) -> JointTargets:
        targets = step(gait, *arguments)  # type: ignore[arg-type]
        states.append(gait.state)
        return targets

    monkeypatch.setattr(Gait, "step", counted)
    warm_up(robot, GaitParameters(), ControllerSettings())
    assert states[0] is GaitState.STAND
    assert states[-1] is GaitState.WALK
    assert len(states) > 50
