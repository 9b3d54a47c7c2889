"""Rollouts are deterministic, stop at a fall and run in parallel with the same results."""

import dataclasses
import itertools
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from nao_lipm_gait.gait import Gait
from nao_lipm_gait.parameters import GaitParameters, load_preset
from robot_core.errors import NaoGaitError
from robot_core.types import STANDSTILL, GaitStatus, JointTargets, SensorFrame, VelocityCommand
from sim_bridge.trials.parallel import parallel_map
from sim_bridge.trials.result_cache import ResultCache
from sim_bridge.trials.rollout import RolloutSpec, make_pair, rollout, run_all
from sim_bridge.trials.tasks import Task, find_task, walk
from sim_bridge.trials.trace import Recorder, Trace
from sim_bridge.trials.trial import Push, TimedCommands, run

pytest.importorskip("mujoco")
SHORT = dataclasses.replace(walk("forward", x=0.1, axis="x"), start=4.0, end=5.0)


def same(a: Trace, b: Trace) -> bool:
    return all(
        np.array_equal(getattr(a, f.name), getattr(b, f.name), equal_nan=True)
        for f in dataclasses.fields(Trace)
    )


@pytest.fixture(scope="module")
def walked() -> Any:
    parameters = load_preset("default")
    spec = RolloutSpec(
        SHORT, robot_seed=3, parameters=parameters, keep_trace=True, engine="mujoco"
    )
    return spec, rollout(spec)


def test_the_same_spec_gives_the_same_walk_bit_for_bit(walked: Any) -> None:
    spec, first = walked
    again = rollout(spec)
    assert same(first.trace, again.trace)
    assert first.metrics == again.metrics


def test_another_robot_or_noise_walks_differently(walked: Any) -> None:
    spec, first = walked
    for change in ({"robot_seed": 4}, {"noise_seed": 1}):
        assert not same(first.trace, rollout(dataclasses.replace(spec, **change)).trace)


def test_the_trace_covers_the_task_at_the_control_rate(walked: Any) -> None:
    _, result = walked
    trace = result.trace
    assert len(trace) == 501
    assert trace.time[-1] == pytest.approx(5.0)
    assert set(np.diff(trace.stamp)) == {10_000_000}
    known = trace.status_stamp >= 0
    assert set((trace.stamp - trace.status_stamp)[known]) == {40_000_000}
    assert trace.command[-1] == pytest.approx(SHORT.command_at(SHORT.end).x * np.array((1, 0, 0)))
    assert not result.metrics.fell
    assert result.metrics.duration == pytest.approx(1.0)


def test_a_fall_ends_the_rollout() -> None:
    # Far beyond what the robot can do, at once and without feedback.
    parameters = GaitParameters(
        feedback=False, extensions=False, step_side_max=0.2,
        step_turn_max=1.5, step_turn_rate=1.5,
    )  # fmt: skip
    command = VelocityCommand(0.6, 0.6, 6.0)
    task = Task("tumble", ((1.0, STANDSTILL), (1.1, command)), 1.0, 30.0)
    result = rollout(
        RolloutSpec(task, parameters=parameters, keep_trace=True, engine="mujoco")
    )
    assert result.metrics.fell
    assert result.trace is not None
    assert result.trace.time[-1] == result.metrics.fall_time < 30.0


@pytest.mark.parametrize("delay", [0.0, 0.025, 0.04])
def test_answers_ahead_of_time_change_nothing(delay: float) -> None:
    def walked(ahead: bool) -> Trace:
        options = (("sensors.delay", delay),)
        spec = RolloutSpec(
            find_task("diagonal"), robot_seed=5, plant_options=options, engine="mujoco"
        )
        simulation, gait = make_pair(spec)
        recorder, push = Recorder(), Push(4.0, 6.0, 1.0)
        policy = TimedCommands(spec.task.command_at, (push,), ahead=ahead)
        with simulation:
            for tick in itertools.islice(run(simulation, gait, policy), 500):
                recorder.add(tick.truth, tick.command, tick.status)
        return recorder.trace()

    one_by_one, in_a_row = walked(False), walked(True)
    assert len(one_by_one) > 400
    assert one_by_one.com_estimated_in_q[-1].any()
    assert same(one_by_one, in_a_row)


class Faltering:
    """A gait that breaks down at its second frame."""

    def __init__(self, gait: Gait, calls: list[str]) -> None:
        self._gait = gait
        self._calls = calls

    def step(self, frame: SensorFrame, command: VelocityCommand) -> JointTargets:
        self._calls.append("gait")
        if self._calls.count("gait") == 2:
            raise RuntimeError("broken down")
        return self._gait.step(frame, command)

    @property
    def status(self) -> GaitStatus:
        return self._gait.status


def test_answers_come_in_a_row_and_what_is_raised_in_its_period() -> None:
    simulation, gait = make_pair(RolloutSpec(find_task("forward"), engine="mujoco"))
    calls: list[str] = []
    policy = TimedCommands(find_task("forward").command_at)
    with simulation:
        ticks = run(simulation, Faltering(gait, calls), policy)

        def walk_on() -> None:
            for _ in ticks:
                calls.append("tick")

        with pytest.raises(RuntimeError, match="broken down"):
            walk_on()
    # at rest; then all that is known: nothing for three periods, the first frame, and the second
    assert calls == ["tick", "gait", "gait", "tick", "tick", "tick", "tick"]


def _square(value: int) -> int:
    return value * value


def test_parallel_results_keep_the_order_and_equal_the_serial_ones() -> None:
    assert parallel_map(_square, range(7), jobs=2, show=False) == [n * n for n in range(7)]
    task = dataclasses.replace(SHORT, start=3.0, end=3.5)
    specs = [RolloutSpec(task, robot_seed=seed, engine="mujoco") for seed in (0, 1)]
    together = run_all(specs, jobs=2, show=False)
    assert [result.spec.robot_seed for result in together] == [0, 1]
    assert [result.metrics for result in together] == [rollout(spec).metrics for spec in specs]


@dataclasses.dataclass(frozen=True)
class _Squared:
    number: int
    square: int


_RUN: list[int] = []


def _squared(number: int) -> _Squared:
    _RUN.append(number)
    return _Squared(number, number * number)


def test_a_finished_run_is_not_run_again(tmp_path: Path) -> None:
    file = tmp_path / "runs.jsonl"
    _RUN.clear()
    for last in (3, 5):
        kept = ResultCache(str(file), _Squared)
        found = parallel_map(_squared, range(last), jobs=1, show=False, kept=kept)
        assert found == [_Squared(n, n * n) for n in range(last)]
    assert _RUN == [0, 1, 2, 3, 4]


@pytest.mark.usefixtures("mujoco_only")
def test_finished_walks_come_back_from_their_file(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    file = str(tmp_path / "walks.jsonl")
    task = find_task("spot").lasting(0.5)
    specs = [RolloutSpec(task, robot_seed=seed, engine="mujoco") for seed in (0, 1)]
    walked = run_all(specs, jobs=1, show=False, resume=file)
    monkeypatch.setattr("sim_bridge.trials.rollout.rollout", pytest.fail)
    found = run_all(specs, jobs=1, show=False, resume=file)
    assert repr(found) == repr(walked)


@pytest.mark.parametrize("text", ["nonsense", "[]", '{"square": 4}'])
def test_a_file_that_holds_no_finished_runs_is_refused_in_one_line(
    tmp_path: Path, text: str
) -> None:
    file = tmp_path / "runs.jsonl"
    file.write_text(text + "\n")
    with pytest.raises(NaoGaitError, match="finished runs") as error:
        ResultCache(str(file), _Squared)
    assert "\n" not in str(error.value)


def test_a_finished_run_of_another_kind_is_refused(tmp_path: Path) -> None:
    file = str(tmp_path / "runs.jsonl")
    ResultCache(file, _Squared).add(2, _Squared(2, 4))
    with pytest.raises(NaoGaitError, match="resume"):
        ResultCache(file, GaitStatus).result(2)


def test_the_ideal_plant_walks_with_the_preset_made_for_it() -> None:
    task = find_task("forward=25").lasting(2.0)
    spec = RolloutSpec(
        task, robot_seed=-1, noise_seed=0, plant="ideal", parameters=load_preset("ideal")
    )
    metrics = rollout(spec).metrics
    assert not metrics.fell
    assert metrics.speed_x == pytest.approx(0.25, rel=0.1)
    assert metrics.com_error_y < 0.001
