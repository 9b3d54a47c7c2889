"""Every suite: its rows with tiny settings, and what its numbers mean."""

import itertools
import json
import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scores import metrics, options, score, values

from gait_lab.bench import registry
from gait_lab.bench.figures import paper_figures, push_figure
from gait_lab.bench.options import Options
from gait_lab.bench.suites import endurance, limits, paper, posture, start
from gait_lab.bench.suites.compute import compute
from gait_lab.bench.suites.endurance import Stretch
from gait_lab.bench.suites.heat import LONGEST, heat_walk, minutes_until
from gait_lab.bench.suites.peers import SWEEP as PEERS
from gait_lab.bench.walks import METRICS, FallDetection, Variant
from nao_lipm_gait.parameters import GaitParameters, load_preset
from robot_core.errors import NaoGaitError
from robot_core.types import STANDSTILL
from sim_bridge.trials.metrics import Metrics
from sim_bridge.trials.rollout import RolloutSpec, rollout
from sim_bridge.trials.tasks import STAND_TIME, TASKS, RandomCommands, find_task
from sim_bridge.trials.trial import TrialSpec

SCHEMA = {"suite", "metric", "unit", "value", "paper", "engine", "plant", "robots", "seed"}
TINY: dict[str, tuple[dict[str, Any], tuple[str, ...]]] = {
    "speed": ({"tasks": ("forward=10",), "window": 0.5},
              ("forward_worst", "forward_open_loop_median", "forward_half_error_worst",
               "forward_yaw_drift_worst")),
    "error": ({"tasks": ("spot", "forward=10"), "window": 0.5},
              ("spot_com_y_error_mean", "forward_10_com_y_error_measured_mean",
               "forward_10_speed_median")),
    "push": ({"tasks": ("spot",), "directions": ("left",), "phases": 1, "impulses": (0.5,)},
             ("push_spot_left_max", "push_spot_left_0.5_survival",
              "push_spot_open_loop_left_0.5_survival")),
    "start": ({"open_loop": "off"},
              ("all_starts", "all_start_falls", "forward_stop_falls", "all_stopped")),
    "limits": ({"window": 0.1, "cases": ("arc_left", "turn_50hz")},
               ("limits_falls", "limits_speed_share", "arc_left_least_above",
                "turn_50hz_yaw_drift_worst")),
    "endurance": ({"metres": 0.3},
                  ("closed_falls_per_km", "open_loop_falls_per_km", "closed_distance")),
    "delay": ({"tasks": ("forward=10",), "window": 0.5, "open_loop": "off"},
              ("delay_0_matched_forward_10_upright", "delay_80_own_forward_10_worst")),
    "robust": ({"tasks": ("forward=10",), "window": 0.5, "open_loop": "off",
                "only": ("stiff_floor", "joint_zeros")},
               ("stiff_floor_forward_10_upright_share", "joint_zeros_forward_10_median")),
    "plant": ({"tasks": ("forward=10",), "window": 0.5, "open_loop": "off",
               "ingredients": ("dc_line",)},
              ("unchanged_forward_median", "dc_line_off_forward_upright",
               "dc_line_forward_breaks_at")),
    "ground": ({"tasks": ("forward=10",), "window": 0.5, "ingredients": ("slabs",)},
               ("unchanged_forward_10_median_of_upright", "slabs_3_forward_10_upright",
                "slabs_forward_10_breaks_at")),
    "odometry": ({"courses": ("curve",), "bias_wait": 1.0},
                 ("curve_heading_error_worst", "curve_place_error_median", "curve_stood_worst")),
    "heat": ({"speeds": ("10",), "window": 1.0},
             ("forward_10_minutes_until_sit_worst", "forward_10_cost_of_transport_median",
              "forward_10_knee_torque_median")),
    "soles": ({"tasks": ("spot", "forward=10"), "window": 2.0},
              ("sole_pitch_rms_before", "sole_pitch_rms_after", "sole_roll_rms_before",
               "sole_roll_rms_after", "forward_10_sole_roll_worst_after")),
    "zeros": ({"tasks": (), "joints": ("LKneePitch",), "degrees": (4,)},
              ("healthy_named", "wrong_4_alone", "wrong_4_other", "wrong_4_failed")),
    "solo": ({"limit": 3.0}, ("goal_within_3s", "falls_per_minute", "outs", "kicks")),
    "keeper": ({"targets": ("right",), "limit": 2.0},
               ("shots_held", "corners_held", "motions_at_wide_balls", "up_again", "falls")),
    "abilities": ({"abilities": ("two at the ball",)}, ("two_at_the_ball_done",)),
    "duel": ({"angles": 1, "window": 1.0, "policy": ("gain=0.4",)},
             ("duel_gain", "duel_rest", "duel_falls", "duel_falls_per_robot_minute")),
    "bump": ({"into": ("post", "lying"), "directions": ("left",), "speeds": (0.4,), "window": 0.2},
             ("bump_survived_04", "bump_post_left_04_survived", "bump_lying_left_04_survived")),
    "challenges": ({"challenges": ("walk straight", "ball control"), "limit": 1.0},
                   ("walk_straight_seconds_median", "walk_straight_seconds_worst",
                    "ball_control_done", "ball_control_penalties_median")),
    "paper": ({"tasks": ("forward=10",), "window": 0.5, "drawn": "off", "open_loop": "off",
               "push": False},
              ("paper_slow_median", "paper_slow_speed_error", "paper_slow_slip_worst",
               "paper_com_error_slow", "default_com_error_true_slow")),
    "posture": ({"window": 0.5, "experiments": ("start", "straight")},
                ("start_on_runs", "straight_on_fall_share", "straight_off_median")),
    "localization": ({"window": 4.0, "ablation": False},
                     ("pose_error_median", "pose_error_p95", "heading_error_median", "wrong_half",
                      "valid_wrong_share")),
    "ball": ({"window": 4.0, "ablation": False},
             ("ball_position_error_median", "ball_velocity_error_median", "ball_known_share")),
}  # fmt: skip
"""Suite -> its smallest form, and its main metrics."""
LIKE_ANOTHER = {
    "error", "start", "delay", "robust", "plant", "ground", "paper", "posture", "limits", "zeros",
    "abilities", "challenges", "keeper", "ball",
}  # fmt: skip
"""Suites that run their trials as `speed`, `solo` or `localization` do, which stand for all of
them in what is repeated."""


@pytest.fixture
def brisk(monkeypatch: pytest.MonkeyPatch) -> None:
    """Walks that begin sooner: what is measured here is not how well the robot walks."""
    for constant, seconds in (
        ("sim_bridge.trials.tasks.RAMP_TIME", 0.5), ("sim_bridge.trials.tasks.SETTLE_TIME", 0.2),
        ("gait_lab.bench.suites.limits.SETTLE_TIME", 0.5),
        ("gait_lab.bench.suites.limits.STEPS_WINDOW", 1.0),
        ("gait_lab.bench.suites.start.STOP_TIME", STAND_TIME + 1.0),
        ("gait_lab.bench.suites.start.END", STAND_TIME + 4.0),
    ):  # fmt: skip
        monkeypatch.setattr(constant, seconds)


@pytest.mark.usefixtures("brisk")
@pytest.mark.parametrize("name", TINY)
def test_a_suite_writes_its_rows_and_the_same_ones_again(name: str, tmp_path: Path) -> None:
    pytest.importorskip("mujoco")
    asked, headlines = TINY[name]

    def run(file: Path) -> list[dict[str, Any]]:
        printed: list[str] = []
        registry.run(name, {"robots": 1, "seed": 2, "jobs": 1, "show": False, **asked},
                  json_file=file, out=printed.append)  # fmt: skip
        assert printed[0].strip()
        rows: list[dict[str, Any]] = json.loads(file.read_text())
        return rows

    rows = run(tmp_path / "rows.json")
    names = [row["metric"] for row in rows]
    assert len(set(names)) == len(names)
    assert set(headlines) <= set(names)
    for row in rows:
        assert set(row) == SCHEMA
        assert (row["suite"], row["engine"], row["robots"], row["seed"]) == (name, "mujoco", 1, 2)
        assert row["value"] is None or math.isfinite(row["value"])
    assert name in LIKE_ANOTHER or run(tmp_path / "again.json") == rows


@pytest.mark.parametrize("name", ["duel", "match"])
@pytest.mark.parametrize("setting", ["haste=1", "apart", "apart=near", "apart=-1"])
def test_a_policy_that_does_not_exist_is_refused(name: str, setting: str) -> None:
    with pytest.raises(NaoGaitError, match="policy"):
        registry.plan(name, {"policy": (setting,)})


def test_compute_measures_ticks_and_rollouts() -> None:
    rows: Any = values(compute.measure(options("compute", window=0.5)))
    assert 1.0 < rows["tick_p50"] <= rows["tick_p99"]
    assert 0.1 < rows["rollout_share"] < 1.5
    parts = [rows[f"{name}_time"] for name in ("engine", "plant", "gait", "truth")]
    assert min(parts) > 0.0
    assert sum(parts) == pytest.approx(rows["rollout_time"])
    assert 0.0 < rows["pitch_physics_share"] < 1.0


# -- walks -----------------------------------------------------------------------------------------


def of_task(*scored: Metrics, task: str = "back") -> dict[str, float | None]:
    """All measurements of one task."""
    return values(score(task, *scored).rows(*METRICS))


def test_worst_and_median_are_in_the_commanded_direction() -> None:
    rows = of_task(*(metrics(speed_x=-v) for v in (0.20, 0.22, 0.30)))
    assert rows["back_median"] == pytest.approx(22.0)
    assert rows["back_upright"] == 3
    low = score("back", *(metrics(speed_x=-v) for v in (0.20, 0.30))).rows("worst")
    assert low[0].value == pytest.approx(20.0)


@pytest.mark.parametrize(
    "change",
    [{"fell": True, "fall_time": 3.0}, {"flight_share": 0.06}, {"slip_speed": 0.031},
     {"contact_ticks": 1}, {"slip_speed": math.nan}],
)  # fmt: skip
def test_a_speed_does_not_count_if_one_robot_does_not_walk(change: dict[str, Any]) -> None:
    usual = {"speed_x": -0.3, "duration": 20.0}
    rows = of_task(metrics(**usual), metrics(**{**usual, **change}))
    assert rows["back_speed_worst"] is None
    assert rows["back_median"] is None
    assert rows["back_counts"] == 0.0
    assert rows["back_median_of_upright"] == pytest.approx(30.0)


def test_half_speed_is_judged_by_the_robot_that_is_furthest_off() -> None:
    rows = of_task(metrics(speed_x=0.19), metrics(speed_x=0.23), task="forward=20")
    assert rows["forward_error_worst"] == pytest.approx(15.0)
    assert rows["forward_speed_error"] == pytest.approx(2.0)


def test_each_quantity_of_the_paper_is_beside_its_published_value() -> None:
    walked = {
        "forward": metrics(speed_x=0.3, com_error_y_measured=0.004, com_error_y=0.003),
        "turn": metrics(turn_rate=1.5),
        "spot": metrics(speed_x=0.006, speed_y=-0.008, com_error_y_measured=0.002),
    }
    rows = {row.metric: row for task, each in walked.items()
            for row in paper.score_rows("paper", score(task, each))}  # fmt: skip
    assert rows["paper_forward_median"].paper == 31.0
    assert rows["paper_forward_median"].value == pytest.approx(30.0)
    assert rows["paper_turn_median"].paper == 92.0
    assert rows["paper_com_error_full"].value == pytest.approx(4.0)
    assert rows["paper_com_error_full"].paper == 7.76
    assert rows["paper_com_error_true_full"].value == pytest.approx(3.0)
    assert rows["paper_com_error_spot"].paper == 4.26
    assert rows["paper_spot_drift_worst"].value == pytest.approx(1.0)


def test_a_robot_whose_calibration_failed_walks_without_and_does_not_count() -> None:
    pytest.importorskip("mujoco")
    task = find_task("spot").measured(0.1, 0.2)
    weak = (("motor.torque_fraction", 0.05),)  # it collapses in the stand
    result = rollout(RolloutSpec(task, engine="mujoco", plant_options=weak, calibrated=True))
    assert "not calibrated" in result.faults


def test_detection_counts_leads_and_false_alarms() -> None:
    detection = FallDetection().add(
        metrics(fell=True, fall_time=5.0, alarm_time=4.7),
        metrics(fell=True, fall_time=5.0, alarm_time=4.9),
        metrics(fell=True, fall_time=5.0),
        metrics(alarm_time=3.0),
        metrics(),
    )
    rows = values(detection.rows("all"))
    assert rows["all_falls"] == 3
    assert rows["all_falls_foreseen"] == 2
    assert rows["all_fall_lead_median"] == pytest.approx(0.1)
    assert rows["all_false_alarms"] == 1


def test_the_open_loop_differs_from_the_preset_in_the_feedback_alone() -> None:
    ours = GaitParameters(swing_lift=0.03)
    gaits = {name: each.of(ours) for name, each in paper.GAITS.items()}
    assert gaits["paper"] == load_preset("paper")
    assert gaits["paper_open_loop"] == load_preset("paper").replace(feedback=False)
    assert gaits["default"] == ours
    spec = Variant().spec(Options.of({}, {}).but(parameters=ours), False, TASKS["spot"], 0)
    assert spec.parameters == ours.replace(feedback=False)


def test_the_peers_are_what_they_are_called() -> None:
    ours = GaitParameters(swing_lift=0.03)
    found = {name: change.variant.of(ours) for name, change in PEERS.variants.items()}
    assert found["default"] == ours
    assert found["open_loop"] == ours.replace(feedback=False)
    assert found["paper"] == load_preset("paper")
    for name in ("zmp", "preview"):
        with_gyro, without = found[f"{name}_gyro"], found[name]
        assert with_gyro.walk == without.walk == name
        assert with_gyro.gyro_roll_gain != 0.0 == without.gyro_roll_gain == without.gyro_pitch_gain


# -- start, endurance, heat ------------------------------------------------------------------------


def test_falls_belong_to_the_start_or_to_the_stop() -> None:
    fallen = (metrics(fell=True, fall_time=t) for t in (1.5, 4.9, start.STOP_TIME + 0.1))
    walks_on, steps = metrics(speed_x=0.05), metrics(support_changes=1)
    found = start.tally("all", [score("forward", *fallen, metrics(), walks_on, steps)])
    assert [row.value for row in found] == [6, 2, 1, 1]


def test_there_are_two_hundred_starts_by_default() -> None:
    assert options("start").robots * len(start.cases()) == 200
    assert not any(command.is_zero for command in start.cases().values())


def test_speeds_above_the_limits_are_compared_with_the_best_within() -> None:
    slow, best, above = (score("forward", *(metrics(speed_x=v) for v in speeds))
                         for speeds in ((0.2, 0.2, 0.3), (0.4, 0.5, 0.4), (0.38, 0.1, 0.5)))
    found = values(limits.direction_rows("ahead", [slow, best], [above, best]))
    assert found["ahead_best_within"] == pytest.approx(40.0)
    assert found["ahead_least_above"] == pytest.approx(38.0)
    assert found["ahead_speed_share"] == pytest.approx(0.95)
    fallen = score("forward", metrics(fell=True), metrics(fell=True), metrics(fell=True))
    found = values(limits.direction_rows("ahead", [slow, best], [above, fallen]))
    assert found["ahead_falls"] == 3
    assert found["ahead_speed_share"] is None


def test_a_square_wave_has_no_mean() -> None:
    speeds = limits.Limits(0.4, 0.4, 0.3, 2.0)
    for name, wave in limits.CASES.squares.items():
        task = limits.square(name, speeds, wave, 6.0)
        times = [STAND_TIME + 0.1 + 0.002 * n for n in range(round(wave.period / 0.002))]
        asked = [task.command_at(time) for time in times]
        for axis in zip(*asked, strict=True):
            assert sum(axis) / len(axis) == pytest.approx(0.0, abs=0.06 * wave.factor)


def test_the_preset_gentle_walks_as_fast_with_less_torque() -> None:
    pytest.importorskip("mujoco")
    task, hot = find_task("forward=20").lasting(2.0), (("heat.enabled", True),)
    usual, gentle = (
        heat_walk((task, TrialSpec(
            robot_seed=41, parameters=load_preset(preset), plant_options=hot, engine="mujoco",
        )))
        for preset in ("default", "gentle")
    )  # fmt: skip
    assert usual is not None
    assert gentle is not None
    assert gentle.speed == pytest.approx(0.2, abs=0.03)
    assert gentle.knee_torque < 0.9 * usual.knee_torque
    assert gentle.power < 0.9 * usual.power
    assert np.max(gentle.final) < np.max(usual.final)


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
    rows = values(endurance.loop_rows("closed", [[fell, whole], [replace(whole, metres=50.0)]]))
    assert rows["closed_distance"] == pytest.approx(0.1)
    assert rows["closed_falls_per_km"] == pytest.approx(10.0)
    assert rows["closed_robots_without_fall"] == 1
    assert rows["closed_fall_lead_median"] == pytest.approx(0.3)
    assert values(endurance.loop_rows("closed", [[]]))["closed_falls_per_km"] is None


def test_after_a_fall_the_robot_walks_on_with_other_noise(monkeypatch: pytest.MonkeyPatch) -> None:
    walked: list[int] = []

    def stretch(spec: RolloutSpec, number: int, metres: float, seconds: float) -> Stretch:
        walked.append(number)
        return Stretch(min(4.0, metres), 30.0, metres > 4.0, None, False)

    monkeypatch.setattr(endurance, "walk_stretch", stretch)
    journey = endurance.walk_journey((RolloutSpec(TASKS["stand"]), 10.0))
    assert walked == [0, 1, 2]
    assert sum(each.metres for each in journey) == 10.0
    monkeypatch.setattr(endurance, "walk_stretch", lambda *_: Stretch(0.0, 2.0, True, 0.0, False))
    journey = endurance.walk_journey((RolloutSpec(TASKS["stand"]), 50.0))
    assert len(journey) == endurance.FALLS_MAX, "a robot that gets nowhere is given up"


def test_minutes_until_a_temperature_follow_one_time_constant() -> None:
    rise = minutes_until(60.0, 95.0, 25.0, 600.0)
    assert rise == pytest.approx(10.0 * math.log(2.0))
    assert minutes_until(78.0, 77.0, 25.0, 600.0) == LONGEST


# -- posture ---------------------------------------------------------------------------------------


def test_soccer_asks_for_each_piece_at_once_and_twice() -> None:
    task = posture.soccer_task(0.4)
    lap = sum(piece.seconds for piece in posture.SOCCER)
    assert task.end == pytest.approx(STAND_TIME + posture.LAPS * lap)
    assert task.command_at(STAND_TIME - 0.01) == STANDSTILL
    for lap_began in (STAND_TIME, STAND_TIME + lap):
        time = lap_began
        for piece in posture.SOCCER:
            for inside in (time + 2 * posture.JUMP, time + piece.seconds - posture.JUMP):
                command = task.command_at(inside)
                assert command.x == pytest.approx(0.4 * piece.forward)
                assert (command.y, command.yaw) == pytest.approx((piece.side, piece.turn))
            time += piece.seconds


def test_falls_are_counted_from_the_beginning_of_the_walk() -> None:
    task = replace(find_task("forward=40").lasting(5.0), name="straight")
    walked = {"speed_x": 0.4, "duration": 5.0, "support_changes": 10}

    def rows(name: str, *times: float | None) -> dict[str, float | None]:
        fell = (metrics(**walked, fell=time is not None, fall_time=time) for time in times)
        return values(posture.experiment_rows(name, score(task, *fell)))

    found = rows("on", None, None) | rows("off", STAND_TIME + 3.0, STAND_TIME + 9.0)
    assert found["on_falls"] == 0
    assert found["off_fall_share"] == 100.0
    assert found["off_time_to_fall_median"] == pytest.approx(6.0)
    assert found["on_worst"] == pytest.approx(40.0)
    assert found["off_worst"] is None, "a fallen robot has no speed"


@pytest.mark.parametrize(
    ("name", "asked", "field"),
    [("posture", {"experiments": ("chess",)}, "experiment"),
     ("posture", {"tasks": ("turn",)}, "task"),
     ("paper", {"urdf": "bruno"}, "robot"),
     ("paper", {"tasks": ("forward=31", "forward=25")}, "task"),
     ("plant", {"engine": "pybullet"}, "engine"),
     ("plant", {"ingredients": ("slack",)}, "ingredient"),
     ("loss", {"tasks": ("turn=50",)}, "task"),
     ("peers", {"urdf": "bruno"}, "robot")],
)  # fmt: skip
def test_what_a_suite_cannot_do_is_refused(name: str, asked: dict[str, Any], field: str) -> None:
    with pytest.raises(NaoGaitError) as refused:
        registry.plan(name, asked)
    assert refused.value.field == field


# -- figures ---------------------------------------------------------------------------------------


def test_the_papers_figures_are_drawn(tmp_path: Path) -> None:
    pytest.importorskip("mujoco")
    asked = options("paper", seed=2).but(parameters=load_preset("paper"))
    files = paper_figures(asked, tmp_path / "figures")
    assert [file.name for file in files] == [f"paper_figure_{number}.png" for number in (4, 6, 7)]
    assert all(file.read_bytes().startswith(b"\x89PNG") for file in files)


def test_the_largest_pushes_are_drawn(tmp_path: Path) -> None:
    found = {f"push_spot_{way}_max": 2.0 for way in ("left", "right", "back")}
    path = tmp_path / "push.png"
    assert push_figure(found, path) == path
    assert path.stat().st_size > 3000
    assert push_figure({"push_stand_left_max": 2.0}, path) is None
