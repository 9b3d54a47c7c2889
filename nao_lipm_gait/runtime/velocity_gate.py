"""The velocity that the gait gets: the commanded one, or standstill while the robot must stand."""

from nao_lipm_gait.gait import Gait
from nao_lipm_gait.runtime.bias_wait import BiasWait
from nao_lipm_gait.runtime.commands import VelocityInput
from nao_lipm_gait.runtime.diagnostics import COMMANDS, Diagnostics
from nao_lipm_gait.runtime.heat_watch import HeatWatch
from nao_lipm_gait.runtime.state_log import StateLog
from robot_core.log import Level
from robot_core.types import STANDSTILL, VelocityCommand


class VelocityGate:
    """Decides once per tick.

    Args:
        gait: The gait.
        velocity: The commanded velocity.
        heat: Slows the robot down while a motor is hot.
        bias_wait: See `BiasWait`.
        diagnostics: Takes reports.
        log: Takes lines about the wait.
    """

    def __init__(
        self, gait: Gait, velocity: VelocityInput, heat: HeatWatch, bias_wait: float,
        diagnostics: Diagnostics, log: StateLog,
    ) -> None:  # fmt: skip
        self._gait = gait
        self._velocity = velocity
        self._heat = heat
        self._bias_wait = BiasWait(bias_wait)
        self._diagnostics = diagnostics
        self._log = log
        self._motors_ready = True

    def restart(self) -> None:
        """Wait for the gyro's bias again, as after a gap in the sensor frames."""
        self._bias_wait.restart()

    def note_motors(self, ready: bool) -> None:
        """Whether the motors follow what is commanded; until then the robot stands."""
        self._motors_ready = ready
        if ready:
            self._diagnostics.end("motors", "the motors are ready")

    def command(self, stamp: int, *, stand: bool, ticked: bool) -> VelocityCommand:
        """The velocity for a tick.

        Args:
            stamp: Stamp [ns] of the sensor frame.
            stand: The robot must stand for another reason.
            ticked: There was a tick before.
        """
        command = self._heat.limited(self._velocity.at(stamp))
        if stand:
            command = STANDSTILL
        if not self._motors_ready:
            if not command.is_zero:
                text = "standing until the motors are ready"
                self._diagnostics.begin(COMMANDS, Level.OK, "motors", text)
            command = STANDSTILL
        wait = self._bias_wait
        if wait.over:
            return command
        sigma = self._gait.heading_drift_sigma if ticked else None
        stands = wait.update(stamp, self._gait.state, sigma)
        self._log.update_bias_wait(wait, stands=stands, commanded=not command.is_zero)
        return STANDSTILL if stands else command
