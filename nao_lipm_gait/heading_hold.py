"""Straight walks kept straight: while no turn is commanded, the heading is held by small turns."""

from math import remainder, tau

from nao_lipm_gait.signals import VelocityCommand

SETTLING_TIME = 0.5
"""[s] after the last commanded turn for which its steps still turn the robot."""
RATE_MAX = 0.3
"""[rad/s] that the hold may add."""


class HeadingHold:
    """Remembers the heading at which turning ended, and steers back to it."""

    def __init__(self) -> None:
        self.release()

    def release(self) -> None:
        """Take the next heading as the wanted one."""
        self._wanted: float | None = None
        self._straight_time = 0.0

    @property
    def holds(self) -> bool:
        """Whether there is a heading to be held."""
        return self._wanted is not None

    def steered(
        self, command: VelocityCommand, heading: float, gain: float, dt: float
    ) -> VelocityCommand:
        """The command with the turn [rad/s] that brings the heading [rad] back.

        gain [1/s]: turning rate per error; 0 leaves every command as it is.
        """
        if gain <= 0.0 or command.yaw != 0.0 or command.is_zero:
            self.release()
            return command
        self._straight_time += dt
        if self._wanted is None:
            if self._straight_time < SETTLING_TIME:
                return command
            self._wanted = heading
        rate = gain * remainder(self._wanted - heading, tau)
        return VelocityCommand(command.x, command.y, min(max(rate, -RATE_MAX), RATE_MAX))
