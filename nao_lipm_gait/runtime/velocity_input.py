"""The last velocity command, for as long as it counts."""

from nao_lipm_gait.types import STANDSTILL, VelocityCommand


class VelocityInput:
    """Holds a command and forgets it when it gets old, on the clock of the sensor stamps.

    That clock stands still when the robot does, so a paused simulation times nothing out, and it
    makes a run reproducible. With several senders the newest command counts.
    """

    def __init__(self, timeout: float) -> None:
        """Timeout [s]"""
        self._timeout = round(timeout * 1e9)
        self._command = STANDSTILL
        self._received: int | None = None
        self.timed_out = False
        """The last command was to move, and has become too old."""

    def receive(self, command: VelocityCommand, now: int | None) -> None:
        """Take a command that arrives when the newest sensor stamp is `now` [ns].

        None: no sensors yet; the command then counts from the first frame on.
        """
        self._command = command
        self._received = now
        self.timed_out = False

    def at(self, stamp: int) -> VelocityCommand:
        """The command for the frame of this stamp [ns]; standstill when the last one is too old."""
        if self._command.is_zero:
            return STANDSTILL
        if self._received is None:
            self._received = stamp
        if stamp - self._received > self._timeout:
            self._command = STANDSTILL
            self.timed_out = True
        return self._command

    def age(self, stamp: int) -> float | None:
        """[s] since the last command; None without one."""
        return None if self._received is None else (stamp - self._received) * 1e-9

    def clear(self) -> None:
        self._command = STANDSTILL
        self._received = None
        self.timed_out = False
