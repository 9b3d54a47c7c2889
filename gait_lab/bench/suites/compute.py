"""The suite `compute`: what one tick costs, and where the time of a rollout goes.

One walk is timed by its parts, and twice more by itself: once as a whole, once tick by tick. For
the parts three things run side by side: the whole rollout, its simulation alone, and its physics
steps alone. The timers and cache contention from the other two runs slow it down.
"""

import math
import time
from dataclasses import dataclass
from itertools import islice
from typing import Any, TypeVar

from gait_lab.bench.options import BenchOptions
from gait_lab.bench.result import Column, Measurement, SuiteResult, Table
from gait_lab.bench.suite import Suite
from gait_lab.bench.timing import BLOCK, PhysicsSteps, cpu_time, time_scene
from nao_lipm_gait.gait import Gait
from robot_core.robot import load_robot
from robot_core.types import GaitStatus, JointTargets, SensorFrame, VelocityCommand
from sim_bridge.plant import load_plant, with_options
from sim_bridge.scene import load_scene
from sim_bridge.terrain import is_uneven
from sim_bridge.trials.compiled import is_compiled
from sim_bridge.trials.rollout import RolloutSpec, make_pair, rollout
from sim_bridge.trials.tasks import Task, find_task
from sim_bridge.trials.trace import Recorder
from sim_bridge.trials.trial import CONTROL_PERIOD, TimedCommands, run
from sim_bridge.world import World

FIRST = 50
"""Ticks of the gait that are left out: caches fill and imports run in them."""
SCENE = "pitch"
"""The scene on which several gaits walk in one process."""
_World = TypeVar("_World", bound=World)


@dataclass(frozen=True)
class Options(BenchOptions):
    """What the suite `compute` runs on."""

    robots: int = 1


def compute(options: Options) -> SuiteResult:
    """Cost of one tick while walking, and of the parts of a rollout."""
    timing = time_walk(options, find_task("forward"))
    plant = with_options(load_plant(options.plant), options.plant_options)
    # A field is level, whatever the ground of the walk above.
    level = with_options(plant, (("terrain.kind", "flat"),)) if is_uneven(plant.terrain) else plant
    pitch = time_scene(load_scene(SCENE), level, options.engine, options.window)
    ticks = sorted(timing.gait_ticks[FIRST:])
    p50 = ticks[len(ticks) // 2] / 1000.0
    p99 = ticks[min(len(ticks) - 1, math.ceil(len(ticks) * 0.99) - 1)] / 1000.0
    most = ticks[-1] / 1000.0
    speed, alone = timing.speed(timing.by_itself), timing.speed(timing.simulation_alone)
    loop = timing.speed(timing.simulation + timing.gait)
    whole = timing.speed(timing.rollout)
    parts = _parts(timing, options)
    lines = [
        (name, content, timing.per_tick(span), 100.0 * span / timing.rollout)
        for name, content, span in parts
    ]
    columns = (
        Column("part"), Column(""), Column("time", "us per tick", 0), Column("share", "%", 0),
    )  # fmt: skip
    notes = (
        f"Gait.step: p50 {p50:.0f} us, p99 {p99:.0f} us, max {most:.0f} us "
        f"({len(ticks)} ticks one by one, wall time; everything else is CPU time).",
        f"Simulated s per s: {speed:.1f}, the same rollout by itself, with its set-up. With the "
        f"clocks of this table: {loop:.1f} engine, plant and gait, {alone:.1f} the same engine and "
        f"plant alone (share {loop / alone:.2f}; with truth and metrics {whole:.1f}, "
        f"{whole / alone:.2f}).",
        f"{pitch.robots} robots with a gait each on the scene {SCENE}, in one process: "
        f"{pitch.speed:.1f} simulated s per s; share of the physics steps "
        f"{pitch.physics_share:.2f}.",
        "The table is of runs in which the gait answers several delayed frames in a row, as in "
        "rollouts.",
    )
    return SuiteResult(
        (
            Measurement("tick_p50", "us", p50),
            Measurement("tick_p99", "us", p99),
            Measurement("tick_max", "us", most),
            Measurement("rollout_speed", "s/s", speed),
            Measurement("loop_speed", "s/s", loop),
            Measurement("physics_speed", "s/s", alone),
            Measurement("rollout_share", "", loop / alone),
            Measurement("rollout_share_with_truth", "", whole / alone),
            *(Measurement(f"{name}_time", "us", timing.per_tick(span)) for name, _, span in parts),
            Measurement("pitch_speed", "s/s", pitch.speed),
            Measurement("pitch_physics_share", "", pitch.physics_share),
        ),
        f"{timing.ticks * CONTROL_PERIOD:g} s forward walk on robot {options.seed}, one core, "
        f"plant {options.plant_title}, {options.engine}, "
        f"the gait {'compiled' if is_compiled() else 'as Python'}",
        (Table(columns, lines),), notes,
    )  # fmt: skip


def _parts(timing: "WalkTiming", options: BenchOptions) -> tuple[tuple[str, str, int], ...]:
    """Name, content and time [ns] of each part of a rollout."""
    plant = with_options(load_plant(options.plant), options.plant_options)
    steps = round(CONTROL_PERIOD / plant.physics.step)
    rest = timing.rollout - timing.simulation - timing.gait
    return (
        ("engine", f"{steps} steps of {options.engine}", timing.engine_alone),
        ("plant", "setpoints, observation, sensors", timing.simulation - timing.engine_alone),
        ("gait", "Gait.step", timing.gait),
        ("truth", "ground truth, status, metrics", rest),
        ("rollout", "all of it", timing.rollout),
    )


@dataclass(slots=True)
class WalkTiming:
    """Where the time of a rollout went: CPU time, but wall time for the single ticks.

    Attributes:
        ticks: Control periods that were walked.
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


def time_walk(options: BenchOptions, task: Task) -> WalkTiming:
    """Walk the task with one robot, up to a fall, and time the parts."""
    robot = load_robot(options.urdf)
    plant = with_options(load_plant(options.plant), options.plant_options)

    def world(kind: type[_World]) -> _World:
        return kind.single(
            robot, plant, options.seed, engine=options.engine, control_period=CONTROL_PERIOD
        )

    walking, alone = world(_TimedWorld), world(World)
    engine = PhysicsSteps(alone, options.engine)
    gait = _ClockedGait(Gait(robot, options.parameters))
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
            timing.rollout += cpu_time(walk_on, min(BLOCK, ticks - timing.ticks))
            wall += time.perf_counter_ns() - began
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
    # The wall clock gives the shares of the parts: the clock of CPU time costs a system call.
    timing.simulation = round(timing.rollout * walking.wall / wall)
    timing.gait = round(timing.rollout * sum(gait.spans) / wall)
    timing.by_itself = cpu_time(rollout, _spec(options, task))
    timing.gait_ticks = _ticks(options, task)
    return timing


def _ticks(options: BenchOptions, task: Task) -> tuple[int, ...]:
    """[ns] of each `Gait.step` of a walk by itself, by the wall clock.

    Ticks and control periods of the plant alternate, as on a robot, where other work is done
    between two ticks.
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
    return RolloutSpec(task.lasting(options.window), robot_seed=options.seed, **options.trial)


class _TimedWorld(World):
    """Records the wall time of its steps [ns], and their targets."""

    wall = 0

    def __init__(self, *arguments: Any, **options: Any) -> None:
        super().__init__(*arguments, **options)
        self.targets: list[JointTargets | None] = []

    def step(self) -> None:
        """A control period."""
        self.targets.append(self.robot.last_command)
        began = time.perf_counter_ns()
        super().step()
        self.wall += time.perf_counter_ns() - began


class _ClockedGait:
    """Records the wall time of every tick [ns]."""

    def __init__(self, gait: Gait) -> None:
        self._gait = gait
        self.spans: list[int] = []

    def step(self, frame: SensorFrame, command: VelocityCommand) -> JointTargets:
        """A tick of the gait."""
        began = time.perf_counter_ns()
        targets = self._gait.step(frame, command)
        self.spans.append(time.perf_counter_ns() - began)
        return targets

    @property
    def status(self) -> GaitStatus:
        """Of the gait."""
        return self._gait.status


SUITE = Suite(
    name="compute",
    title="Cost of control",
    summary="time of one tick, and where the time of a rollout goes",
    measure=compute,
    options=Options,
    takes=("window",),
    quick=({"window": 10.0},),
)
