"""Sweeps: what a file declares is what is walked; its levels, changes and trials."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import attrs
import pytest
from scores import metrics, options, values

from gait_lab.bench import walks
from gait_lab.bench.registry import find_suite
from gait_lab.bench.sweep import Level, Sweep, load_changes, load_sweep, sweep_suite
from nao_lipm_gait.parameters import GaitParameters, load_preset
from robot_core.errors import NaoGaitError
from robot_core.resources import share
from sim_bridge.plant import Plant, load_plant, with_options
from sim_bridge.trials.metrics import Metrics
from sim_bridge.trials.rollout import RolloutResult, RolloutSpec, rollout
from sim_bridge.trials.tasks import TASKS, find_task

FILES = sorted(share("config", "bench").glob("*.yaml"))
FORWARD = 100.0 * find_task("forward").asked
"""Speed [cm/s] of a robot that walks as fast as it is asked."""


def shipped(name: str) -> Sweep:
    """A shipped sweep."""
    return load_sweep(share("config", "bench", f"{name}.yaml"))


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
def walked(monkeypatch: pytest.MonkeyPatch) -> list[RolloutSpec]:
    """All rollouts that are asked for; the robots walk as above."""
    seen: list[RolloutSpec] = []

    def run_all(specs: list[RolloutSpec], **_: object) -> list[RolloutResult]:
        seen.extend(specs)
        return [RolloutResult(spec, metrics_of(spec)) for spec in specs]

    monkeypatch.setattr(walks, "run_all", run_all)
    return seen


def test_every_variant_is_walked_by_the_same_robots(walked: list[RolloutSpec]) -> None:
    asked = options("robust", robots=2, tasks=("forward=20", "turn"), seed=5)
    found = list(shipped("robust").measure(asked))
    assert len(walked) == 6 * 2 * 2 * 2
    assert {spec.robot_seed for spec in walked} == {5, 6}
    stiff = [spec for spec in walked if ("contact.stiffness", 4e4) in spec.plant_options]
    assert len(stiff) == 8
    rows = {row.metric: row for row in found if not isinstance(row, str)}
    assert rows["stiff_floor_forward_20_median"].value == pytest.approx(20.0)
    assert "contact.stiffness" in str(rows["stiff_floor_turn_open_loop_upright"].plant)
    assert rows["unchanged_turn_upright"].plant is None


def test_the_first_value_that_fells_a_robot_is_named(walked: list[RolloutSpec]) -> None:
    asked = options(
        "plant", robots=2, tasks=("forward", "back"), ingredients=("stiffness", "play_deg")
    )
    found = values(shipped("plant").measure(asked))
    assert found["unchanged_forward_median"] == pytest.approx(FORWARD)
    assert found["stiffness_100_back_median"] == pytest.approx(40.0)
    assert found["stiffness_50_forward_open_loop_upright"] == 1
    assert found["stiffness_50_forward_open_loop_median"] is None  # a fall: does not count
    assert found["stiffness_50_forward_open_loop_median_of_upright"] == pytest.approx(0.7 * FORWARD)
    assert found["play_deg_5_forward_open_loop_upright"] == 2
    assert found["stiffness_forward_open_loop_breaks_at"] == 75.0
    assert found["stiffness_forward_breaks_at"] is None
    assert found["stiffness_back_open_loop_breaks_at"] is None
    assert found["open_loop_falls"] == 2
    assert found["closed_falls"] == 0


LEVELS = shipped("plant").levels


@pytest.mark.parametrize("level", LEVELS.values(), ids=list(LEVELS))
def test_every_value_changes_the_reference_plant_and_nothing_else(level: Level) -> None:
    reference = load_plant("reference")
    seen: list[Plant] = []
    for variant in level.variants("level").values():
        changed = with_options(reference, variant.plant)
        assert changed not in (reference, *seen)
        seen.append(changed)
        named = {name for name, _ in variant.plant}
        for section in ("physics", "motor", "contact", "sensors", "variation"):
            before, after = getattr(reference, section), getattr(changed, section)
            for field in attrs.fields(type(before)):
                if f"{section}.{field.name}" not in named:
                    assert getattr(before, field.name) == getattr(after, field.name)


def test_a_matched_gait_predicts_over_the_delay_and_the_motors() -> None:
    for name, change in shipped("delay").variants.items():
        _, delay, kind = name.split("_")
        assert change.plant == {"sensors.delay": pytest.approx(0.001 * float(delay))}
        matched = {"feedback_delay": pytest.approx(0.001 * float(delay) + 0.02)}
        assert change.set == (matched if kind == "matched" else {})


def test_motors_at_the_effort_of_the_urdf_are_weaker_and_still_walk() -> None:
    pytest.importorskip("mujoco")
    asked = options("robust").but(parameters=load_preset("default"))
    task = TASKS["forward"].scaled(0.25, "slow").lasting(0.3)
    weak, usual = (
        rollout(shipped("robust").variants[name].variant.spec(asked, True, task, 0)).metrics
        for name in ("weak_motors", "unchanged")
    )
    assert not weak.fell
    assert weak.saturated_share > usual.saturated_share


# -- ablation --------------------------------------------------------------------------------------


def test_the_shipped_changes_do_what_their_names_say() -> None:
    base = load_preset("default")
    changes = shipped("ablation").variants
    assert changes.pop("unchanged").variant.of(base) == base
    assert changes["open_loop"].variant.of(base) == base.replace(feedback=False)
    assert changes["paper"].variant.of(base) == load_preset("paper")
    for name, change in changes.items():
        changed = change.variant.of(base)
        assert changed != base
        if name.startswith("without_"):
            before, after = base.as_dict(), changed.as_dict()
            assert {key for key in before if before[key] != after[key]} <= set(change.set)


def test_a_trial_gives_its_metrics_with_an_extension_and_without_it(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    def run_all(specs: list[RolloutSpec], **_: object) -> list[RolloutResult]:
        lifts = [spec.parameters.swing_lift for spec in specs]
        return [
            RolloutResult(spec, metrics(speed_x=lift, speed_y=lift))
            for spec, lift in zip(specs, lifts, strict=True)
        ]

    monkeypatch.setattr(walks, "run_all", run_all)
    sweep = attrs.evolve(shipped("ablation"), pushes={}, always=())
    file = tmp_path / "list.yaml"
    file.write_text("without_lift: {set: {swing_lift: 0.02}, trials: [drift]}\nunchanged: {}\n")
    asked = options("ablation", robots=2, tasks=("forward",), changes=file)
    asked = asked.but(parameters=GaitParameters(swing_lift=0.03))
    found = values(sweep_suite("ablation", sweep, find_suite).measure(asked))
    assert found["lift_side_median_with"] == pytest.approx(3.0)
    assert found["lift_side_median_without"] == pytest.approx(2.0)
    assert found["unchanged_forward_median"] == pytest.approx(3.0)
    assert "without_lift_forward_median" not in found, "it runs in its trial alone"
    unknown = attrs.evolve(sweep.trials["drift"], metrics=("height",))
    sweep = attrs.evolve(sweep, trials={**sweep.trials, "drift": unknown})
    with pytest.raises(NaoGaitError, match=r"height.*side_median"):
        list(sweep.measure_trials(asked, find_suite))


@pytest.mark.parametrize(
    "text",
    ["", "[1, 2]", "a: {sett: {}}", "a: {set: {wings: 2}}", "a: {set: [1]}", "a: {preset: 3}",
     "a: {preset: nobody}", "A b: {set: {feedback: false}}", "a: {set: {",
     "without_a: {trials: [nothing]}", "a: {trials: [drift]}"],
)  # fmt: skip
def test_a_bad_list_of_changes_is_refused(text: str, tmp_path: Path) -> None:
    file = tmp_path / "list.yaml"
    file.write_text(text)
    with pytest.raises(NaoGaitError):
        load_changes(file, ("drift",))
    with pytest.raises(NaoGaitError):
        load_changes(tmp_path / "missing.yaml")


@pytest.mark.parametrize(
    "change",
    [{"metrics": ["height"]}, {"options": 3}, {"title": ""}, {"wings": 2},
     {"pushes": [["up", 1.0]]}, {"pushes": {"up": 1.0}}, {"pushes": {"left": None}},
     {"levels": {"a": {"option": "motor.play"}}}],
)  # fmt: skip
def test_a_bad_sweep_is_refused(change: dict[str, Any], tmp_path: Path) -> None:
    file = tmp_path / "sweep.yaml"
    file.write_text(str({"title": "T", "summary": "s", "metrics": ["worst"], **change}))
    with pytest.raises(NaoGaitError):
        load_sweep(file)


def test_an_ablation_measures_every_change_on_the_same_robots(tmp_path: Path) -> None:
    pytest.importorskip("mujoco")
    file = tmp_path / "list.yaml"
    file.write_text(
        "unchanged: {}\nsame: {set: {feedback: true}}\nother: {set: {feedback: false}}\n"
    )
    asked = options("ablation", robots=1, tasks=("forward",), window=0.5, phases=1, changes=file)
    sweep = attrs.evolve(shipped("ablation"), always=(), pushes={"left": 1.0})
    found = values(sweep.measure(asked.but(parameters=GaitParameters())))
    of = {
        name: {metric.removeprefix(f"{name}_"): value for metric, value in found.items()
               if metric.startswith(f"{name}_")}
        for name in ("unchanged", "same", "other")
    }  # fmt: skip
    assert of["unchanged"] == of["same"] != of["other"]
    assert {"push_left_1_survival", "fall_lead_median"} <= set(of["unchanged"])


def test_a_rollout_walks_on_the_replaced_options() -> None:
    task = replace(find_task("forward=10"), start=0.1, end=0.3)
    traces = []
    for plant in ((), (("motor.torque_fraction", 0.02),)):
        trace = rollout(RolloutSpec(task, plant_options=plant, keep_trace=True)).trace
        assert trace is not None
        traces.append(trace)
    assert traces[1].saturated.sum() > traces[0].saturated.sum()
    with pytest.raises(NaoGaitError, match=r"motor\.play"):  # PyBullet has none
        rollout(RolloutSpec(task, plant_options=(("motor.play", 0.03),)))
