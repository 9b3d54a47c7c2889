"""Messages of the IMU and the joints in, complete sensor frames out."""

import math
from typing import NamedTuple

import numpy as np

from nao_lipm_gait.gait import MISSED_TICKS_MAX
from nao_lipm_gait.runtime.diagnostics import SENSORS, WALK, Diagnostics
from nao_lipm_gait.runtime.frame_sync import FrameSync
from nao_lipm_gait.runtime.inputs import ImuInput, JointInput
from nao_lipm_gait.runtime.stamps import LONGEST_GAP, SensorAge, StampMonitor, Step
from nao_lipm_gait.runtime.validation import JointSample, SensorValidation
from robot_core.errors import NaoGaitError
from robot_core.log import Level
from robot_core.message_checks import stamp_of
from robot_core.robot import RobotDescription
from robot_core.types import FloatArray, JointTargets, SensorFrame

STAMP = "joint_states header.stamp"
STEADY_TIME = 0.1
"""[s] Wall time between two joint states in which the robot cannot have moved far."""
STEADY_ANGLE = 0.3
"""[rad] Largest change of a joint of a robot that has not been moved meanwhile."""
ASKED_AGAIN = 0.2
"""[s] of wall time without joint states, after which a repeated stamp asks for the answer again, as
`sim_bridge` does in lockstep. That is no fault."""
OFF_RATE, RATE_AGAIN = 0.1, 0.05
"""Share by which the mean step of the stamps may differ from the control period, and below which it
is right again."""
LATE_UNJUDGED = 4
"""Control periods by which sensors are late from which on their joints are not compared."""
FAR_OFF_RATE = 1.4
"""Control periods between nearly all joint states from which on the robot does not walk."""


class Gaps(NamedTuple):
    """What is missing of the sensors.

    Attributes:
        blind_since: Stamp of the first frame without an IMU sample [ns]; None with one.
        imu_behind: Time [ns] from the newest IMU sample to such a frame; None if none arrives.
        unread_since: Stamp since which joints are substituted [ns]; None while they are read.
        off_rate: The joint states come too rarely for the control period.
        wrong: Leg joints do not follow their targets, which stand in for them.
        gyro_jumps: The gyro is not used, and has to prove itself again.
        limp: A leg motor gives no torque.
    """

    blind_since: int | None = None
    imu_behind: int | None = None
    unread_since: int | None = None
    off_rate: bool = False
    wrong: bool = False
    gyro_jumps: bool = False
    limp: bool = False


COMPLETE = Gaps()


class NewTime(NamedTuple):
    """The stamps begin, or continue on another time base.

    Attributes:
        stamp: The first stamp [ns] of it.
        first: There was no time before.
        steady: The robot has not moved meanwhile: only the clock has jumped.
    """

    stamp: int
    first: bool
    steady: bool


class Taken(NamedTuple):
    """What a message has led to.

    Attributes:
        frames: The frames that are complete now, the oldest first; each leads to a tick.
        gaps: What is missing in the newest of them.
        new_time: Set if the frames are of another time base.
        again: The last targets, to be sent again.
        refused: Why a message that can be read leads to nothing else.
        repeated: It is a joint state that has come before.
    """

    frames: tuple[SensorFrame, ...] = ()
    gaps: Gaps = COMPLETE
    new_time: NewTime | None = None
    again: JointTargets | None = None
    refused: NaoGaitError | None = None
    repeated: bool = False


NOTHING = Taken()


class Intake:
    """Decides which messages are used, and makes frames of them.

    Args:
        robot: The robot that is measured.
        control_period: Time between two joint states [s].
        say: Takes what was found.
    """

    def __init__(self, robot: RobotDescription, control_period: float, say: Diagnostics) -> None:
        self._say = say
        self._seconds = control_period
        self._period = round(control_period * 1e9)
        self._stamps = StampMonitor(self._period, MISSED_TICKS_MAX)
        self._validation = SensorValidation(robot, control_period, say)
        self._sync = FrameSync(self._period)
        self._age = SensorAge(control_period)
        self._command_lag = robot.command_lag
        self._delay = 0
        self._arrival: int | None = None
        self._arrived_at = self._continued_at = -math.inf
        self._last_position: FloatArray | None = None
        self._last_sent: JointTargets | None = None
        self._doubtful: NaoGaitError | None = None
        self._off_rate = False

    @property
    def stamp(self) -> int | None:
        """The newest accepted stamp of joint states [ns]; None before the first."""
        return self._stamps.last

    @property
    def missed(self) -> int:
        """Joint states that never arrived."""
        return self._stamps.missed

    @property
    def answered(self) -> bool:
        """Targets have been sent."""
        return self._last_sent is not None

    def set_delay(self, delay: float) -> None:
        """Set the time [s] until a command shows in the sensors."""
        self._delay = round(delay * 1e9)
        self._age.usual = delay - self._command_lag

    def forget_wrong_joints(self) -> None:
        """Another gait moves the robot: its joints need not follow the targets of this one."""
        self._validation.forget_wrong_joints()

    def forget_motors(self) -> None:
        """The robot lies, or a motion moves it: its leg motors are judged anew."""
        self._validation.forget_motors()

    def sent(self, targets: JointTargets) -> None:
        """Keep targets that were sent."""
        self._last_sent = targets
        self._validation.sent(targets)

    def imu(self, message: ImuInput, *, upright: bool = True) -> Taken:
        """Take an IMU message of an upright robot or not; NaoGaitError if it cannot be used."""
        frame = self._sync.add_imu(self._validation.imu(message, upright=upright))
        return NOTHING if frame is None else self._completed((frame,))

    def joints(
        self, message: JointInput, now: float, *, walking: bool, tilt: tuple[float, float],
        driven: bool = False,
    ) -> Taken:  # fmt: skip
        """Take a joint state.

        Args:
            message: The joint state.
            now: Wall time [s], for what is reported.
            walking: The robot walks, so its joints must move.
            tilt: Last known roll and pitch of the torso [rad], which an IMU that is gone keeps.
            driven: The motors follow the targets of a stand or walk, as far as is known.

        Raises:
            NaoGaitError: If it cannot be read.
        """
        stamp = stamp_of(message.sec, message.nanosec, STAMP)
        step = self._stamps.classify(stamp)
        if step is Step.NEXT:
            delay = self._delay + self._age.late * self._period
            driven = driven and abs(self._age.late) < LATE_UNJUDGED
            sample = self._validation.next_joints(
                message, stamp, delay=delay, walking=walking, driven=driven
            )
        else:
            sample = self._validation.read_joints(message, stamp)
        self._arrival = message.arrived
        before, self._arrived_at = self._arrived_at, now - message.waited
        last = self._stamps.last or 0
        self._stamps.accept(stamp, step)
        if self._doubtful is not None:
            self._settle_doubt(self._doubtful, step)
        if step is Step.REPEATED:
            return self._repeated(stamp, tilt, asked=self._arrived_at - before > ASKED_AGAIN)
        if step is Step.EARLY:
            return self._early(stamp, last)
        if step is Step.LATE:
            return Taken(refused=self._unexpected(step, stamp))
        if step is Step.DOUBTFUL:
            self._say.rejected["joint_states"] += 1
            self._doubtful = self._unexpected(step, stamp)
            return NOTHING
        new_time = None if step is Step.NEXT else self._begin(step, sample, stamp - last, now)
        self._continued_at, self._last_position = now, sample.position
        self._check_rate()
        try:
            frames = self._sync.add_joints(sample, tilt)
        except NaoGaitError as error:
            return Taken(new_time=new_time, refused=error)
        return self._completed(frames, new_time)

    def overdue(self, tilt: tuple[float, float]) -> Taken:
        """Use joints whose IMU sample has not arrived in time; `tilt` and errors as in `joints`."""
        frame = self._sync.overdue(tilt)
        return NOTHING if frame is None else self._completed((frame,))

    def _completed(
        self, frames: tuple[SensorFrame, ...], new_time: NewTime | None = None
    ) -> Taken:
        """The frames with their age, and what is missing of them."""
        frames = tuple([self._aged(frame) for frame in frames])
        blind, unread = self._sync.blind_since, self._validation.unread_since
        wrong = bool(self._validation.joints.trouble)
        limp = bool(self._validation.motors.trouble)
        if blind is None and unread is None and not (self._off_rate or wrong or limp):
            return Taken(frames, COMPLETE, new_time)
        behind, jumps = self._sync.imu_behind, self._validation.gyro_jumps
        gaps = Gaps(blind, behind, unread, self._off_rate, wrong, jumps, limp)
        return Taken(frames, gaps, new_time)

    def _aged(self, frame: SensorFrame) -> SensorFrame:
        late = self._age.update(frame.stamp, self._arrival)
        return frame._replace(late=late) if late else frame

    # -- stamps that are not the next one ----------------------------------------------------------

    def _repeated(self, stamp: int, tilt: tuple[float, float], *, asked: bool) -> Taken:
        """The sender missed the answer, and may have `asked` again, or an IMU sample is missing."""
        try:
            frame = self._sync.repeat(stamp, tilt)
        except NaoGaitError as no_imu:
            return Taken(refused=no_imu, repeated=True)
        self._say.rejected["joint_states"] += 1
        if not asked and stamp == 0:
            allowed = "the time of sampling, which its sender has to set"
            return Taken(refused=NaoGaitError(STAMP, "0 s again", allowed), repeated=True)
        if not asked:
            error = NaoGaitError(STAMP, f"{stamp * 1e-9:.3f} s again", "a later stamp")
            text = f"{error}; the answer is sent again"
            self._say.event(SENSORS, Level.WARN, "repeated joint_states", text)
        if frame is not None:
            return self._completed((frame,))._replace(repeated=True)
        sent = self._last_sent
        answered = sent is not None and sent.stamp == stamp
        return Taken(again=sent if answered else None, repeated=True)

    def _early(self, stamp: int, last: int) -> Taken:
        """Answer a stamp [ns] before the next tick is due: in lockstep the robot waits for it."""
        sent = self._last_sent
        again = None if sent is None else sent._replace(stamp=stamp)
        got = f"{(stamp - last) * 1e-9:.6g} s after the last"
        allowed = f"steps of control_period, {self._seconds:g} s"
        return Taken(again=again, refused=NaoGaitError(STAMP, got, allowed))

    def _unexpected(self, step: Step, stamp: int) -> NaoGaitError:
        """The error of a stamp [ns] that is late or may begin a new time."""
        return NaoGaitError(
            STAMP,
            f"{stamp * 1e-9:.3f} s, {step.value}",
            f"a stamp that follows {(self._stamps.last or 0) * 1e-9:.3f} s, or more stamps of the "
            "new time",
        )

    def _settle_doubt(self, error: NaoGaitError, step: Step) -> None:
        """Report the last doubtful stamp, unless this one continues from it."""
        self._doubtful = None
        if step not in (Step.BACKWARDS, Step.JUMP):
            text = f"{error}; message ignored"
            self._say.event(SENSORS, Level.WARN, error.field, text, burst=5)

    def _begin(self, step: Step, sample: JointSample, gap: int, now: float) -> NewTime:
        """Continue on a new time base that begins with `sample`, `gap` [ns] after the last one."""
        first, stamp, last = step is Step.FIRST, sample.stamp, self._last_position
        near = last is not None and float(np.abs(sample.position - last).max()) < STEADY_ANGLE
        steady = first or (now - self._continued_at < STEADY_TIME and near)
        if not first:
            self._report_new_time(step, stamp, gap, steady=steady)
            self._sync.restart(stamp)
            if steady:
                self._age.set_clock(stamp, self._arrival)
        self._validation.restart(sample, steady)
        return NewTime(stamp, first, steady)

    def _report_new_time(self, step: Step, stamp: int, gap: int, *, steady: bool) -> None:
        """A robot that was silent for longer than a walk bridges was paused or reset: no fault."""
        if gap > LONGEST_GAP and not steady:
            text = f"joint_states after a pause of {gap * 1e-9:.2f} s: restarting from a stand"
            self._say.event(WALK, Level.OK, "pause", text)
            return
        text = (
            f"{STAMP}: {step.value} to {stamp * 1e-9:.3f} s; allowed: steps of {self._seconds:g} s "
            f"and no gap over {self._stamps.longest_gap * 1e-9:.3g} s; "
            + ("stopping" if steady else "restarting from a stand")
        )
        self._say.event(WALK, Level.WARN, f"stamp {step.value}", text)

    def _check_rate(self) -> None:
        """Report joint states at another rate: the walk then runs too fast or too slow."""
        slow = self._stamps.usual_step * 1e-9
        self._off_rate = slow > FAR_OFF_RATE * self._seconds
        if self._off_rate:
            text = (
                f"{STAMP}: steps of {slow:.4g} s; allowed: steps of control_period, "
                f"{self._seconds:g} s; set control_period to {slow:.4g}, or the sensors to "
                f"{1.0 / self._seconds:.4g} Hz; the robot stands"
            )
            self._say.begin(SENSORS, Level.ERROR, "rate", text)
            return
        step, period = self._stamps.mean_step * 1e-9, self._seconds
        if abs(step - period) > OFF_RATE * period:
            text = (
                f"{STAMP}: steps of {step:.4g} s on average; allowed: steps of "
                f"control_period, {period:g} s; the walk runs {period / step:.2g} times as fast"
            )
            self._say.begin(SENSORS, Level.WARN, "rate", text)
        elif abs(step - period) < RATE_AGAIN * period:
            self._say.end("rate", "joint_states arrive at the control period again")
