"""What a fault finds and may change: the robot, its gaits, the operator, the judge."""

import numpy as np

from gait_lab.faults.gait_process import GaitProcess
from gait_lab.faults.invariants import Invariants
from nao_lipm_gait.parameters import GaitParameters
from nao_lipm_gait.robot import RobotDescription
from nao_lipm_gait.runtime.controller import Settings
from nao_lipm_gait.runtime.diagnostics import Others
from nao_lipm_gait.types import JointTargets, VelocityCommand
from sim_bridge.command_input import CommandInput
from sim_bridge.simulation import GroundTruth, Reading, Simulation

PERIOD = 0.01
"""[s] of a tick."""
RESET_SILENCE = 60
"""Ticks without sensors after a reset, as in the bridge."""


class Harness:
    """Everything but the passing of time."""

    def __init__(
        self,
        simulation: Simulation,
        parameters: GaitParameters,
        settings: Settings,
        command: VelocityCommand,
    ) -> None:
        """settings: of each gait. command: what the operator asks for."""
        self.simulation = simulation
        self.robot: RobotDescription = simulation.robot
        self.parameters = parameters
        self.tick = 0
        self.command = command
        self.truth: GroundTruth = simulation.truth()
        self.gaits: list[GaitProcess] = []
        self.others = Others()
        self.fallen = False
        self.height = float(self.truth.torso_position[2])
        """[m] of the torso over the floor while standing."""
        self.judge = Invariants(self.robot, self.seconds)
        self._settings = settings
        self._births = 0
        self._ear = CommandInput(self.robot)
        self._targets: JointTargets | None = None
        self._sent: Reading | None = None
        self._silent_until = 0

    def seconds(self) -> float:
        """[s] since the start."""
        return self.tick * PERIOD

    def start_gait(self) -> GaitProcess:
        """One more gait process."""
        self._births += 1
        gait = GaitProcess(
            f"gait_{self._births}", self.robot, self.parameters, self._settings, self.judge,
            self.seconds,
        )  # fmt: skip
        self.gaits.append(gait)
        return gait

    def kill_gait(self) -> None:
        """End the first gait without a word; what it sent is still under way."""
        del self.gaits[0]

    def reset_robot(self) -> None:
        """As the bridge's service: back to the start, the clock goes on, silence for a while."""
        self.simulation.reset()
        self._ear.reset(self.simulation.time)
        self._targets = self._sent = None
        self._silent_until = self.tick + RESET_SILENCE
        self.fallen = False
        self.judge.robot_was_reset()

    def restart_robot(self, ticks: int) -> None:
        """As if the bridge were killed and started again: nobody remembers who commanded."""
        self.reset_robot()
        self._ear = CommandInput(self.robot)
        self._silent_until = self.tick + ticks

    def disturb_robot(self, force: np.ndarray) -> None:
        """A force (3,) [N] on the torso during the next tick."""
        self.simulation.push(force, PERIOD)
