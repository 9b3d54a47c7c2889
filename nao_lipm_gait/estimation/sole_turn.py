"""How the torso turns about the vertical over its stance sole, by the joint angles."""

from math import remainder, tau

from nao_lipm_gait.estimation.level_frame import LevelFrame


class TurnOverSole:
    """Differences of the torso's heading over the sole that carries it."""

    def __init__(self) -> None:
        self._support = 0
        self._heading = 0.0

    def update(self, support: int, support_sole: LevelFrame) -> float | None:
        """The torso's turn [rad] since the last tick; None in one in which the support changes.

        support +1 left or -1 right.
        """
        before, self._heading = self._heading, support_sole.torso_yaw
        if support != self._support:
            self._support = support
            return None
        return remainder(self._heading - before, tau)
