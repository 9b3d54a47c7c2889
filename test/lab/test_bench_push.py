"""The suite `push`: what survival means, which phases are pushed, and that pushes push."""

import dataclasses
import math
from typing import Any

import numpy as np
import pytest
from test_metrics import LEFT, walk

from gait_lab.analysis.metrics import Metrics
from gait_lab.bench import BenchOptions, push_search, running
from gait_lab.bench.push_cells import DIRECTIONS, Cell, Kind, cycle_after, push_task, survives
from gait_lab.bench.push_search import LADDER
from gait_lab.bench.suites import push
from gait_lab.trials.rollout import RolloutResult, RolloutSpec
from gait_lab.trials.tasks import find_task
from gait_lab.trials.trial import Push
from nao_lipm_gait.errors import NaoGaitError
from nao_lipm_gait.parameters import load_preset

TINY = BenchOptions(
    robots=1, seed=-1, engine="mujoco", parameters=load_preset("default"), tasks=("spot",),
    directions=("left", "right"), phases=2, open_loop="off", jobs=1, show=False,
)  # fmt: skip


def metrics(**changes: Any) -> Metrics:
    values: dict[str, Any] = {field.name: 0.0 for field in dataclasses.fields(Metrics)}
    values |= {"fell": False, "fall_time": None, "alarm_time": None, "support_changes": 9}
    return Metrics(**{**values, **changes})


def values(options: BenchOptions) -> dict[str, float | None]:
    return {row.metric: row.value for row in push.push(options).rows}


@pytest.fixture(scope="module")
def pushed() -> dict[str, float | None]:
    pytest.importorskip("mujoco")
    return values(dataclasses.replace(TINY, impulses=(0.0, 0.5, 20.0)))


def test_who_is_not_pushed_walks_on_and_nobody_stands_twenty_newton_seconds(
    pushed: dict[str, float | None],
) -> None:
    for side in TINY.directions:
        assert pushed[f"push_spot_{side}_0_survival"] == 100.0
        assert pushed[f"push_spot_{side}_20_survival"] == 0.0
        assert pushed[f"push_spot_{side}_20_fell"] == TINY.phases
        assert pushed[f"push_spot_{side}_max"] in (0.0, 0.5)
    assert pushed["push_spot_falls"] >= 2 * TINY.phases  # type: ignore[operator]


def test_who_feels_a_push_by_the_accelerometer_stands_more() -> None:
    pytest.importorskip("mujoco")

    def survival(push_acceleration: bool) -> float | None:
        parameters = TINY.parameters.replace(push_acceleration=push_acceleration)
        options = dataclasses.replace(
            TINY, seed=0, phases=8, directions=("right",), impulses=(2.0,), parameters=parameters
        )
        return values(options)["push_spot_right_2_survival"]

    assert survival(True) == 100.0
    # In the phase in which the foot is about to land, the positions speak too late.
    assert survival(False) < 100.0


def test_the_nominal_robot_is_as_strong_on_the_left_as_on_the_right(
    pushed: dict[str, float | None],
) -> None:
    left, right = (pushed[f"push_spot_{side}_0.5_survival"] for side in TINY.directions)
    assert left == right == 100.0


def test_the_same_seed_gives_the_same_rows(pushed: dict[str, float | None]) -> None:
    assert values(dataclasses.replace(TINY, impulses=(0.0, 0.5, 20.0))) == pushed


def test_a_push_points_where_the_robot_looks() -> None:
    left = Push(1.0, 2.0, math.radians(DIRECTIONS["left"]))
    assert left.force(0.0) == pytest.approx((0.0, 20.0, 0.0))
    assert left.force(math.radians(90.0)) == pytest.approx((-20.0, 0.0, 0.0))
    ahead = Push(1.0, 2.0, math.radians(DIRECTIONS["forward"]))
    assert ahead.force(math.radians(180.0)) == pytest.approx((-20.0, 0.0, 0.0))


def test_the_phases_cover_one_cycle_of_two_steps() -> None:
    support = np.where(np.arange(1000) // 20 % 2, LEFT, 2)
    begin, end = cycle_after(walk(support=support), 3.5)  # type: ignore[misc]
    assert end - begin == pytest.approx(0.4)
    assert 3.5 <= begin < 3.9
    assert cycle_after(walk(), 3.5) is None


SPOT, FORWARD = push_task("spot"), push_task("forward=20")


@pytest.mark.parametrize(
    ("task", "change", "lives"),
    [
        (SPOT, {}, True),
        (SPOT, {"fell": True, "fall_time": 4.0}, False),
        (SPOT, {"speed_x": 0.05}, True),
        (SPOT, {"speed_x": 0.05, "speed_y": -0.05}, False),
        (SPOT, {"turn_rate": 0.5}, False),
        (SPOT, {"support_changes": 0}, False),
        (push_task("stand"), {"support_changes": 0}, True),
        (FORWARD, {"speed_x": 0.15}, True),
        (FORWARD, {"speed_x": 0.1}, False),
        (FORWARD, {"speed_x": -0.2}, False),
    ],
)
def test_survival_is_walking_on_as_asked(task: Any, change: dict[str, Any], lives: bool) -> None:
    alone = metrics(speed_x=0.2 if task is FORWARD else 0.0)
    result = RolloutResult(RolloutSpec(task), metrics(**change))
    assert survives(result, alone) == lives


def test_the_search_finds_the_edge_of_each_direction(monkeypatch: pytest.MonkeyPatch) -> None:
    edges = {"left": 1.0, "forward": 3.5, "back": 0.5}
    calls = []

    def push_all(wanted: Any, options: BenchOptions, *_: object) -> None:
        calls.append(1)
        for kind, direction, impulse in wanted:
            kind.cells[direction, impulse] = Cell(int(impulse <= edges[direction]), 1)

    monkeypatch.setattr(push_search, "push_all", push_all)
    kind = Kind("spot", find_task("spot"), True)
    push_search.search_largest([kind], list(edges), TINY)
    assert kind.largest("left") == 1.0
    assert kind.largest("forward") == LADDER[-1] == 3.5
    assert kind.largest("back") is None
    assert len(calls) <= 4
    texts = [push._largest_text(kind, direction) for direction in edges]
    assert texts == ["1", ">= 3.5", "< 0.75"]


def test_the_later_robots_are_spared_where_the_first_ones_are_lost(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    pushed = []

    def push_all(wanted: Any, options: BenchOptions, robots: slice) -> None:
        count = len(options.seeds[robots]) * options.phases
        for kind, direction, impulse in wanted:
            cell = kind.cells.setdefault((direction, impulse), Cell())
            cell.pushed += count
            cell.survived += count if direction == "left" else count - 2
            pushed.append((direction, count))

    monkeypatch.setattr(push_search, "push_all", push_all)
    kind = Kind("spot", find_task("spot"), True)
    options = dataclasses.replace(TINY, robots=8, phases=2)
    push_search.push_until_lost([(kind, "left", 1.0), (kind, "right", 1.0)], options)
    assert pushed == [("left", 4), ("right", 4), ("left", 12)]
    assert kind.cells["left", 1.0].passes
    assert not kind.cells["left", 1.0].given_up
    assert kind.cells["right", 1.0].given_up
    assert not kind.cells["right", 1.0].passes
    names = {row.metric for row in push._rows(kind, ["left", "right"])}
    assert "push_spot_left_1_survival" in names
    assert "push_spot_right_1_survival" not in names


@pytest.mark.parametrize(
    ("asked", "field"),
    [({"directions": ("up",)}, "direction"), ({"tasks": ("spot", "spot")}, "task"),
     ({"tasks": ("hop",)}, "task"), ({"impulses": (-1.0,)}, "impulse")],
)  # fmt: skip
def test_what_cannot_be_pushed_is_one_clear_error(asked: dict[str, Any], field: str) -> None:
    with pytest.raises(NaoGaitError) as caught:
        running.run("push", {"engine": "mujoco", "show": False, **asked}, out=lambda _: None)
    assert caught.value.field == field
