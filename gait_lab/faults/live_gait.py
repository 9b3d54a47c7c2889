"""One gait process, as far as the robot, the operator and the judge can tell."""

import time
from collections.abc import Callable

from gait_lab.faults.judge import Judge
from gait_lab.faults.wire import Message
from nao_lipm_gait.parameters import GaitParameters
from nao_lipm_gait.robot_description import RobotDescription
from nao_lipm_gait.ros.gait_entry import GaitEntry, Settings
from nao_lipm_gait.ros.outlet import DeafOutlet
from nao_lipm_gait.signals import JointTargets


class LiveGait(DeafOutlet):
    """Gathers what its gait sends, and shows it to the judge."""

    def __init__(
        self,
        name: str,
        robot: RobotDescription,
        parameters: GaitParameters,
        settings: Settings,
        judge: Judge,
        seconds: Callable[[], float],
    ) -> None:
        """seconds: [s] since the start."""
        self.name = name
        self._judge = judge
        self.entry = GaitEntry(robot, parameters, settings, self, seconds)
        self.sent: list[JointTargets] = []

    def command(self, targets: JointTargets) -> None:
        self.sent.append(targets)
        self._judge.see_command(self.name, self.entry.state, targets)

    def receive(self, message: Message) -> None:
        """Take a message; the judge looks at how long that took."""
        before = time.thread_time()
        self.entry.receive(message.topic, lambda: message.content)
        self._judge.see_duration(message.topic, time.thread_time() - before)
