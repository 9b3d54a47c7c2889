"""The procedure of a calibration: the robot stands, steps on the spot and stands.

It decides by the time of the robot's sensors what happens next. `nao_gait calibrate` carries it out
over ROS, `sim_bridge.trials.calibration` on a simulated robot.
"""

import math
from enum import StrEnum

from nao_lipm_gait.estimation.sole_levelling import TILT_MAX
from nao_lipm_gait.runtime.calibration_monitor import Measurement
from nao_lipm_gait.velocity_control import DEADBAND
from robot_core.errors import NaoGaitError
from robot_core.types import ON_THE_WAY, STANDSTILL, GaitState, VelocityCommand, state_of

STEP_ON_THE_SPOT = VelocityCommand(DEADBAND.x, 0.0, 0.0)
"""The slowest walk ahead, which stays in place; a command of zero would stand."""
STAND_TIME = 2.0
"""Duration [s] of the quiet stand before the steps, for the gyro."""
STEP_TIME = 12.0
"""Least duration [s] of the steps; the soles are usually level after 3 s."""
STEADY_TIME, STEADY = 3.0, 0.004
"""Duration [s] of steps in which the measured tilt may change by so much [rad]: that of soles which
are tilted farther than can be levelled goes on rising."""
REST_TIME = 5.0
"""Duration [s] of the quiet stand after them, for gyro and accelerometer."""
PHASE_LIMIT = 60.0
"""Longest duration [s] of each of the three."""
PLACE = 0.3
"""Distance [m] from its place, by odometry, at which the robot does not step on the spot."""


class CalibrationError(Exception):
    """The robot was not calibrated; the text says why."""


class Phase(StrEnum):
    """What the robot does."""

    STAND = "standing"
    STEP = "stepping on the spot"
    REST = "standing on level soles"
    DONE = "done"


class Procedure:
    """The phases of a calibration.

    The methods `see_*` raise `CalibrationError` if the calibration cannot succeed any more.

    Attributes:
        phase: What the robot does now.
        measured: The last measurement; None before the first.
    """

    def __init__(self) -> None:
        self.phase = Phase.STAND
        self.measured: Measurement | None = None
        self._state = GaitState.STAND
        self._place: tuple[float, float] | None = None
        self._now = self._began = self._stepped = 0.0
        self._tilt, self._tilted_at = (math.inf, math.inf), 0.0

    @property
    def command(self) -> VelocityCommand | None:
        """What to command now; None = nothing, the robot stands."""
        if self.phase is Phase.STAND:
            return None
        return STEP_ON_THE_SPOT if self.phase is Phase.STEP else STANDSTILL

    @property
    def elapsed(self) -> float:
        """Duration [s] of the present phase."""
        return self._now - self._began

    def see_odometry(self, now: float, x: float, y: float) -> None:
        """Take a place x, y [m] of the robot at a time [s] of its sensors."""
        if self._place is None:
            self._place = x, y
            self._now = self._began = now
        if now < self._now:
            raise CalibrationError("the clock of the sensors went back")
        if self.phase is Phase.STEP and self._state is GaitState.WALK:
            self._stepped += now - self._now
        self._now = now
        if math.hypot(x - self._place[0], y - self._place[1]) > PLACE:
            raise CalibrationError(f"the robot left its place by more than {PLACE:g} m")
        if self.elapsed > PHASE_LIMIT:
            raise CalibrationError(f"{_UNFINISHED[self.phase]} after {PHASE_LIMIT:g} s")

    def see_state(self, text: str) -> None:
        """Take the state of the gait, as in `gait/support`."""
        state = state_of(text)
        if state is None:
            raise CalibrationError(f"gait/support says {text[:60]!r}: no state of the gait")
        self._state = state
        if self._state is GaitState.FALLEN:
            raise CalibrationError("the robot has fallen")
        walks = self._state in ON_THE_WAY and self.phase is not Phase.STAND
        if self._state is not GaitState.STAND and not walks:
            raise CalibrationError(
                f"{self.phase}, the gait is in {self._state}: the robot has to stand first, "
                "undisturbed, and nobody else may command it"
            )

    def see_command(self, command: VelocityCommand) -> None:
        """Take a command from `cmd_vel`, which is ours or that of somebody else."""
        ours = {
            Phase.STAND: (STANDSTILL,),
            Phase.STEP: (STEP_ON_THE_SPOT,),
        }.get(self.phase, (STANDSTILL, STEP_ON_THE_SPOT))  # the last step may arrive late
        if command not in ours:
            raise CalibrationError("somebody else commands the robot on cmd_vel")

    def see_measurement(self, stamp: float, measured: Measurement) -> None:
        """Take what the gait has measured up to a time [s]; the next phase may begin.

        Raises:
            NaoGaitError: The gait does not measure the soles.
        """
        self.measured = measured
        if not measured.steps_measure:
            raise NaoGaitError("gait parameters level_soles, feedback", "false", "true for both")
        if self._place is None or stamp < self._began:
            return
        if self.phase is Phase.STAND:
            if measured.stand_time >= STAND_TIME:
                self._begin(Phase.STEP)
        elif self.phase is Phase.STEP:
            self._note_tilt(measured)
            if self._stepped >= STEP_TIME:
                _check_soles(measured)
                steady = self._stepped - self._tilted_at >= STEADY_TIME
                if measured.soles_level and steady:
                    self._begin(Phase.REST)
        elif measured.stand_time >= REST_TIME:
            self._begin(Phase.DONE)

    def _note_tilt(self, measured: Measurement) -> None:
        """Remember since when the tilt has not changed much."""
        tilt = measured.sole_pitch, measured.sole_roll
        if math.dist(tilt, self._tilt) > STEADY:
            self._tilt, self._tilted_at = tilt, self._stepped

    def _begin(self, phase: Phase) -> None:
        self.phase = phase
        self._began = self._now


def _check_soles(measured: Measurement) -> None:
    """Raise `CalibrationError` for soles that are tilted as far as can be levelled, or farther."""
    for axis, tilt, joints in (
        ("pitched", measured.sole_pitch, "hip pitch, knee or ankle pitch"),
        ("rolled", measured.sole_roll, "hip roll or ankle roll"),
    ):
        if abs(tilt) >= TILT_MAX:
            raise CalibrationError(
                f"the left sole is {axis} by {math.degrees(tilt):+.1f} deg or more relative to the "
                f"right one: the zero of a {joints} joint is wrong; mend it in the robot"
            )


_UNFINISHED = {
    Phase.STAND: "the robot has not come to rest",
    Phase.STEP: "the tilt of the soles is not known",
    Phase.REST: "the robot has not come to rest after its steps",
    Phase.DONE: "no end",
}
