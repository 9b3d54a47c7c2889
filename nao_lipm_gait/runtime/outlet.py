"""Where the answers of a gait go: to ROS, to a simulated robot, to nobody."""

from typing import Protocol

from nao_lipm_gait.runtime.diagnostics import Level
from nao_lipm_gait.types import GaitStatus, JointTargets


class Outlet(Protocol):
    """Where the answers go."""

    def command(self, targets: JointTargets) -> None:
        """The answer to a sensor frame."""

    def status(self, status: GaitStatus) -> None:
        """What the gait did in this tick."""

    def log(self, level: Level, text: str) -> None:
        """A line for people."""


class DeafOutlet:
    """Hears nothing; a subclass takes what it wants to hear."""

    def command(self, targets: JointTargets) -> None:
        pass

    def status(self, status: GaitStatus) -> None:
        pass

    def log(self, level: Level, text: str) -> None:
        pass
