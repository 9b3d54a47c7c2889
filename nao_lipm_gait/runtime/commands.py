"""Commands that last: a velocity until it times out, a wait for the gyro's bias, a motion."""

from nao_lipm_gait.motion.scheduler import GET_UP
from nao_lipm_gait.runtime.diagnostics import Diagnostics
from robot_core.log import Level
from robot_core.types import DOWN, GETTING_UP, STAND, STANDSTILL, GaitState, VelocityCommand

DRIFT_MAX = 9e-4
"""Deviation [rad/s] of the heading's drift below which the gyro's bias counts as known: 1.5 deg in
half a minute. White noise of 0.005 rad/s per sample takes 17 s without a yaw gyro, else 5 s."""
LONGEST_BIAS_WAIT = 20.0
"""Longest time [s] to stand, unless set otherwise."""


class HeldVelocity:
    """Holds the last velocity command until its `timeout` [s], on the clock of the sensor stamps.

    That clock stands still when the robot does, so a paused simulation does not time out, and runs
    are reproducible. With several senders the newest command counts.

    Attributes:
        timed_out: The last command was to move, and it is too old.
    """

    def __init__(self, timeout: float, say: Diagnostics) -> None:
        self._timeout = round(timeout * 1e9)
        self._text = f"no cmd_vel for {timeout:g} s: the robot stops"
        self._say = say
        self._logged = False
        self.clear()

    def clear(self) -> None:
        """Forget the command."""
        self._command = STANDSTILL
        self._received: int | None = None
        self.timed_out = False

    def receive(self, command: VelocityCommand, now: int | None) -> None:
        """Keep a command of the newest sensor stamp, `now` [ns].

        Before the first it is None: the command's time then begins with the first frame.
        """
        self._command = command
        self._received = now
        self.timed_out = False
        if self._logged:
            self._logged = False
            self._say.log(Level.OK, "cmd_vel arrives again")

    def at(self, stamp: int) -> VelocityCommand:
        """The command for the frame of this stamp [ns]; standstill if the last one is too old."""
        if self._command.is_zero:
            return STANDSTILL
        if self._received is None:
            self._received = stamp
        if stamp - self._received > self._timeout:
            self._command = STANDSTILL
            self.timed_out = True
            self._logged = self._say.log_event(Level.WARN, "cmd_vel timeouts", self._text, burst=2)
        return self._command

    def age(self, stamp: int) -> float | None:
        """Time [s] since the last command at `stamp` [ns]; None without one."""
        return None if self._received is None else (stamp - self._received) * 1e-9


class BiasWait:
    """The stand before the first walk, in which the gait learns the bias of its gyro.

    Attributes:
        longest: Longest time [s] to stand; 0 does not wait.
        over: The robot may walk.
        known: The wait is over because the bias is known.
    """

    def __init__(self, longest: float) -> None:
        self.longest = longest
        self.restart()

    def restart(self) -> None:
        """Begin again, as after a gap in the sensor frames."""
        self.over = self.longest == 0.0
        self.known = False
        self._stands_since: int | None = None

    def update(self, stamp: int, state: GaitState, drift_sigma: float | None) -> bool:
        """Whether to stand in this tick of the stamp [ns].

        drift_sigma: see `Gait.heading_drift_sigma` [rad/s]; None before the first tick.
        """
        if self.over:
            return False
        if state is not GaitState.STAND:
            self._stands_since = None
            return False
        if self._stands_since is None or stamp < self._stands_since:  # or the clock was set back
            self._stands_since = stamp
        self.known = drift_sigma is not None and drift_sigma < DRIFT_MAX
        self.over = self.known or stamp - self._stands_since > self.longest * 1e9
        return not self.over


class MotionRequests:
    """Follows the last requested motion to its end.

    Each method returns what became of a motion, as `name: outcome`, or None while that is open.
    """

    def __init__(self) -> None:
        self._name: str | None = None
        self._started = False

    @property
    def is_open(self) -> bool:
        """A motion is followed."""
        return self._name is not None

    def request(self, name: str) -> str | None:
        """A motion was requested and accepted; it replaces one that is not done."""
        replaced, self._name, self._started = self._name, name, False
        return None if replaced is None else f"{replaced}: replaced by {name}"

    def update(self, state: GaitState, running: str, waits: bool, ended: bool) -> str | None:
        """Follow one tick of the gait.

        Args:
            state: State of the gait.
            running: Name of the running motion; empty without one.
            waits: A requested motion or get-up has not begun yet.
            ended: The running motion has reached its last keyframe, which it holds.
        """
        name = self._name
        if name is None:
            return None
        aborted = f"aborted, the robot is {state.value}"
        if name == GET_UP:
            self._started = self._started or state is GETTING_UP
            if self._started and state is STAND:
                return self._close("done")
            return None if state is GETTING_UP or waits else self._close(aborted)
        if running == name and not waits:
            self._started = True
            return self._close("done") if ended else None
        if self._started:
            # A motion to the floor or the stand is over in the tick in which it reaches its end.
            return self._close(aborted if state in DOWN else "done")
        return None if waits else self._close(aborted)

    def _close(self, outcome: str) -> str:
        name, self._name = self._name, None
        return f"{name}: {outcome}"
