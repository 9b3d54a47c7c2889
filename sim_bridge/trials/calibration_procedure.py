"""The procedure of a calibration: the robot stands, steps on the spot and stands.

To find a wrong zero it does so in several poses, which are parameters of the gait.

It decides by the time of the robot's sensors what happens next. `nao_gait calibrate` carries it out
over ROS, `sim_bridge.trials.calibration` on a simulated robot.
"""

import math
from collections.abc import Mapping, Sequence
from enum import StrEnum

import numpy as np

from nao_lipm_gait.calibration import Calibration
from nao_lipm_gait.estimation.joint_zeros import (
    Means,
    Pose,
    Zero,
    corrected,
    joint_zeros,
    wrong_zeros,
)
from nao_lipm_gait.estimation.sole_levelling import TILT_MAX
from nao_lipm_gait.parameters import BY_NAME
from nao_lipm_gait.runtime.calibration_monitor import Measurement
from nao_lipm_gait.velocity_control import DEADBAND
from robot_core.errors import NaoGaitError
from robot_core.robot import RobotDescription
from robot_core.types import (
    ON_THE_WAY,
    STANDSTILL,
    FloatArray,
    GaitState,
    VelocityCommand,
    state_of,
)

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
LONGEST_STEP_TIME = 20.0
"""Duration [s] of the first steps after which a wrong zero is looked for anyway."""
POSE_STEP_TIME, POSE_REST_TIME = 6.0, 2.0
"""The same durations [s] in the poses after the first."""
SETTLED_TIME = 2.0
"""Duration [s] of steps in a pose before they are measured."""
MEANS_TIME = 1.5
"""Least duration [s] of the means over a stand."""
PHASE_LIMIT = 60.0
"""Longest duration [s] of each of the three."""
PLACE, POSED_PLACE = 0.3, 1.0
"""Distance [m] from its place, by odometry, at which the robot does not step on the spot; it drifts
farther in several poses with a wrong zero."""


def calibration_poses(parameters: Mapping[str, float]) -> list[dict[str, float]]:
    """The poses in which zeros show: as it walks, leaning ahead and back, with the feet apart.

    Args:
        parameters: Values of `POSED` that the gait has.

    Returns:
        Values of `POSED` for each pose, the first as given.
    """
    height, pitch, spacing, offset = (parameters[name] for name in POSED)
    poses = (
        (height, pitch, spacing, offset),
        (0.98 * height, pitch + 0.21, spacing, offset),
        (height, pitch - 0.24, spacing, offset),
        (height, pitch, 1.5 * spacing, offset + 0.25 * spacing),
    )
    return [
        {name: min(max(value, BY_NAME[name].minimum), BY_NAME[name].maximum)
         for name, value in zip(POSED, pose, strict=True)}
        for pose in poses
    ]  # fmt: skip


POSED = ("com_height", "torso_pitch", "foot_spacing", "pendulum_offset_y")
"""Parameters of the gait in which poses differ."""


class CalibrationError(Exception):
    """The robot was not calibrated; the text says why."""


class Phase(StrEnum):
    """What the robot does."""

    STAND = "standing"
    STEP = "stepping on the spot"
    REST = "standing on level soles"
    DONE = "done"


class _Sum:
    """Sums of joint angles and forces since a time [s]."""

    def __init__(self, began: float) -> None:
        self.began = began
        self._count = 0
        self._position: FloatArray = np.zeros(0)
        self._force: FloatArray = np.zeros(3)

    def add(self, position: FloatArray, force: FloatArray) -> None:
        self._position = position + (self._position if self._count else 0.0)
        self._force = self._force + force
        self._count += 1

    def means(self) -> Means:
        return Means(self._position / self._count, self._force / self._count)


class Procedure:
    """The phases of a calibration.

    The methods `see_*` raise `CalibrationError` if the calibration cannot succeed any more.

    Args:
        poses: Parameters of the gait in each pose, to find a wrong zero; none for one pose only.

    Attributes:
        phase: What the robot does now.
        measured: The last measurement; None before the first.
        level: The one at the end of the first stand on level soles; None before it.
        seen: What was measured in each pose, the stand at the beginning first.
    """

    def __init__(self, poses: Sequence[Mapping[str, float]] = ()) -> None:
        self.phase = Phase.STAND
        self.measured: Measurement | None = None
        self.level: Measurement | None = None
        self.seen: list[Pose] = []
        self._poses, self._pose = poses, 0
        self._steps: Means | None = None
        self._sum: _Sum | None = None
        self._state = GaitState.STAND
        self._place: tuple[float, float] | None = None
        self._now = self._began = self._stepped = 0.0
        self._tilt, self._tilted_at = (math.inf, math.inf), 0.0
        self._rests = False

    @property
    def command(self) -> VelocityCommand | None:
        """What to command now; None = nothing, the robot stands."""
        if self.phase is Phase.STAND:
            return None
        return STEP_ON_THE_SPOT if self.phase is Phase.STEP else STANDSTILL

    def result(self, robot: RobotDescription) -> tuple[list[Zero], Calibration]:
        """The leg joints, the most suspicious one first, and a calibration; after `Phase.DONE`.

        The calibration corrects a wrong zero if it is clear which one it is.
        """
        assert self.level is not None
        found, calibration = joint_zeros(robot, self.seen), self.level.calibration
        wrong, stand = wrong_zeros(found), self.seen[1].stand
        if len(wrong) == 1 and stand is not None:
            calibration = corrected(robot, calibration, wrong[0], stand.position)
        return found, calibration

    @property
    def parameters(self) -> Mapping[str, float]:
        """The parameters that the gait must have now; empty if they do not matter."""
        return self._poses[self._pose] if self._poses else {}

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
        place = POSED_PLACE if self._poses else PLACE
        if math.hypot(x - self._place[0], y - self._place[1]) > place:
            raise CalibrationError(f"the robot left its place by more than {place:g} m")
        if self.elapsed > PHASE_LIMIT:
            raise CalibrationError(f"{_UNFINISHED[self.phase]} after {PHASE_LIMIT:g} s")

    def see_sensors(self, position: FloatArray, force: FloatArray) -> None:
        """Take measured joint angles (n,) [rad] and the specific force (3,) [m/s^2] of an instant.

        The angles are without the zeros that are corrected already.
        """
        if self.phase is Phase.STEP:
            measures = self._stepped > SETTLED_TIME
        else:
            measures = self._now > self._began and self._rests
        if measures:
            if self._sum is None:
                self._sum = _Sum(self._now)
            self._sum.add(position, force)

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
        ours: tuple[VelocityCommand, ...] = STANDSTILL, STEP_ON_THE_SPOT
        # Later on the last one of another phase may arrive late.
        if self._pose == 0 and self.phase is Phase.STAND:
            ours = (STANDSTILL,)
        elif self._pose == 0 and self.phase is Phase.STEP:
            ours = (STEP_ON_THE_SPOT,)
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
        if self.phase is Phase.STEP:
            self._note_tilt(measured)
            if self._stepped >= (POSE_STEP_TIME if self._pose else STEP_TIME):
                self._end_steps(measured)
            return
        self._rests = measured.stand_time > 0.0
        if not self._averaged:
            return
        if self.phase is Phase.STAND:
            if measured.stand_time >= STAND_TIME:
                self._note_pose(Pose(stand=self._means()))
                self._begin(Phase.STEP)
        elif measured.stand_time >= (POSE_REST_TIME if self._pose else REST_TIME):
            self._end_rest(measured)

    @property
    def _averaged(self) -> bool:
        """The means over this stand are good enough."""
        since = None if self._sum is None else self._now - self._sum.began
        return not self._poses or (since is not None and since >= MEANS_TIME)

    def _end_steps(self, measured: Measurement) -> None:
        """Stand, if the soles are level; in several poses after some time anyway."""
        if not self._poses:
            _check_soles(measured)
        level = measured.soles_level and self._stepped - self._tilted_at >= STEADY_TIME
        if level or self._pose > 0 or (self._poses and self._stepped >= LONGEST_STEP_TIME):
            self._steps = self._means()
            self._begin(Phase.REST)

    def _end_rest(self, measured: Measurement) -> None:
        """Go on to the next pose, or end."""
        self.level = self.level or measured
        self._note_pose(
            Pose(self._steps, (measured.sole_pitch, measured.sole_roll), self._means())
        )
        if self._pose + 1 < len(self._poses):
            self._pose += 1
            self._begin(Phase.STEP)
        else:
            self._begin(Phase.DONE)

    def _means(self) -> Means | None:
        """Means over the present phase; None without sensors."""
        return None if self._sum is None else self._sum.means()

    def _note_pose(self, pose: Pose) -> None:
        if self._poses:
            self.seen.append(pose)

    def _note_tilt(self, measured: Measurement) -> None:
        """Remember since when the tilt has not changed much."""
        tilt = measured.sole_pitch, measured.sole_roll
        if math.dist(tilt, self._tilt) > STEADY:
            self._tilt, self._tilted_at = tilt, self._stepped

    def _begin(self, phase: Phase) -> None:
        self.phase = phase
        self._began = self._now
        self._stepped = 0.0
        self._sum, self._rests = None, False


def _check_soles(measured: Measurement) -> None:
    """Raise `CalibrationError` for soles that are tilted as far as can be levelled, or farther."""
    for axis, tilt, joints in (
        ("pitched", measured.sole_pitch, "hip pitch, knee or ankle pitch"),
        ("rolled", measured.sole_roll, "hip roll or ankle roll"),
    ):
        if abs(tilt) >= TILT_MAX:
            raise CalibrationError(
                f"the left sole is {axis} by {math.degrees(tilt):+.1f} deg or more relative to the "
                f"right one: the zero of a {joints} joint is wrong; `nao_gait calibrate --zeros` "
                "looks for it, mend it in the robot"
            )


_UNFINISHED = {
    Phase.STAND: "the robot has not come to rest",
    Phase.STEP: "the tilt of the soles is not known",
    Phase.REST: "the robot has not come to rest after its steps",
    Phase.DONE: "no end",
}
