"""Any command is walkable: deadband, mean over a step, speeds above the limits."""

import itertools

import pytest
from hypothesis import given
from hypothesis import strategies as st

from nao_lipm_gait.presets import preset_for
from nao_lipm_gait.velocity_control import DEADBAND, StepMean, outside_deadband
from robot_core.robot import load_robot
from robot_core.types import STANDSTILL, GaitState, VelocityCommand
from sim_bridge.trials.rollout import RolloutSpec, rollout
from sim_bridge.trials.tasks import STAND_TIME, Task
from sim_bridge.trials.trial import Trial, TrialSpec

NUMBERS = st.floats(-5.0, 5.0)
COMMANDS = st.builds(VelocityCommand, NUMBERS, NUMBERS, NUMBERS)


@given(COMMANDS)
def test_an_axis_is_commanded_as_it_is_or_not_at_all(command: VelocityCommand) -> None:
    found = outside_deadband(command)
    for asked, limit, walked in zip(command, DEADBAND, found, strict=True):
        assert walked == (asked if abs(asked) >= limit else 0.0)


@given(st.lists(COMMANDS.filter(lambda command: not command.is_zero), min_size=1, max_size=30))
def test_a_walk_gets_the_mean_since_the_step_began(commands: list[VelocityCommand]) -> None:
    mean = StepMean()
    mean.update(VelocityCommand(9.0, 9.0, 9.0), 1)
    found = [mean.update(command, 2) for command in commands][-1]
    expected = [sum(axis) / len(commands) for axis in zip(*commands, strict=True)]
    assert list(found) == pytest.approx(expected, abs=1e-12)


def test_a_stop_counts_at_once_and_what_was_before_it_is_forgotten() -> None:
    mean, fast, slow = StepMean(), VelocityCommand(0.4), VelocityCommand(0.1)
    for _ in range(10):
        mean.update(fast, 1)
    assert mean.update(STANDSTILL, 1).is_zero
    assert mean.update(slow, 1) == slow


def test_a_velocity_in_the_deadband_does_not_make_a_robot_step() -> None:
    pytest.importorskip("mujoco")
    with Trial(TrialSpec(engine="mujoco"), action=VelocityCommand(1e-9, -9e-4, 4e-4)) as trial:
        states = {tick.status.state for tick in trial.steps(2.0) if tick.status is not None}
    assert states == {GaitState.STAND}


@pytest.mark.parametrize("urdf", ["nao_h21_v33", "bruno"])
def test_far_above_the_limits_a_robot_walks_as_fast_as_it_can(urdf: str) -> None:
    """Commands at once from standing: straight ahead, and mixed in all axes."""
    pytest.importorskip("mujoco")
    parameters, speeds = preset_for(load_robot(urdf), "default"), []
    for x, y, yaw in ((0.6, 0.0, 0.0), (3.0, 0.0, 0.0), (2.0, -1.0, 5.0)):
        knots = ((STAND_TIME, STANDSTILL), (STAND_TIME + 0.01, VelocityCommand(x, y, yaw)))
        task = Task("above", knots, STAND_TIME + 6.0, STAND_TIME + 9.0, "x")
        spec = RolloutSpec(task, robot_seed=1, urdf=urdf, parameters=parameters, engine="mujoco")
        metrics = rollout(spec).metrics
        assert not metrics.fell
        speeds.append(metrics.speed_x)
    assert speeds[1] == pytest.approx(speeds[0], rel=0.04)
    assert speeds[2] > 0.02


def test_a_turn_that_alternates_within_a_step_turns_nowhere() -> None:
    """At 50 Hz with a mean of 0; read once a step it turned by up to 0.5 rad/s."""
    pytest.importorskip("mujoco")
    with Trial(TrialSpec(engine="mujoco"), action=STANDSTILL) as trial:
        trial.advance(2.0)
        for sign in itertools.islice(itertools.cycle((2.0, -2.0)), 250):
            trial.action = VelocityCommand(0.0, 0.0, sign)
            tick = trial.advance(0.02)
        assert trial.stood
    assert tick.status is not None
    assert abs(tick.status.base_footprint_in_odom[2]) < 0.35
