"""Everything between a message and an answer, without ROS: checks, clocks, guards, reports.

The node puts DDS around it, the fault campaign a simulated robot: both run the same code.
"""

import math
from collections import Counter
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from nao_lipm_gait.errors import NaoGaitError
from nao_lipm_gait.gait import MISSED_TICKS_MAX, Gait
from nao_lipm_gait.head.goals import Goal
from nao_lipm_gait.motion.library import MotionLibrary
from nao_lipm_gait.motion.motion_file import load_motions
from nao_lipm_gait.motion.scheduler import GET_UP
from nao_lipm_gait.parameters import GaitParameters
from nao_lipm_gait.robot import RobotDescription
from nao_lipm_gait.runtime.diagnostics import (
    COMMANDS,
    SENSORS,
    SILENCE,
    WALK,
    Health,
    Level,
    Others,
    Remarks,
    TickStatistics,
)
from nao_lipm_gait.runtime.frame_sync import MAX_IMU_AGE, FrameSync, JointSample
from nao_lipm_gait.runtime.inputs import ImuInput, Input, JointInput, LoadInput
from nao_lipm_gait.runtime.outlet import Outlet
from nao_lipm_gait.runtime.parameter_changes import changed_by, needing_reset
from nao_lipm_gait.runtime.sole_loads import SoleLoads
from nao_lipm_gait.runtime.stamp_monitor import StampMonitor, Step
from nao_lipm_gait.runtime.target_guard import TargetGuard
from nao_lipm_gait.runtime.validation import SensorValidation, finite, read_velocity, stamp_of
from nao_lipm_gait.runtime.velocity_input import VelocityInput
from nao_lipm_gait.types import (
    BUSY,
    GRAVITY,
    ON_THE_WAY,
    STANDSTILL,
    FloatArray,
    GaitState,
    GaitStatus,
    JointTargets,
    SensorFrame,
)

STEADY = 0.1
"""[s] of wall time between two joint states: whatever their stamps say, none is missing."""
NEAR = 0.3
"""[rad] between two joint states of one motion."""
WITHOUT_JOINTS = 300_000_000
"""[ns] without joints that can be read, after which the robot stops walking."""
HELD_MAX = 5
"""Ticks in a row without usable targets, after which the gait begins anew."""
LOAD_ABSURD = 1e5
"""[N]"""
OFF_RATE = 0.1
"""Share by which the steps of the stamps may differ from the control period on average."""
_CRASHES_MAX = 32


@dataclass(frozen=True, slots=True)
class Settings:
    """What does not change while the entry lives."""

    control_period: float = 0.01
    """[s] between two joint states."""
    cmd_vel_timeout: float = 0.5
    """[s]"""
    imu_patience: float = 0.1
    """[s] without an IMU, after which the robot stops walking."""


class GaitController:
    """One gait and all that stands between it and the messages."""

    def __init__(
        self,
        robot: RobotDescription,
        parameters: GaitParameters,
        settings: Settings,
        outlet: Outlet,
        clock: Callable[[], float],
        motions: MotionLibrary | None = None,
    ) -> None:
        """clock: any monotonic time [s]; it is used for reports and never for the walk.
        motions: None = those that are shipped for this robot.
        """
        self._settings = settings
        self._outlet = outlet
        self._clock = clock
        self._parameters = parameters
        self._gait = Gait(robot, parameters, settings.control_period, motions)
        self._guarded = TargetGuard(self._gait, robot, settings.control_period)
        self._remarks = Remarks(outlet.log, clock)
        self._senses = SensorValidation(robot, self._remarks)
        self._assembler = FrameSync(self._force_at_rest)
        self._loads = SoleLoads(self._gait.mass)
        self._blind = self._held = 0
        self._stamps = StampMonitor(round(settings.control_period * 1e9), MISSED_TICKS_MAX)
        self._velocity = VelocityInput(settings.cmd_vel_timeout)
        self._ticks = TickStatistics()
        self.faults = 0
        """Ticks whose targets were held or cut."""
        self.unexpected = 0
        """Exceptions that are none of ours: mistakes of this program."""
        self.crashes: list[str] = []
        """The first few ticks for which the gait had no targets that can be used, and why."""
        self.wants_loads = False
        """Messages from the soles are of use now."""
        self.deadline_misses = 0
        """Ticks that took longer than a control period."""
        self._last_targets: JointTargets | None = None
        self._pose: FloatArray | None = None
        self._status: GaitStatus | None = None
        self._sensors_at: float | None = None
        self._followed_at = self._started_at = clock()

    @property
    def state(self) -> GaitState:
        return self._gait.state

    @property
    def parameters(self) -> GaitParameters:
        """As last asked for; a walking robot takes them over at its next support change."""
        return self._parameters

    @property
    def last_status(self) -> GaitStatus | None:
        """Of the last tick; None before the first."""
        return self._status

    @property
    def rejected(self) -> Counter[str]:
        """Refused messages per topic."""
        return self._remarks.rejected

    # -- messages ----------------------------------------------------------------------------------

    def receive(self, topic: str, make: Callable[[], Input]) -> None:
        """Take a message; whatever is wrong with it becomes a remark and never an exception.

        make: gives what the message says; it runs behind the same fence.
        """
        self.fenced(topic, lambda: self._take(make()))

    def fenced(self, topic: str, work: Callable[[], None]) -> None:
        """Run `work`; what it raises is counted, logged and reported under the topic."""
        group = COMMANDS if topic == "cmd_vel" or topic.startswith("~/") else SENSORS
        try:
            work()
        except NaoGaitError as error:
            self.rejected[topic] += 1
            self._remarks.tell(group, Level.WARN, error.field, f"{error}; message ignored", burst=5)
        except Exception as error:
            self.rejected[topic] += 1
            self.unexpected += 1
            text = f"{topic}: {type(error).__name__}: {error}; message ignored"
            self._remarks.tell(group, Level.ERROR, topic, text)

    def _take(self, message: Input) -> None:
        if isinstance(message, JointInput):
            self._take_joints(message)
        elif isinstance(message, ImuInput):
            self._take_imu(message)
        elif isinstance(message, LoadInput):
            stamp = stamp_of(message.sec, message.nanosec, "wrench header.stamp")
            self._loads.see(
                message.side, stamp, finite(message.force, "wrench force.z", LOAD_ABSURD, "N")
            )
        else:
            command = read_velocity(message.linear, message.angular)
            # Arrival counts, not the header: senders may live on another clock than the sensors.
            self._velocity.receive(command, self._stamps.last)

    def _take_imu(self, message: ImuInput) -> None:
        frame = self._assembler.add_imu(self._senses.imu(message))
        if frame is not None:
            self._tick(frame)

    def _take_joints(self, message: JointInput) -> None:
        stamp = stamp_of(message.sec, message.nanosec, "joint_states header.stamp")
        delay = round(self._parameters.feedback_delay * 1e9)
        position, velocity, unread = self._senses.joints(
            stamp, message,
            delay=delay,
            is_next=self._stamps.is_next(stamp),
            on_the_way=self._gait.state in ON_THE_WAY,
        )  # fmt: skip
        last, now = self._stamps.last, self._clock()
        self._sensors_at = now
        step = self._stamps.see(stamp)
        if step is Step.REPEATED:
            self._answer_again(stamp)
            return
        if step is Step.SOON:
            self._answer_soon(stamp)
            return
        if step is Step.LATE or step is Step.DOUBTFUL:
            self._leave_out(step, stamp)
            return
        if step is not Step.NEXT:
            steady = now - self._followed_at < STEADY and self._is_near(position)
            self._begin_anew(step, stamp, steady)
        self._followed_at = now
        period = self._settings.control_period
        elapsed = period if last is None or step is not Step.NEXT else (stamp - last) * 1e-9
        position = self._senses.without_spikes(
            stamp, position, delay=delay, elapsed=elapsed, unread=unread
        )
        self._pose = position
        self._check_rate()
        for frame in self._assembler.add_joints(JointSample(stamp, position, velocity)):
            self._tick(frame)

    def _check_rate(self) -> None:
        """Other steps than the control period are walked, but in another time than the robot's."""
        step, period = self._stamps.mean_step * 1e-9, self._settings.control_period
        if abs(step - period) > OFF_RATE * period:
            text = (
                f"joint_states header.stamp: steps of {step:.4g} s on average; allowed: steps of "
                f"control_period, {period:g} s; the walk runs {period / step:.2g} times as fast"
            )
            self._remarks.tell(SENSORS, Level.WARN, "rate", text)

    def _is_near(self, position: FloatArray) -> bool:
        """The joints are where they were a moment ago."""
        return self._pose is not None and bool(np.abs(position - self._pose).max() < NEAR)

    def _answer_again(self, stamp: int) -> None:
        """The same stamp twice is no second tick, but the sender may have missed the answer, or
        wait for the answer to a frame that waits for its IMU sample.
        """
        frame = self._assembler.insist(stamp)
        if frame is not None:
            self._tick(frame)
        elif self._last_targets is not None and self._last_targets.stamp == stamp:
            self._outlet.command(self._last_targets)
        raise NaoGaitError(
            "joint_states header.stamp", f"{stamp * 1e-9:.3f} s again", "a stamp that rises"
        )

    def _answer_soon(self, stamp: int) -> None:
        """No tick is due, but a robot in lockstep goes on only after an answer."""
        if self._last_targets is not None:
            self._outlet.command(self._last_targets._replace(stamp=stamp))
        after = (stamp - (self._stamps.last or 0)) * 1e-9
        raise NaoGaitError(
            "joint_states header.stamp",
            f"{after:.6g} s after the last",
            f"steps of control_period, {self._settings.control_period:g} s",
        )

    def _leave_out(self, step: Step, stamp: int) -> None:
        """No answer: to a new time that is one, the robot's next message will be the proof."""
        last = self._stamps.last or 0
        raise NaoGaitError(
            "joint_states header.stamp",
            f"{stamp * 1e-9:.3f} s, {step.value}",
            f"a stamp that follows {last * 1e-9:.3f} s, or more of the new time",
        )

    def _begin_anew(self, step: Step, stamp: int, steady: bool) -> None:
        """Stand. A walk whose clock alone has jumped comes to its end first."""
        longest = self._stamps.longest_gap * 1e-9
        self._remarks.tell(
            WALK,
            Level.WARN,
            f"stamp {step.value}",
            f"joint_states header.stamp: {step.value} to {stamp * 1e-9:.3f} s; allowed: steps of "
            f"{self._settings.control_period:g} s and no gap over {longest:.3g} s; "
            + ("stopping" if steady else "beginning anew from a stand"),
        )
        self._assembler.begin_at(stamp)
        self._senses.begin_anew(steady)
        self._velocity.clear()
        if steady:
            self._gait.continue_at(stamp)
            self._guarded.go_on_at(stamp)
            if self._gait.state in ON_THE_WAY:
                self._gait.request_stand()
            return
        self._guarded.begin_anew()
        self._gait.restart()

    # -- the tick ----------------------------------------------------------------------------------

    def _tick(self, frame: SensorFrame) -> None:
        command = self._velocity.at(frame.stamp)
        trouble = self._sensor_trouble(frame.stamp)
        if trouble is not None:
            command = STANDSTILL
            self._remarks.tell(SENSORS, Level.ERROR, trouble.split(":")[0], trouble)
        begin = self._clock()
        answer = self._guarded.step(frame, command)
        self._ticks.add((self._clock() - begin) * 1e6)
        self._outlet.command(answer.targets)
        if self._clock() - begin > self._settings.control_period:
            self.deadline_misses += 1
            text = f"a tick took longer than {self._settings.control_period:g} s"
            self._remarks.tell(WALK, Level.WARN, "deadline", text)
        self._last_targets = answer.targets
        self._senses.told(answer.targets)
        if answer.fault is not None:
            self.faults += 1
            if answer.held and len(self.crashes) < _CRASHES_MAX:
                self.crashes.append(answer.fault)
            self._remarks.tell(WALK, Level.ERROR, "tick", f"targets held or cut: {answer.fault}")
        self._held = self._held + 1 if answer.held else 0
        if self._held >= HELD_MAX:
            # What it remembers may be spoilt for ever; a stand needs none of it.
            self._held = 0
            self._gait.restart()
        if not answer.held:
            self._status = self._gait.status
            self._outlet.status(self._status)

    def _sensor_trouble(self, stamp: int) -> str | None:
        """What is wrong with the sensors so that nobody should walk on them."""
        before, self._blind = self._blind, self._blind_for(stamp)
        blind = self._blind
        self.wants_loads = blind > 0
        patience = round(self._settings.imu_patience * 1e9)
        if blind > patience:
            if self._loads.carry_nothing(stamp) or self._gait.state is GaitState.FALLEN:
                self._gait.report_fall()
                return f"imu/data: none for {blind * 1e-9:.1f} s, and no load on the soles: relaxed"
            return f"{self._imu_trouble(blind)}; the robot stops and stands"
        if blind == 0 and before > patience:
            self._see_again()
        since = self._senses.unread_since
        if since is not None and stamp - since > WITHOUT_JOINTS:
            unread = (stamp - since) * 1e-9
            return f"joint_states: none to be read for {unread:.1f} s; the robot stops"
        return None

    def _imu_trouble(self, blind: int) -> str:
        """blind: [ns]."""
        behind = self._assembler.imu_behind
        if behind is None:
            return f"imu/data: none for {blind * 1e-9:.1f} s"
        side = "before" if behind > 0 else "after"
        return (
            f"imu/data header.stamp: {abs(behind) * 1e-9:.3f} s {side} joint_states; "
            f"allowed: at most {MAX_IMU_AGE * 1e-9:g} s"
        )

    def _blind_for(self, stamp: int) -> int:
        """[ns] for which there has been no IMU."""
        since = self._assembler.blind_since
        return 0 if since is None else stamp - since + 1

    def _see_again(self) -> None:
        """The IMU is back: a robot that does not walk begins with what it says."""
        self._loads.begin_anew()
        if self._gait.state in BUSY:
            return
        # A fallen robot stays so until the IMU has shown for a while that it is upright.
        self._gait.restart()
        self._guarded.begin_anew()

    def _force_at_rest(self) -> FloatArray:
        """(3,) [m/s^2] What the accelerometer of a resting torso shows at the believed tilt."""
        roll = pitch = 0.0
        if self._status is not None:
            roll, pitch = self._status.torso_roll, self._status.torso_pitch
        level = math.cos(pitch)
        up = (-math.sin(pitch), level * math.sin(roll), level * math.cos(roll))
        return GRAVITY * np.array(up)

    # -- services and parameters -------------------------------------------------------------------

    def stand(self) -> str:
        """Stop and stand; what is going to happen, in words."""
        self._velocity.clear()
        self._gait.request_stand()
        return "standing once the step is done, or once a lying robot is upright" + self._unheard

    def relax(self) -> str:
        """Take the torque off; what is going to happen, in words."""
        self._velocity.clear()
        self._gait.request_relax()
        return "relaxed from the next tick on; ~/stand makes it stiff again" + self._unheard

    @property
    def _unheard(self) -> str:
        if self._last_targets is not None:
            return ""
        return "; but no sensors have been heard yet, and without them nothing is sent"

    def request_motion(self, name: str) -> None:
        """Run a motion, by its name or from a file, when it can begin; NaoGaitError for one that
        cannot.
        """
        if not name.endswith(".yaml"):
            self._gait.request_motion(name)
        else:
            self._gait.request_motion(load_motions(Path(name), self._gait.robot)[0])

    def look(self, goal: Goal | None) -> None:
        """Turn the head; None gives it back. NaoGaitError for a robot without one."""
        self._gait.request_look(goal)

    def get_up(self) -> str:
        """Get up from the floor; what is going to happen, in words. NaoGaitError if it cannot."""
        self._gait.request_motion(GET_UP)
        return "getting up once the robot has come to rest"

    def with_changes(self, changes: Mapping[str, object]) -> GaitParameters:
        """The gait's parameters with these changes, all or none; other names are not ours.

        Raises NaoGaitError that names parameter, value and what is allowed.
        """
        return changed_by(self._parameters, changes, self._gait.state in BUSY)

    def change_parameters(self, changes: Mapping[str, object]) -> None:
        """Take changes over; a walking robot does so where it next changes its support foot."""
        changed = self.with_changes(changes)
        if changed == self._parameters:
            return
        needs_reset = bool(needing_reset(self._parameters, changed))
        self._parameters = changed
        self._gait.set_parameters(changed)
        if needs_reset:
            self._gait.restart()  # the standing robot blends from its pose into the same one

    # -- watching ----------------------------------------------------------------------------------

    def watch(self) -> None:
        """Say when the sensors are silent; to be called some times per second."""
        now = self._clock()
        silent_since = self._started_at if self._sensors_at is None else self._sensors_at
        patience = 4 * SILENCE if self._sensors_at is None else SILENCE
        if now - silent_since > patience:
            # Nothing can be commanded without sensors; the robot holds the last targets.
            text = f"no joint_states for {now - silent_since:.1f} s"
            self._remarks.tell(SENSORS, Level.ERROR, "silence", text)

    def see_others(self, others: Others) -> None:
        """Report who else is there."""
        others.report(self._remarks)

    def health(self) -> Health:
        """How it went since the last call."""
        remarks = self._remarks.take()
        stamp = self._stamps.last
        return Health(
            ticks=self._ticks.summarize(),
            sensor_age=None if self._sensors_at is None else self._clock() - self._sensors_at,
            missed_ticks=self._stamps.missed,
            rejected=self.rejected,
            faults=self.faults,
            deadline_misses=self.deadline_misses,
            status=self._status,
            command_age=None if stamp is None else self._velocity.age(stamp),
            command_timed_out=self._velocity.timed_out,
            sensors=remarks[SENSORS],
            walk=remarks[WALK],
            commands=remarks[COMMANDS],
        )
