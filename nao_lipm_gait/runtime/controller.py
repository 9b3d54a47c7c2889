"""The gait behind its checks: contents of messages in, joint targets, status and log lines out.

The ROS node, the fault trials and the benchmarks run this same class. The way of a joint state:

    receive -> Intake -> Supervisor -> TargetGuard(Gait.step) -> Output, with a Reporter beside it
"""

from collections.abc import Callable, Mapping
from typing import NamedTuple

from nao_lipm_gait.calibration import NOT_CALIBRATED, Calibration
from nao_lipm_gait.gait import Gait
from nao_lipm_gait.parameters import BY_NAME, NEEDS_RESET, GaitParameters
from nao_lipm_gait.runtime.diagnostics import WALK
from nao_lipm_gait.runtime.inputs import ImuInput, Input, JointInput
from nao_lipm_gait.runtime.intake import Gaps, Intake, NewTime, Taken
from nao_lipm_gait.runtime.reporter import PublisherCounts, Reporter
from nao_lipm_gait.runtime.supervisor import ControllerSettings, Supervisor
from nao_lipm_gait.runtime.target_guard import GuardedTargets, TargetGuard
from robot_core.errors import NaoGaitError
from robot_core.head_goals import Goal
from robot_core.log import Level, LogLine, Report
from robot_core.motion.library import MotionLibrary
from robot_core.robot import RobotDescription
from robot_core.types import (
    BUSY,
    ON_THE_WAY,
    UPRIGHT,
    GaitState,
    GaitStatus,
    JointTargets,
    Pose2,
    Pose6,
    SensorFrame,
)

DELAY_WALKED = 0.1
"""[s] With more, NAOs fall at 0.1 m/s although it is right: 0 of 3 with 0.1, 2 with 0.12, 3 with
0.14."""

__all__ = ["Answer", "ControllerSettings", "GaitController", "Output"]


class Answer(NamedTuple):
    """The answer to one joint state.

    Attributes:
        targets: Targets to send as `joint_command`.
        status: What the gait did; None if there was no tick, or the last targets are held.
        torso_pose: The base link in base_footprint, with a status; see `Gait.torso_pose`.
    """

    targets: JointTargets
    status: GaitStatus | None = None
    torso_pose: Pose6 | None = None


class Output(NamedTuple):
    """What is to be published after a call.

    Attributes:
        answers: The oldest first; two if a joint state completes the one before it.
        log: Lines for the log.
        motion_results: What became of requested motions, as `name: outcome`.
    """

    answers: tuple[Answer, ...] = ()
    log: tuple[LogLine, ...] = ()
    motion_results: tuple[str, ...] = ()


class GaitController:
    """One gait and all that stands between it and the messages.

    Args:
        robot: The robot.
        parameters: Parameters of the gait.
        settings: What does not change.
        clock: Any monotonic time [s]; it is used for reports and never for the walk.
        motions: None = those that are shipped for this robot.
        calibration: Known constant errors of the robot's sensors.

    Attributes:
        parameters: The last requested ones; a walk applies them at its next support change.
        reporter: Counts refused messages, faults and exceptions.
        last_status: Status of the last tick; None before the first.
    """

    def __init__(
        self,
        robot: RobotDescription,
        parameters: GaitParameters,
        settings: ControllerSettings,
        clock: Callable[[], float],
        motions: MotionLibrary | None = None,
        calibration: Calibration = NOT_CALIBRATED,
    ) -> None:
        period = settings.control_period
        self._clock = clock
        self._gait = Gait(robot, parameters, period, motions, calibration)
        self._guard = TargetGuard(self._gait, robot, period)
        self.reporter = Reporter(self._gait, period, clock)
        self._intake = Intake(robot, period, self.reporter.say)
        self._set_delay(parameters.feedback_delay)
        self._supervisor = Supervisor(self._gait, settings, self.reporter.say)
        self.parameters = parameters
        self.last_status: GaitStatus | None = None
        self._refused: tuple[SensorFrame, Gaps] | None = None

    @property
    def state(self) -> GaitState:
        """What the gait is doing."""
        return self._gait.state

    @property
    def needs_loads(self) -> bool:
        """The messages of the soles are used now."""
        return self._supervisor.needs_loads

    @property
    def loads_file(self) -> bool:
        """A requested motion file is loaded; its motion is requested with a later message."""
        return self._supervisor.loads_file

    # -- messages ----------------------------------------------------------------------------------

    def receive(self, topic: str, read: Callable[[], Input]) -> Output:
        """Take a message; nothing about it can raise.

        Args:
            topic: Where it came from.
            read: Gives the contents of the message; its exceptions are caught as well.
        """
        answers: list[Answer] = []
        return self._output(topic, lambda: self._take(read(), answers), answers)

    def run(self, topic: str, work: Callable[[], object]) -> Output:
        """Do some other work for a topic; an exception is counted, logged and reported."""
        return self._output(topic, work, [])

    def overdue(self) -> Output:
        """Walk on for one control period whose joint state or IMU sample has not arrived in time.

        For a robot in real time, which does not wait for its answers. To be called once for each
        control period without an answer; after a few of them the robot holds its targets.
        """
        answers: list[Answer] = []
        return self._output("overdue sensors", lambda: self._walk_on(answers), answers, "")

    def watch(self) -> Output:
        """Report sensors that are silent; to be called a few times per second."""
        return self._output("watchdog", self.reporter.watch, [])

    def _output(
        self, topic: str, work: Callable[[], object], answers: list[Answer],
        effect: str = "; message ignored",
    ) -> Output:  # fmt: skip
        self.reporter.attempt(topic, work, effect)
        if self.loads_file:
            self.reporter.attempt("~/motion", self._supervisor.request_loaded, "; message ignored")
        return Output(
            tuple(answers), self.reporter.say.take_log(), self._supervisor.take_results()
        )

    def _take(self, message: Input, answers: list[Answer]) -> None:
        if isinstance(message, JointInput):
            now = self._clock()
            walking = self._gait.state in ON_THE_WAY
            if self._gait.state not in UPRIGHT:
                self._intake.forget_motors()
            taken = self._intake.joints(
                message, now, walking=walking, tilt=self._tilt, driven=self._supervisor.drives
            )
            self.reporter.joints_arrived(now, message.waited, repeated=taken.repeated)
            self._act_on(taken, answers)
        elif isinstance(message, ImuInput):
            upright = self._gait.state in UPRIGHT
            self._act_on(self._intake.imu(message, upright=upright), answers)
        else:
            self._supervisor.receive(message, self._intake.stamp)

    def _walk_on(self, answers: list[Answer]) -> None:
        taken = self._intake.overdue(self._tilt)
        if taken.frames:
            self._act_on(taken, answers)
            return
        guarded = self._guard.coast()
        if guarded is not None:
            self._send(guarded)
            answers.append(Answer(guarded.targets))

    # -- the tick ----------------------------------------------------------------------------------

    def _act_on(self, taken: Taken, answers: list[Answer]) -> None:
        if taken.new_time is not None:
            self._begin(taken.new_time)
        for frame in taken.frames:
            answers.append(self._offer(frame, taken.gaps))
        if taken.repeated and self._refused is not None:
            # Lockstep waits: no later frame will tell more.
            answers.append(self._offer(*self._refused, last=True))
        if taken.again is not None:
            answers.append(Answer(taken.again))
        if taken.refused is not None:
            raise taken.refused

    def _offer(self, frame: SensorFrame, gaps: Gaps, *, last: bool = False) -> Answer:
        self._refused = frame, gaps
        self._supervisor.admit(frame, last=last)
        self._refused = None
        return self._tick(frame, gaps)

    def _begin(self, time: NewTime) -> None:
        self._refused = None
        if time.steady:
            self._guard.shift_clock(time.stamp)
        else:
            self._guard.restart()  # the robot may be anywhere
        self._supervisor.new_time(time)

    def _tick(self, frame: SensorFrame, gaps: Gaps) -> Answer:
        frame, command = self._supervisor.decide(frame, gaps)
        begin = self._clock()
        guarded = self._guard.step(frame, command)
        end = self._clock()
        self._send(guarded)
        status = None if guarded.held else self._gait.status
        self.reporter.ticked(begin, end, status)
        self._supervisor.follow(status)
        if status is None:
            return Answer(guarded.targets)
        self.last_status = status
        return Answer(guarded.targets, status, self._gait.torso_pose)

    def _send(self, guarded: GuardedTargets) -> None:
        self._intake.sent(guarded.targets)
        self.reporter.sent(guarded)

    @property
    def _tilt(self) -> tuple[float, float]:
        """Last known roll and pitch of the torso [rad]."""
        status = self.last_status
        return (0.0, 0.0) if status is None else (status.torso_roll, status.torso_pitch)

    # -- services and parameters -------------------------------------------------------------------

    def answer(self, act: Callable[[], str]) -> tuple[bool, str]:
        """Do what a service asks for; nothing about it can raise.

        Args:
            act: Does it, and describes what is going to happen.

        Returns:
            Whether it was accepted, and the description or the reason of the refusal.
        """
        try:
            return True, act()
        except NaoGaitError as error:
            return False, str(error)
        except Exception as error:
            return False, self.reporter.service_failed(error)

    def note_motors(self, ready: bool) -> None:
        """Record whether the motors follow what is commanded; until then the robot stands."""
        self._supervisor.note_motors(ready)

    def stand(self) -> str:
        """Stop and stand; describes what is going to happen."""
        self._supervisor.stand()
        return "standing once the step is done, or once a lying robot is upright" + self._no_sensors

    def relax(self) -> str:
        """Take the torque off all joints; describes what is going to happen."""
        self._supervisor.relax()
        return "relaxed from the next tick on; ~/stand makes it stiff again" + self._no_sensors

    @property
    def _no_sensors(self) -> str:
        if self._intake.answered:
            return ""
        return "; but no sensor message has arrived yet, and without one nothing is sent"

    def request_motion(self, name: str) -> None:
        """Run a motion as soon as it can begin; see `Supervisor.request_motion`."""
        self._supervisor.request_motion(name)

    def get_up(self) -> str:
        """Get up from the floor; describes what is going to happen.

        Raises:
            NaoGaitError: If the robot does not lie.
        """
        self._supervisor.get_up()
        return "getting up once the robot has come to rest"

    def look(self, goal: Goal | None) -> None:
        """Turn the head; None returns control to the gait.

        Raises:
            NaoGaitError: For a robot without a head to turn.
        """
        self._gait.request_look(goal)

    def lift(self, share: float) -> None:
        """Lift the feet by a share of `swing_lift`; NaoGaitError if it is not from 0 to 1."""
        self._gait.request_lift(share)

    def kick(self, ball: Pose2) -> None:
        """Kick a ball in the walk: x, y [m] and the direction of its way in base_footprint."""
        x, y, direction = ball
        self._gait.request_kick((x, y), direction)

    def with_changes(self, changes: Mapping[str, object]) -> GaitParameters:
        """The gait's parameters with these changes, all or none; names of others are left out.

        Raises:
            NaoGaitError: For a bad value, or a change that needs a robot that stands still.
        """
        own = {n: BY_NAME[n].check(value) for n, value in changes.items() if n in BY_NAME}
        changed = self.parameters.replace(**own)
        needing = self._needing_restart(changed)
        if needing and self._gait.state in BUSY:
            allowed = "no change while walking or in a motion; stand first"
            raise NaoGaitError(needing[0], getattr(changed, needing[0]), allowed)
        return changed

    def change_parameters(self, changes: Mapping[str, object]) -> None:
        """Apply changes; a walk applies them at its next support change.

        Raises:
            NaoGaitError: As `with_changes`.
        """
        changed = self.with_changes(changes)
        if changed == self.parameters:
            return
        restarts = bool(self._needing_restart(changed))
        self.parameters = changed
        self._set_delay(changed.feedback_delay)
        self._gait.set_parameters(changed)
        if restarts:
            self._supervisor.restart()

    def _set_delay(self, delay: float) -> None:
        self._intake.set_delay(delay)
        if delay > DELAY_WALKED:
            text = (
                f"feedback_delay: {delay:g} s; robots walked safely with at most {DELAY_WALKED:g} s"
            )
            self.reporter.say.begin(WALK, Level.WARN, "feedback_delay", text)
        else:
            self.reporter.say.end("feedback_delay", "feedback_delay is one that robots walk with")

    def _needing_restart(self, changed: GaitParameters) -> list[str]:
        return [n for n in NEEDS_RESET if getattr(self.parameters, n) != getattr(changed, n)]

    # -- watching ----------------------------------------------------------------------------------

    def note_publishers(self, counts: PublisherCounts) -> None:
        """Report publishers that are one too many; to be called once per second."""
        self.reporter.note_publishers(counts)
        if self._supervisor.note_gaits(counts.joint_command):
            self._intake.forget_wrong_joints()

    def reports(self) -> tuple[Report, ...]:
        """The reports since the last call; to be called once per second."""
        return self.reporter.reports(
            self.parameters, self._supervisor.velocity, self._intake.stamp, self._intake.missed
        )
