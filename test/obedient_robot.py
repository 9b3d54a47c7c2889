"""A robot for tests of the gait without a simulator."""

import numpy as np

from nao_lipm_gait.gait import Gait
from nao_lipm_gait.parameters import GaitParameters
from robot_core.motion.library import MotionLibrary
from robot_core.robot import RobotDescription
from robot_core.types import (
    STANDSTILL,
    FloatArray,
    GaitState,
    JointTargets,
    SensorFrame,
    VelocityCommand,
)

PERIOD = 10_000_000
"""Time [ns] between two frames."""
UPRIGHT = (0.0, 0.0, 9.81)
"""Specific force [m/s^2] of an upright torso at rest."""
PARAMETERS = GaitParameters(torso_pitch=0.0, yaw_from_lean=False)
"""Parameters for a torso that stays upright whatever the legs do."""


class ObedientRobot:
    """A gait whose joints reach their targets at once; only the test moves the torso.

    Args:
        robot: Robot of the gait.
        parameters: Parameters of the gait.
        motions: Motions of the gait; None = the shipped ones.

    Attributes:
        gait: The gait under test.
        stamp: Stamp [ns] of the next frame.
        shown: Joint angles (n,) [rad] of the next frames; the delay is `feedback_delay`.
        force: Specific force (3,) [m/s^2] of the torso.
        rate: Angular velocity (3,) [rad/s] of the torso.
    """

    def __init__(
        self,
        robot: RobotDescription,
        parameters: GaitParameters = PARAMETERS,
        motions: MotionLibrary | None = None,
    ) -> None:
        self.gait = Gait(robot, parameters, motions=motions)
        self.stamp = 0
        self.shown = [np.array(robot.stand_pose)] * max(1, round(parameters.feedback_delay / 0.01))
        self.force = UPRIGHT
        self.rate = (0.0, 0.0, 0.0)

    @property
    def joints(self) -> FloatArray:
        """Joint angles (n,) [rad] that the last targets reached."""
        return self.shown[-1]

    def frame(self, joints: FloatArray | None = None) -> SensorFrame:
        """The next frame; joints: (n,) [rad] in place of the shown ones."""
        joints = self.shown[0] if joints is None else joints
        rate, force = np.array(self.rate), np.array(self.force)
        return SensorFrame(self.stamp, joints, rate, force)

    def tick(
        self, command: VelocityCommand = STANDSTILL, frame: SensorFrame | None = None
    ) -> JointTargets:
        """One tick; frame: in place of the next one."""
        targets = self.gait.step(self.frame() if frame is None else frame, command)
        self.stamp += PERIOD
        self.shown = [*self.shown[1:], targets.position]
        return targets

    def run(self, seconds: float, command: VelocityCommand = STANDSTILL) -> list[JointTargets]:
        """Ticks for some time [s]."""
        return [self.tick(command) for _ in range(round(seconds * 100))]

    def states(self, seconds: float, command: VelocityCommand = STANDSTILL) -> list[GaitState]:
        """The modes of some time [s], each named when it begins."""
        found: list[GaitState] = []
        for _ in range(round(seconds * 100)):
            self.tick(command)
            if not found or found[-1] is not self.gait.state:
                found.append(self.gait.state)
        return found

    def lose_frame(self) -> None:
        """A frame that does not arrive: the joints hold their last targets."""
        self.stamp += PERIOD
        self.shown = [*self.shown[1:], self.shown[-1]]

    def lie_down(self, force: tuple[float, float, float]) -> None:
        """Lie with this specific force [m/s^2] when frames come again after 10 s."""
        self.force = force
        self.stamp += 10**10
