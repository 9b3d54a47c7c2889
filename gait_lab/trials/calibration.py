"""Calibration of a simulated robot by its own sensors, and what its soles are in truth."""

from collections.abc import Iterator
from dataclasses import replace
from functools import lru_cache
from itertools import islice
from typing import NamedTuple

from gait_lab.trials.tasks import STAND_TIME
from gait_lab.trials.trial import (
    CONTROL_PERIOD,
    Push,
    TimedCommands,
    TrialSpec,
    make_gait,
    make_world,
    run,
)
from nao_lipm_gait.calibration import NOT_CALIBRATED, Calibration
from nao_lipm_gait.parameters import load_preset
from nao_lipm_gait.types import STANDSTILL, VelocityCommand
from sim_bridge.robot import SimulatedRobot

STEPPING_TIME = 15.0
"""[s] of stepping on the spot; the soles are level after about 8 s."""
REST_TIME = 8.0
"""[s] of the stand after it, for the IMU."""
STEP_ON_THE_SPOT = VelocityCommand(1e-4, 0.0, 0.0)
"""Slow enough to stay in place; a command of zero would stand."""


def calibrate(spec: TrialSpec) -> Calibration:
    """Calibrate the robot of a trial with the preset `default`: stand, step on the spot, stand.

    Args:
        spec: The robot; its parameters and calibration are not used.

    Returns:
        What the gait has measured; not calibrated if the robot fell.
    """
    spec = TrialSpec(**{name: getattr(spec, name) for name in TrialSpec.__dataclass_fields__})
    return _calibrate(replace(spec, parameters=load_preset("default"), calibration=NOT_CALIBRATED))


@lru_cache(maxsize=256)
def _calibrate(spec: TrialSpec) -> Calibration:
    stepping_end = STAND_TIME + STEPPING_TIME

    def command_at(time: float) -> VelocityCommand:
        return STEP_ON_THE_SPOT if STAND_TIME <= time < stepping_end else STANDSTILL

    gait = make_gait(spec)
    ticks = round((stepping_end + REST_TIME) / CONTROL_PERIOD)
    with make_world(spec) as world:
        for tick in islice(run(world, gait, TimedCommands(command_at)), ticks):
            if tick.fallen:
                return NOT_CALIBRATED
    return gait.calibration


class SoleTilt(NamedTuple):
    """Tilt of the left sole relative to the right one when the joint angles say parallel.

    Attributes:
        pitch: [rad]
        roll: [rad]
    """

    pitch: float
    roll: float


def true_tilt(robot: SimulatedRobot) -> SoleTilt:
    """The tilt by the encoder offsets of a simulated robot: the differences of their sums."""
    description = robot.description
    zero = dict(zip(description.joint_names, robot.individual.joint_zero.tolist(), strict=True))
    left, right = description.left_leg, description.right_leg
    pitch = [zero[leg.hip_pitch] + zero[leg.knee_pitch] + zero[leg.ankle_pitch]
             for leg in (left, right)]  # fmt: skip
    roll = [zero[leg.hip_roll] + zero[leg.ankle_roll] for leg in (left, right)]
    return SoleTilt(pitch[0] - pitch[1], roll[0] - roll[1])


class Levelled(NamedTuple):
    """Levelling of one robot after one control period of a walk.

    Attributes:
        left: Tilt that is left: the true one minus the applied one.
        softness: Learned softness of the ground.
        fallen: The robot has fallen.
    """

    left: SoleTilt
    softness: float
    fallen: bool


def levelling(
    spec: TrialSpec, command: VelocityCommand, seconds: float, pushes: tuple[Push, ...] = ()
) -> Iterator[Levelled]:
    """Walk a robot and compare its soles with the truth.

    Args:
        spec: The robot.
        command: What it is commanded after a stand of `STAND_TIME`.
        seconds: Duration [s] of the walk.
        pushes: Pushes on the way; times count from the start of the trial.

    Yields:
        The state at the end of each control period, the first one before the walk.
    """

    def command_at(time: float) -> VelocityCommand:
        return command if time >= STAND_TIME else STANDSTILL

    gait = make_gait(spec)
    ticks = round((STAND_TIME + seconds) / CONTROL_PERIOD)
    with make_world(spec) as world:
        truth = true_tilt(world.robot)
        for tick in islice(
            run(world, gait, TimedCommands(command_at, pushes, ahead=False)), ticks
        ):
            soles = gait.levelling
            left = truth.pitch - soles.applied_pitch, truth.roll - soles.applied_roll
            yield Levelled(SoleTilt(*left), soles.softness, tick.fallen)
