"""What must never happen whatever the fault, and when the robot fell."""

import math
from collections.abc import Callable, Sequence

import numpy as np

from nao_lipm_gait.runtime.controller import GaitController
from nao_lipm_gait.runtime.target_guard import SPEED_SHARE
from robot_core.log import Level, Report
from robot_core.robot import RobotDescription
from robot_core.types import GaitState, JointTargets

HANG = 1.0
"""Limit of the processor time [s] that one message may take."""
FALL_GRACE = 0.3
"""Time [s] after a fall from which a stiff command is a violation: sensors are delayed."""
START_GRACE = 0.1
"""Time [s] in which a gait that begins, or begins again, has to detect that the robot lies."""
GAP = 0.2
"""[s] without commands after which a gait begins again: it knows nothing of the time between."""
SILENT_STOP = 2.2
"""Longest time [s] for which the robot may ignore a velocity command without a diagnostic.

Diagnostics are published each second, and standing up takes almost one.
"""
UPRIGHT_STATES = (GaitState.STAND, GaitState.WALK, GaitState.STOP, GaitState.LIFTED)
"""States in which the gait has not detected a fall."""
_ROUNDING = 1e-9


class CommandCheck:
    """The contract of `joint_command`: finite, within the joint limits, and not too fast."""

    def __init__(self, robot: RobotDescription) -> None:
        self._lower, self._upper = robot.lower, robot.upper
        self._stride = SPEED_SHARE * 0.01 * np.asarray(robot.velocity_limit)
        self._last: JointTargets | None = None

    def check(self, targets: JointTargets) -> str | None:
        """Check the next command of one gait; return the violation, or None."""
        position, stiffness = np.asarray(targets.position), targets.stiffness
        if position.shape != self._lower.shape or not np.isfinite(position).all():
            return f"position {position}"
        if not 0.0 <= stiffness <= 1.0:
            return f"stiffness {stiffness}"
        below, above = position < self._lower - _ROUNDING, position > self._upper + _ROUNDING
        if below.any() or above.any():
            return "beyond the joint limits"
        last, self._last = self._last, targets
        if last is None or not (stiffness > 0.0 and last.stiffness > 0.0):
            return None
        ticks = round((targets.stamp - last.stamp) / 1e7)
        share = float(np.max(np.abs(position - last.position) / self._stride)) / max(1, ticks)
        # After a longer gap the robot may have moved anywhere.
        if 1 <= ticks <= 20 and share > 1.0 + 1e-6:
            return f"{share * SPEED_SHARE:.1f} times the speed limit of a joint"
        return None


class Invariants:
    """Checks every command, every diagnostic and the ground truth of a run.

    Attributes:
        explained: Every diagnostic above OK, in the order of its first appearance.
        fell_at: Time of the first fall [s]; None without one.
    """

    def __init__(self, robot: RobotDescription, seconds: Callable[[], float]) -> None:
        self._robot = robot
        self._seconds = seconds
        self.violations: dict[str, str] = {}
        self.explained: dict[str, None] = {}
        self.fell_at: float | None = None
        self._down_since: float | None = None
        self._idle_since: float | None = None
        self._begun: dict[str, float] = {}
        self._last_command: dict[str, float] = {}
        self._checks: dict[str, CommandCheck] = {}
        self._explained_at = -1.0

    def violate(self, kind: str, evidence: str) -> None:
        """Record a violation; only the first of each kind is kept."""
        self.violations.setdefault(kind, f"{self._seconds():.2f} s: {evidence}")

    def listed(self) -> tuple[str, ...]:
        """Return the violations as `kind: evidence`."""
        return tuple(f"{kind}: {text}" for kind, text in self.violations.items())

    def robot_was_reset(self) -> None:
        """Forget the fall and the last commands: the robot stands at its start again."""
        self._down_since = None
        self._checks.clear()

    def check_command(self, sender: str, state: GaitState, targets: JointTargets) -> None:
        """Check a command of a gait against its contract and against the state of the robot."""
        check = self._checks.setdefault(sender, CommandCheck(self._robot))
        found = check.check(targets)
        if found is not None:
            self.violate("command", found)
        now = self._seconds()
        if now > self._last_command.get(sender, -math.inf) + GAP:
            self._begun[sender] = now
        self._last_command[sender] = now
        if (
            targets.stiffness > 0.0
            and self._down_since is not None
            and now > max(self._down_since + FALL_GRACE, self._begun[sender] + START_GRACE)
            and state in UPRIGHT_STATES
        ):
            self.violate("stiff after a fall", f"state {state.value}")

    def check_duration(self, topic: str, seconds: float) -> None:
        """Check the processor time [s] that a message took."""
        if seconds > HANG:
            self.violate("hang", f"{seconds:.1f} s for {topic}")

    def add_reports(self, found: Sequence[Report]) -> None:
        """Collect the diagnostics above OK: they explain why a robot stopped."""
        for report in found:
            # A joint at its limit does not explain a stop.
            if report.level > Level.OK and not report.message.endswith("out of reach"):
                self._explained_at = self._seconds()
                self.explained[f"{report.name}: {report.message[:160]}"] = None

    def check_tick(
        self, fallen: bool, gaits: Sequence[GaitController], asked_to_walk: bool
    ) -> None:
        """Check the ground truth after a tick, and every running gait."""
        now = self._seconds()
        if fallen:
            self._down_since = now if self._down_since is None else self._down_since
            self.fell_at = now if self.fell_at is None else self.fell_at
        for gait in gaits:
            if gait.reporter.unexpected:
                self.violate("exception", "; ".join(self.explained) or "in a message")
            if gait.reporter.crashes:
                self.violate("exception", gait.reporter.crashes[0])
        self._check_silent_stop(now, gaits, asked_to_walk)

    def _check_silent_stop(
        self, now: float, gaits: Sequence[GaitController], asked_to_walk: bool
    ) -> None:
        walks = any(gait.state is GaitState.WALK for gait in gaits)
        if not gaits or walks or not asked_to_walk:
            self._idle_since = None
            return
        self._idle_since = now if self._idle_since is None else self._idle_since
        if now - max(self._idle_since, self._explained_at) > SILENT_STOP:
            state = gaits[0].state.value
            self.violate("silent stop", f"{state} since {self._idle_since:.2f} s, not explained")
