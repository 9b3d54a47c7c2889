"""The suite `posture`: what its numbers mean, with short walks."""

import json
from pathlib import Path

import pytest
from scores import metrics, score

from gait_lab.bench import BenchOptions, Score, suite
from gait_lab.bench.suites import posture
from robot_core.errors import NaoGaitError
from robot_core.types import STANDSTILL
from sim_bridge.trials.tasks import STAND_TIME, Task


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
    kinds = {(p.forward != 0.0, p.side != 0.0, p.turn != 0.0) for p in posture.SOCCER}
    assert (False, False, False) in kinds, "it stands"
    assert len(kinds) >= 4


def score_of(task: Task, *fall_times: float | None) -> Score:
    """Robots that walk at 0.4 m/s until they fall."""
    walked = {"speed_x": 0.4, "duration": 5.0, "support_changes": 10}
    return score(
        task, *(metrics(**walked, fell=time is not None, fall_time=time) for time in fall_times)
    )


def test_falls_are_counted_from_the_beginning_of_the_walk() -> None:
    task = posture.straight_task(0.4, 5.0)
    halves = (
        posture.Half("straight", "on", score_of(task, None, None)),
        posture.Half("straight", "off", score_of(task, STAND_TIME + 3.0, STAND_TIME + 9.0)),
    )
    rows = {row.metric: row for half in halves for row in half.rows}
    assert rows["straight_on_falls"].value == 0
    assert rows["straight_off_fall_share"].value == 100.0
    assert rows["straight_off_time_to_fall_median"].value == pytest.approx(6.0)
    assert rows["straight_off_time_to_fall_median"].paper == 60.0
    assert rows["straight_on_worst"].value == pytest.approx(40.0)
    assert rows["straight_off_worst"].value is None, "a fallen robot has no speed"


def test_the_suite_runs_on_bruno_with_and_without_gains(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    pytest.importorskip("mujoco")
    monkeypatch.setattr(posture, "SOCCER", posture.SOCCER[:1])
    monkeypatch.setattr(posture, "LAPS", 1)
    seen: list[dict[str, float]] = []
    walk_all = posture.walk_all

    def spied(options: BenchOptions, variants, tasks, label):  # type: ignore[no-untyped-def]
        seen.extend(dict(variant.parameters) for variant in variants)
        assert options.urdf == "bruno"
        assert options.parameters.walk == "zmp", "the robot's own preset"
        return walk_all(options, variants, tasks, label=label)

    monkeypatch.setattr(posture, "walk_all", spied)
    file = tmp_path / "rows.json"
    asked = {"robots": 1, "engine": "mujoco", "window": 0.5, "jobs": 1, "show": False}
    said: list[str] = []
    suite.run("posture", asked, json_file=file, out=said.append)
    assert seen == [{}, dict.fromkeys(posture.GAINS, 0.0)]
    rows = {row["metric"]: row["value"] for row in json.loads(file.read_text())}
    assert rows["start_on_runs"] == rows["soccer_off_runs"] == 1
    assert rows["start_on_fall_share"] == rows["straight_on_fall_share"] == 0.0
    assert rows["straight_on_median"] > 30.0
    assert "Posture control" in said[0]


def test_an_unknown_experiment_is_refused() -> None:
    with pytest.raises(NaoGaitError, match="soccer, start, straight"):
        posture.experiments_of(posture.Options(experiments=("chess",)))


def test_only_one_forward_task_is_taken() -> None:
    for tasks in (("turn",), ("forward", "back")):
        with pytest.raises(NaoGaitError, match="forward"):
            posture.experiments_of(posture.Options(tasks=tasks))
