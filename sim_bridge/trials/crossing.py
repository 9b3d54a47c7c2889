"""A robot crosses a field of uneven ground: one attempt."""

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

from robot_core.errors import NaoGaitError
from robot_core.types import STANDSTILL, VelocityCommand
from sim_bridge.plant import Plant, load_plant, with_options
from sim_bridge.trials.metrics import yaw_of
from sim_bridge.trials.tasks import STAND_TIME
from sim_bridge.trials.trial import Policy, Tick, TrialSpec, make_gait, make_world, run

PATIENCE = 120.0
"""[s] of walking after which an attempt has failed."""
BEYOND = 0.15
"""[m] behind the field where a robot has left it with both feet."""
RAMP = 1.0
"""[s] in which the first command rises."""
STEERING, STEERING_MAX = 0.5, 0.4
"""[1/s] turn rate per heading error of the steering by sight, and its limit [rad/s]."""
INWARDS, INWARDS_MAX = 1.5, 0.5
"""[rad/m] wanted heading towards the middle of the field per distance from it; limit [rad]."""


@dataclass(frozen=True, slots=True)
class CrossingRobot:
    """A robot with its soles, its gait and its speed.

    Attributes:
        name: Name shown in tables.
        urdf: Name or file of the robot.
        preset: Preset of its gait.
        sole: Kind of its soles.
        speed: Commanded speed [m/s].
        steps: [s] of walking after which it pauses.
        pause: [s] of standing.
        paper: [s] published for the paper's field.
    """

    name: str
    urdf: str
    preset: str
    sole: str
    speed: float
    steps: float = math.inf
    pause: float = 0.0
    paper: float | None = None

    def command_at(self, time: float, heading: float, y: float = 0.0) -> VelocityCommand:
        """The command that keeps it on the field.

        By the time [s] since the start, the robot's heading [rad], 0 along the field, and its
        place y [m] to the left of the field's middle.
        """
        walking = time - STAND_TIME
        if walking < 0.0:
            return STANDSTILL
        if math.isfinite(self.steps) and walking % (self.steps + self.pause) >= self.steps:
            return STANDSTILL
        wanted = -_limited(INWARDS * y, INWARDS_MAX)
        turn = _limited(STEERING * math.remainder(wanted - heading, math.tau), STEERING_MAX)
        return VelocityCommand(self.speed * min(1.0, walking / RAMP), 0.0, turn)


@dataclass(frozen=True, slots=True)
class CrossingSpec(TrialSpec):
    """Everything that an attempt depends on; the robot seed also draws the field.

    Attributes:
        robot: Who crosses; its `urdf` counts, not that of the trial.
    """

    robot: CrossingRobot


@dataclass(frozen=True, slots=True)
class CrossingResult:
    """Result of an attempt.

    Attributes:
        spec: The specification.
        end: `crossed`, `fell`, `left` the field sideways, or `late`.
        seconds: [s] from the torso over the field's beginning to the torso over its end; None
            unless crossed.
        way: [m] that the torso came in x from the field's beginning, at most its length.
    """

    spec: CrossingSpec
    end: str
    seconds: float | None
    way: float


def plant_of(spec: CrossingSpec) -> Plant:
    """With the paper's field and the robot's soles, unless the options say otherwise."""
    usual = (("terrain.kind", "hexagons"), ("sole.kind", spec.robot.sole))
    return with_options(load_plant(spec.plant), (*usual, *spec.plant_options))


class _Steering(Policy):
    """Steers the robot along the field from ground truth, like an operator."""

    def __init__(self, robot: CrossingRobot) -> None:
        self._robot = robot

    def command(self, time: float, tick: Tick | None) -> VelocityCommand:
        if tick is None:
            return self._robot.command_at(time, 0.0)
        heading = float(yaw_of(tick.truth.torso_quaternion))
        return self._robot.command_at(time, heading, float(tick.truth.torso_position[1]))


def cross(spec: CrossingSpec, watch: Callable[[Tick], None] | None = None) -> CrossingResult:
    """Run one attempt; `watch` is called with every tick of it.

    Raises:
        NaoGaitError: The terrain is too short to be crossed.
    """
    trial, plant = replace(spec, urdf=spec.robot.urdf), plant_of(spec)
    field = plant.terrain
    if field.length <= BEYOND:
        raise NaoGaitError("terrain.length", field.length, f"more than {BEYOND} m")
    entered = over = math.nan
    x, end = 0.0, "late"
    with make_world(trial, plant=plant) as world:
        for tick in run(world, make_gait(trial), _Steering(spec.robot)):
            if watch is not None:
                watch(tick)
            time = tick.truth.stamp * 1e-9
            x, y, _ = tick.truth.torso_position.tolist()
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


def _limited(value: float, limit: float) -> float:
    return max(-limit, min(limit, value))
