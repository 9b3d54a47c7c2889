"""The trial loop: what a policy commands and disturbs, and when a trial ends."""

from collections.abc import Iterator
from itertools import islice

import numpy as np
import pytest

from robot_core.errors import NaoGaitError
from robot_core.types import STANDSTILL, JointTargets, VelocityCommand
from sim_bridge.trials.trial import (
    Action,
    HeldCommand,
    Policy,
    Push,
    Tick,
    TimedCommands,
    Trial,
    TrialSpec,
    make_gait,
    make_world,
    run,
)
from sim_bridge.world import World

SPEC = TrialSpec(robot_seed=-1, engine="mujoco")
FORWARD = VelocityCommand(0.1)

pytest.importorskip("mujoco")


@pytest.fixture
def world() -> Iterator[World]:
    with make_world(SPEC) as world:
        yield world


def ticks_of(world: World, policy: Policy, count: int, **options: bool) -> list[Tick]:
    return list(islice(run(world, make_gait(SPEC), policy, **options), count))


def test_it_begins_at_rest_and_yields_every_control_period(world: World) -> None:
    ticks = ticks_of(world, HeldCommand(), 11)
    assert [tick.truth.stamp for tick in ticks] == [10_000_000 * n for n in range(11)]
    assert all(tick.status is None for tick in ticks[:4]), "the sensor delay is 40 ms"
    assert all(tick.status is not None for tick in ticks[4:])


def test_a_command_comes_with_its_time_and_the_tick_before(world: World) -> None:
    asked: list[tuple[float, int | None]] = []

    class Noting(Policy):
        def command(self, time: float, tick: Tick | None) -> Action:
            asked.append((time, None if tick is None else tick.truth.stamp))
            return FORWARD

    ticks = ticks_of(world, Noting(), 3)
    assert [tick.command for tick in ticks] == [FORWARD] * 3
    assert asked == [(0.0, None), (0.01, 0), (0.02, 10_000_000)]


def test_no_command_ends_the_trial(world: World) -> None:
    class Short(Policy):
        def command(self, time: float, tick: Tick | None) -> Action:
            return STANDSTILL if time < 0.045 else None

    assert len(list(run(world, make_gait(SPEC), Short()))) == 5


def test_targets_in_place_of_a_command_pass_the_gait_by(world: World) -> None:
    bent = np.array(world.robot.description.stand_pose)
    bent[world.robot.description.index("LShoulderPitch")] += 0.3
    ticks = ticks_of(world, HeldCommand(JointTargets(0, bent)), 60)
    assert all(tick.status is None for tick in ticks)
    assert ticks[-1].truth.joint_position == pytest.approx(bent, abs=0.05)


def test_a_trial_ends_with_a_fall_unless_it_goes_on_past_it(world: World) -> None:
    limp = JointTargets(0, np.array(world.robot.description.stand_pose), 0.0)
    ticks = ticks_of(world, HeldCommand(limp), 300)
    assert [tick.fallen for tick in ticks[-2:]] == [False, True]
    assert len(ticks) < 300
    world.reset()
    assert len(ticks_of(world, HeldCommand(limp), 300, past_falls=True)) == 300


@pytest.mark.parametrize("ahead", [False, True])
def test_a_push_acts_at_its_time_relative_to_the_heading(world: World, ahead: bool) -> None:
    push = Push(time=0.2, impulse=2.0, direction=np.pi / 2.0)
    ticks = ticks_of(world, TimedCommands(lambda _: STANDSTILL, (push,), ahead=ahead), 35)
    speed = np.array([tick.truth.torso_linear_velocity_in_torso[1] for tick in ticks])
    assert np.abs(speed[:21]).max() < 0.02
    assert speed[25:31].max() > 0.1


def test_a_refused_specification_names_its_field() -> None:
    with pytest.raises(NaoGaitError, match="engine"):
        make_world(TrialSpec(engine="bullet"))


def test_a_trial_is_commanded_step_by_step_and_remembers_a_fall() -> None:
    with Trial(SPEC) as trial, make_world(SPEC) as world:
        *_, same = ticks_of(world, HeldCommand(), 21)
        assert trial.advance(0.2).truth.stamp == 200_000_000
        assert np.array_equal(trial.tick.truth.joint_position, same.truth.joint_position)
        trial.action = FORWARD
        assert trial.step().command == FORWARD
        trial.action = JointTargets(0, np.array(trial.gait.robot.stand_pose), 0.0)
        assert sum(1 for _ in trial.steps(2.5)) == 250
        assert trial.tick.fallen
        assert not trial.stood
