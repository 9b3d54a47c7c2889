"""One walk, timed by its parts, and twice more by itself: once whole, once tick by tick.

For the parts it goes three times side by side: the whole rollout, its simulation alone, its physics
steps alone. Clocks and the other two, which take the caches, make it slower than it is by itself.
"""

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import islice
from typing import Any, TypeVar

import numpy as np

from gait_lab.analysis.trace import Recorder
from gait_lab.bench.options import BenchOptions
from gait_lab.trials.rollout import RolloutSpec, make_pair, rollout
from gait_lab.trials.tasks import Task
from gait_lab.trials.trial import CONTROL_PERIOD, TimedCommands, run
from nao_lipm_gait.gait import Gait
from nao_lipm_gait.robot import RobotDescription, load_robot
from nao_lipm_gait.types import FloatArray, GaitStatus, JointTargets, SensorFrame, VelocityCommand
from sim_bridge.engines.backend import StartState, StepInput, make_robot_model
from sim_bridge.engines.registry import make_backend
from sim_bridge.motors import Setpoints
from sim_bridge.plant import Plant, load_plant, with_options
from sim_bridge.world import World

BLOCK = 100
"""Ticks for which one of the three runs before the next has its turn: what else the machine does
slows all of them alike."""
_NO_PUSH = np.zeros(3)
_Simulation = TypeVar("_Simulation", bound=World)


@dataclass(slots=True)
class WalkTiming:
    """Where the time of a rollout went; CPU time but for the single ticks."""

    ticks: int = 0
    """Control periods that were walked."""
    rollout: int = 0
    """[ns] simulation, gait, ground truth and metrics."""
    by_itself: int = 0
    """[ns] the same rollout without clocks and neighbours, with its set-up."""
    simulation: int = 0
    """[ns] `World.step` of the rollout."""
    gait: int = 0
    """[ns] `Gait.step` of the rollout."""
    simulation_alone: int = 0
    """[ns] the same simulation with nothing between its steps: from warm caches it is faster."""
    engine_alone: int = 0
    """[ns] the same physics steps with nothing between them."""
    gait_ticks: tuple[int, ...] = ()
    """[ns] every `Gait.step` of a walk by itself, by the wall clock."""

    def per_tick(self, span: int) -> float:
        """[us]."""
        return span / max(1, self.ticks) / 1000.0

    def speed(self, span: int) -> float:
        """Simulated seconds per second."""
        return self.ticks * CONTROL_PERIOD / (span * 1e-9)


def time_walk(options: BenchOptions, task: Task) -> WalkTiming:
    """Walk the task on one robot, up to a fall."""
    robot = load_robot(options.urdf)
    plant = with_options(load_plant(options.plant), options.plant_options)

    def simulation(kind: type[_Simulation]) -> _Simulation:
        return kind.single(
            robot, plant, options.seed, engine=options.engine, control_period=CONTROL_PERIOD
        )

    walking, alone = simulation(_TimedSimulation), simulation(World)
    engine = _PhysicsSteps(robot, plant, options, alone.robot.start)
    gait = _TimedGait(Gait(robot, options.parameters))
    recorder, timing = Recorder(), WalkTiming()
    try:
        walked = run(walking, gait, TimedCommands(task.command_at))
        next(walked)  # the robot at rest, before the first control period
        targets = walking.targets

        def walk_on(count: int) -> None:
            for tick in islice(walked, count):
                recorder.add(tick.truth, tick.command, tick.status)

        def repeat() -> None:
            for each in targets:
                alone.robot.command(each)
                alone.step()

        ticks = round((task.start + options.window) / CONTROL_PERIOD)
        wall = 0
        while timing.ticks < ticks:
            targets.clear()
            began = time.perf_counter_ns()
            timing.rollout += _cpu_time(walk_on, min(BLOCK, ticks - timing.ticks))
            wall += time.perf_counter_ns() - began
            if not targets:
                break
            timing.simulation_alone += _cpu_time(repeat)
            timing.engine_alone += _cpu_time(engine.run, engine.setpoints(targets))
            timing.ticks += len(targets)
    finally:
        walking.close()
        alone.close()
        engine.close()
    # Of the parts the cheap clock knows the shares; the one of CPU time costs a system call.
    timing.simulation = round(timing.rollout * walking.wall / wall)
    timing.gait = round(timing.rollout * gait.wall / wall)
    timing.by_itself = _cpu_time(rollout, _spec(options, task))
    timing.gait_ticks = _ticks(options, task)
    return timing


def _ticks(options: BenchOptions, task: Task) -> tuple[int, ...]:
    """[ns] by the wall clock, each `Gait.step` of a walk that nothing interrupts.

    One tick, one control period of the plant, and so on: a robot's machine, too, has other things
    to do between two ticks.
    """
    spec = _spec(options, task)
    simulation, gait = make_pair(spec)
    clocked = _ClockedGait(gait)
    try:
        ticks = run(simulation, clocked, TimedCommands(spec.task.command_at, ahead=False))
        for _ in islice(ticks, round(spec.task.end / CONTROL_PERIOD)):
            pass
    finally:
        simulation.close()
    return tuple(clocked.spans)


def _spec(options: BenchOptions, task: Task) -> RolloutSpec:
    return RolloutSpec(
        task.lasting(options.window),
        robot_seed=options.seed,
        parameters=options.parameters,
        plant=options.plant,
        plant_options=options.plant_options,
        urdf=options.urdf,
        engine=options.engine,
    )


class _TimedSimulation(World):
    """Keeps the wall time of its steps [ns], and what they were given."""

    wall = 0

    def __init__(self, *arguments: Any, **options: Any) -> None:
        super().__init__(*arguments, **options)
        self.targets: list[JointTargets | None] = []

    def step(self) -> None:
        self.targets.append(self.robot.last_command)
        began = time.perf_counter_ns()
        super().step()
        self.wall += time.perf_counter_ns() - began


class _ClockedGait:
    """Keeps the time of every tick [ns]."""

    def __init__(self, gait: Gait) -> None:
        self._gait = gait
        self.spans: list[int] = []

    def step(self, frame: SensorFrame, command: VelocityCommand) -> JointTargets:
        begin = time.perf_counter_ns()
        targets = self._gait.step(frame, command)
        self.spans.append(time.perf_counter_ns() - begin)
        return targets

    @property
    def status(self) -> GaitStatus:
        return self._gait.status


class _TimedGait:
    """Keeps the wall time of its ticks [ns]."""

    def __init__(self, gait: Gait) -> None:
        self._gait = gait
        self.wall = 0

    def step(self, frame: SensorFrame, command: VelocityCommand) -> JointTargets:
        began = time.perf_counter_ns()
        targets = self._gait.step(frame, command)
        self.wall += time.perf_counter_ns() - began
        return targets

    @property
    def status(self) -> GaitStatus:
        return self._gait.status


class _PhysicsSteps:
    """The engine of a simulation, with nothing around it."""

    def __init__(
        self, robot: RobotDescription, plant: Plant, options: BenchOptions, start: StartState
    ) -> None:
        model = make_robot_model(robot, plant, options.seed)
        individual = model.individual
        self._backend = make_backend(options.engine, [model])
        self._backend.reset([start])
        steps = round(CONTROL_PERIOD / plant.physics.step)
        self._setpoints = Setpoints(robot, plant, individual, steps)
        self._setpoints.reset(start.joint_position - individual.joint_zero)
        self._target = self._setpoints.current

    def setpoints(self, targets: Sequence[JointTargets | None]) -> list[FloatArray]:
        """(n,) [rad] for every physics step of these control periods."""
        rows: list[FloatArray] = []
        for each in targets:
            self._target = self._target if each is None else each.position
            rows += self._setpoints.advance(self._target)
        return rows

    def run(self, setpoints: Sequence[FloatArray]) -> None:
        for setpoint in setpoints:
            self._backend.step([StepInput(setpoint, 1.0, _NO_PUSH)])

    def close(self) -> None:
        self._backend.close()


def _cpu_time(work: Callable[..., object], *arguments: Any) -> int:
    """[ns]."""
    begin = time.process_time_ns()
    work(*arguments)
    return time.process_time_ns() - begin
