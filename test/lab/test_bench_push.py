"""The suite `push`: what survival means, which phases are pushed, and that pushes push."""

import math
from typing import Any

import numpy as np
import pytest
from scores import metrics, options, values

from gait_lab.bench import pushes
from gait_lab.bench.options import Options
from gait_lab.bench.pushes import (
    DIRECTIONS,
    LADDER,
    Cell,
    PushSeries,
    cycle_after,
    impulse_step,
    survives,
)
from gait_lab.bench.registry import plan
from gait_lab.bench.suites.push import push
from made_walk import LEFT, walk
from nao_lipm_gait.parameters import load_preset
from robot_core.errors import NaoGaitError
from sim_bridge.trials.rollout import RolloutResult, RolloutSpec
from sim_bridge.trials.trial import Push

TINY = options(
    "push", robots=1, seed=-1, tasks=("spot",), directions=("left", "right"), phases=2,
    open_loop="off",
).but(parameters=load_preset("default"))  # fmt: skip


def pushed_values(asked: Options) -> dict[str, float | None]:
    """The measurements of the suite with these options."""
    return values(push.measure(asked))


@pytest.fixture(scope="module")
def pushed() -> dict[str, float | None]:
    pytest.importorskip("mujoco")
    return pushed_values(TINY.but(impulses=(0.0, 0.5, 20.0)))


@pytest.mark.xdist_group("pushed")
def test_no_push_is_survived_by_all_and_twenty_newton_seconds_by_none(
    pushed: dict[str, float | None],
) -> None:
    for side in TINY.directions:
        assert pushed[f"push_spot_{side}_0_survival"] == 100.0
        assert pushed[f"push_spot_{side}_20_survival"] == 0.0
        assert pushed[f"push_spot_{side}_20_fell"] == TINY.phases
        assert pushed[f"push_spot_{side}_max"] in (0.0, 0.5)
    assert pushed["push_spot_falls"] >= 2 * TINY.phases  # type: ignore[operator]


def test_push_detection_saves_robots() -> None:
    pytest.importorskip("mujoco")

    def survival(push_velocity: float) -> float | None:
        parameters = TINY.parameters.replace(push_velocity=push_velocity)
        asked = TINY.but(
            seed=0, phases=4, directions=("right",), impulses=(2.0,), parameters=parameters
        )
        return pushed_values(asked)["push_spot_right_2_survival"]

    assert survival(TINY.parameters.push_velocity) == 100.0
    assert survival(0.0) < 100.0


@pytest.mark.xdist_group("pushed")
def test_the_nominal_robot_is_as_strong_on_the_left_as_on_the_right(
    pushed: dict[str, float | None],
) -> None:
    left, right = (pushed[f"push_spot_{side}_0.5_survival"] for side in TINY.directions)
    assert left == right == 100.0


def test_a_push_points_where_the_robot_looks() -> None:
    left = Push(1.0, 2.0, math.radians(DIRECTIONS["left"]))
    assert left.force(0.0) == pytest.approx((0.0, 20.0, 0.0))
    assert left.force(math.radians(90.0)) == pytest.approx((-20.0, 0.0, 0.0))
    ahead = Push(1.0, 2.0, math.radians(DIRECTIONS["forward"]))
    assert ahead.force(math.radians(180.0)) == pytest.approx((-20.0, 0.0, 0.0))


@pytest.mark.parametrize("step", [20, 40])
@pytest.mark.parametrize("after", [3.5, 3.7])
def test_the_phases_cover_one_cycle_of_two_steps(step: int, after: float) -> None:
    support = np.where(np.arange(1000) // step % 2, LEFT, 2)
    begin, end = cycle_after(walk(support=support), after)  # type: ignore[misc]
    assert end - begin == pytest.approx(0.02 * step)
    assert after <= begin < after + 0.02 * step
    assert cycle_after(walk(), 3.5) is None


SPOT, FORWARD = PushSeries("spot").task, PushSeries("forward=20").task


@pytest.mark.parametrize(
    ("task", "change", "lives"),
    [
        (SPOT, {}, True),
        (SPOT, {"fell": True, "fall_time": 4.0}, False),
        (SPOT, {"speed_x": 0.05}, True),
        (SPOT, {"speed_x": 0.05, "speed_y": -0.05}, False),
        (SPOT, {"turn_rate": 0.5}, False),
        (SPOT, {"support_changes": 0}, False),
        (PushSeries("stand").task, {"support_changes": 0}, True),
        (FORWARD, {"speed_x": 0.15}, True),
        (FORWARD, {"speed_x": 0.1}, False),
        (FORWARD, {"speed_x": -0.2}, False),
    ],
)
def test_survival_is_walking_on_as_before(task: Any, change: dict[str, Any], lives: bool) -> None:
    alone = metrics(speed_x=0.2 if task is FORWARD else 0.0)
    pushed = metrics(**{"support_changes": 9, **change})
    result = RolloutResult(RolloutSpec(task), pushed)
    assert survives(result, alone) == lives


def test_heavy_robots_get_larger_pushes_and_tall_ones_more_room() -> None:
    assert impulse_step("nao_h21_v33") == 0.25
    assert 6.0 < impulse_step("booster_t1") / 0.25 < 7.0  # 31.6 and 4.9 kg
    drifts = metrics(support_changes=9, speed_x=0.08)  # T1 is 2.2 times as tall
    for robot, lives in (("nao_h21_v33", False), ("booster_t1", True)):
        result = RolloutResult(RolloutSpec(SPOT, urdf=robot), drifts)
        assert survives(result, metrics()) == lives


def test_the_search_finds_the_edge_of_each_direction(monkeypatch: pytest.MonkeyPatch) -> None:
    edges = {"left": 1.0, "forward": 3.5, "back": 0.5}
    calls = []

    def push_all(wanted: Any, options: Options, *_: object) -> None:
        calls.append(1)
        for each, direction, impulse in wanted:
            each.cells[direction, impulse] = Cell(int(impulse <= edges[direction]), 1)

    monkeypatch.setattr(pushes, "push_all", push_all)
    series = PushSeries("spot")
    ladder = [impulse_step("nao_h21_v33") * each for each in LADDER]
    pushes.search_largest([series], list(edges), TINY, ladder)
    assert series.largest("left") == 1.0
    assert series.largest("forward") == ladder[-1] == 3.5
    assert series.largest("back") is None
    assert len(calls) <= 4


def test_the_later_robots_are_not_pushed_where_the_first_ones_failed(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    pushed = []

    def push_all(wanted: Any, options: Options, robots: slice) -> None:
        count = len(options.seeds[robots]) * options.phases
        for each, direction, impulse in wanted:
            cell = each.cells.setdefault((direction, impulse), Cell())
            cell.pushed += count
            cell.survived += count if direction == "left" else count - 2
            pushed.append((direction, count))

    monkeypatch.setattr(pushes, "push_all", push_all)
    series = PushSeries("spot")
    asked = TINY.but(robots=8, phases=2)
    wanted = [(series, "left", 1.0), (series, "right", 1.0)]
    pushes.push_until_lost(wanted, asked)
    assert pushed == [("left", 4), ("right", 4), ("left", 12)]
    assert series.cells["left", 1.0].passes
    assert not series.cells["left", 1.0].given_up
    assert series.cells["right", 1.0].given_up
    assert not series.cells["right", 1.0].passes


@pytest.mark.parametrize(
    ("asked", "field"),
    [({"directions": ("up",)}, "direction"), ({"tasks": ("spot", "spot")}, "task"),
     ({"tasks": ("hop",)}, "task"), ({"impulses": (-1.0,)}, "impulse")],
)  # fmt: skip
def test_what_cannot_be_pushed_is_refused(asked: dict[str, Any], field: str) -> None:
    with pytest.raises(NaoGaitError) as caught:
        plan("push", asked)
    assert caught.value.field == field
