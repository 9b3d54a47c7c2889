"""One gait process as the robot, the operator and the invariants see it."""

import time
from collections.abc import Callable

from gait_lab.faults.channel import Message
from gait_lab.faults.invariants import Invariants
from nao_lipm_gait.parameters import GaitParameters
from nao_lipm_gait.robot import RobotDescription
from nao_lipm_gait.runtime.controller import GaitController, Settings
from nao_lipm_gait.runtime.outlet import DeafOutlet
from nao_lipm_gait.types import JointTargets


class GaitProcess(DeafOutlet):
    """Collects the commands of its gait and shows them to the invariants.

    Args:
        name: Name of the process, the sender of its commands.
        robot: The robot to walk.
        parameters: Parameters of the gait.
        settings: Settings of the gait.
        invariants: Checks every command and the duration of every message.
        seconds: Returns the time since the start [s].
    """

    def __init__(
        self,
        name: str,
        robot: RobotDescription,
        parameters: GaitParameters,
        settings: Settings,
        invariants: Invariants,
        seconds: Callable[[], float],
    ) -> None:
        self.name = name
        self._invariants = invariants
        self.entry = GaitController(robot, parameters, settings, self, seconds)
        self._commands: list[JointTargets] = []

    def command(self, targets: JointTargets) -> None:
        """Collect a command of the gait."""
        self._commands.append(targets)
        self._invariants.check_command(self.name, self.entry.state, targets)

    def take_commands(self) -> list[JointTargets]:
        """Return the commands since the last call."""
        commands, self._commands = self._commands, []
        return commands

    def receive(self, message: Message) -> None:
        """Process a message, and check how much processor time that took."""
        before = time.thread_time()
        self.entry.receive(message.topic, lambda: message.content)
        self._invariants.check_duration(message.topic, time.thread_time() - before)
