"""Where the time of a simulation goes: physics steps alone, and several gaits on one pitch."""

import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from itertools import islice
from typing import Any

import numpy as np

from robot_core.types import JointTargets, VelocityCommand
from sim_bridge.engines.registry import make_backend
from sim_bridge.motors import Setpoints
from sim_bridge.plant import Plant
from sim_bridge.scene import Scene
from sim_bridge.state import StepInput
from sim_bridge.trials.trial import (
    CONTROL_PERIOD,
    Tick,
    TimedCommands,
    make_gaits,
    make_scene_world,
    run_several,
)
from sim_bridge.world import World

BLOCK = 100
"""Control periods after which the next part has its turn, so that other load on the machine slows
all of them alike."""
CIRCLE = VelocityCommand(0.12, 0.0, 0.4)
"""Walked by each robot of a scene: a circle of 0.3 m, on which it meets nobody."""
_NO_PUSH = np.zeros(3)
Targets = Sequence[JointTargets | None]
"""Of the robots of a world in one control period."""


class PhysicsSteps:
    """The physics steps of a world alone."""

    def __init__(self, world: World, engine: str) -> None:
        """Build the engine of this world once more.

        Args:
            world: Its robots and surroundings.
            engine: `pybullet` or `mujoco`.
        """
        robots = world.robots
        self._backend = make_backend(
            engine, [robot.model for robot in robots], world.surroundings
        )
        self._backend.reset([robot.start for robot in robots])
        self._setpoints = []
        for robot in robots:
            steps = round(CONTROL_PERIOD / robot.plant.physics.step)
            setpoints = Setpoints(robot.description, robot.plant, robot.individual, steps)
            setpoints.reset(robot.start.joint_position - robot.individual.joint_zero)
            self._setpoints.append(setpoints)
        self._targets = [setpoints.current for setpoints in self._setpoints]

    def inputs(self, targets: Sequence[Targets]) -> list[tuple[StepInput, ...]]:
        """The inputs of all robots for every physics step of these control periods."""
        inputs: list[tuple[StepInput, ...]] = []
        for each in targets:
            rows = []
            for index, given in enumerate(each):
                if given is not None:
                    self._targets[index] = given.position
                rows.append(self._setpoints[index].advance(self._targets[index]))
            inputs += [
                tuple(StepInput(setpoint, 1.0, _NO_PUSH) for setpoint in step)
                for step in zip(*rows, strict=True)
            ]
        return inputs

    def run(self, inputs: Sequence[tuple[StepInput, ...]]) -> None:
        """A physics step for each of the inputs."""
        for each in inputs:
            self._backend.step(each)

    def close(self) -> None:
        """Release the engine."""
        self._backend.close()


@dataclass(frozen=True, slots=True)
class SceneTiming:
    """What several gaits in one world cost.

    Attributes:
        robots: Number of robots.
        simulated: [s].
        whole: [s] of CPU time for simulation, gaits and ground truth.
        physics: [s] of CPU time for the same physics steps alone.
        fallen: Number of robots that have fallen.
    """

    robots: int
    simulated: float
    whole: float
    physics: float
    fallen: int

    @property
    def speed(self) -> float:
        """Simulated seconds per second."""
        return self.simulated / self.whole

    @property
    def physics_share(self) -> float:
        """Share of the physics in the whole."""
        return self.physics / self.whole


def time_scene(scene: Scene, plant: Plant, engine: str, seconds: float) -> SceneTiming:
    """Let each robot of a scene walk a circle with a gait of its own, in one process.

    Args:
        scene: Field and robots.
        plant: Of all robots.
        engine: `pybullet` or `mujoco`.
        seconds: [s] of simulated time.
    """
    with make_scene_world(scene, plant=plant, engine=engine) as world:
        physics = PhysicsSteps(world, engine)
        count = round(seconds / CONTROL_PERIOD)
        targets: list[Targets] = []
        whole = alone = done = 0
        try:
            policies = [TimedCommands(lambda _: CIRCLE) for _ in world.robots]
            ticks = run_several(
                world,
                make_gaits(world),
                policies,
                lambda world, _: targets.append([each.last_command for each in world.robots]),
            )
            last = next(ticks)  # at rest, before the first control period
            while done < count:
                targets.clear()
                block: list[tuple[Tick, ...]] = []
                whole += cpu_time(_advance, ticks, min(BLOCK, count - done), block)
                last = block[-1]
                alone += cpu_time(physics.run, physics.inputs(targets))
                done += len(block)
        finally:
            physics.close()
        fallen = sum(tick.fallen for tick in last)
        simulated = done * CONTROL_PERIOD
        return SceneTiming(len(world.robots), simulated, whole * 1e-9, alone * 1e-9, fallen)


def _advance(
    ticks: Iterator[tuple[Tick, ...]], count: int, last: list[tuple[Tick, ...]]
) -> None:
    """Take this many control periods; `last` gets the ticks."""
    last.extend(islice(ticks, count))


def cpu_time(work: Callable[..., object], *arguments: Any) -> int:
    """CPU time of a call [ns]."""
    begin = time.process_time_ns()
    work(*arguments)
    return time.process_time_ns() - begin
