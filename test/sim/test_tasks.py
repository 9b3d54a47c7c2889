"""The commands of the rollout tasks."""

import math

import pytest

from robot_core.errors import NaoGaitError
from robot_core.types import STANDSTILL
from sim_bridge.trials import tasks
from sim_bridge.trials.tasks import RAMP_TIME, STAND_TIME, TASKS, Task, find_task, walk


@pytest.mark.parametrize("task", TASKS.values(), ids=list(TASKS))
def test_tasks_stand_first_and_hold_their_command_over_the_window(task: Task) -> None:
    assert task.command_at(0.0).is_zero
    assert task.end - task.start == pytest.approx(20.0)
    for time in (task.start, (task.start + task.end) / 2, task.end, task.end + 100):
        assert task.command_at(time) == task.command


@pytest.mark.parametrize("task", TASKS.values(), ids=list(TASKS))
def test_commands_never_jump(task: Task) -> None:
    step, period = 0.0, 0.01
    for tick in range(round(task.end / period)):
        before, after = task.command_at(tick * period), task.command_at((tick + 1) * period)
        step = max(step, abs(after.x - before.x), abs(after.y - before.y))
    assert step <= TASKS["forward"].asked / tasks.RAMP_TIME * period + 1e-9


def test_ramp_is_linear() -> None:
    task = walk("test", x=0.3, y=-0.15, axis="x")
    assert task.command_at(STAND_TIME) == STANDSTILL
    halfway = task.command_at(STAND_TIME + RAMP_TIME / 2.0)
    assert (halfway.x, halfway.y) == pytest.approx((0.15, -0.075))


def test_a_speed_can_be_given_in_the_unit_of_the_table() -> None:
    assert find_task("forward=31").command.x == pytest.approx(0.31)
    assert find_task("back=22").command.x == pytest.approx(-0.22)
    assert find_task("turn_right=92").command.yaw == pytest.approx(-math.radians(92))
    curve = find_task("curve=30").command
    assert (curve.x, curve.yaw) == pytest.approx((0.3, math.radians(40)))
    assert find_task("side") is TASKS["side"]


@pytest.mark.parametrize("text", ["run", "forward=", "forward=fast", "forward=-1", "forward=nan",
                                  "forward=inf", "spot=3", ""])  # fmt: skip
def test_bad_task_names_are_refused(text: str) -> None:
    with pytest.raises(NaoGaitError, match=r"^task: got"):
        find_task(text)


def test_spot_steps_without_being_a_standstill() -> None:
    assert not TASKS["spot"].command.is_zero
    assert TASKS["stand"].command.is_zero


def test_a_task_needs_increasing_times_and_a_window() -> None:
    with pytest.raises(NaoGaitError, match="increasing times"):
        Task("bad", ((1.0, STANDSTILL), (1.0, STANDSTILL)), 0.0, 1.0)
    with pytest.raises(NaoGaitError, match="start < end"):
        Task("bad", ((1.0, STANDSTILL),), 2.0, 2.0)
