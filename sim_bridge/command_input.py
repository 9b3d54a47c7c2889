"""What the robot does with commands: who may command it, and which answers still count."""

from collections.abc import Sequence

from nao_lipm_gait.errors import NaoGaitError
from nao_lipm_gait.robot_description import RobotDescription
from nao_lipm_gait.signals import JointTargets
from sim_bridge.commands import CommandReader

TAKE_OVER = 0.2
"""[s] of silence of the one who commands, after which another one may."""


class CommandInput:
    """One commander at a time: of two gaits the robot obeys the one that came first.

    Commands of two gaits mixed would make a fall certain; each believes that its own are carried
    out. A gait that ended is replaced as soon as it has been silent for a moment.
    """

    def __init__(self, robot: RobotDescription) -> None:
        self._reader = CommandReader(robot)
        self._sender: str | None = None
        self._heard = 0.0
        self._commands_from = 0

    def reset(self, stamp: int) -> None:
        """Answers to sensors up to `stamp` [ns] no longer count."""
        self._reader.reset()
        self._commands_from = stamp

    def admit(self, sender: str, now: float) -> None:
        """Raises NaoGaitError when another one commands.

        Args:
            sender: header.frame_id of the command; each gait has its own.
            now: any monotonic time [s].
        """
        if sender != self._sender and self._sender is not None and now - self._heard < TAKE_OVER:
            raise NaoGaitError(
                "joint_command header.frame_id",
                sender[:40],
                f"one gait; the robot obeys {self._sender[:40]!r} until it is silent for "
                f"{TAKE_OVER:g} s",
            )

    def read(
        self,
        sender: str,
        now: float,
        stamp: int,
        names: Sequence[str],
        position: Sequence[float],
        effort: Sequence[float],
    ) -> tuple[JointTargets | None, str | None]:
        """As `CommandReader.read`; no targets for an answer to what was before a reset.

        Who sends what can be carried out commands from then on.
        """
        if 0 < stamp <= self._commands_from:
            return None, None
        read = self._reader.read(stamp, names, position, effort)
        self._sender, self._heard = sender, now
        return read
