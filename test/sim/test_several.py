"""Several gaits on one pitch, in one process."""

import math
from itertools import islice

import numpy as np
import pytest

from robot_core.types import STANDSTILL, VelocityCommand
from sim_bridge.scene import load_scene
from sim_bridge.trials.trial import (
    HeldCommand,
    Policy,
    TimedCommands,
    make_gaits,
    make_scene_world,
    run_several,
)

pytestmark = pytest.mark.usefixtures("mujoco_only")
FORWARD = VelocityCommand(0.1, 0.0, 0.0)


def test_each_robot_does_what_its_own_policy_commands() -> None:
    commands = (STANDSTILL, FORWARD, FORWARD, STANDSTILL)
    with make_scene_world(load_scene("pitch")) as world:
        starts = [robot.spec.pose for robot in world.robots]
        policies = [TimedCommands(lambda _, each=each: each) for each in commands]  # type: ignore[misc]
        *_, ticks = islice(run_several(world, make_gaits(world), policies), 401)
        assert world.time == 4_000_000_000
    for command, (x, y, heading), tick in zip(commands, starts, ticks, strict=True):
        moved = tick.truth.torso_position[:2] - (x, y)
        ahead = moved @ np.array((math.cos(heading), math.sin(heading)))
        assert not tick.fallen
        if command is FORWARD:
            assert ahead > 0.15
        else:
            assert np.linalg.norm(moved) < 0.05


def test_one_policy_ends_the_trial_of_all() -> None:
    class Ends(Policy):
        def command(self, time: float, tick: object) -> VelocityCommand | None:
            return None if time > 0.055 else STANDSTILL

    with make_scene_world(load_scene("pitch_small")) as world:
        policies = [HeldCommand(), HeldCommand(), Ends(), HeldCommand()]
        assert len(list(run_several(world, make_gaits(world), policies))) == 6


def test_the_same_scene_gives_the_same_walk_to_the_last_bit() -> None:
    def ends() -> list[np.ndarray]:
        with make_scene_world(load_scene("pitch_small"), noise_seed=3) as world:
            policies = [TimedCommands(lambda _: FORWARD) for _ in world.robots]
            *_, ticks = islice(run_several(world, make_gaits(world), policies), 101)
        return [tick.truth.joint_position for tick in ticks]

    for first, again in zip(ends(), ends(), strict=True):
        assert np.array_equal(first, again)
