"""The suite `plant`: one option at a time, and what breaks the walk is named."""

import dataclasses
import math
from typing import Any

import attrs
import pytest
from scores import metrics, values

from gait_lab import cli
from gait_lab.bench import BenchOptions, SuiteResult, score, suite
from gait_lab.bench.suites import plant
from gait_lab.bench.suites.plant import INGREDIENTS, Ingredient
from robot_core.errors import NaoGaitError
from sim_bridge.plant import Plant, load_plant, with_options
from sim_bridge.trials.metrics import Metrics
from sim_bridge.trials.rollout import RolloutResult, RolloutSpec, rollout
from sim_bridge.trials.tasks import find_task, walk

OPTIONS = plant.Options(
    robots=2, engine="mujoco", tasks=("forward", "back"), window=5.0, jobs=1, show=False,
    ingredients=("stiffness", "play_deg"), open_loop="beside",
)  # fmt: skip
FORWARD = 100.0 * find_task("forward").asked
"""Speed [cm/s] of a robot that walks as fast as it is asked."""


def metrics_of(spec: RolloutSpec) -> Metrics:
    """A robot that is slow on soft servos, and falls forward on softer ones without feedback."""
    stiffness = dict(spec.plant_options).get("motor.stiffness")
    soft = isinstance(stiffness, float) and stiffness < 100.0
    fell = soft and spec.robot_seed == 1 and spec.task.asked > 0 and not spec.parameters.feedback
    return metrics(
        fell=fell, fall_time=6.5 if fell else None, alarm_time=6.3 if fell else None,
        speed_x=spec.task.asked * (0.7 if soft else 1.0),
    )  # fmt: skip


@pytest.fixture
def result(monkeypatch: pytest.MonkeyPatch) -> SuiteResult:
    """The sweep over robots that walk as above."""

    def run_all(specs: list[RolloutSpec], **_: object) -> list[RolloutResult]:
        return [RolloutResult(spec, metrics_of(spec)) for spec in specs]

    monkeypatch.setattr(score, "run_all", run_all)
    monkeypatch.setattr(plant, "require_accepted", lambda changes, options: None)
    return plant.sweep(OPTIONS)


def test_rows_name_the_change_the_task_and_the_loop(result: SuiteResult) -> None:
    found = values(result.measurements)
    assert found["unchanged_forward_median"] == pytest.approx(FORWARD)
    assert found["stiffness_100_back_median"] == pytest.approx(40.0)
    assert found["stiffness_50_forward_median"] == pytest.approx(0.7 * FORWARD)
    assert found["stiffness_50_forward_open_loop_upright"] == 1
    assert found["stiffness_50_forward_open_loop_median"] is None  # a fall: does not count
    assert found["stiffness_50_forward_open_loop_median_of_upright"] == pytest.approx(0.7 * FORWARD)
    assert found["play_deg_5_forward_open_loop_upright"] == 2
    assert len(found) == len(result.measurements)


def test_the_first_value_that_fells_a_robot_is_named(result: SuiteResult) -> None:
    found = values(result.measurements)
    assert found["stiffness_forward_open_loop_breaks_at"] == 75.0
    assert found["stiffness_forward_breaks_at"] is None
    assert found["stiffness_back_open_loop_breaks_at"] is None
    assert found["open_loop_falls"] == 2
    assert found["closed_falls"] == 0
    assert found["open_loop_fall_lead_median"] == pytest.approx(0.2)
    breaks = {(row[0], row[2]): row[3:] for row in result.tables[1].rows}
    tried = "300, 150, 100, 75, 50"
    assert breaks["motor.stiffness", "open"] == (tried, "forward at 75 (1/2; 6.5 s)")
    assert breaks["motor.play", "closed"] == ("1.2, 2, 3, 5", "nothing")


def test_the_table_marks_falls_and_slow_walks(result: SuiteResult) -> None:
    lines = {
        " ".join(line.split()[:-4]): line.split()[-4:]
        for line in result.tables[0].text().splitlines()
        if line.startswith(("motor.", "nothing"))
    }
    assert lines["nothing closed"] == ["2/2", f"{FORWARD:.1f}", "2/2", "40.0"]
    assert lines["motor.stiffness 100 N m/rad open"] == ["2/2", f"{FORWARD:.1f}", "2/2", "40.0"]
    slow = f"~{0.7 * FORWARD:.1f}"
    assert lines["motor.stiffness 75 N m/rad open"] == ["x1/2", slow, "2/2", "~28.0"]


@pytest.mark.parametrize("ingredient", INGREDIENTS.values(), ids=list(INGREDIENTS))
def test_every_value_changes_the_reference_plant_and_nothing_else(ingredient: Ingredient) -> None:
    reference = load_plant("reference")
    seen: list[Plant] = []
    for value in ingredient.values:
        changed = with_options(reference, ingredient.change(value))
        assert changed not in (reference, *seen)
        seen.append(changed)
        named = {name for name, _ in ingredient.change(value)}
        for section in ("physics", "motor", "contact", "sensors", "variation"):
            before, after = getattr(reference, section), getattr(changed, section)
            for field in attrs.fields(type(before)):
                if f"{section}.{field.name}" not in named:
                    assert getattr(before, field.name) == getattr(after, field.name)


def test_values_are_given_in_their_own_unit() -> None:
    assert dict(INGREDIENTS["play_deg"].change(1.2))["motor.play"] == math.radians(1.2)
    assert dict(INGREDIENTS["delay_ms"].change(60.0))["sensors.delay"] == pytest.approx(0.06)
    assert dict(INGREDIENTS["dc_line"].change(False))["motor.torque_speed_line"] is False
    # each robot has a coefficient of its own, unless the plant says otherwise
    assert dict(INGREDIENTS["floor_friction"].change(0.2))["variation.friction"] is None


@pytest.mark.parametrize(
    ("change", "field"),
    [({"engine": "pybullet"}, "engine"), ({"ingredients": ("slack",)}, "ingredient")],
)
def test_a_sweep_that_cannot_be_is_refused(change: dict[str, Any], field: str) -> None:
    with pytest.raises(NaoGaitError) as caught:
        plant.sweep(dataclasses.replace(OPTIONS, **change))
    assert caught.value.field == field


def test_what_the_engine_refuses_is_said_before_the_first_walk(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    pytest.importorskip("mujoco")

    def run_all(*_: object, **__: object) -> None:
        pytest.fail("walked")

    monkeypatch.setattr(score, "run_all", run_all)
    slow_servos = dataclasses.replace(OPTIONS, plant_options=(("motor.lag", 0.03),))
    with pytest.raises(NaoGaitError, match=r"motor\.stiffness"):
        plant.sweep(slow_servos)


def test_the_command_line_fills_in_what_the_suite_usually_runs_on(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    asked: list[BenchOptions] = []

    def run(name: str, given: dict[str, Any], **_: object) -> None:
        asked.extend(each.options for each in suite.plan(name, given))

    monkeypatch.setattr(suite, "run", run)
    assert cli.main(["bench", "plant", "--plant-set", "motor.play=0.035"]) == 0
    assert cli.main(["bench", "speed", "--robots", "3"]) == 0
    of_plant, of_speed = asked
    assert (of_plant.robots, of_plant.window, of_plant.engine) == (2, 5.0, "mujoco")
    assert of_plant.plant_options == (("motor.play", 0.035),)
    assert of_plant.plant_title == "reference motor.play=0.035"
    assert (of_speed.robots, of_speed.window, of_speed.engine) == (3, 20.0, "pybullet")


def test_a_rollout_walks_on_the_replaced_options() -> None:
    task = dataclasses.replace(walk("forward", x=0.1, axis="x"), start=0.1, end=0.3)
    traces = []
    for options in ((), (("motor.torque_fraction", 0.02),)):
        trace = rollout(RolloutSpec(task, plant_options=options, keep_trace=True)).trace
        assert trace is not None
        traces.append(trace)
    assert traces[1].saturated.sum() > traces[0].saturated.sum()
    with pytest.raises(NaoGaitError, match=r"motor\.play"):  # PyBullet has none
        rollout(RolloutSpec(task, plant_options=(("motor.play", 0.03),)))
