"""What is said about the stamps of joint states: wrong rates, repeats, jumps of the clock."""

from nao_lipm_gait.runtime.diagnostics import SENSORS, WALK, Diagnostics
from nao_lipm_gait.runtime.stamp_monitor import LONGEST_GAP, NEW_TIME, StampMonitor, Step
from robot_core.errors import NaoGaitError
from robot_core.log import Level

STAMP = "joint_states header.stamp"
OFF_RATE, RATE_AGAIN = 0.1, 0.05
"""Share by which the mean step of the stamps may differ from the control period, and below which it
is right again."""


class StampReports:
    """Reports what the stamp monitor has found.

    Args:
        stamps: The stamp monitor.
        diagnostics: Takes the reports.
        period: Control period [s].
    """

    def __init__(self, stamps: StampMonitor, diagnostics: Diagnostics, period: float) -> None:
        self._stamps = stamps
        self._diagnostics = diagnostics
        self._period = period
        self._doubtful: NaoGaitError | None = None

    def check_rate(self) -> None:
        """Report joint states at another rate: the walk then runs too fast or too slow."""
        step, period = self._stamps.mean_step * 1e-9, self._period
        if abs(step - period) > OFF_RATE * period:
            text = (
                f"{STAMP}: steps of {step:.4g} s on average; allowed: steps of "
                f"control_period, {period:g} s; the walk runs {period / step:.2g} times as fast"
            )
            self._diagnostics.begin(SENSORS, Level.WARN, "rate", text)
        elif abs(step - period) < RATE_AGAIN * period:
            self._diagnostics.end("rate", "joint_states arrive at the control period again")

    def repeated(self, stamp: int) -> None:
        """Report a stamp [ns] that came twice."""
        error = NaoGaitError(STAMP, f"{stamp * 1e-9:.3f} s again", "a later stamp")
        text = f"{error}; the answer is sent again"
        self._diagnostics.event(SENSORS, Level.WARN, "repeated joint_states", text)

    def early(self, stamp: int) -> NaoGaitError:
        """The error of a stamp [ns] before the next tick is due."""
        after = (stamp - (self._stamps.last or 0)) * 1e-9
        return NaoGaitError(
            STAMP, f"{after:.6g} s after the last", f"steps of control_period, {self._period:g} s"
        )

    def unexpected(self, step: Step, stamp: int) -> NaoGaitError:
        """The error of a stamp [ns] that is late or may begin a new time."""
        last = self._stamps.last or 0
        return NaoGaitError(
            STAMP,
            f"{stamp * 1e-9:.3f} s, {step.value}",
            f"a stamp that follows {last * 1e-9:.3f} s, or more stamps of the new time",
        )

    def hold(self, stamp: int) -> None:
        """Keep a doubtful stamp [ns]: if it begins a new time base, the next message proves it."""
        self._diagnostics.rejected["joint_states"] += 1
        self._doubtful = self.unexpected(Step.DOUBTFUL, stamp)

    def settle(self, step: Step) -> None:
        """Report a doubtful stamp, unless the message after it continues from it."""
        error, self._doubtful = self._doubtful, None
        if error is not None and step not in NEW_TIME:
            text = f"{error}; message ignored"
            self._diagnostics.event(SENSORS, Level.WARN, error.field, text, burst=5)

    def new_time(self, step: Step, stamp: int, gap: int, *, steady: bool) -> None:
        """Report a new time base.

        A robot that was silent for longer than any outage that is bridged was paused or reset,
        which is no fault.

        Args:
            step: BACKWARDS or JUMP.
            stamp: The first stamp [ns] of the new time.
            gap: Time [ns] since the last stamp.
            steady: The robot has not moved meanwhile: only the clock has jumped.
        """
        if gap > LONGEST_GAP and not steady:
            text = f"joint_states after a pause of {gap * 1e-9:.2f} s: restarting from a stand"
            self._diagnostics.event(WALK, Level.OK, "pause", text)
            return
        longest = self._stamps.longest_gap * 1e-9
        text = (
            f"{STAMP}: {step.value} to {stamp * 1e-9:.3f} s; allowed: steps "
            f"of {self._period:g} s and no gap over {longest:.3g} s; "
            + ("stopping" if steady else "restarting from a stand")
        )
        self._diagnostics.event(WALK, Level.WARN, f"stamp {step.value}", text)
