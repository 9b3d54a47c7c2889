"""The collector stays off the tick, and still collects."""

import gc
from collections.abc import Iterator

import pytest

from nao_lipm_gait.runtime.garbage import RESTING, WALKING, GarbageKeeper


@pytest.fixture
def keeper() -> Iterator[GarbageKeeper]:
    keeper = GarbageKeeper()
    gc.collect()
    yield keeper
    keeper.close()
    assert gc.isenabled()


class Knot:
    def __init__(self) -> None:
        self.me = self


def test_nothing_is_collected_between_two_ticks(keeper: GarbageKeeper) -> None:
    assert not gc.isenabled()
    keeper.after_tick(resting=False)
    before = sum(each["collections"] for each in gc.get_stats())
    kept = [Knot() for _ in range(RESTING // 2)]
    keeper.after_tick(resting=False)
    assert sum(each["collections"] for each in gc.get_stats()) == before
    assert keeper.collections == 0
    assert kept


def test_a_resting_gait_collects_everything(keeper: GarbageKeeper) -> None:
    for _ in range(2 * RESTING):
        Knot()
    keeper.after_tick(resting=True)
    assert keeper.collections == 1
    assert gc.collect() == 0, "nothing was left"


def test_a_walking_gait_collects_before_it_is_too_much(keeper: GarbageKeeper) -> None:
    for _ in range(10):
        for _ in range(WALKING // 4):
            Knot()
        keeper.after_tick(resting=False)
    assert 1 <= keeper.collections <= 5
    assert gc.get_count()[0] <= WALKING + WALKING // 4
