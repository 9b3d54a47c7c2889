"""One gait process as the robot, the operator and the invariants see it."""

import time
from collections.abc import Callable
from dataclasses import replace

from gait_lab.faults.channel import Message
from gait_lab.faults.invariants import Invariants
from nao_lipm_gait.parameters import GaitParameters
from nao_lipm_gait.runtime.controller import ControllerSettings, GaitController, Output
from nao_lipm_gait.runtime.inputs import JointInput
from robot_core.robot import RobotDescription
from robot_core.types import JointTargets


class WatchedGait:
    """Collects the commands of its gait, sent under its name, and shows them to the invariants."""

    def __init__(
        self,
        name: str,
        robot: RobotDescription,
        parameters: GaitParameters,
        settings: ControllerSettings,
        invariants: Invariants,
        seconds: Callable[[], float],
    ) -> None:
        self.name = name
        self._invariants = invariants
        self._seconds = seconds
        self.controller = GaitController(robot, parameters, settings, seconds)
        self._answered = False
        self._commands: list[JointTargets] = []

    def take_commands(self) -> list[JointTargets]:
        """Return the commands since the last call."""
        commands, self._commands = self._commands, []
        return commands

    def receive(self, message: Message) -> None:
        """Process a message; check its answers and the processor time that it took."""
        before = time.thread_time()
        content = message.content
        if isinstance(content, JointInput):
            content = replace(content, arrived=round(self._seconds() * 1e9))
        output = self.controller.receive(message.topic, lambda: content)
        self._invariants.check_duration(message.topic, time.thread_time() - before)
        self._keep(output)

    def end_period(self) -> None:
        """Nothing more arrives in this control period: without an answer, the gait walks on."""
        if not self._answered:
            self._keep(self.controller.overdue())
        self._answered = False

    def _keep(self, output: Output) -> None:
        self._answered |= bool(output.answers)
        for targets, status, _ in output.answers:
            state = self.controller.state if status is None else status.state
            self._invariants.check_command(self.name, state, targets)
            self._commands.append(targets)
