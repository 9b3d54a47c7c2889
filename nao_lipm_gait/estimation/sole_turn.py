"""How the torso turns about the vertical over its stance sole, by the joint angles."""

from math import atan2, remainder, tau

from nao_lipm_gait.estimation.com_measurement import level_heading
from nao_lipm_gait.kinematics.body_model import SolePose
from nao_lipm_gait.signals import Point3


class TurnOverSole:
    """Differences of the torso's heading over the sole that carries it."""

    def __init__(self) -> None:
        self._support = 0
        self._heading = 0.0

    def update(self, support: int, support_sole: SolePose, up: Point3) -> float | None:
        """The torso's turn [rad] since the last tick; None in one in which the support changes.

        support +1 left or -1 right; sole and vertical in the torso frame.
        """
        forward, left = level_heading(support_sole, up)
        before, self._heading = self._heading, atan2(left[0], forward[0])
        if support != self._support:
            self._support = support
            return None
        return remainder(self._heading - before, tau)
