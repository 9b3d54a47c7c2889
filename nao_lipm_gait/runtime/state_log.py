"""What the log says about the gait's state, each thing once when it changes."""

from nao_lipm_gait.gait import Gait
from nao_lipm_gait.runtime.bias_wait import BiasWait
from nao_lipm_gait.runtime.diagnostics import COMMANDS, Diagnostics
from robot_core.log import Level
from robot_core.types import DOWN, GaitState, GaitStatus


class StateLog:
    """Logs falls, get-ups and what else an operator must know of; steps of a walk are not.

    Args:
        gait: The gait.
        diagnostics: Takes the lines.
        cmd_vel_timeout: Age [s] at which a velocity command means stop.
    """

    def __init__(self, gait: Gait, diagnostics: Diagnostics, cmd_vel_timeout: float) -> None:
        self._gait = gait
        self._diagnostics = diagnostics
        self._cmd_vel_timeout = cmd_vel_timeout
        self._state = GaitState.STAND
        self._timed_out = self._logged_timeout = False

    def update(self, status: GaitStatus) -> None:
        """Log the state if it has changed."""
        if status.state is not self._state:
            self._log_change(status)

    def update_command(self, *, timed_out: bool) -> None:
        """Log that `cmd_vel` has timed out; call it in each tick."""
        if timed_out and not self._timed_out:
            self._timed_out = True
            text = f"no cmd_vel for {self._cmd_vel_timeout:g} s: the robot stops"
            self._logged_timeout = self._diagnostics.log_event(
                Level.WARN, "cmd_vel timeouts", text, burst=2
            )

    def command_arrived(self) -> None:
        """Log that `cmd_vel` arrives again, if its timeout was logged."""
        self._timed_out = False
        if self._logged_timeout:
            self._logged_timeout = False
            self._diagnostics.log(Level.OK, "cmd_vel arrives again")

    def update_bias_wait(self, wait: BiasWait, *, stands: bool, commanded: bool) -> None:
        """Report the stand before the first walk.

        Args:
            wait: The wait, after its update in this tick.
            stands: The robot must still stand.
            commanded: A walk is commanded.
        """
        if wait.known:
            self._diagnostics.end("gyro bias", "the gyro's bias is known")
        elif wait.over:
            text = "the gyro's bias is not known after {:g} s of standing: the walk may turn"
            self._diagnostics.end("gyro bias", text.format(wait.longest))
        elif stands and commanded:
            text = f"standing until the gyro's bias is known, for {wait.longest:g} s at most"
            self._diagnostics.begin(COMMANDS, Level.OK, "gyro bias", text)

    def _log_change(self, status: GaitStatus) -> None:
        before, self._state = self._state, status.state
        if status.state is GaitState.FALLEN and before is not GaitState.GETTING_UP:
            self._diagnostics.log(Level.WARN, "fallen, relaxed")
        elif status.state is GaitState.FALLEN and self._gait.gets_up_again:
            self._diagnostics.log(Level.OK, "not up yet, going on")  # rolled over, or a failed try
        elif status.state is GaitState.FALLEN:
            self._diagnostics.log(Level.WARN, "getting up has failed, relaxed")
        elif status.state is GaitState.GETTING_UP:
            self._diagnostics.log(Level.OK, f"getting up: {status.motion}")
        elif status.state is GaitState.RELAXED:
            self._diagnostics.log(Level.OK, "relaxed: no torque on the joints")
        elif before is GaitState.GETTING_UP:
            self._diagnostics.log(Level.OK, "stood up")
        elif before in DOWN:
            self._diagnostics.log(Level.OK, "upright, standing")
        elif status.state is GaitState.LIFTED:
            text = "lifted: the soles carry no load; standing until they do again"
            self._diagnostics.log(Level.WARN, text)
        elif before is GaitState.LIFTED:
            self._diagnostics.log(Level.OK, "back on the ground")
