"""What the motors say of themselves in each frame, and what must then not go on.

A leg motor that cannot carry makes the robot sit down, or go limp where a command would only drive
it further from where it is told to be. An arm or head motor goes limp alone.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field

from lola_bridge.codec import JOINTS, LolaSensors

VERY_HOT = 2
"""`Status` from which on a motor takes less than 70 % of its stiffness; 3: none (nao_lola)."""
FOLLOWS = 0.5
"""Stiffness from which on a joint is expected to follow its command."""
STUCK_ANGLE = 0.15
"""[rad] between a command and that at which the measured angle last changed: an encoder has a
hundred counts in it."""
STUCK_TIME = 0.6
"""[s] of this, after which the encoder sticks."""
LEG_JOINTS = ("HipYawPitch", "HipRoll", "HipPitch", "KneePitch", "AnklePitch", "AnkleRoll")
LEGS = frozenset(index for index, joint in enumerate(JOINTS) if joint[1:] in LEG_JOINTS)


@dataclass(frozen=True)
class MotorLimits:
    """What a motor may show.

    Attributes:
        hot: Temperature [deg C] from which on a motor is not used.
        cool: Below it, it is used again.
        error: Difference [rad] between command and measurement that counts as not following.
        time: For so long [s].
        current: Mean current [A] over `time`.
    """

    hot: float = 80.0
    cool: float = 70.0
    error: float = 0.4
    time: float = 1.0
    current: float = 2.0


@dataclass
class MotorFaults:
    """What is wrong now.

    Attributes:
        sit: Why the robot has to sit down.
        limp: Why the whole robot has to go limp.
        spared: Arm and head joints that go limp, and why.
    """

    sit: str | None = None
    limp: str | None = None
    spared: dict[int, str] = field(default_factory=dict)


class MotorWatch:
    """Watches the motors of one robot.

    Args:
        limits: What they may show.
        driven: (25,) Motors that are commanded.
        period: Time of a frame [s].
    """

    def __init__(self, limits: MotorLimits, driven: Sequence[bool], period: float) -> None:
        self._hot: set[int] = set()
        self._latched: dict[int, str] = {}
        self.configure(limits, driven, period)

    def configure(self, limits: MotorLimits, driven: Sequence[bool], period: float) -> None:
        """Go on with other limits; what was given up stays so."""
        self._limits, self._period = limits, period
        self._driven = [index for index, each in enumerate(driven) if each]
        self.restart()

    def restart(self) -> None:
        """Forget measurements, as after a new connection; what was given up stays so."""
        count = len(JOINTS)
        self._off, self._stuck, self._current = [0.0] * count, [0.0] * count, [0.0] * count
        self._seen, self._sent = [math.nan] * count, [0.0] * count

    def forgive(self) -> None:
        """Use again what did not follow: somebody has looked at it."""
        self._latched.clear()
        self.restart()

    def update(
        self, sensors: LolaSensors, position: Sequence[float], stiffness: Sequence[float]
    ) -> MotorFaults:
        """Judge a frame.

        Args:
            sensors: The frame.
            position: (25,) [rad] what was sent last.
            stiffness: (25,) what was sent last.
        """
        faults = MotorFaults()
        for joint in self._driven:
            warm = self._temperature_fault(joint, sensors)
            if warm is not None:
                if joint in LEGS:
                    faults.sit = faults.sit or f"{warm}: sitting down"
                else:
                    faults.spared[joint] = f"{warm}: this joint goes limp"
            if joint not in self._latched:
                text = self._motion_fault(joint, sensors, position[joint], stiffness[joint])
                if text is not None:
                    self._latched[joint] = text
        for joint, text in self._latched.items():
            if joint in LEGS:
                faults.limp = faults.limp or f"{text}: going limp"
            else:
                faults.spared.setdefault(joint, f"{text}: this joint goes limp")
        return faults

    def _temperature_fault(self, joint: int, sensors: LolaSensors) -> str | None:
        """A motor that is too hot, by its temperature or its own word."""
        degrees, status = sensors.temperature[joint], sensors.status[joint]
        limit = self._limits.cool if joint in self._hot else self._limits.hot
        unknown = joint in self._hot and not math.isfinite(degrees)
        if degrees >= limit or status >= VERY_HOT or unknown:
            self._hot.add(joint)
            said = f", status {status}" if status >= VERY_HOT else ""
            shown = "an unknown temperature, hot before" if unknown else f"{degrees:.0f} deg C"
            return f"{JOINTS[joint]} at {shown}{said}"
        self._hot.discard(joint)
        return None

    def _motion_fault(
        self, joint: int, sensors: LolaSensors, position: float, stiffness: float
    ) -> str | None:
        """A motor that does not follow, draws too much, or whose encoder sticks."""
        limits, period = self._limits, self._period
        current = sensors.current[joint]
        if math.isfinite(current):
            share = min(1.0, period / limits.time)
            self._current[joint] += share * (abs(current) - self._current[joint])
        if self._current[joint] > limits.current:
            return f"{JOINTS[joint]} draws {self._current[joint]:.1f} A"
        measured = sensors.position[joint]
        if stiffness < FOLLOWS or measured != self._seen[joint]:
            self._seen[joint], self._sent[joint], self._stuck[joint] = measured, position, 0.0
        if stiffness < FOLLOWS:
            self._off[joint] = 0.0
            return None
        error = abs(position - measured)
        self._off[joint] = self._off[joint] + period if error > limits.error else 0.0
        if self._off[joint] > limits.time:
            return f"{JOINTS[joint]} is {error:.2f} rad from its command for {limits.time:g} s"
        if abs(position - self._sent[joint]) > STUCK_ANGLE:
            self._stuck[joint] += period
        if self._stuck[joint] > STUCK_TIME:
            return f"{JOINTS[joint]} shows one angle while it is told to move (encoder?)"
        return None
