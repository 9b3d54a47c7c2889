"""What must never happen, whatever the fault, and what became of the robot."""

from collections.abc import Callable, Sequence

import numpy as np

from nao_lipm_gait.robot import RobotDescription
from nao_lipm_gait.runtime.controller import GaitController
from nao_lipm_gait.runtime.diagnostics import Level, Report
from nao_lipm_gait.runtime.target_guard import SPEED_SHARE
from nao_lipm_gait.types import GaitState, JointTargets

HANG = 1.0
"""[s] of processor time that no message may take."""
FALL_GRACE = 0.3
"""[s] after a fall until no stiff command may come: sensors are late, and a fall takes a while."""
START_GRACE = 0.1
"""[s] that a new gait has to see that the robot lies."""
SILENT_STOP = 2.2
"""[s] for which a robot that is asked to walk may not walk without a report: these come each
second, and a stand takes almost one."""
UPRIGHT_STATES = (GaitState.STAND, GaitState.WALK, GaitState.STOP)
"""A gait that knows of no fall."""
_ROUNDING = 1e-9


class CommandCheck:
    """The contract of `joint_command`: finite, within the limits of the joints, not too fast."""

    def __init__(self, robot: RobotDescription) -> None:
        self._lower, self._upper = robot.lower, robot.upper
        self._stride = SPEED_SHARE * 0.01 * np.asarray(robot.velocity_limit)
        self._last: JointTargets | None = None

    def see(self, targets: JointTargets) -> str | None:
        """What is wrong with the next command of one gait; None where nothing is."""
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
        # After a longer gap the robot may be anywhere.
        if 1 <= ticks <= 20 and share > 1.0 + 1e-6:
            return f"{share * SPEED_SHARE:.1f} times the speed limit of a joint"
        return None


class Invariants:
    """Looks at every command, every report and the truth."""

    def __init__(self, robot: RobotDescription, seconds: Callable[[], float]) -> None:
        """seconds: [s] since the start."""
        self._robot = robot
        self._seconds = seconds
        self.violations: dict[str, str] = {}
        """Kind -> the first evidence."""
        self.explained: dict[str, None] = {}
        """Everything that a report said above OK."""
        self.fell_at: float | None = None
        self._down_since: float | None = None
        self._idle_since: float | None = None
        self._born: dict[str, float] = {}
        self._checks: dict[str, CommandCheck] = {}
        self._told_at = -1.0

    def violate(self, kind: str, evidence: str) -> None:
        self.violations.setdefault(kind, f"{self._seconds():.2f} s: {evidence}")

    def robot_was_reset(self) -> None:
        self._down_since = None
        self._checks.clear()

    def see_command(self, sender: str, state: GaitState, targets: JointTargets) -> None:
        """What a gait sends, and the state that it believes to be in."""
        check = self._checks.setdefault(sender, CommandCheck(self._robot))
        found = check.see(targets)
        if found is not None:
            self.violate("command", found)
        now = self._seconds()
        born = self._born.setdefault(sender, now)
        if (
            targets.stiffness > 0.0
            and self._down_since is not None
            and now > max(self._down_since + FALL_GRACE, born + START_GRACE)
            and state in UPRIGHT_STATES
        ):
            self.violate("stiff after a fall", f"state {state.value}")

    def see_duration(self, topic: str, seconds: float) -> None:
        if seconds > HANG:
            self.violate("hang", f"{seconds:.1f} s for {topic}")

    def see_reports(self, said: Sequence[Report]) -> None:
        for report in said:
            # A joint at its limit explains nothing.
            if report.level > Level.OK and not report.message.endswith("out of reach"):
                self._told_at = self._seconds()
                self.explained[f"{report.name}: {report.message[:160]}"] = None

    def see_tick(self, fallen: bool, gaits: Sequence[GaitController], asked_to_walk: bool) -> None:
        """The truth after a tick, and every gait that lives."""
        now = self._seconds()
        if fallen:
            self._down_since = now if self._down_since is None else self._down_since
            self.fell_at = now if self.fell_at is None else self.fell_at
        for gait in gaits:
            if gait.unexpected:
                self.violate("exception", "; ".join(self.explained) or "in a message")
            if gait.crashes:
                self.violate("exception", gait.crashes[0])
        self._watch_for_silence(now, gaits, asked_to_walk)

    def _watch_for_silence(
        self, now: float, gaits: Sequence[GaitController], asked_to_walk: bool
    ) -> None:
        walks = any(gait.state is GaitState.WALK for gait in gaits)
        if not gaits or walks or not asked_to_walk:
            self._idle_since = None
            return
        self._idle_since = now if self._idle_since is None else self._idle_since
        if now - max(self._idle_since, self._told_at) > SILENT_STOP:
            state = gaits[0].state.value
            self.violate("silent stop", f"{state} since {self._idle_since:.2f} s without a word")
