"""The gait behind its checks: contents of messages in, joint targets, status and log lines out.

The ROS node, the fault trials and the benchmarks run this same class. The way of a joint state:

    receive -> StampMonitor -> SensorValidation -> FrameSync -> TargetGuard(Gait.step) -> Output
"""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from nao_lipm_gait.calibration import NOT_CALIBRATED, Calibration
from nao_lipm_gait.gait import MISSED_TICKS_MAX, Gait
from nao_lipm_gait.parameters import GaitParameters
from nao_lipm_gait.runtime.calibration_monitor import CalibrationMonitor
from nao_lipm_gait.runtime.commands import (
    VelocityInput,
    needing_restart,
    read_velocity,
    with_changes,
)
from nao_lipm_gait.runtime.diagnostics import COMMANDS, SENSORS, WALK, Diagnostics
from nao_lipm_gait.runtime.frame_sync import FrameSync
from nao_lipm_gait.runtime.heat_watch import HeatWatch
from nao_lipm_gait.runtime.inputs import ImuInput, Input, JointInput, LoadInput, TemperatureInput
from nao_lipm_gait.runtime.lift_watch import LiftWatch
from nao_lipm_gait.runtime.motion_commands import MotionCommands
from nao_lipm_gait.runtime.publisher_watch import PublisherCounts, PublisherWatch
from nao_lipm_gait.runtime.reports import Health, reports
from nao_lipm_gait.runtime.sensor_age import SensorAge
from nao_lipm_gait.runtime.sensor_outage import SensorOutage
from nao_lipm_gait.runtime.sole_loads import LOAD_AGE, SoleLoads
from nao_lipm_gait.runtime.stamp_monitor import NEW_TIME, StampMonitor, Step
from nao_lipm_gait.runtime.stamp_reports import StampReports
from nao_lipm_gait.runtime.state_log import StateLog
from nao_lipm_gait.runtime.target_guard import GuardedTargets, TargetGuard
from nao_lipm_gait.runtime.tick_times import TickTimes
from nao_lipm_gait.runtime.validation import JointSample, SensorValidation
from nao_lipm_gait.runtime.velocity_gate import VelocityGate
from robot_core.errors import NaoGaitError, one_line
from robot_core.head_goals import Goal
from robot_core.log import SILENCE, Level, LogLine, Report
from robot_core.message_checks import finite, stamp_of
from robot_core.motion.library import MotionLibrary
from robot_core.robot import RobotDescription
from robot_core.types import (
    BUSY,
    DOWN,
    GRAVITY,
    ON_THE_WAY,
    FloatArray,
    GaitState,
    GaitStatus,
    JointTargets,
    Pose6,
    SensorFrame,
)

STEADY_TIME = 0.1
"""[s] Wall time between two joint states in which the robot cannot have moved far."""
STEADY_ANGLE = 0.3
"""[rad] Largest change of a joint of a robot that has not been moved meanwhile."""
HELD_MAX = 5
"""Ticks in a row without usable targets, after which the gait restarts."""
COAST_MAX = 3
"""Control periods in a row for which the robot walks on without sensors."""
LOAD_ABSURD = 1e5
"""[N]"""
TEMPERATURE_ABSURD = 500.0
"""[deg C]"""
ASKED_AGAIN = 0.2
"""[s] of wall time without joint states, after which a repeated stamp asks for the answer again, as
`sim_bridge` does in lockstep. That is no fault."""
WAITING = 10.0
"""[s] from the start without any joint state, after which it is a warning."""
_CRASHES_MAX = 32


@dataclass(frozen=True, slots=True)
class ControllerSettings:
    """What does not change while the controller runs.

    Attributes:
        control_period: Time between two joint states [s].
        cmd_vel_timeout: Age [s] at which a velocity command means stop.
        imu_patience: Time [s] without an IMU after which the robot stops walking.
        bias_wait: Longest time [s] to stand before the first walk until the gyro's bias is known; a
            walk with an unknown bias turns.
        hot_speed: Factor on the commanded velocity while a motor is hot; 1 = unchanged.
    """

    control_period: float = 0.01
    cmd_vel_timeout: float = 0.5
    imu_patience: float = 0.1
    bias_wait: float = 0.0
    hot_speed: float = 1.0


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
        settings: ControllerSettings of this controller.
        clock: Any monotonic time [s]; it is used for reports and never for the walk.
        motions: None = those that are shipped for this robot.
        calibration: Known constant errors of the robot's sensors.

    Attributes:
        faults: Ticks whose targets were held or clipped by the guard.
        unexpected: Exceptions other than NaoGaitError: mistakes of this program.
        crashes: Why the first few ticks gave no usable targets.
        needs_loads: The messages of the soles are used now.
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
        self._settings = settings
        self._clock = clock
        self._parameters = parameters
        self._diagnostics = Diagnostics(clock)
        self._period = round(settings.control_period * 1e9)
        self._stamps = StampMonitor(self._period, MISSED_TICKS_MAX)
        self._stamp_reports = StampReports(
            self._stamps, self._diagnostics, settings.control_period
        )
        self._validation = SensorValidation(robot, self._diagnostics)
        self._sync = FrameSync(self._acceleration_at_rest, self._period)
        self._gait = Gait(robot, parameters, settings.control_period, motions, calibration)
        self._guard = TargetGuard(self._gait, robot, settings.control_period)
        self._age = SensorAge(settings.control_period)
        self._age.set_usual(parameters.feedback_delay - robot.command_lag)
        self._arrival: int | None = None
        self._loads = SoleLoads(self._gait.mass)
        self._outage = SensorOutage(self._loads, settings.imu_patience)
        self._lift = None if robot.force_sensors is None else LiftWatch(self._loads)
        self._velocity = VelocityInput(settings.cmd_vel_timeout)
        self._ticks = TickTimes(settings.control_period)
        self._publishers = PublisherWatch(self._diagnostics, clock)
        self._calibration = CalibrationMonitor(self._gait, self._diagnostics)
        self._heat = HeatWatch(robot, self._diagnostics, settings.hot_speed)
        self._motions = MotionCommands(self._gait, self._diagnostics)
        self._state_log = StateLog(self._gait, self._diagnostics, settings.cmd_vel_timeout)
        self._gate = VelocityGate(
            self._gait, self._velocity, self._heat, settings.bias_wait, self._diagnostics,
            self._state_log,
        )  # fmt: skip
        self._answers: list[Answer] = []
        self._last_targets: JointTargets | None = None
        self._last_position: FloatArray | None = None
        self._held = self._coasted = 0
        self._sensors_at: float | None = None
        self._arrived_at = -math.inf
        self._continued_at = self._started_at = clock()
        self.faults = self.unexpected = 0
        self.crashes: list[str] = []
        self.last_status: GaitStatus | None = None

    @property
    def state(self) -> GaitState:
        """What the gait is doing."""
        return self._gait.state

    @property
    def parameters(self) -> GaitParameters:
        """The last requested parameters; a walk applies them at its next support change."""
        return self._parameters

    @property
    def needs_loads(self) -> bool:
        """The messages of the soles: always with force sensors, else while the IMU is missing."""
        return self._lift is not None or self._outage.blind > 0

    @property
    def rejected(self) -> Mapping[str, int]:
        """Refused messages per topic."""
        return self._diagnostics.rejected

    # -- messages ----------------------------------------------------------------------------------

    def receive(self, topic: str, read: Callable[[], Input]) -> Output:
        """Take a message; nothing about it can raise.

        Args:
            topic: Where it came from.
            read: Gives the contents of the message; its exceptions are caught as well.

        Returns:
            The answers to send, and log lines.
        """
        return self.run(topic, lambda: self._take(read()))

    def run(
        self, topic: str, work: Callable[[], object], effect: str = "; message ignored"
    ) -> Output:
        """Do some work for a topic; an exception is counted, logged and reported.

        Args:
            topic: Under which it is counted.
            work: What to do.
            effect: What an exception leads to, as the end of the log line.
        """
        group = COMMANDS if topic == "cmd_vel" or topic.startswith("~/") else SENSORS
        try:
            work()
        except NaoGaitError as error:
            self._diagnostics.rejected[topic] += 1
            text = f"{error}{effect}"
            self._diagnostics.event(group, Level.WARN, error.field, text, burst=5)
        except Exception as error:
            self._diagnostics.rejected[topic] += 1
            self.unexpected += 1
            text = f"{topic}: {one_line(error)}{effect}"
            self._diagnostics.event(group, Level.ERROR, topic, text)
        answers = tuple(self._answers)
        self._answers.clear()
        return Output(answers, self._diagnostics.take_log(), self._motions.take_results())

    def _take(self, message: Input) -> None:
        if isinstance(message, JointInput):
            self._take_joints(message)
        elif isinstance(message, ImuInput):
            frame = self._sync.add_imu(self._validation.imu(message))
            if frame is not None:
                self._tick(frame)
        elif isinstance(message, LoadInput):
            stamp = stamp_of(message.sec, message.nanosec, "wrench header.stamp")
            force = finite(message.force, "wrench force.z", LOAD_ABSURD, "N")
            if abs(stamp - (self._stamps.last or 0)) < LOAD_AGE:  # else it is of another time
                self._loads.add(message.side, stamp, force)
        elif isinstance(message, TemperatureInput):
            degrees = finite(message.degrees, "temperature", TEMPERATURE_ABSURD, "deg C")
            self._heat.receive(message.joint, degrees, (self._stamps.last or 0) * 1e-9)
        else:
            command = read_velocity(message)
            # Its arrival counts, not its stamp: senders may use another clock than the sensors.
            self._velocity.receive(command, self._stamps.last)
            self._state_log.command_arrived()

    def _take_joints(self, message: JointInput) -> None:
        stamp = stamp_of(message.sec, message.nanosec, "joint_states header.stamp")
        step = self._stamps.classify(stamp)
        if step is Step.NEXT:
            sample = self._validation.next_joints(
                message, stamp,
                delay=round(self._parameters.feedback_delay * 1e9) + self._age.late * self._period,
                walking=self._gait.state in ON_THE_WAY,
            )  # fmt: skip
        else:
            sample = self._validation.read_joints(message, stamp)
        now = self._sensors_at = self._clock()
        self._arrival = message.arrived
        before, arrived = self._arrived_at, now - message.waited
        self._arrived_at = arrived
        self._diagnostics.end("silence", "joint_states arrive")
        last = self._stamps.last
        self._stamps.accept(stamp, step)
        self._stamp_reports.settle(step)
        if step is Step.REPEATED:
            self._answer_again(stamp, asked=arrived - before > ASKED_AGAIN)
            return
        if self._ticks.was_late(arrived):
            period = self._settings.control_period
            text = f"a tick took longer than {period:g} s: the next joint_states had to wait"
            self._diagnostics.event(WALK, Level.WARN, "late ticks", text)
        if step is Step.EARLY:
            self._answer_early(stamp)
        elif step is Step.LATE:
            raise self._stamp_reports.unexpected(step, stamp)
        elif step is Step.DOUBTFUL:
            self._stamp_reports.hold(stamp)
            return
        elif step is Step.FIRST:
            self._validation.restart(sample, steady=True)
            self._heat.restart(stamp * 1e-9)
        elif step in NEW_TIME:
            self._restart(step, sample, now, stamp - (last or 0))
        self._continued_at = now
        self._last_position = sample.position
        self._stamp_reports.check_rate()
        for frame in self._sync.add_joints(sample):
            self._tick(frame)

    def _answer_again(self, stamp: int, asked: bool) -> None:
        """Answer a repeated stamp: the sender missed the answer, or its IMU sample is missing.

        Args:
            stamp: The stamp [ns].
            asked: The sender has waited for an answer and asks again.
        """
        frame = self._sync.repeat(stamp)
        if frame is not None:
            self._tick(frame)
        elif self._last_targets is not None and self._last_targets.stamp == stamp:
            self._answers.append(Answer(self._last_targets))
        self._diagnostics.rejected["joint_states"] += 1
        if not asked:
            self._stamp_reports.repeated(stamp)

    def _answer_early(self, stamp: int) -> None:
        """Answer a stamp before the next tick is due: in lockstep the robot waits for it.

        Raises:
            NaoGaitError: Always, to report the early stamp.
        """
        if self._last_targets is not None:
            self._answers.append(Answer(self._last_targets._replace(stamp=stamp)))
        raise self._stamp_reports.early(stamp)

    def _restart(self, step: Step, sample: JointSample, now: float, gap: int) -> None:
        """Continue on a new time base, from a stand; if only the clock has jumped, stop first.

        Args:
            step: BACKWARDS or JUMP.
            sample: The joint state.
            now: Its arrival [s].
            gap: Time [ns] since the last stamp.
        """
        last, stamp = self._last_position, sample.stamp
        near = last is not None and float(np.abs(sample.position - last).max()) < STEADY_ANGLE
        steady = now - self._continued_at < STEADY_TIME and near
        self._stamp_reports.new_time(step, stamp, gap, steady=steady)
        self._sync.restart(stamp)
        self._validation.restart(sample, steady)
        self._velocity.clear()
        self._heat.restart(stamp * 1e-9)
        self._loads.clear()
        if self._lift is not None:
            self._lift.restart()
        if steady:
            self._gait.continue_at(stamp)
            self._guard.shift_clock(stamp)
            if self._gait.state in ON_THE_WAY:
                self._gait.request_stand()
        else:
            self._guard.restart()  # the robot may be anywhere
            self._restart_gait()

    def _restart_gait(self) -> None:
        """Restart the gait; its first targets may be anywhere, the guard leads there."""
        self._gait.restart()
        self._gate.restart()

    # -- without sensors ---------------------------------------------------------------------------

    def overdue(self) -> Output:
        """Walk on for one control period whose joint state or IMU sample has not arrived in time.

        For a robot in real time, which does not wait for its answers. To be called once for each
        control period without an answer; after `COAST_MAX` of them the robot holds its targets.
        """
        return self.run("overdue sensors", self._walk_on, "")

    def _walk_on(self) -> None:
        frame = self._sync.overdue()
        if frame is not None:
            self._tick(frame)
            return
        guarded = self._guard.coast() if self._coasted < COAST_MAX else None
        if guarded is not None:
            self._coasted += 1
            self._note_fault(guarded)
            self._last_targets = guarded.targets
            self._validation.sent(guarded.targets)
            self._answers.append(Answer(guarded.targets))

    # -- the tick ----------------------------------------------------------------------------------

    def _tick(self, frame: SensorFrame) -> None:
        self._coasted = 0
        self._heat.update(frame.stamp * 1e-9)
        if self._heat.leg_too_hot and self._gait.state not in DOWN:
            self._motions.sit_down(self._heat.take_leg())
        command = self._gate.command(
            frame.stamp,
            stand=self._sensors_are_missing(frame.stamp),
            ticked=self.last_status is not None,
        )
        late = self._age.update(frame.stamp, self._arrival)
        lifted = self._lift is not None and self._lift.update(
            frame.stamp, frame.linear_acceleration
        )
        if late or lifted:
            frame = frame._replace(late=late, lifted=lifted)
        begin = self._clock()
        guarded = self._guard.step(frame, command)
        self._ticks.add(begin, self._clock())
        self._last_targets = guarded.targets
        self._validation.sent(guarded.targets)
        self._note_fault(guarded)
        if guarded.held:
            self._answers.append(Answer(guarded.targets))
            self._count_held(str(guarded.fault))
        else:
            self._held = 0
            status = self.last_status = self._gait.status
            self._answers.append(Answer(guarded.targets, status, self._gait.torso_pose))
            self._state_log.update(status)
            self._motions.follow(status)
        self._state_log.update_command(timed_out=self._velocity.timed_out)

    def _note_fault(self, guarded: GuardedTargets) -> None:
        if guarded.fault is not None:
            self.faults += 1
            text = f"targets held or clipped: {guarded.fault}"
            self._diagnostics.event(WALK, Level.ERROR, "tick", text)

    def _count_held(self, fault: str) -> None:
        if len(self.crashes) < _CRASHES_MAX:
            self.crashes.append(fault)
        self._held += 1
        if self._held >= HELD_MAX:
            # The gait's internal state may be corrupt; standing does not depend on it.
            self._held = 0
            self._restart_gait()

    def _sensors_are_missing(self, stamp: int) -> bool:
        """Whether the robot must not walk in this tick; handles a fall and the end of an outage."""
        outage = self._outage.assess(
            stamp, self._sync, self._validation.unread_since, self._gait.state
        )
        if outage.fallen:
            self._gait.report_fall()
        # A fallen robot stays fallen until the IMU has shown for some time that it is upright.
        if outage.imu_returned and self._gait.state not in BUSY:
            self._restart_gait()
        if outage.reason is None:
            self._diagnostics.end("outage", "the sensors are complete again")
            return False
        self._diagnostics.begin(SENSORS, Level.ERROR, "outage", outage.reason, outage.log_key)
        return True

    def _acceleration_at_rest(self) -> FloatArray:
        """Specific force (3,) [m/s^2] that a resting torso with the last known tilt measures."""
        roll = pitch = 0.0
        if self.last_status is not None:
            roll, pitch = self.last_status.torso_roll, self.last_status.torso_pitch
        level = math.cos(pitch)
        up = (-math.sin(pitch), level * math.sin(roll), level * math.cos(roll))
        return GRAVITY * np.array(up)

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
            self.unexpected += 1
            text = one_line(error)
            self._diagnostics.event(COMMANDS, Level.ERROR, "service", f"service: {text}")
            return False, text

    def note_motors(self, ready: bool) -> None:
        """Whether the motors follow what is commanded; until then the robot stands."""
        self._gate.note_motors(ready)

    def stand(self) -> str:
        """Stop and stand; describes what is going to happen."""
        self._velocity.clear()
        self._gait.request_stand()
        return "standing once the step is done, or once a lying robot is upright" + self._no_sensors

    def relax(self) -> str:
        """Take the torque off all joints; describes what is going to happen."""
        self._velocity.clear()
        self._gait.request_relax()
        return "relaxed from the next tick on; ~/stand makes it stiff again" + self._no_sensors

    @property
    def _no_sensors(self) -> str:
        if self._last_targets is not None:
            return ""
        return "; but no sensor message has arrived yet, and without one nothing is sent"

    def request_motion(self, name: str) -> None:
        """Run a motion as soon as it can begin; see `MotionCommands.request`."""
        self._motions.request(name)

    def get_up(self) -> str:
        """Get up from the floor; describes what is going to happen.

        Raises:
            NaoGaitError: If the robot does not lie.
        """
        self._motions.get_up()
        return "getting up once the robot has come to rest"

    def look(self, goal: Goal | None) -> None:
        """Turn the head; None returns control to the gait.

        Raises:
            NaoGaitError: For a robot without a head to turn.
        """
        self._gait.request_look(goal)

    def with_changes(self, changes: Mapping[str, object]) -> GaitParameters:
        """The gait's parameters with these changes, all or none; names of others are left out.

        Raises:
            NaoGaitError: With parameter, value and what is allowed.
        """
        return with_changes(self._parameters, changes, self._gait.state in BUSY)

    def change_parameters(self, changes: Mapping[str, object]) -> None:
        """Apply changes; a walk applies them at its next support change.

        Raises:
            NaoGaitError: As `with_changes`.
        """
        changed = self.with_changes(changes)
        if changed == self._parameters:
            return
        needs_restart = bool(needing_restart(self._parameters, changed))
        self._parameters = changed
        self._age.set_usual(changed.feedback_delay - self._gait.robot.command_lag)
        self._gait.set_parameters(changed)
        if needs_restart:
            self._restart_gait()

    # -- watching ----------------------------------------------------------------------------------

    def watch(self) -> Output:
        """Report sensors that are silent; to be called a few times per second."""
        return self.run("watchdog", self._watch)

    def _watch(self) -> None:
        self._diagnostics.watch()
        self._calibration.watch()
        now = self._clock()
        if self._sensors_at is None:
            if now - self._started_at > WAITING:
                text = f"no joint_states in the first {WAITING:g} s; is a robot running?"
                self._diagnostics.begin(SENSORS, Level.WARN, "silence", text)
        elif now - self._sensors_at > SILENCE:
            text = f"no joint_states for over {SILENCE:g} s: the robot holds its last targets"
            self._diagnostics.begin(SENSORS, Level.ERROR, "silence", text)

    def note_publishers(self, counts: PublisherCounts) -> None:
        """Report publishers that are one too many; to be called once per second."""
        self._publishers.update(counts)

    def reports(self) -> tuple[Report, ...]:
        """The reports since the last call; to be called once per second."""
        stamp = self._stamps.last
        others = reports(
            Health(
                ticks=self._ticks.summarize(),
                sensor_age=None if self._sensors_at is None else self._clock() - self._sensors_at,
                missed_ticks=self._stamps.missed,
                rejected=self.rejected,
                faults=self.faults,
                deadline_misses=self._ticks.misses,
                status=self.last_status,
                command_age=None if stamp is None else self._velocity.age(stamp),
                command_timed_out=self._velocity.timed_out,
                gyro_bias_sigma=self._gait.gyro_bias_sigma,
                remarks=self._diagnostics.take_remarks(),
            )
        )
        p = self._parameters
        return *others, self._calibration.report(steps_measure=p.level_soles and p.feedback)
