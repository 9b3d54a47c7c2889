"""Before the first walk: does the torso of the robot that stands lean as its joints say?

A leg joint with a wrong zero, an IMU that is mounted askew and a floor that slopes look the same
here, so the robot may walk; `nao_gait calibrate --zeros` tells them apart, in several poses.
"""

from math import acos, degrees, hypot

import numpy as np

from nao_lipm_gait.whole_body.body_model import BodyModel
from robot_core.robot import RobotDescription
from robot_core.types import SensorFrame

LEAN_MAX = 0.065
"""[rad] Largest lean that needs no explanation. Of 3,000 NAOs and as many Brunos of the
reference plant one in a thousand leans by 0.053 by its joints and IMU, the worst by 0.063."""
STAND_TICKS = 30
"""Ticks of a quiet stand over which the lean is averaged."""
QUIET = 0.02
"""[rad] Largest movement of a joint in them."""
QUIET_TURN = 0.05
"""[rad/s] Largest change of the gyro from their first to their second half: a robot that rocks on
its soles, as a T1 does for 3 s after it was set down, leans by 0.08 rad with joints at rest."""


class StandCheck:
    """Judges the first quiet stand; one tick after the other.

    Attributes:
        warning: What is wrong; empty if nothing.
    """

    def __init__(self, robot: RobotDescription) -> None:
        self._body = BodyModel(robot)
        self._frames: list[SensorFrame] = []
        self.done = False
        self.warning = ""

    def update(self, frame: SensorFrame, *, stands: bool) -> None:
        """One tick.

        Args:
            frame: Sensors without the errors that were calibrated.
            stands: The robot stands on both soles by its own motors.
        """
        self._frames.append(frame)
        moved = np.abs(frame.joint_position - self._frames[0].joint_position).max()
        if not stands or moved > QUIET:
            self._frames.clear()
        if len(self._frames) < STAND_TICKS:
            return
        rates = np.array([each.angular_velocity[:2] for each in self._frames])
        turn = np.subtract(*(half.mean(axis=0) for half in np.split(rates, 2)))
        if hypot(*turn.tolist()) > QUIET_TURN:
            del self._frames[: STAND_TICKS // 2]
            return
        self.done = True
        force = np.mean([each.linear_acceleration for each in self._frames], axis=0)
        vertical = self._body.vertical(np.mean([f.joint_position for f in self._frames], axis=0))
        lean = acos(min(1.0, float(force @ vertical / np.linalg.norm(force))))
        self._frames.clear()
        if lean > LEAN_MAX:
            self.warning = (
                f"the robot stands {degrees(lean):.1f} deg askew by its IMU; allowed: "
                f"{degrees(LEAN_MAX):.1f} deg from upright by its joints; does the floor slope, is "
                "the IMU mounted askew, or the zero of a leg joint wrong? `nao_gait calibrate "
                "--zeros` tells"
            )
