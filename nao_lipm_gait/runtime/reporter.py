"""Everything that is said of the gait while it runs: the log, the reports and their numbers."""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass

from nao_lipm_gait.gait import Gait
from nao_lipm_gait.parameters import GaitParameters
from nao_lipm_gait.runtime.calibration_monitor import DEVIATION_KNOWN, calibration_report
from nao_lipm_gait.runtime.commands import HeldVelocity
from nao_lipm_gait.runtime.diagnostics import COMMANDS, SENSORS, WALK, Diagnostics
from nao_lipm_gait.runtime.reports import (
    TickTimes,
    commands_report,
    sensors_report,
    walk_report,
)
from nao_lipm_gait.runtime.target_guard import GuardedTargets
from robot_core.errors import NaoGaitError, one_line
from robot_core.log import SILENCE, Level, Report
from robot_core.types import DOWN, GaitState, GaitStatus

WAITING = 10.0
"""[s] from the start without any joint state, after which it is a warning."""
LEASE = 25.0
"""[s] for which discovery keeps a process that was killed: by default 20 s in Fast DDS, 10 s in
Cyclone DDS. One publisher too many is logged only after it; the reports show it at once."""
_CRASHES_MAX = 32
_MORE_PUBLISHERS = {
    "joint_states": (
        SENSORS, Level.ERROR,
        "; allowed: one robot; does another run share this ROS_DOMAIN_ID?",
    ),
    "joint_command": (
        WALK, Level.ERROR,
        "; allowed: one gait; the simulated robot executes only the commands of the first",
    ),
    "cmd_vel": (COMMANDS, Level.WARN, "; the newest command counts"),
}  # fmt: skip
"""Report, level and what is said of more than one publisher on a topic."""


@dataclass(frozen=True, slots=True)
class PublisherCounts:
    """Publishers on the topics of this gait, as discovery sees them.

    Attributes:
        cmd_vel: Senders of velocity commands.
        joint_states: Robots.
        joint_command: Gaits, this one included.
        mismatched: A sender of an input whose type or quality of service does not fit.
        clock: Simulations, which tell the time.
    """

    cmd_vel: int = 1
    joint_states: int = 1
    joint_command: int = 1
    mismatched: str = ""
    clock: int = 0


class Reporter:
    """Logs falls, get-ups and what else an operator must know of; counts what goes into reports.

    Args:
        gait: Is only read.
        control_period: Time between two joint states [s].
        clock: Any monotonic time [s].

    Attributes:
        unexpected: Exceptions other than NaoGaitError: mistakes of this program.
    """

    def __init__(self, gait: Gait, control_period: float, clock: Callable[[], float]) -> None:
        self.say = Diagnostics(clock)
        self.faults = self.unexpected = 0
        self.crashes: list[str] = []
        self._gait = gait
        self._clock = clock
        self._period = control_period
        self._ticks = TickTimes(control_period)
        self._started_at = clock()
        self._sensors_at: float | None = None
        self._refused_at = -math.inf
        self._state = GaitState.STAND
        self._status: GaitStatus | None = None
        self._soles_logged = self._simulated = False
        self._more_since: dict[str, float] = {}

    # -- messages ----------------------------------------------------------------------------------

    def attempt(self, topic: str, work: Callable[[], object], effect: str) -> None:
        """Do some work for a topic; an exception is counted, logged and reported."""
        try:
            work()
        except Exception as error:
            group = COMMANDS if topic == "cmd_vel" or topic.startswith("~/") else SENSORS
            self.say.rejected[topic] += 1
            if topic == "joint_states":
                self._refused_at = self._clock()
            if isinstance(error, NaoGaitError):
                self.say.event(group, Level.WARN, error.field, f"{error}{effect}", burst=5)
                return
            self.unexpected += 1
            self.say.event(group, Level.ERROR, topic, f"{topic}: {one_line(error)}{effect}")

    def service_failed(self, error: Exception) -> str:
        """A service raised an exception other than NaoGaitError; returns what it says."""
        self.unexpected += 1
        text = one_line(error)
        self.say.event(COMMANDS, Level.ERROR, "service", f"service: {text}")
        return text

    def joints_arrived(self, now: float, waited: float, *, repeated: bool) -> None:
        """A readable joint state was taken at `now` [s], after it had waited [s]."""
        self._sensors_at = now
        self.say.end("silence", "joint_states arrive")
        if not repeated and self._ticks.was_late(now - waited):
            text = f"a tick took longer than {self._period:g} s: the next joint_states had to wait"
            self.say.event(WALK, Level.WARN, "late ticks", text)

    # -- ticks -------------------------------------------------------------------------------------

    def ticked(self, begin: float, end: float, status: GaitStatus | None) -> None:
        """A tick from `begin` to `end` [s]; its status is None if its targets were held."""
        self._ticks.add(begin, end)
        if status is None:
            return
        self._status = status
        if status.state is not self._state:
            self._log_change(status)
        if status.blocked:
            text = "blocked: steps fall short as if against something; odometry runs ahead"
            self.say.begin(WALK, Level.WARN, "blocked", text)
        else:
            self.say.end("blocked", "no longer blocked")

    def sent(self, guarded: GuardedTargets) -> None:
        """Report targets that were held or clipped."""
        if guarded.fault is None:
            return
        self.faults += 1
        text = f"targets held or clipped: {guarded.fault}"
        self.say.event(WALK, Level.ERROR, "tick", text)
        if guarded.held and len(self.crashes) < _CRASHES_MAX:
            self.crashes.append(guarded.fault)

    def _log_change(self, status: GaitStatus) -> None:
        before, self._state = self._state, status.state
        state, log = status.state, self.say.log
        if state is GaitState.FALLEN and before is not GaitState.GETTING_UP:
            log(Level.WARN, "fallen, relaxed")
        elif state is GaitState.FALLEN and self._gait.gets_up_again:
            log(Level.OK, "not up yet, going on")  # rolled over, or a failed try
        elif state is GaitState.FALLEN:
            log(Level.WARN, "getting up has failed, relaxed")
        elif state is GaitState.GETTING_UP:
            log(Level.OK, f"getting up: {status.motion}")
        elif state is GaitState.RELAXED:
            log(Level.OK, "relaxed: no torque on the joints")
        elif before is GaitState.GETTING_UP:
            log(Level.OK, "stood up")
        elif before in DOWN:
            log(Level.OK, "upright, standing")
        elif state is GaitState.LIFTED:
            log(Level.WARN, "lifted: the soles carry no load; standing until they do again")
        elif before is GaitState.LIFTED:
            log(Level.OK, "back on the ground")

    # -- a few times per second --------------------------------------------------------------------

    def watch(self) -> None:
        """Report joint states that are silent, and log what has ended or become known."""
        self.say.watch()
        if not self._soles_logged and max(self._gait.levelling.sigma) < DEVIATION_KNOWN:
            self._soles_logged = True
            message = calibration_report(self._gait, steps_measure=True).message
            self.say.log(Level.OK, f"soles measured, the ankles correct them: {message}")
        now, refused = self._clock(), self._joints_are_refused()
        none = "no usable joint_states" if refused else "no joint_states"
        if self._sensors_at is None:
            if now - self._started_at > WAITING:
                why = ": they are refused" if refused else "; is a robot running?"
                text = f"{none} in the first {WAITING:g} s{why}"
                self.say.begin(SENSORS, Level.WARN, "silence", text)
        elif now - self._sensors_at > SILENCE:
            held = self._simulated and not refused
            why = "the simulation stands still or sends none; " if held else ""
            text = f"{none} for over {SILENCE:g} s: {why}the robot holds its last targets"
            self.say.begin(SENSORS, Level.WARN if held else Level.ERROR, "silence", text)

    def _joints_are_refused(self) -> bool:
        """Joint states arrive, but cannot be read."""
        return self._clock() - self._refused_at < SILENCE

    def note_publishers(self, counts: PublisherCounts) -> None:
        """Report topics that have more publishers than they should; once per second."""
        self._simulated = counts.clock > 0
        for topic, (group, level, text) in _MORE_PUBLISHERS.items():
            self._check_publishers(topic, getattr(counts, topic), group, level, text)
        if counts.mismatched:
            # The name of a sender may be discovered later than its publisher.
            text = counts.mismatched
            self.say.begin(COMMANDS, Level.ERROR, "inputs", text, kind=text)
        else:
            self.say.end("inputs", "every sender of an input is received")

    def _check_publishers(
        self, topic: str, count: int, group: str, level: Level, text: str
    ) -> None:
        key, text = f"publishers of {topic}", f"{count} publishers on {topic}{text}"
        if count <= 1:
            self._more_since.pop(topic, None)
            self.say.end(key, f"one publisher on {topic} again")
            return
        now = self._clock()
        if now - self._more_since.setdefault(topic, now) > LEASE:
            self.say.begin(group, level, key, text)
        else:
            self.say.remark(group, level, text)

    def reports(
        self, parameters: GaitParameters, velocity: HeldVelocity, stamp: int | None, missed: int
    ) -> tuple[Report, ...]:
        """The reports since the last call; once per second.

        Args:
            parameters: Of the gait.
            velocity: The commanded velocity.
            stamp: See `Intake.stamp`.
            missed: See `Intake.missed`.
        """
        age = None if self._sensors_at is None else self._clock() - self._sensors_at
        remarks = self.say.take_remarks()
        sensors = sensors_report(
            age, self._joints_are_refused(), missed, self.rejected, remarks[SENSORS]
        )
        walk = walk_report(
            self._status, self._ticks.summarize(), self._ticks.misses, self.faults,
            self._gait.gyro_bias_sigma, remarks[WALK],
        )  # fmt: skip
        asked = None if stamp is None else velocity.age(stamp)
        commands = commands_report(asked, velocity.timed_out, remarks[COMMANDS])
        steps_measure = parameters.level_soles and parameters.feedback
        calibration = calibration_report(self._gait, steps_measure=steps_measure)
        return sensors, walk, commands, calibration

    @property
    def rejected(self) -> Mapping[str, int]:
        """Refused messages per topic."""
        return self.say.rejected
