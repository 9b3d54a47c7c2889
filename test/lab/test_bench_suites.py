"""Every suite: its rows and table with tiny settings, and what its numbers mean."""

import itertools
import json
import math
from pathlib import Path
from typing import Any

import pytest
from scores import metrics, score, values

from gait_lab.bench import suite
from gait_lab.bench.changes import load_changes
from gait_lab.bench.figures import delay_figure
from gait_lab.bench.score import FallDetection
from gait_lab.bench.suites import ablation, endurance, robust, speed, start
from gait_lab.bench.suites.compute import Options as ComputeOptions
from gait_lab.bench.suites.compute import compute
from gait_lab.bench.suites.delay import DELAYS, MOTOR_LAG, delays_of
from gait_lab.bench.suites.endurance import Journey, JourneySpec, Stretch, Total
from gait_lab.bench.suites.heat import LONGEST, minutes_until
from gait_lab.bench.suites.robust import PLANTS
from nao_lipm_gait.parameters import GaitParameters, load_preset
from robot_core.errors import NaoGaitError
from sim_bridge.trials.metrics import Metrics
from sim_bridge.trials.rollout import RolloutSpec, rollout
from sim_bridge.trials.tasks import TASKS, RandomCommands

SCHEMA = {"suite", "metric", "unit", "value", "paper", "engine", "plant", "robots", "seed"}
TINY: dict[str, dict[str, Any]] = {
    "speed": {"tasks": ("forward=10",), "window": 0.5},
    "error": {"tasks": ("spot", "forward=10"), "window": 0.5},
    "push": {"tasks": ("spot",), "directions": ("left",), "phases": 1, "impulses": (0.5,)},
    "start": {"open_loop": "off"},
    "endurance": {"metres": 0.3},
    "delay": {"tasks": ("forward=10",), "window": 0.5, "open_loop": "off"},
    "robust": {"tasks": ("forward=10",), "window": 0.5, "open_loop": "off",
               "only": ("stiff_floor", "joint_zeros")},
    "odometry": {"courses": ("curve",), "bias_wait": 1.0},
    "heat": {"speeds": ("10",), "window": 1.0},
    "soles": {"tasks": ("spot", "forward=10"), "window": 2.0},
    "behavior": {"limit": 3.0},
    "keeper": {"targets": ("right",), "limit": 2.0},
    "scenes": {"scenes": ("two at the ball",)},
    "challenges": {"challenges": ("walk straight", "ball control"), "limit": 1.0},
    "paper": {"tasks": ("forward=10",), "window": 0.5, "drawn": "off", "open_loop": "off",
              "push": False},
    "localization": {"window": 4.0, "ablation": False},
    "ball": {"window": 4.0, "ablation": False},
}
HEADLINES = {
    "speed": ("forward_worst", "forward_open_loop_median", "forward_half_error_worst",
              "forward_yaw_drift_worst"),
    "error": ("spot_com_y_error_mean", "forward_10_com_y_error_measured_mean",
              "forward_10_speed_median"),
    "push": ("push_spot_left_max", "push_spot_left_0.5_survival",
             "push_spot_open_loop_left_0.5_survival"),
    "start": ("all_starts", "all_start_falls", "forward_stop_falls", "all_stopped"),
    "endurance": ("closed_falls_per_km", "open_loop_falls_per_km", "closed_distance"),
    "delay": ("delay_0_matched_forward_10_upright", "delay_80_own_forward_10_worst"),
    "robust": ("stiff_floor_forward_10_upright_share", "joint_zeros_forward_10_median"),
    "odometry": ("curve_heading_error_worst", "curve_place_error_median", "curve_stood_worst"),
    "heat": ("forward_10_minutes_until_sit_worst", "forward_10_cost_of_transport_median"),
    "soles": ("sole_pitch_rms_before", "sole_pitch_rms_after", "sole_roll_rms_before",
              "sole_roll_rms_after", "forward_10_sole_roll_worst_after"),
    "behavior": ("goal_within_120s", "falls_per_minute", "outs", "kicks"),
    "paper": ("paper_slow_median", "paper_slow_speed_error", "paper_slow_slip_worst",
              "paper_com_error_slow", "default_com_error_true_slow"),
    "localization": ("pose_error_median", "pose_error_p95", "heading_error_median", "wrong_half",
                     "valid_wrong_share"),
    "scenes": ("two_at_the_ball_done",),
    "challenges": ("walk_straight_seconds_median", "walk_straight_seconds_worst",
                   "ball_control_done", "ball_control_penalties_median"),
    "keeper": ("shots_held", "corners_held", "motions_at_wide_balls", "up_again", "falls"),
    "ball": ("ball_position_error_median", "ball_velocity_error_median", "ball_known_share"),
}  # fmt: skip


def run(name: str, file: Path) -> list[dict[str, Any]]:
    """The rows of a suite in its tiny form on robot 2."""
    asked = {"robots": 1, "seed": 2, "engine": "mujoco", "jobs": 1, "show": False, **TINY[name]}
    printed: list[str] = []
    suite.run(name, asked, json_file=file, out=printed.append)
    assert printed[0].strip()
    rows: list[dict[str, Any]] = json.loads(file.read_text())
    return rows


@pytest.mark.parametrize("name", TINY)
def test_a_suite_writes_its_rows_and_the_same_ones_again(name: str, tmp_path: Path) -> None:
    pytest.importorskip("mujoco")
    rows = run(name, tmp_path / "rows.json")
    names = [row["metric"] for row in rows]
    assert len(set(names)) == len(names)
    assert set(HEADLINES[name]) <= set(names)
    for row in rows:
        assert set(row) == SCHEMA
        assert (row["suite"], row["engine"], row["robots"], row["seed"]) == (name, "mujoco", 1, 2)
        assert row["value"] is None or math.isfinite(row["value"])
    assert run(name, tmp_path / "again.json") == rows


# -- speed -----------------------------------------------------------------------------------------


def speed_values(*scored: Metrics, task: str = "back") -> dict[str, float | None]:
    """The measurements of the suite `speed` for one task at full speed."""
    return values(speed.full_speed_rows(score(task, *scored)))


def test_worst_and_median_are_in_the_commanded_direction() -> None:
    rows = speed_values(*(metrics(speed_x=-v) for v in (0.20, 0.22, 0.30)))
    assert rows["back_worst"] == pytest.approx(20.0)
    assert rows["back_median"] == pytest.approx(22.0)
    assert rows["back_upright"] == 3


@pytest.mark.parametrize(
    "change",
    [{"fell": True, "fall_time": 3.0}, {"flight_share": 0.06}, {"slip_speed": 0.031},
     {"contact_ticks": 1}, {"slip_speed": math.nan}],
)  # fmt: skip
def test_a_speed_does_not_count_if_one_robot_does_not_walk(change: dict[str, Any]) -> None:
    usual = {"speed_x": -0.3, "duration": 20.0}
    rows = speed_values(metrics(**usual), metrics(**{**usual, **change}))
    assert rows["back_worst"] is None
    assert rows["back_median"] is None
    assert rows["back_counts"] == 0.0
    assert rows["back_worst_of_upright"] == pytest.approx(30.0)


def test_half_speed_is_judged_by_the_robot_that_is_furthest_off() -> None:
    half = score("forward=20", metrics(speed_x=0.19), metrics(speed_x=0.23))
    assert speed.deviations(half) == pytest.approx([5.0, 15.0])
    assert values(speed.half_speed_rows(half))["forward_error_worst"] == pytest.approx(15.0)
    fell = score("forward=20", metrics(speed_x=0.2), metrics(fell=True, fall_time=3.0))
    assert values(speed.half_speed_rows(fell))["forward_error_worst"] is None


# -- start -----------------------------------------------------------------------------------------


def test_falls_belong_to_the_start_or_to_the_stop() -> None:
    fallen = (metrics(fell=True, fall_time=t) for t in (1.5, 4.9, start.STOP_TIME + 0.1))
    walks_on, steps = metrics(speed_x=0.05), metrics(support_changes=1)
    tally = start.Tally([score("forward", *fallen, metrics(), walks_on, steps)])
    assert (tally.starts, tally.start_falls, tally.stop_falls, tally.stopped) == (6, 2, 1, 1)


def test_there_are_two_hundred_starts_by_default() -> None:
    assert start.Options().robots * len(start.cases()) == 200
    assert not any(command.is_zero for command in start.cases().values())


# -- endurance -------------------------------------------------------------------------------------


def test_random_commands_are_smooth_bounded_and_seeded() -> None:
    commands, again, other = (RandomCommands(seed) for seed in ((3, 0), (3, 0), (3, 1)))
    times = [0.01 * tick for tick in range(30000)]
    asked = [commands.at(time) for time in times]
    assert asked == [again.at(time) for time in times]
    assert asked != [other.at(time) for time in times]
    limits = (TASKS["forward"].asked, TASKS["side"].asked, TASKS["turn"].asked)
    for axis, limit in zip(("x", "y", "yaw"), limits, strict=True):
        along = [getattr(command, axis) for command in asked]
        assert max(along) > 0.5 * limit
        assert min(along) < -0.5 * limit
        assert max(map(abs, along)) <= limit
        jumps = [abs(b - a) for a, b in itertools.pairwise(along)]
        assert max(jumps) <= 2.0 * limit * 0.01 * 1.5 + 1e-9
    assert any(command.is_zero for command in asked[200:])


def test_falls_per_kilometre_count_every_stretch() -> None:
    fell = Stretch(20.0, 200.0, True, 0.3, False)
    whole = Stretch(30.0, 300.0, False, None, True)
    other = Journey((Stretch(50.0, 500.0, False, None, False),))
    total = Total(True, (Journey((fell, whole)), other))
    assert total.kilometres == pytest.approx(0.1)
    assert total.falls == 1
    assert total.falls_per_km == pytest.approx(10.0)
    assert total.without_fall == 1
    assert total.speed == pytest.approx(10.0)
    assert total.detection.falls == 1
    assert total.detection.false_alarms == 1
    assert total.detection.lead_median == pytest.approx(0.3)
    assert Total(True, (Journey(()),)).falls_per_km is None


def test_after_a_fall_the_robot_walks_on_with_other_noise(monkeypatch: pytest.MonkeyPatch) -> None:
    walked: list[int] = []

    def stretch(spec: RolloutSpec, number: int, metres: float, seconds: float) -> Stretch:
        walked.append(number)
        return Stretch(min(4.0, metres), 30.0, metres > 4.0, None, False)

    monkeypatch.setattr(endurance, "walk_stretch", stretch)
    journey = endurance.walk_journey(JourneySpec(RolloutSpec(TASKS["stand"]), 10.0))
    assert walked == [0, 1, 2]
    assert journey.metres == 10.0
    assert journey.falls == 2


def test_a_robot_that_gets_nowhere_is_given_up(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(endurance, "walk_stretch", lambda *_: Stretch(0.0, 2.0, True, 0.0, False))
    journey = endurance.walk_journey(JourneySpec(RolloutSpec(TASKS["stand"]), 50.0))
    assert journey.falls == endurance.FALLS_MAX
    assert journey.metres == 0.0


# -- delay, robust ---------------------------------------------------------------------------------


def test_a_matched_gait_predicts_over_the_delay_and_the_motors() -> None:
    delays = delays_of(0.06)
    for delay, each in zip(DELAYS, delays, strict=False):
        assert dict(each.variant.plant)["sensors.delay"] == pytest.approx(delay / 1000.0)
        expected = delay / 1000.0 + MOTOR_LAG
        assert each.variant.parameters["feedback_delay"] == pytest.approx(expected)
    own = [each for each in delays if not each.matched]
    assert [each.sensors for each in own] == list(DELAYS)
    assert {each.feedback_delay for each in own} == {0.06}


def test_motors_at_the_effort_of_the_urdf_are_weaker_and_still_walk() -> None:
    pytest.importorskip("mujoco")
    weak = PLANTS["weak_motors"]
    task = TASKS["forward"].scaled(0.25, "slow").lasting(0.3)
    spec = RolloutSpec(task, engine="mujoco", plant_options=weak.plant, urdf_effort=True)
    usual = RolloutSpec(task, engine="mujoco")
    slow, free = rollout(spec).metrics, rollout(usual).metrics
    assert not slow.fell
    assert slow.saturated_share > free.saturated_share
    rows = robust.plant_rows("weak_motors", score("forward", metrics(speed_x=0.3)))
    assert values(rows)["weak_motors_forward_upright_share"] == 100.0


# -- ablation --------------------------------------------------------------------------------------


def test_the_shipped_changes_do_what_their_names_say() -> None:
    base = load_preset("default")
    changes = {change.name: change for change in load_changes()}
    assert changes["open_loop"].parameters(base) == base.replace(feedback=False)
    assert changes["paper"].parameters(base) == load_preset("paper")
    for change in changes.values():
        assert change.parameters(base) != base
    without = [change for change in changes.values() if change.name.startswith("without_")]
    assert without
    for change in without:
        before, changed = base.as_dict(), change.parameters(base).as_dict()
        assert {name for name in before if before[name] != changed[name]} <= set(change.settings)


@pytest.mark.parametrize(
    "text",
    ["", "[1, 2]", "a: {}", "a: {sett: {}}", "a: {set: {wings: 2}}", "a: {set: [1]}",
     "a: {preset: 3}", "a: {preset: nobody}", "A b: {set: {feedback: false}}", "a: {set: {",
     "unchanged: {set: {feedback: false}}"],
)  # fmt: skip
def test_a_bad_list_of_changes_is_refused(text: str, tmp_path: Path) -> None:
    file = tmp_path / "list.yaml"
    file.write_text(text)
    with pytest.raises(NaoGaitError):
        load_changes(file)
    with pytest.raises(NaoGaitError):
        load_changes(tmp_path / "missing.yaml")


def test_an_ablation_measures_every_change_on_the_same_robots(tmp_path: Path) -> None:
    pytest.importorskip("mujoco")
    file = tmp_path / "list.yaml"
    file.write_text("same: {set: {feedback: true}}\nopen_loop: {set: {feedback: false}}\n")
    options = ablation.Options(
        robots=1, engine="mujoco", parameters=GaitParameters(), tasks=("forward",), window=0.5,
        phases=1, changes=file, jobs=1, show=False,
    )  # fmt: skip
    rows = values(ablation.ablation(options).measurements)
    of = {
        name: {metric.removeprefix(f"{name}_"): value for metric, value in rows.items()
               if metric.startswith(f"{name}_")}
        for name in ("unchanged", "same", "open_loop")
    }  # fmt: skip
    assert of["unchanged"] == of["same"] != of["open_loop"]
    for direction, impulse in ablation.PUSHES:
        assert f"push_{direction}_{impulse:g}_survival" in of["unchanged"]
    assert "fall_lead_median" in of["unchanged"]


# -- compute, fall detection -----------------------------------------------------------------------


def test_compute_measures_ticks_and_rollouts() -> None:
    rows: Any = values(compute(ComputeOptions(window=0.5)).measurements)
    assert 1.0 < rows["tick_p50"] <= rows["tick_p99"]
    assert 0.1 < rows["rollout_share"] < 1.5
    parts = [rows[f"{name}_time"] for name in ("engine", "plant", "gait", "truth")]
    assert min(parts) > 0.0
    assert sum(parts) == pytest.approx(rows["rollout_time"])
    assert rows["rollout_speed"] > 0.0
    assert 1e4 / rows["rollout_time"] < rows["loop_speed"] < rows["physics_speed"]
    assert rows["pitch_speed"] > 0.1
    assert 0.0 < rows["pitch_physics_share"] < 1.0


def test_detection_counts_leads_and_false_alarms() -> None:
    detection = FallDetection()
    for each in (
        metrics(fell=True, fall_time=5.0, alarm_time=4.7),
        metrics(fell=True, fall_time=5.0, alarm_time=4.9),
        metrics(fell=True, fall_time=5.0),
        metrics(alarm_time=3.0),
        metrics(),
    ):
        detection.add(each)
    assert (detection.rollouts, detection.falls, detection.foreseen) == (5, 3, 2)
    assert detection.lead_median == pytest.approx(0.1)
    assert detection.false_alarms == 1


def test_minutes_until_a_temperature_follow_one_time_constant() -> None:
    rise = minutes_until(60.0, 95.0, 25.0, 600.0)
    assert rise == pytest.approx(10.0 * math.log(2.0))
    assert minutes_until(78.0, 77.0, 25.0, 600.0) == LONGEST


def test_the_errors_by_the_delay_of_the_images_are_drawn(tmp_path: Path) -> None:
    values = {
        f"delay_{delay}_{what}_error_median": value
        for delay, value in (("0_ms", 2.0), ("300_ms", 2.3), ("300_ms_ignored", 5.0))
        for what in ("pose", "heading")
    }
    path = tmp_path / "delays.png"
    assert delay_figure(values, path) == path
    assert path.stat().st_size > 3000
    assert delay_figure({"pose_error_median": 2.0}, path) is None
