"""What is sent to the robot in each cycle: the gait's command, or what keeps the robot safe.

A pure state machine, stepped once per LoLA frame; no clock, no I/O. Joint arrays (25,) are in the
order of `codec.JOINTS`.

    limp -> starting -> active -> sitting -> resting -> relaxing -> limp

From every state but `active` a fresh command that may pass leads to `starting`. A robot that lies,
or was limp anyway, does not sit: it goes limp. All three head buttons take the stiffness off in the
same cycle, from every state. Whatever a button stops goes on only after a long press of the chest
button.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field
from enum import StrEnum
from typing import NamedTuple

from lola_bridge.codec import JOINTS, TOUCH, LolaSensors
from lola_bridge.motor_watch import MotorLimits, MotorWatch
from robot_core.log import Level, LogLine
from robot_core.rate_limiter import eased, limited_step

BODY_VERSION = "6."
"""Begin of the body versions whose joints, limits and masses this package knows."""
BATTERY_LOW, BATTERY_AGAIN = 0.05, 0.10
"""Charge below which no command passes, and from which on commands pass again."""
GO_ON_TIME = 1.0
"""[s] for which the chest button is held to let commands pass again."""
BOUNCE_TIME = 0.2
"""[s] without contact after which a button counts as released; bounces of 96 ms were seen."""
LYING = 1.0
"""[rad] Roll or pitch from which on the robot lies or falls: it must not sit down then."""
REST = 0.5
"""Stiffness with which the robot keeps its sitting pose, which needs a quarter of the torque."""
REST_TIME = 60.0
"""[s] for which it does so, before it goes limp."""
LIMP_SHARE = 0.05
"""Stiffness up to which a joint counts as limp."""
_CHEST = TOUCH.index("chest")
_HEAD = tuple(TOUCH.index(name) for name in ("head_front", "head_middle", "head_rear"))


class Mode(StrEnum):
    """What the bridge does with the robot.

    Attributes:
        LIMP: No torque; waits for a command.
        HOLDING: Keeps the pose in which it was found stiff, until the chest button is pressed.
        STARTING: Stiffness rises, and the joints move from where they are to the command.
        ACTIVE: Commands pass, within the limits.
        SITTING: The robot sits down.
        RESTING: It sits, with less stiffness, and waits for commands.
        RELAXING: The stiffness falls to 0.
    """

    LIMP = "limp"
    HOLDING = "holding"
    STARTING = "starting"
    ACTIVE = "active"
    SITTING = "sitting"
    RESTING = "resting"
    RELAXING = "relaxing"


@dataclass(frozen=True)
class SafetySettings:
    """Times and limits.

    Attributes:
        period: Time of a cycle [s].
        stiffness_ramp: Time [s] in which the stiffness rises at the start and falls at the end.
        silence_time: Time [s] without a command after which the robot sits down.
        sit_time: Time [s] to sit down.
        lower: (25,) [rad]
        upper: (25,) [rad]
        speed: (25,) [rad/s] Largest speed of the commanded angles.
        driven: (25,) Joints that may be stiff; the others (wrists, hands) stay limp.
        sit: (25,) [rad] Pose in which the robot rests on its legs without torque.
        dry_run: Send no stiffness, whatever is commanded.
        wait_for_button: No command passes until the chest button was held once.
        motors: What the motors may show.
    """

    period: float
    stiffness_ramp: float
    silence_time: float
    sit_time: float
    lower: Sequence[float]
    upper: Sequence[float]
    speed: Sequence[float]
    driven: Sequence[bool]
    sit: Sequence[float]
    dry_run: bool = False
    wait_for_button: bool = False
    motors: MotorLimits = field(default_factory=MotorLimits)


class JointCommand(NamedTuple):
    """What the gait commands.

    Attributes:
        position: (25,) [rad]
        stiffness: (25,) Share of the motors' torque, 0 to 1.
    """

    position: Sequence[float]
    stiffness: Sequence[float]


class SafeCommand(NamedTuple):
    """What is sent to the robot.

    Attributes:
        position: (25,) [rad], inside the limits.
        stiffness: (25,) 0 to 1.
        mode: See `Mode`.
    """

    position: list[float]
    stiffness: list[float]
    mode: Mode


@dataclass
class _Refusals:
    """Why no command may pass now, by source; the first one counts."""

    reasons: dict[str, str] = field(default_factory=dict)
    log: list[LogLine] = field(default_factory=list)

    def update(self, key: str, text: str | None, level: Level = Level.WARN) -> None:
        """Set the reason of a source, or None; its begin and its end are logged."""
        if text is None:
            ended = self.reasons.pop(key, None)
            if ended is not None:
                self.log.append(LogLine(Level.OK, f"{key}: commands pass again"))
        else:
            if key not in self.reasons:
                self.log.append(LogLine(level, text))
            self.reasons[key] = text


class Safety:
    """The state machine of one robot.

    Args:
        settings: Times and limits.

    Attributes:
        mode: See `Mode`.
        misses: Cycles in a row without a fresh command.
        repeated: Cycles in which the last command was sent again, since the start.
    """

    def __init__(self, settings: SafetySettings) -> None:
        self._s = settings
        count = len(JOINTS)
        self._zeros = [0.0] * count
        self._position = [
            min(max(0.0, low), high)
            for low, high in zip(settings.lower, settings.upper, strict=True)
        ]
        self._stiffness = list(self._zeros)
        self._refusals = _Refusals()
        self._stopped = settings.wait_for_button
        self._released = False
        self._chest = _Button(settings.period)
        self._motors = MotorWatch(settings.motors, settings.driven, settings.period)
        self._spared: dict[int, str] = {}
        self._bad_frames = 0
        self._log: list[LogLine] = []
        self.misses = self.repeated = 0
        self.restart()

    def restart(self) -> None:
        """Forget commands and measurements, as after a new connection to the robot."""
        self.mode = Mode.LIMP
        self._first = True
        self._measured: list[float] | None = None
        self._command: JointCommand | None = None
        self._stiffness = list(self._zeros)
        self._begin_phase()
        self.misses = self._bad_frames = 0
        self._lying = False
        self._motors.restart()

    def configure(self, settings: SafetySettings) -> None:
        """Continue with other settings, and with the commands of another node."""
        if settings.wait_for_button and not self._s.wait_for_button:
            self._stopped = True
        self._s, self._released = settings, False
        self._motors.configure(settings.motors, settings.driven, settings.period)
        self._chest = _Button(settings.period)
        self._refusals.update("end", None)

    def release(self) -> None:
        """No command passes any more: sit down, go limp."""
        self._released = True
        self._refusals.update("end", "the node ends: sitting down")

    @property
    def refusal(self) -> str | None:
        """Why no command may pass now; None if commands pass."""
        return next(iter(self._refusals.reasons.values()), None)

    def take_log(self) -> list[LogLine]:
        """The log lines since the last call."""
        lines = self._refusals.log + self._log
        self._refusals.log, self._log = [], []
        return lines

    def step(self, sensors: LolaSensors | None, command: JointCommand | None) -> SafeCommand:
        """Advance by one cycle.

        Args:
            sensors: Sensors of this cycle; None = they cannot be used.
            command: A command that has arrived since the last cycle; None = none.
        """
        emergency = self._watch(sensors)
        refused = self.refusal
        self.misses = self.misses + 1 if command is None else 0
        if command is not None:
            self._command = command
        if emergency:
            self._stiffness = list(self._zeros)
            if self.mode is not Mode.LIMP:
                self._enter(Mode.LIMP, "head buttons: limp")
        else:
            self._advance(command is not None, refused)
        position, stiffness = self._wanted()
        return self._limited(position, stiffness)

    def unseen(self) -> SafeCommand:
        """The answer to a frame that is too old to say where the robot is: no stiffness."""
        return self._limited(self._position, self._zeros)

    # -- what speaks against commands --------------------------------------------------------------

    def _watch(self, sensors: LolaSensors | None) -> bool:
        """Update the refusals; whether the stiffness must go at once."""
        if sensors is None:
            self._bad_frames += 1
            seconds = self._bad_frames * self._s.period
            if seconds > self._s.silence_time:
                self._refusals.update("sensors", f"no usable sensors for {seconds:.2f} s")
            return False
        self._bad_frames = 0
        self._refusals.update("sensors", None)
        self._measured = self._inside(sensors.position)
        self._lying = max(abs(sensors.angles[0]), abs(sensors.angles[1])) > LYING
        if self._first:
            self._take_over(sensors.stiffness)
        self._watch_body(sensors)
        self._watch_motors(sensors)
        return self._watch_buttons(sensors)

    def _take_over(self, stiffness: Sequence[float]) -> None:
        """Begin with a robot that somebody has left stiff, or with a limp one."""
        self._first = False
        self._stiffness = [min(max(share, 0.0), 1.0) for share in stiffness]
        if max(self._stiffness) > LIMP_SHARE and self._measured is not None:
            self._position = list(self._measured)
            if self._s.wait_for_button and self._stopped:
                self._enter(Mode.HOLDING, "a stiff robot: it holds its pose")
            else:
                self._stop("a stiff robot without commands")

    def _watch_body(self, sensors: LolaSensors) -> None:
        update, reasons = self._refusals.update, self._refusals.reasons
        version = sensors.robot_config.body_version
        known = version.startswith(BODY_VERSION)
        text = f"body version: got {version[:20]!r}; allowed: {BODY_VERSION}x; no command passes"
        update("body version", None if known else text, Level.ERROR)
        charge = sensors.battery[0]
        low = charge < (BATTERY_AGAIN if "battery" in reasons else BATTERY_LOW)
        update("battery", f"battery at {100 * charge:.0f} %: sitting down" if low else None)

    def _watch_motors(self, sensors: LolaSensors) -> None:
        stiffness = self._zeros if self._s.dry_run else self._stiffness
        faults = self._motors.update(sensors, self._position, stiffness)
        self._refusals.update("temperature", faults.sit)
        self._refusals.update("motor", faults.limp, Level.ERROR)
        for joint in faults.spared.keys() - self._spared.keys():
            self._log.append(LogLine(Level.WARN, faults.spared[joint]))
        for joint in self._spared.keys() - faults.spared.keys():
            self._log.append(LogLine(Level.OK, f"{JOINTS[joint]} is used again"))
        self._spared = faults.spared

    def _watch_buttons(self, sensors: LolaSensors) -> bool:
        """Chest: sit down at once; held, go on. All three on the head: stiffness off, at once.

        A robot that lies has fallen on its chest button, or is not to be started by it.
        """
        pressed = self._chest.update(sensors.touch[_CHEST] >= 0.5)
        if not self._lying:
            if pressed and not self._stopped:
                self._stopped = True
                self._chest.use_up()
            elif self._stopped and self._chest.held(GO_ON_TIME):
                self._stopped = False
                self._chest.use_up()
                self._motors.forgive()
        emergency = all(sensors.touch[index] >= 0.5 for index in _HEAD)
        self._stopped = self._stopped or emergency
        text = f"stopped by a button: hold the chest button for {GO_ON_TIME:g} s to go on"
        self._refusals.update("chest button", text if self._stopped else None)
        return emergency

    # -- modes -------------------------------------------------------------------------------------

    def _advance(self, fresh: bool, refused: str | None) -> None:
        s, before = self._s, self.mode
        self._cycles += 1
        elapsed = self._cycles * s.period
        silent = self.misses * s.period > s.silence_time
        limp = "motor" in self._refusals.reasons
        if before not in (Mode.LIMP, Mode.RELAXING) and limp:
            self._enter(Mode.RELAXING, None)  # the refusal has been logged
        elif before in (Mode.STARTING, Mode.ACTIVE):
            if refused is not None:
                self._stop(None)
            elif silent:
                self._stop(f"no joint_command for {self.misses * s.period:.2f} s")
            elif before is Mode.STARTING and elapsed >= s.stiffness_ramp:
                self._enter(Mode.ACTIVE, "commands pass")
            elif not fresh:
                self.repeated += 1
        elif fresh and refused is None and self._measured is not None:
            self._enter(Mode.STARTING, "commands arrive: stiffness rises")
        elif before in (Mode.SITTING, Mode.RESTING, Mode.HOLDING) and self._lying:
            self._enter(Mode.RELAXING, "going limp")
        elif before is Mode.HOLDING and elapsed >= REST_TIME:
            self._stop("nobody has pressed the chest button")
        elif before is Mode.SITTING and elapsed >= s.sit_time:
            self._enter(Mode.RESTING, "sitting")
        elif before is Mode.RESTING and elapsed >= self._rest_time:
            self._enter(Mode.RELAXING, "going limp")
        elif before is Mode.RELAXING and elapsed >= s.stiffness_ramp:
            self._enter(Mode.LIMP, "limp")

    @property
    def _rest_time(self) -> float:
        """[s] for which the robot keeps its sitting pose."""
        return self._s.stiffness_ramp if self._released else REST_TIME

    def _stop(self, reason: str | None) -> None:
        """Sit down; a robot that lies or is limp goes limp."""
        if reason is not None:
            self._log.append(LogLine(Level.WARN, f"{reason}: sitting down"))
        limp = max(self._stiffness) <= LIMP_SHARE
        self._enter(Mode.RELAXING if limp or self._lying else Mode.SITTING, None)

    def _enter(self, mode: Mode, text: str | None) -> None:
        self.mode = mode
        if text is not None:
            self._log.append(LogLine(Level.OK, text))
        if mode is Mode.STARTING and max(self._stiffness) <= LIMP_SHARE and self._measured:
            self._position = list(self._measured)
        self._begin_phase()

    def _begin_phase(self) -> None:
        self._cycles = 0
        self._position_before = list(self._position)
        self._stiffness_before = list(self._stiffness)

    # -- targets -----------------------------------------------------------------------------------

    def _wanted(self) -> tuple[Sequence[float], Sequence[float]]:
        """Angles [rad] and stiffness that this mode asks for."""
        s, mode, command = self._s, self.mode, self._command
        if mode is Mode.ACTIVE and command is not None:
            return command
        if mode is Mode.STARTING and command is not None:
            share = _share(self._cycles * s.period, s.stiffness_ramp)
            return (
                _blend(self._position_before, command.position, eased(share)),
                _blend(self._stiffness_before, command.stiffness, share),
            )
        if mode is Mode.HOLDING:
            return self._position_before, self._stiffness_before
        if mode is Mode.SITTING:
            share = _share(self._cycles * s.period, s.sit_time)
            return _blend(self._position_before, s.sit, eased(share)), self._stiffness_before
        if mode is Mode.RESTING:
            share = _share(self._cycles * s.period, s.stiffness_ramp)
            least = [min(before, REST) for before in self._stiffness_before]
            return s.sit, _blend(self._stiffness_before, least, share)
        if mode is Mode.RELAXING:
            share = _share(self._cycles * s.period, s.stiffness_ramp)
            return self._position_before, _blend(self._stiffness_before, self._zeros, share)
        return self._measured or self._position, self._zeros

    def _limited(self, position: Sequence[float], stiffness: Sequence[float]) -> SafeCommand:
        """Limit angles, their speeds and the stiffness; keep what is sent."""
        s = self._s
        stiffness = [
            min(max(share, 0.0), 1.0) if driven and joint not in self._spared else 0.0
            for joint, (share, driven) in enumerate(zip(stiffness, s.driven, strict=True))
        ]
        # A joint that was limp starts from where it is.
        origin = [
            before if share > LIMP_SHARE else measured
            for before, share, measured in zip(
                self._position, self._stiffness, self._measured or self._position, strict=True
            )
        ]
        position = [
            limited_step(before, target, speed * s.period) if share > LIMP_SHARE else target
            for before, target, speed, share in zip(
                origin, self._inside(position), s.speed, stiffness, strict=True
            )
        ]
        self._position, self._stiffness = position, stiffness
        if s.dry_run:
            return SafeCommand(list(self._measured or position), list(self._zeros), self.mode)
        return SafeCommand(list(position), list(stiffness), self.mode)

    def _inside(self, position: Sequence[float]) -> list[float]:
        return [
            min(max(angle, low), high)
            for angle, low, high in zip(position, self._s.lower, self._s.upper, strict=True)
        ]


class _Button:
    """A button that bounces: pressed with the first contact, released after a time without one."""

    def __init__(self, period: float) -> None:
        self._period = period
        self._since_contact = BOUNCE_TIME
        self._contact_time = 0.0
        self._used = False
        self._down = False

    def update(self, contact: bool) -> bool:
        """Take a frame; whether the button has just gone down."""
        before = self._down
        self._since_contact = 0.0 if contact else self._since_contact + self._period
        self._down = contact or (self._down and self._since_contact < BOUNCE_TIME)
        self._contact_time = self._contact_time + self._period if contact else 0.0
        self._used = self._used and self._down
        return self._down and not before

    def held(self, time: float) -> bool:
        """Whether contact has lasted this long [s], and this press has done nothing yet."""
        return not self._used and self._contact_time >= time

    def use_up(self) -> None:
        """Let this press do nothing more until the button is released."""
        self._used = True


def _share(elapsed: float, duration: float) -> float:
    return min(1.0, elapsed / duration) if duration > 0.0 else 1.0


def _blend(first: Sequence[float], second: Sequence[float], share: float) -> list[float]:
    return [a + share * (b - a) for a, b in zip(first, second, strict=True)]
