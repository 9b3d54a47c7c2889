"""What is sent to the robot in each cycle: the gait's command, or what keeps the robot safe.

A pure state machine, stepped once per LoLA frame; no clock, no I/O. Joint arrays (25,) are in the
order of `codec.JOINTS`.

    limp -> starting -> active -> sitting -> resting -> relaxing -> limp

From every state but `active` a fresh command that may pass leads to `starting`. A robot that lies,
or was limp anyway, does not sit: it goes limp.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field
from enum import StrEnum
from typing import NamedTuple

from lola_bridge.codec import JOINTS, TOUCH, LolaSensors
from robot_core.log import Level, LogLine
from robot_core.rate_limiter import limited_step

BODY_VERSION = "6."
"""Begin of the body versions whose joints, limits and masses this package knows."""
BATTERY_LOW, BATTERY_AGAIN = 0.05, 0.10
"""Charge below which no command passes, and from which on commands pass again."""
HOT, COOL = 80.0, 70.0
"""[deg C] of a leg motor from which on no command passes, and below which commands pass again."""
LYING = 1.0
"""[rad] Roll or pitch from which on the robot lies or falls: it must not sit down then."""
REST = 0.5
"""Stiffness with which the robot keeps its sitting pose, which needs a quarter of the torque."""
REST_TIME = 60.0
"""[s] for which it does so, before it goes limp."""
LIMP_SHARE = 0.05
"""Stiffness up to which a joint counts as limp."""
_LEG = tuple(
    index for index, joint in enumerate(JOINTS)
    if joint[1:] in ("HipYawPitch", "HipRoll", "HipPitch", "KneePitch", "AnklePitch", "AnkleRoll")
)  # fmt: skip
_CHEST = TOUCH.index("chest")
_HEAD = tuple(TOUCH.index(name) for name in ("head_front", "head_middle", "head_rear"))


class Mode(StrEnum):
    """What the bridge does with the robot.

    Attributes:
        LIMP: No torque; waits for a command.
        STARTING: Stiffness rises, and the joints move from where they are to the command.
        ACTIVE: Commands pass, within the limits.
        SITTING: The robot sits down.
        RESTING: It sits, with less stiffness, and waits for commands.
        RELAXING: The stiffness falls to 0.
    """

    LIMP = "limp"
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
        wait_for_button: No command passes until the chest button was pressed once.
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
        self._pressed = self._all_pressed = False
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

    def configure(self, settings: SafetySettings) -> None:
        """Continue with other settings, and with the commands of another node."""
        if settings.wait_for_button and not self._s.wait_for_button:
            self._stopped = True
        self._s, self._released = settings, False
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
        relax = self._watch(sensors)
        refused = self.refusal
        self.misses = self.misses + 1 if command is None else 0
        if command is not None:
            self._command = command
        self._advance(command is not None, refused, relax)
        position, stiffness = self._wanted()
        return self._limited(position, stiffness)

    # -- what speaks against commands --------------------------------------------------------------

    def _watch(self, sensors: LolaSensors | None) -> bool:
        """Update the refusals; whether the robot must go limp at once."""
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
        return self._watch_buttons(sensors)

    def _take_over(self, stiffness: Sequence[float]) -> None:
        """Begin with a robot that somebody has left stiff, or with a limp one."""
        self._first = False
        self._stiffness = [min(max(share, 0.0), 1.0) for share in stiffness]
        if max(self._stiffness) > LIMP_SHARE and self._measured is not None:
            self._position = list(self._measured)
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
        hottest = max(_LEG, key=sensors.temperature.__getitem__)
        degrees = sensors.temperature[hottest]
        hot = degrees >= (COOL if "temperature" in reasons else HOT)
        text = f"{JOINTS[hottest]} at {degrees:.0f} deg C: sitting down"
        update("temperature", text if hot else None)

    def _watch_buttons(self, sensors: LolaSensors) -> bool:
        """Chest: sit down, or go on. All three on the head: go limp at once."""
        pressed = sensors.touch[_CHEST] >= 0.5
        if pressed and not self._pressed:
            self._stopped = not self._stopped
        self._pressed = pressed
        all_pressed = all(sensors.touch[index] >= 0.5 for index in _HEAD)
        relax = all_pressed and not self._all_pressed
        self._all_pressed = all_pressed
        self._stopped = self._stopped or relax
        text = "chest button: no command passes until it is pressed again"
        self._refusals.update("chest button", text if self._stopped else None)
        return relax

    # -- modes -------------------------------------------------------------------------------------

    def _advance(self, fresh: bool, refused: str | None, relax: bool) -> None:
        s, before = self._s, self.mode
        self._cycles += 1
        elapsed = self._cycles * s.period
        silent = self.misses * s.period > s.silence_time
        if before in (Mode.STARTING, Mode.ACTIVE):
            if relax:
                self._enter(Mode.RELAXING, "head buttons: going limp")
            elif refused is not None:
                self._stop(None)  # the refusal has been logged
            elif silent:
                self._stop(f"no joint_command for {self.misses * s.period:.2f} s")
            elif before is Mode.STARTING and elapsed >= s.stiffness_ramp:
                self._enter(Mode.ACTIVE, "commands pass")
            elif not fresh:
                self.repeated += 1
        elif fresh and refused is None and self._measured is not None:
            self._enter(Mode.STARTING, "commands arrive: stiffness rises")
        elif before in (Mode.SITTING, Mode.RESTING) and (relax or self._lying):
            self._enter(Mode.RELAXING, "going limp")
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
                _blend(self._position_before, command.position, _smooth(share)),
                _blend(self._stiffness_before, command.stiffness, share),
            )
        if mode is Mode.SITTING:
            share = _share(self._cycles * s.period, s.sit_time)
            return _blend(self._position_before, s.sit, _smooth(share)), self._stiffness_before
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
            min(max(share, 0.0), 1.0) if driven else 0.0
            for share, driven in zip(stiffness, s.driven, strict=True)
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


def _share(elapsed: float, duration: float) -> float:
    return min(1.0, elapsed / duration) if duration > 0.0 else 1.0


def _smooth(share: float) -> float:
    """From 0 to 1 with zero speed at both ends."""
    return share * share * (3.0 - 2.0 * share)


def _blend(first: Sequence[float], second: Sequence[float], share: float) -> list[float]:
    return [a + share * (b - a) for a, b in zip(first, second, strict=True)]
