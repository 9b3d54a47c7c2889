"""The suite `compute`: what one tick costs, and where the time of a rollout goes.

One walk is timed by its parts, and twice more by itself: once as a whole, once tick by tick. For
the parts three things run side by side: the whole rollout, its simulation alone, and its physics
steps alone. The timers and cache contention from the other two runs slow it down.
"""

import math
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from itertools import islice
from typing import Any, TypeVar

import numpy as np

from gait_lab.bench.options import Options
from gait_lab.bench.rows import Row, rows_of
from gait_lab.bench.suite import suite
from nao_lipm_gait.gait import Gait
from robot_core.robot import load_robot
from robot_core.types import GaitStatus, JointTargets, SensorFrame, VelocityCommand
from sim_bridge.engines.registry import make_backend
from sim_bridge.motors import Setpoints
from sim_bridge.plant import Plant, with_options
from sim_bridge.scene import Scene, load_scene
from sim_bridge.state import StepInput
from sim_bridge.terrain import is_uneven
from sim_bridge.trials.compiled import is_compiled
from sim_bridge.trials.rollout import RolloutSpec, make_pair, rollout
from sim_bridge.trials.tasks import Task, find_task
from sim_bridge.trials.trace import Recorder
from sim_bridge.trials.trial import (
    CONTROL_PERIOD,
    TimedCommands,
    Walker,
    make_gaits,
    make_scene_world,
    run,
    run_several,
)
from sim_bridge.world import World

FIRST = 50
"""Ticks of the gait that are left out: caches fill and imports run in them."""
SCENE = "pitch"
"""The scene on which several gaits walk in one process."""
BLOCK = 100
"""Control periods after which the next part has its turn, so that other load on the machine slows
all of them alike."""
CIRCLE = VelocityCommand(0.12, 0.0, 0.4)
"""Walked by each robot of a scene: a circle of 0.3 m, on which it meets nobody."""
Targets = Sequence[JointTargets | None]
"""Of the robots of a world in one control period."""
_World = TypeVar("_World", bound=World)


@suite(
    "compute", "Cost of control", "time of one tick, and where the time of a rollout goes",
    options={"window": ...}, quick=({"window": 10.0},),
)  # fmt: skip
def compute(options: Options) -> Iterator[Row | str]:
    """Cost of one tick while walking, and of the parts of a rollout."""
    timing = time_walk(options, find_task("forward"))
    plant = options.made_plant
    # A field is level, whatever the ground of the walk above.
    level = with_options(plant, (("terrain.kind", "flat"),)) if is_uneven(plant.terrain) else plant
    pitch_speed, pitch_share = time_scene(
        load_scene(SCENE), level, options.engine, options.window
    )
    ticks = [span / 1000.0 for span in sorted(timing.gait_ticks[FIRST:])]
    speed, alone = timing.speed(timing.by_itself), timing.speed(timing.simulation_alone)
    loop = timing.speed(timing.simulation + timing.gait)
    whole = timing.speed(timing.rollout)
    parts = {
        "engine": timing.engine_alone,
        "plant": timing.simulation - timing.engine_alone,
        "gait": timing.gait,
        "truth": timing.rollout - timing.simulation - timing.gait,
        "rollout": timing.rollout,
    }
    yield from rows_of(
        "",
        ("tick_p50", "us", ticks[len(ticks) // 2]),
        ("tick_p99", "us", ticks[min(len(ticks) - 1, math.ceil(len(ticks) * 0.99) - 1)]),
        ("tick_max", "us", ticks[-1]),
        ("rollout_speed", "s/s", speed),
        ("loop_speed", "s/s", loop),
        ("physics_speed", "s/s", alone),
        ("rollout_share", "", loop / alone),
        ("rollout_share_with_truth", "", whole / alone),
        *((f"{name}_time", "us", timing.per_tick(span)) for name, span in parts.items()),
        ("pitch_speed", "s/s", pitch_speed),
        ("pitch_physics_share", "", pitch_share),
    )
    yield (
        f"{timing.ticks * CONTROL_PERIOD:g} s forward walk on one core, the gait "
        f"{'compiled' if is_compiled() else 'as Python'}. Ticks are wall time, all else CPU time. "
        "rollout speed: simulated s per s of a rollout by itself, with its set-up; loop: engine, "
        "plant and gait; physics: engine and plant alone; share: of these two. Times are per tick: "
        "plant: setpoints, observation, sensors; truth: ground truth, status, metrics. pitch: "
        f"robots with a gait each on the scene {SCENE}, in one process."
    )


@dataclass(slots=True)
class WalkTiming:
    """Where the time of a rollout went: CPU time, but wall time for the single ticks.

    Attributes:
        rollout: [ns] of simulation, gait, ground truth and metrics.
        by_itself: [ns] of the same rollout without clocks and without the other two, with set-up.
        simulation: [ns] of `World.step` in the rollout.
        gait: [ns] of `Gait.step` in the rollout.
        simulation_alone: [ns] of the same simulation with nothing between its steps; it is faster
            from warm caches.
        engine_alone: [ns] of the same physics steps with nothing between them.
        gait_ticks: [ns] of each `Gait.step` of a walk by itself.
    """

    ticks: int = 0
    rollout: int = 0
    by_itself: int = 0
    simulation: int = 0
    gait: int = 0
    simulation_alone: int = 0
    engine_alone: int = 0
    gait_ticks: tuple[int, ...] = ()

    def per_tick(self, span: int) -> float:
        """A time [ns] per control period [us]."""
        return span / max(1, self.ticks) / 1000.0

    def speed(self, span: int) -> float:
        """Simulated seconds per second of a time [ns]."""
        return self.ticks * CONTROL_PERIOD / (span * 1e-9)


def cpu_time(work: Callable[..., object], *arguments: Any) -> int:
    """CPU time of a call [ns]."""
    begin = time.process_time_ns()
    work(*arguments)
    return time.process_time_ns() - begin


def time_walk(options: Options, task: Task) -> WalkTiming:
    """Walk the task with one robot, up to a fall, and time the parts."""
    robot = load_robot(options.urdf)
    spec = RolloutSpec(task.lasting(options.window), robot_seed=options.seed, **options.trial)

    def world(kind: type[_World]) -> _World:
        return kind.single(
            robot, options.made_plant, options.seed, engine=options.engine,
            control_period=CONTROL_PERIOD,
        )  # fmt: skip

    walking, alone = world(_TimedWorld), world(World)
    engine = PhysicsSteps(alone, options.engine)
    gait = ClockedWalker(Gait(robot, options.parameters), time.thread_time_ns)
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
        while timing.ticks < ticks:
            targets.clear()
            timing.rollout += cpu_time(walk_on, min(BLOCK, ticks - timing.ticks))
            if not targets:
                break
            timing.simulation_alone += cpu_time(repeat)
            inputs = engine.inputs([(each,) for each in targets])
            timing.engine_alone += cpu_time(engine.run, inputs)
            timing.ticks += len(targets)
    finally:
        walking.close()
        alone.close()
        engine.close()
    timing.simulation, timing.gait = walking.span, sum(gait.spans)
    timing.by_itself = cpu_time(rollout, spec)
    # Ticks and control periods of the plant alternate, as on a robot.
    simulation, walker = make_pair(spec)
    clocked = ClockedWalker(walker, time.perf_counter_ns)
    with simulation:
        alternating = run(simulation, clocked, TimedCommands(spec.task.command_at, ahead=False))
        for _ in islice(alternating, round(spec.task.end / CONTROL_PERIOD)):
            pass
    timing.gait_ticks = tuple(clocked.spans)
    return timing


class _TimedWorld(World):
    """Records the CPU time of its steps [ns], and their targets."""

    span = 0

    def __init__(self, *arguments: Any, **options: Any) -> None:
        super().__init__(*arguments, **options)
        self.targets: list[JointTargets | None] = []

    def step(self) -> None:
        """A control period."""
        self.targets.append(self.robot.last_command)
        began = time.thread_time_ns()
        super().step()
        self.span += time.thread_time_ns() - began


class ClockedWalker:
    """Records the time of every tick [ns] on a clock."""

    def __init__(self, walker: Walker, clock: Callable[[], int]) -> None:
        self._walker, self._clock = walker, clock
        self.spans: list[int] = []

    def step(self, frame: SensorFrame, command: VelocityCommand) -> JointTargets:
        """A tick of the walker."""
        began = self._clock()
        targets = self._walker.step(frame, command)
        self.spans.append(self._clock() - began)
        return targets

    @property
    def status(self) -> GaitStatus:
        """Of the walker."""
        return self._walker.status


class PhysicsSteps:
    """The physics steps of a world alone: its engine is built once more."""

    def __init__(self, world: World, engine: str) -> None:
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
        no_push = np.zeros(3)
        for each in targets:
            rows = []
            for index, given in enumerate(each):
                if given is not None:
                    self._targets[index] = given.position
                rows.append(self._setpoints[index].advance(self._targets[index]))
            inputs += [
                tuple(StepInput(setpoint, 1.0, no_push) for setpoint in step)
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


def time_scene(scene: Scene, plant: Plant, engine: str, seconds: float) -> tuple[float, float]:
    """Simulated seconds per second, and the share of the physics, of a circle of each robot."""
    with make_scene_world(scene, plant=plant, engine=engine) as world:
        physics = PhysicsSteps(world, engine)
        count = round(seconds / CONTROL_PERIOD)
        targets: list[Targets] = []
        whole = alone = 0
        try:
            policies = [TimedCommands(lambda _: CIRCLE) for _ in world.robots]
            ticks = run_several(
                world, make_gaits(world), policies,
                lambda world, _: targets.append([each.last_command for each in world.robots]),
            )  # fmt: skip
            next(ticks)  # at rest, before the first control period
            for done in range(0, count, BLOCK):
                targets.clear()
                whole += cpu_time(list, islice(ticks, min(BLOCK, count - done)))
                alone += cpu_time(physics.run, physics.inputs(targets))
        finally:
            physics.close()
        return count * CONTROL_PERIOD / (whole * 1e-9), alone / whole
