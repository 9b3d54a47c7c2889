"""The suite `heat`: how long each speed can be walked until a motor is hot, and what it costs.

Each robot walks for the window; the mean load of every motor then gives its temperature over time,
because the temperature is linear in the load and follows it with one time constant. Torque that
fades, and a robot that sits down, come later than this forecast goes.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from statistics import median

import numpy as np

from gait_lab.bench.options import BenchOptions, option
from gait_lab.bench.result import Column, Measurement, SuiteResult, Table, finite
from gait_lab.bench.suite import Suite
from nao_lipm_gait.runtime.watches import HOT, SIT
from robot_core.errors import NaoGaitError
from robot_core.types import GRAVITY, FloatArray
from sim_bridge.plant import load_plant, with_options
from sim_bridge.trials.parallel import parallel_map
from sim_bridge.trials.tasks import Task, find_task
from sim_bridge.trials.trial import (
    TimedCommands,
    TrialSpec,
    loaded_robot,
    make_gait,
    make_world,
    run,
)

SLOWEST = 0.01
"""[m/s] Below this the robot goes nowhere, and transport has no cost."""
LONGEST = 60.0
"""[min] A longer time counts as this."""


@dataclass(frozen=True)
class Options(BenchOptions):
    """What the suite `heat` runs on."""

    robots: int = 4
    engine: str = "mujoco"
    urdf: str = "nao_v6"
    speeds: tuple[str, ...] = option(
        ("10", "20", "30", "40"), "forward speed [cm/s]; 0 = stand", "V", flags=("--speed",)
    )


@dataclass(frozen=True, slots=True)
class HeatWalk:
    """One walk, or a stand.

    Attributes:
        task: What is walked.
        spec: The robot.
    """

    task: Task
    spec: TrialSpec


@dataclass(frozen=True, slots=True)
class HeatResult:
    """What a walk does to motors and battery.

    Attributes:
        final: (n,) [deg C] of each motor after a long time.
        power: [W] of robot and electronics.
        speed: [m/s] over the ground; 0 for a stand.
        fell: The robot fell, and the rest does not count.
    """

    final: FloatArray
    power: float
    speed: float
    fell: bool


def heat_walk(walk: HeatWalk) -> HeatResult:
    """Walk, and average the loads over the window of the task."""
    task, spec = walk.task, walk.spec
    count = len(loaded_robot(spec.urdf).joint_names)
    finals, energy, where = [], [], []
    with make_world(spec) as world:
        heat = world.robot.heat
        if heat is None:
            raise NaoGaitError("heat.enabled", False, "true")
        for tick in run(world, make_gait(spec), TimedCommands(task.command_at)):
            time = tick.truth.stamp * 1e-9
            if tick.fallen or time >= task.end:
                break
            if time >= task.start:
                finals.append(heat.final)
                energy.append(heat.energy)
                where.append(tick.truth.torso_position[:2])
        fell = tick.fallen or len(finals) < 2
    if fell:
        return HeatResult(np.full(count, math.nan), math.nan, math.nan, True)
    seconds = task.end - task.start
    speed = float(np.hypot(*(where[-1] - where[0]))) / seconds
    power = (energy[-1] - energy[0]) / seconds
    return HeatResult(np.mean(finals, axis=0), power, speed, False)


def minutes_until(degrees: float, final: float, ambient: float, time_constant: float) -> float:
    """Minutes until a motor that warms from `ambient` to `final` [deg C] has `degrees`."""
    if final <= degrees:
        return LONGEST
    return min(
        LONGEST, -time_constant / 60.0 * math.log((final - degrees) / (final - ambient))
    )


def heat(options: Options) -> SuiteResult:
    """Every robot at every speed."""
    switched = (*options.plant_options, ("heat.enabled", True))
    plant = with_options(load_plant(options.plant), switched).heat
    tasks = [
        find_task("stand" if speed == "0" else f"forward={speed}").lasting(options.window)
        for speed in options.speeds
    ]
    walks = [
        HeatWalk(
            task,
            TrialSpec(robot_seed=seed, **{**options.trial, "plant_options": switched}),
        )
        for task in tasks
        for seed in options.seeds
    ]
    found = parallel_map(
        heat_walk, walks, jobs=options.jobs, show=options.show, label="walks",
        note=lambda one: "fell" if one.fell else f"{one.power:.0f} W",
    )  # fmt: skip
    robot = loaded_robot(options.urdf)
    if robot.battery is None:
        raise NaoGaitError("urdf", options.urdf, "a robot whose battery is known")
    mass = make_gait(walks[0].spec).mass
    rows: list[Measurement] = []
    lines = []
    for index, asked in enumerate(options.speeds):
        results = found[index * options.robots : (index + 1) * options.robots]
        upright = [each for each in results if not each.fell]
        name = f"forward_{asked}"
        hot, sits = (
            [minutes_until(limit, float(np.max(each.final)), plant.ambient, plant.time_constant)
             for each in upright]
            for limit in (HOT, SIT)
        )  # fmt: skip
        power = _median([each.power for each in upright])
        moving = [each for each in upright if each.speed > SLOWEST]
        costs = [each.power / (mass * GRAVITY * each.speed) for each in moving]
        battery = robot.battery.energy * plant.charge / 60.0 / power if power > 0.0 else math.nan
        rows += [
            Measurement(f"{name}_minutes_until_hot_worst", "min", finite(_least(hot))),
            Measurement(f"{name}_minutes_until_sit_worst", "min", finite(_least(sits))),
            Measurement(f"{name}_minutes_until_sit_median", "min", finite(_median(sits))),
            Measurement(f"{name}_power_median", "W", finite(power)),
            Measurement(f"{name}_cost_of_transport_median", "", finite(_median(costs))),
            Measurement(f"{name}_battery_median", "min", finite(battery)),
            Measurement(f"{name}_falls", "robots", len(results) - len(upright)),
        ]  # fmt: skip
        hottest = max(upright, key=lambda each: float(each.final.max()), default=None)
        joint = "" if hottest is None else robot.joint_names[int(np.argmax(hottest.final))]
        final = math.nan if hottest is None else float(hottest.final.max())
        lines.append((
            f"{asked} cm/s", 100.0 * _median([each.speed for each in upright]), joint, final,
            _minutes(_least(hot)), _minutes(_least(sits)),
            _minutes(_median(sits)), power, _median(costs), battery, len(results) - len(upright),
        ))  # fmt: skip
    columns = (
        Column("commanded"), Column("speed", "cm/s", 1), Column("hottest motor", "worst robot"),
        Column("in the end", "deg C", 0), Column(f"until {HOT:g} deg C", "worst, min"),
        Column(f"until {SIT:g} deg C", "worst, min"), Column("", "median, min"),
        Column("power", "W", 0), Column("cost of transport", "P/(m g v)", 2),
        Column("battery", "min", 0), Column("falls"),
    )  # fmt: skip
    notes = (
        f"Rise {plant.rise:g} K at nominal torque and time constant {plant.time_constant:g} s are "
        "chosen, not measured; nominal torques and battery are published. The gait warns at "
        f"{HOT:g} deg C and sits down when a leg has {SIT:g} deg C.",
        f"From {plant.ambient:g} deg C; power with {plant.electronics:g} W of electronics.",
    )
    title = f"Heat, {options.window:g} s of each walk forecast; {options.title}"
    return SuiteResult(tuple(rows), title, (Table(columns, lines),), notes)


def _median(values: Sequence[float]) -> float:
    return median(values) if values else math.nan


def _least(values: Sequence[float]) -> float:
    return min(values, default=math.nan)


def _minutes(value: float) -> str:
    return f"over {LONGEST:g}" if value >= LONGEST else f"{value:.1f}"


SUITE = Suite(
    name="heat",
    title="Hot motors and an empty battery",
    summary="minutes of walking until a motor is hot, and the cost of transport",
    measure=heat,
    options=Options,
    takes=("robots", "window"),
    quick=({"robots": 1, "window": 10.0},),
    applies=lambda options: loaded_robot(options.urdf).battery is not None,
)
