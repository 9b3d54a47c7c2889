"""A robot crosses a field of uneven ground: one attempt, in one process."""

import math
from collections.abc import Callable
from dataclasses import dataclass

from gait_lab.analysis.metrics import yaw_of
from gait_lab.trials.rollout import CONTROL_PERIOD, Tick, loaded_robot, walk
from gait_lab.trials.tasks import STAND_TIME
from nao_lipm_gait.errors import NaoGaitError
from nao_lipm_gait.gait import Gait
from nao_lipm_gait.parameters import GaitParameters
from nao_lipm_gait.types import STANDSTILL, VelocityCommand
from sim_bridge.plant import Plant, PlantOption, Terrain, load_plant, with_options
from sim_bridge.simulation import Simulation

PATIENCE = 120.0
"""[s] of walking after which an attempt has failed."""
BEYOND = 0.15
"""[m] behind the field where a robot has left it with both feet."""
RAMP = 1.0
"""[s] in which the first command rises."""
STEERING = 0.5
"""[1/s] turn rate per heading error: someone sees the robot and steers it,"""
STEERING_MAX = 0.4
"""[rad/s] at most so fast,"""
INWARDS, INWARDS_MAX = 1.5, 0.5
"""[rad/m] and [rad]: towards the middle of the field, the more so the further it is from there."""


@dataclass(frozen=True, slots=True)
class Walker:
    """A robot with its soles and its gait."""

    name: str
    urdf: str
    preset: str
    sole: str
    speed: float
    """[m/s] asked."""
    steps: float = math.inf
    """[s] of walking after which it"""
    pause: float = 0.0
    """[s] stands."""
    paper: float | None = None
    """[s] published for the paper's field."""

    def command_at(self, time: float, heading: float, y: float = 0.0) -> VelocityCommand:
        """The command at a time [s] since the start, for a robot that is turned by `heading`.

        `y` [m]: so far it is to the left of the middle of the field.
        """
        walking = time - STAND_TIME
        if walking < 0.0:
            return STANDSTILL
        if math.isfinite(self.steps) and walking % (self.steps + self.pause) >= self.steps:
            return STANDSTILL
        wanted = -_cut(INWARDS * y, INWARDS_MAX)
        turn = _cut(STEERING * math.remainder(wanted - heading, math.tau), STEERING_MAX)
        return VelocityCommand(self.speed * min(1.0, walking / RAMP), 0.0, turn)


@dataclass(frozen=True, slots=True)
class CrossingSpec:
    """Everything that an attempt depends on."""

    walker: Walker
    parameters: GaitParameters
    """Of its gait."""
    robot_seed: int = 0
    """The robot and its field."""
    closed_loop: bool = True
    """What the parameters stand for."""
    plant: str = "reference"
    plant_options: tuple[PlantOption, ...] = ()
    engine: str = "pybullet"


@dataclass(frozen=True, slots=True)
class CrossingResult:
    spec: CrossingSpec
    end: str
    """`crossed`, `fell`, `left` the field sideways, or `late`."""
    seconds: float | None
    """[s] from the torso over the field's beginning to the torso over its end."""
    way: float
    """[m] that the torso got in x from the field's beginning, at most its length."""


def plant_of(spec: CrossingSpec) -> Plant:
    """With the paper's field and the walker's soles, unless the options say otherwise."""
    usual = (("terrain.kind", "hexagons"), ("sole.kind", spec.walker.sole))
    return with_options(load_plant(spec.plant), (*usual, *spec.plant_options))


def cross(spec: CrossingSpec, watch: Callable[[Tick], None] | None = None) -> CrossingResult:
    """One attempt; `watch` sees every tick of it."""
    walker, plant = spec.walker, plant_of(spec)
    robot = loaded_robot(walker.urdf)
    simulation = Simulation(
        robot, plant, spec.robot_seed, engine=spec.engine, control_period=CONTROL_PERIOD
    )
    try:
        return _cross(spec, plant.terrain, simulation, Gait(robot, spec.parameters), watch)
    finally:
        simulation.close()


def _cross(
    spec: CrossingSpec,
    field: Terrain,
    simulation: Simulation,
    gait: Gait,
    watch: Callable[[Tick], None] | None,
) -> CrossingResult:
    x = 0.0
    if field.length <= BEYOND:
        raise NaoGaitError("terrain.length", field.length, f"over {BEYOND} m to be crossed")
    entered = over = math.nan

    def command_at(time: float) -> VelocityCommand:
        return spec.walker.command_at(time, heading, y)

    heading = y = 0.0
    end = "late"
    for tick in walk(simulation, gait, command_at):
        if watch is not None:
            watch(tick)
        time = tick.truth.stamp * 1e-9
        x, y, _ = tick.truth.torso_position.tolist()
        heading = float(yaw_of(tick.truth.torso_quaternion))
        if math.isnan(entered) and x >= field.start:
            entered = time
        if math.isnan(over) and x >= field.start + field.length:
            over = time
        if tick.fallen:
            end = "fell"
        elif abs(y) > field.width / 2.0:
            end = "left"
        elif x >= field.start + field.length + BEYOND:
            end = "crossed"
        elif time < STAND_TIME + PATIENCE:
            continue
        break
    way = min(max(x - field.start, 0.0), field.length)
    return CrossingResult(spec, end, over - entered if end == "crossed" else None, way)


def _cut(value: float, most: float) -> float:
    return max(-most, min(most, value))
