"""The suite `heat`: how long each speed can be walked until a motor is hot, and what it costs.

Each robot walks for the window; the mean load of every motor then gives its temperature over time,
because the temperature is linear in the load and follows it with one time constant. Torque that
fades, and a robot that sits down, come later than this forecast goes.
"""

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from gait_lab.bench.options import Option, Options
from gait_lab.bench.rows import Row, rows_of
from gait_lab.bench.suite import suite
from gait_lab.bench.walks import median
from nao_lipm_gait.runtime.watches import HOT, SIT
from robot_core.errors import NaoGaitError
from robot_core.types import GRAVITY, FloatArray
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


@dataclass(frozen=True, slots=True)
class HeatResult:
    """What a walk does to motors and battery.

    Attributes:
        final: (n,) [deg C] of each motor after a long time.
        power: [W] of robot and electronics.
        speed: [m/s] over the ground; 0 for a stand.
        knee_torque: [N m] root mean square of both knees.
    """

    final: FloatArray
    power: float
    speed: float
    knee_torque: float


def heat_walk(asked: tuple[Task, TrialSpec]) -> HeatResult | None:
    """Walk, and average the loads over the window of the task; None after a fall."""
    task, spec = asked
    robot = loaded_robot(spec.urdf)
    knees = [robot.index(leg.knee_pitch) for leg in (robot.left_leg, robot.right_leg)]
    finals, energy, where, torques = [], [], [], []
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
                torques.append(tick.truth.joint_torque[knees])
        if tick.fallen or len(finals) < 2:
            return None
    seconds = task.end - task.start
    speed = float(np.hypot(*(where[-1] - where[0]))) / seconds
    knee_torque = float(np.sqrt(np.mean(np.square(torques))))
    power = (energy[-1] - energy[0]) / seconds
    return HeatResult(np.mean(finals, axis=0), power, speed, knee_torque)


def minutes_until(degrees: float, final: float, ambient: float, time_constant: float) -> float:
    """Minutes until a motor that warms from `ambient` to `final` [deg C] has `degrees`."""
    if final <= degrees:
        return LONGEST
    return min(
        LONGEST, -time_constant / 60.0 * math.log((final - degrees) / (final - ambient))
    )


@suite(
    "heat", "Hot motors and an empty battery",
    "minutes of walking until a motor is hot, and the cost of transport",
    options={
        "robots": 4, "urdf": "nao_v6", "window": ...,
        "speeds": Option(("10", "20", "30", "40"), "forward speed [cm/s]; 0 = stand", "V",
                         ("--speed",)),
    },
    quick=({"robots": 1, "window": 10.0},),
    applies=lambda options: loaded_robot(options.urdf).battery is not None,
)  # fmt: skip
def heat(options: Options) -> Iterator[Row | str]:
    """Every robot at every speed."""
    options = options.but(plant_options=(*options.plant_options, ("heat.enabled", True)))
    plant, robot = options.made_plant.heat, loaded_robot(options.urdf)
    if robot.battery is None:
        raise NaoGaitError("urdf", options.urdf, "a robot whose battery is known")
    specs = [TrialSpec(robot_seed=seed, **options.trial) for seed in options.seeds]
    mass = make_gait(specs[0]).mass
    walks = [
        (find_task("stand" if speed == "0" else f"forward={speed}").lasting(options.window), spec)
        for speed in options.speeds for spec in specs
    ]  # fmt: skip
    found = options.map(heat_walk, walks, label="walks")
    for asked, results in zip(options.speeds, options.by_robots(found), strict=True):
        upright = [each for each in results if each is not None]
        hot, sits = (
            [minutes_until(limit, float(np.max(each.final)), plant.ambient, plant.time_constant)
             for each in upright]
            for limit in (HOT, SIT)
        )  # fmt: skip
        power = median(each.power for each in upright)
        costs = [each.power / (mass * GRAVITY * each.speed)
                 for each in upright if each.speed > SLOWEST]  # fmt: skip
        yield from rows_of(
            f"forward_{asked}",
            ("minutes_until_hot_worst", "min", min(hot, default=None)),
            ("minutes_until_sit_worst", "min", min(sits, default=None)),
            ("minutes_until_sit_median", "min", median(sits)),
            ("power_median", "W", power),
            ("cost_of_transport_median", "", median(costs)),
            ("knee_torque_median", "N m", median(each.knee_torque for each in upright)),
            ("battery_median", "min",
             robot.battery.energy * plant.charge / 60.0 / power if power else None),
            ("falls", "robots", len(results) - len(upright)),
        )  # fmt: skip
    yield (
        f"Rise {plant.rise:g} K at nominal torque and time constant {plant.time_constant:g} s are "
        "chosen, not measured; nominal torques and battery are published. The gait warns at "
        f"{HOT:g} deg C and sits down when a leg has {SIT:g} deg C. From {plant.ambient:g} deg C; "
        f"power with {plant.electronics:g} W of electronics; {LONGEST:g} min: that or longer. Knee "
        "torque: root mean square."
    )
