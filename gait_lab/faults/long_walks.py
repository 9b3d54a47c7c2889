"""Long walks through the entry: with lost messages, and for hours."""

import gc
import math
import os
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from gait_lab.faults.campaign import FaultRun
from gait_lab.faults.fault import Fault
from gait_lab.faults.fault_trial import World
from gait_lab.faults.harness import PERIOD
from gait_lab.faults.network_faults import Loss
from gait_lab.trials.random_commands import RandomCommands
from gait_lab.trials.rollout import RolloutSpec, make_pair
from gait_lab.trials.tasks import TASKS
from nao_lipm_gait.types import VelocityCommand

START = 1.0
"""[s] The robot stands so long."""
SETTLED = 3.0
"""[s] from when on speed is measured."""


@dataclass(frozen=True, slots=True)
class LossWalk:
    """A straight walk during which messages are lost all the time."""

    run: FaultRun
    """Its seed is that of the robot."""
    share: float
    """Of all messages, in both directions."""
    speed: float
    """[m/s] asked."""
    seconds: float


@dataclass(frozen=True, slots=True)
class LossVerdict:
    """How such a walk went."""

    walk: LossWalk
    fell_at: float | None
    """[s]"""
    speed: float
    """[m/s] mean in the torso's own heading; NaN after a fall."""
    violations: tuple[str, ...]


def rollout_spec(run: FaultRun) -> RolloutSpec:
    return RolloutSpec(
        task=TASKS["stand"], robot_seed=run.seed, parameters=run.parameters, plant=run.plant,
        plant_options=run.plant_options, urdf=run.urdf, engine=run.engine,
    )  # fmt: skip


def walk_with_loss(walk: LossWalk) -> LossVerdict:
    """One robot, until the end or a fall."""
    fault = Loss(np.random.default_rng(max(0, walk.run.seed)))
    fault.begin, fault.share = 0.0, walk.share
    simulation, _ = make_pair(rollout_spec(walk.run))
    speeds = []
    with simulation:
        command = VelocityCommand(walk.speed, 0.0, 0.0)
        world = World(simulation, walk.run.parameters, fault, command, START)
        for _ in range(round((START + walk.seconds) / PERIOD)):
            world.step()
            if world.fallen:
                break
            if world.seconds() > START + SETTLED:
                speeds.append(float(world.truth.torso_linear_velocity_in_torso[0]))
        judge = world.judge
        violations = tuple(f"{kind}: {text}" for kind, text in judge.violations.items())
        mean = math.nan if judge.fell_at is not None or not speeds else float(np.mean(speeds))
        return LossVerdict(walk, judge.fell_at, mean, violations)


@dataclass(frozen=True, slots=True)
class Sample:
    """The process after some walking."""

    seconds: float
    """Simulated."""
    memory: int
    """[bytes] resident."""
    objects: int
    """That the garbage collector knows."""
    falls: int
    steps: int
    violations: tuple[str, ...]


def soak(run: FaultRun, minutes: float, every: float = 10.0) -> Iterator[Sample]:
    """Random commands for so long in one process; a robot that fell is put back to its start."""
    simulation, _ = make_pair(rollout_spec(run))
    commands = RandomCommands((max(0, run.seed), 1))
    falls = steps = last = 0
    with simulation:
        fault = Fault(np.random.default_rng(0))
        world = World(simulation, run.parameters, fault, commands.at(0.0))
        down = 0
        for tick in range(1, round(minutes * 60.0 / PERIOD) + 1):
            asked = commands.at(world.seconds())
            # Half the full speeds: it is the process that shall be worn out, not the robot.
            world.command = VelocityCommand(0.5 * asked.x, 0.5 * asked.y, 0.5 * asked.yaw)
            world.step()
            status = world.gaits[0].entry.last_status
            count = 0 if status is None else status.step_count
            steps += max(0, count - last)
            last = count
            down = down + 1 if world.fallen else 0
            if down == 100:
                falls += 1
                world.reset_robot()
            if tick % round(every / PERIOD) == 0:
                gc.collect()
                violations = world.judge.violations.items()
                yield Sample(
                    world.seconds(), resident(), len(gc.get_objects()), falls, steps,
                    tuple(f"{kind}: {text}" for kind, text in violations),
                )  # fmt: skip


def resident() -> int:
    """[bytes] of memory that this process holds."""
    pages = int(Path("/proc/self/statm").read_text(encoding="ascii").split()[1])
    return pages * os.sysconf("SC_PAGE_SIZE")
