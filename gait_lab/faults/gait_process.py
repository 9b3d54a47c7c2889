"""One gait process, as far as the robot, the operator and the judge can tell."""

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
    """Gathers what its gait sends, and shows it to the judge."""

    def __init__(
        self,
        name: str,
        robot: RobotDescription,
        parameters: GaitParameters,
        settings: Settings,
        judge: Invariants,
        seconds: Callable[[], float],
    ) -> None:
        """seconds: [s] since the start."""
        self.name = name
        self._judge = judge
        self.entry = GaitController(robot, parameters, settings, self, seconds)
        self.sent: list[JointTargets] = []

    def command(self, targets: JointTargets) -> None:
        self.sent.append(targets)
        self._judge.see_command(self.name, self.entry.state, targets)

    def receive(self, message: Message) -> None:
        """Take a message; the judge looks at how long that took."""
        before = time.thread_time()
        self.entry.receive(message.topic, lambda: message.content)
        self._judge.see_duration(message.topic, time.thread_time() - before)
