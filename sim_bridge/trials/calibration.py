"""Calibration of a simulated robot by its own sensors, and what its soles are in truth."""

from collections.abc import Iterator
from dataclasses import replace
from functools import lru_cache
from itertools import islice
from typing import NamedTuple

from nao_lipm_gait.calibration import NOT_CALIBRATED, Calibration
from nao_lipm_gait.estimation.joint_zeros import Zero
from nao_lipm_gait.gait import Gait
from nao_lipm_gait.parameters import load_preset
from nao_lipm_gait.runtime.calibration_monitor import Measurement
from robot_core.errors import NaoGaitError
from robot_core.types import STANDSTILL, VelocityCommand
from sim_bridge.robot import SimulatedRobot
from sim_bridge.trials.calibration_procedure import (
    CalibrationError,
    Phase,
    Procedure,
    calibration_poses,
)
from sim_bridge.trials.tasks import STAND_TIME
from sim_bridge.trials.trial import (
    Action,
    Policy,
    Push,
    Tick,
    TimedCommands,
    TrialSpec,
    make_gait,
    make_world,
    run,
)

MEASUREMENT_PERIOD = 0.5
"""[s] between two looks at what the gait has measured."""


class Calibrating(Policy):
    """Carries out the procedure with a gait; raises `CalibrationError` if it fails.

    With a robot it looks for wrong zeros, in several poses.
    """

    def __init__(self, gait: Gait, robot: SimulatedRobot | None = None) -> None:
        self._gait, self._robot = gait, robot
        parameters = gait.parameters.as_dict()
        poses = () if robot is None else calibration_poses(parameters)
        self.procedure = Procedure(poses)
        self._next_look = 0.0

    def command(self, time: float, tick: Tick | None) -> Action:
        """What the procedure commands; None once it is done."""
        status = None if tick is None else tick.status
        if status is not None:
            x, y, _ = status.base_footprint_in_odom
            self.procedure.see_odometry(time, x, y)
            self.procedure.see_state(status.state.value)
            if time >= self._next_look:
                self._next_look = time + MEASUREMENT_PERIOD
                measured = Measurement.of(self._gait, steps_measure=True)
                self.procedure.see_measurement(time, measured)
            self._pose()
        if self.procedure.phase is Phase.DONE:
            return None
        return self.procedure.command or STANDSTILL


    def _pose(self) -> None:
        """Let the procedure have the sensors, and the gait its parameters."""
        frame = None if self._robot is None else self._robot.sense()
        if frame is not None:
            self.procedure.see_sensors(frame.joint_position, frame.linear_acceleration)
        wanted = self.procedure.parameters
        if any(getattr(self._gait.parameters, name) != value for name, value in wanted.items()):
            self._gait.set_parameters(self._gait.parameters.replace(**wanted))


def find_zeros(spec: TrialSpec) -> tuple[list[Zero], Calibration]:
    """What `nao_gait calibrate --zeros` finds on a robot that was not calibrated.

    Raises:
        CalibrationError: The calibration failed.
    """
    gait = make_gait(replace(spec, calibration=NOT_CALIBRATED))
    with make_world(spec) as world:
        policy = Calibrating(gait, world.robot)
        for tick in run(world, gait, policy):
            if tick.fallen:
                raise CalibrationError("the robot has fallen")
    return policy.procedure.result(gait.robot)


def calibrate(spec: TrialSpec) -> Calibration | None:
    """What a robot's gait measures with the preset `default`, as `nao_gait calibrate` does.

    Parameters and calibration of the specification are not used. None if the calibration failed.
    """
    changed = {"parameters": load_preset("default"), "calibration": NOT_CALIBRATED}
    return _calibrate(TrialSpec(**{**spec.fields, **changed}))


@lru_cache(maxsize=256)
def _calibrate(spec: TrialSpec) -> Calibration | None:
    gait = make_gait(spec)
    fallen = False
    try:
        with make_world(spec) as world:
            for tick in run(world, gait, Calibrating(gait)):
                fallen = tick.fallen
    except (CalibrationError, NaoGaitError):
        return None
    return None if fallen else gait.calibration


class SoleTilt(NamedTuple):
    """Tilt of the left sole relative to the right one when the joint angles say parallel.

    Attributes:
        pitch: [rad]
        roll: [rad]
        lean: Roll [rad] of the torso over level soles when the joint angles say upright.
    """

    pitch: float
    roll: float
    lean: float


def true_tilt(robot: SimulatedRobot) -> SoleTilt:
    """The tilt by the encoder offsets of a simulated robot: differences and mean of their sums."""
    description = robot.description
    zero = dict(zip(description.joint_names, robot.individual.joint_zero.tolist(), strict=True))
    left, right = description.left_leg, description.right_leg
    pitch = [zero[leg.hip_pitch] + zero[leg.knee_pitch] + zero[leg.ankle_pitch]
             for leg in (left, right)]  # fmt: skip
    roll = [zero[leg.hip_roll] + zero[leg.ankle_roll] for leg in (left, right)]
    return SoleTilt(pitch[0] - pitch[1], roll[0] - roll[1], -0.5 * (roll[0] + roll[1]))


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
    """Walk a robot and compare its soles with the truth, every control period.

    It is commanded after a stand of `STAND_TIME`, for a duration [s]; the times of pushes count
    from the start of the trial.
    """

    def command_at(time: float) -> VelocityCommand:
        return command if time >= STAND_TIME else STANDSTILL

    gait = make_gait(spec)
    ticks = round((STAND_TIME + seconds) / spec.control_period)
    with make_world(spec) as world:
        truth = true_tilt(world.robot)
        for tick in islice(
            run(world, gait, TimedCommands(command_at, pushes, ahead=False)), ticks
        ):
            soles = gait.levelling
            left = SoleTilt(
                truth.pitch - soles.applied_pitch,
                truth.roll - soles.applied_roll,
                truth.lean - soles.applied_lean,
            )
            yield Levelled(left, soles.softness, tick.fallen)
