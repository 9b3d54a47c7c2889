"""Every suite: its rows and table with tiny settings, and what its numbers mean."""

import dataclasses
import itertools
import json
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from gait_lab import cli
from gait_lab.analysis.metrics import Metrics
from gait_lab.bench import BenchOptions, Score, catalogue, running
from gait_lab.bench.falls import FallDetection
from gait_lab.bench.suites import endurance, robust, speed, start
from gait_lab.bench.suites.delay import DELAYS, MOTOR_LAG, Late
from gait_lab.bench.suites.endurance import Stretch, Total, Way
from gait_lab.bench.suites.robust import PLANTS
from gait_lab.trials.rollout import RolloutResult, RolloutSpec, rollout
from gait_lab.trials.tasks import TASKS, RandomCommands, find_task
from nao_lipm_gait.errors import NaoGaitError
from nao_lipm_gait.parameters import load_preset
from sim_bridge.motors import TorqueLimits
from sim_bridge.world import World

SCHEMA = {"suite", "metric", "unit", "value", "paper", "engine", "plant", "robots", "seed"}
TINY: dict[str, dict[str, Any]] = {
    "speed": {"tasks": ("forward=10",), "window": 0.5},
    "error": {"tasks": ("spot", "forward=10"), "window": 0.5},
    "push": {"tasks": ("spot",), "directions": ("left",), "phases": 1, "impulses": (0.5,)},
    "start": {"open_loop": "off"},
    "endurance": {"metres": 0.3},
    "delay": {"tasks": ("forward=10",), "window": 0.5, "open_loop": "off"},
    "robust": {"tasks": ("forward=10",), "window": 0.5, "open_loop": "off"},
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
}  # fmt: skip


def run(suite: str, file: Path) -> list[dict[str, Any]]:
    asked = {"robots": 1, "seed": 2, "engine": "mujoco", "jobs": 1, "show": False, **TINY[suite]}
    said: list[str] = []
    running.run(suite, asked, json_file=file, out=said.append)
    assert said[0].strip()
    rows: list[dict[str, Any]] = json.loads(file.read_text())
    return rows


@pytest.mark.parametrize("suite", TINY)
def test_a_suite_writes_its_rows_and_the_same_ones_again(suite: str, tmp_path: Path) -> None:
    pytest.importorskip("mujoco")
    rows = run(suite, tmp_path / "rows.json")
    names = [row["metric"] for row in rows]
    assert len(set(names)) == len(names)
    assert set(HEADLINES[suite]) <= set(names)
    for row in rows:
        assert set(row) == SCHEMA
        assert (row["suite"], row["engine"], row["robots"], row["seed"]) == (suite, "mujoco", 1, 2)
        assert row["value"] is None or math.isfinite(row["value"])
    assert run(suite, tmp_path / "again.json") == rows


def metrics(**changes: Any) -> Metrics:
    values: dict[str, Any] = {field.name: 0.0 for field in dataclasses.fields(Metrics)}
    values |= {"fell": False, "fall_time": None, "alarm_time": None, "support_changes": 0}
    return Metrics(**{**values, **changes})


def score(name: str, *scored: Metrics) -> Score:
    task = find_task(name)
    return Score(task, True, tuple(RolloutResult(RolloutSpec(task), m) for m in scored))


def test_half_speed_is_judged_by_the_robot_that_is_furthest_off() -> None:
    half = score("forward=20", metrics(speed_x=0.19), metrics(speed_x=0.23))
    assert speed.deviations(half) == pytest.approx([5.0, 15.0])
    rows = {row.metric: row.value for row in speed._half_rows(half)}
    assert rows["forward_error_worst"] == pytest.approx(15.0)
    fell = score("forward=20", metrics(speed_x=0.2), metrics(fell=True, fall_time=3.0))
    assert {row.metric: row.value for row in speed._half_rows(fell)}["forward_error_worst"] is None


def test_a_task_at_half_speed_asks_for_half_of_everything() -> None:
    half = TASKS["diagonal"].scaled(0.5, "half")
    for time in (0.0, 2.0, 3.3, 9.0):
        full, less = TASKS["diagonal"].command_at(time), half.command_at(time)
        assert (less.x, less.y) == pytest.approx((full.x / 2, full.y / 2))


def test_falls_belong_to_the_start_or_to_the_stop() -> None:
    fallen = (metrics(fell=True, fall_time=t) for t in (1.5, 4.9, start.STOP_TIME + 0.1))
    walks_on = metrics(speed_x=0.05)
    steps = metrics(support_changes=1)
    tally = start.Tally(score("forward", *fallen, metrics(), walks_on, steps))
    assert (tally.starts, tally.start_falls, tally.stop_falls, tally.stopped) == (6, 2, 1, 1)


def test_two_hundred_starts_are_the_usual_ones() -> None:
    options = catalogue.options_for("start", {})
    assert options.robots * len(start.cases()) == 200
    assert not any(command.is_zero for command in start.cases().values())


def test_random_commands_are_smooth_bounded_and_seeded() -> None:
    commands, again, other = (RandomCommands(seed) for seed in ((3, 0), (3, 0), (3, 1)))
    times = [0.01 * tick for tick in range(30000)]
    asked = [commands.at(time) for time in times]
    assert asked == [again.at(time) for time in times]
    assert asked != [other.at(time) for time in times]
    limits = (TASKS["forward"].asked, TASKS["side"].asked, TASKS["turn"].asked)
    for axis, limit in zip(("x", "y", "yaw"), limits, strict=True):
        values = [getattr(command, axis) for command in asked]
        assert max(values) > 0.5 * limit
        assert min(values) < -0.5 * limit
        assert max(map(abs, values)) <= limit
        jumps = [abs(b - a) for a, b in itertools.pairwise(values)]
        assert max(jumps) <= 2.0 * limit * 0.01 * 1.5 + 1e-9
    assert any(command.is_zero for command in asked[200:])


def test_falls_per_kilometre_count_every_stretch() -> None:
    fell = Stretch(20.0, 200.0, True, 0.3, False)
    whole = Stretch(30.0, 300.0, False, None, True)
    total = Total(True, (Way((fell, whole)), Way((Stretch(50.0, 500.0, False, None, False),))))
    assert total.kilometres == pytest.approx(0.1)
    assert total.falls == 1
    assert total.falls_per_km == pytest.approx(10.0)
    assert total.without_fall == 1
    assert total.speed == pytest.approx(10.0)
    assert total.detection.falls == 1
    assert total.detection.false_alarms == 1
    assert total.detection.lead_median == pytest.approx(0.3)
    assert Total(True, (Way(()),)).falls_per_km is None


def test_after_a_fall_the_way_goes_on_with_other_noise(monkeypatch: pytest.MonkeyPatch) -> None:
    walked: list[int] = []

    def stretch(spec: RolloutSpec, number: int, metres: float, seconds: float) -> Stretch:
        walked.append(number)
        return Stretch(min(4.0, metres), 30.0, metres > 4.0, None, False)

    monkeypatch.setattr(endurance, "_stretch", stretch)
    way = endurance.walk_way(endurance._Asked(RolloutSpec(TASKS["stand"]), 10.0))
    assert walked == [0, 1, 2]
    assert way.metres == 10.0
    assert way.falls == 2


def test_a_robot_that_gets_nowhere_is_given_up(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(endurance, "_stretch", lambda *_: Stretch(0.0, 2.0, True, 0.0, False))
    way = endurance.walk_way(endurance._Asked(RolloutSpec(TASKS["stand"]), 50.0))
    assert way.falls == endurance.FALLS_MAX
    assert way.metres == 0.0


def test_a_matched_gait_bridges_the_delay_and_the_motors() -> None:
    for delay in DELAYS:
        variant = Late(delay, True, delay / 1000.0 + MOTOR_LAG).variant
        assert dict(variant.plant)["sensors.delay"] == pytest.approx(delay / 1000.0)
        assert variant.parameters["feedback_delay"] == pytest.approx(delay / 1000.0 + 0.02)


def torque_limits(world: World) -> TorqueLimits:
    robot = world.robot
    return TorqueLimits(robot.description, robot.plant, robot.individual)


def test_motors_at_the_effort_of_the_urdf_are_weaker_at_every_speed() -> None:
    task = dataclasses.replace(find_task("forward=10"), start=0.1, end=0.3)
    weak = PLANTS["weak_motors"]
    spec = RolloutSpec(task, plant_options=weak.plant, urdf_effort=weak.urdf_effort)
    from gait_lab.trials.rollout import make_pair

    simulation, gait = make_pair(spec)
    with simulation:
        limits, robot = gait.robot.limits, simulation.robot.description
        assert {name: motor.stall_torque for name, motor in robot.motors.items()} == {
            name: limits[name].effort for name in robot.motors
        }
        usual, _ = make_pair(RolloutSpec(task))
        joint = robot.index("LKneePitch")
        with usual:
            for speed_of_joint in (0.0, 2.0, 5.0):
                weakest, usual_limit = (
                    float(torque_limits(each).driving(np.full(22, speed_of_joint))[joint])
                    for each in (simulation, usual)
                )
                assert weakest < usual_limit
    assert not rollout(spec).metrics.fell
    rows = robust._rows("weak_motors", score("forward", metrics(speed_x=0.3)))
    assert rows[1].metric == "weak_motors_forward_upright_share"
    assert rows[1].value == 100.0


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


@pytest.mark.parametrize(
    ("arguments", "word"),
    [(["bench", "hop"], "suite"), (["bench", "push", "--direction", "up"], "direction"),
     (["bench", "push", "--impulse", "-1"], "impulse"),
     (["bench", "endurance", "--metres", "0"], "metres"),
     (["bench", "speed", "--engine", "none"], "engine"),
     (["bench", "delay", "--task", "fly"], "task"),
     (["bench", "speed", "--task", "forward=0"], "task"),
     (["bench", "start", "--task", "forward=20"], "--task"),
     (["bench", "compute", "--robots", "20"], "--robots"),
     (["bench", "faults", "--open-loop", "off"], "--open-loop"),
     (["bench", "loss", "--task", "turn=50"], "forward walks"),
     (["bench", "all", "--task", "turn"], "one forward task")],
)  # fmt: skip
def test_bad_arguments_give_one_line_and_a_bad_exit_status(
    arguments: list[str], word: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert cli.main(arguments) != 0
    error = capsys.readouterr().err
    assert error.count("\n") == 1
    assert word in error


def test_the_closed_loop_is_the_preset_and_the_open_one_only_lacks_feedback() -> None:
    preset = load_preset("default")
    options = BenchOptions(parameters=preset)
    assert options.loop_parameters(True) == preset
    assert options.loop_parameters(False) == preset.replace(feedback=False)
    with pytest.raises(NaoGaitError, match="open-loop"):
        BenchOptions(open_loop="both")
