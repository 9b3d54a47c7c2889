"""How fast the stance sole turns on the ground, which only a yaw gyro can tell at once.

On a slippery floor the moment of the swing leg turns the stance foot. The joints do not see that:
they know how the torso turns over the sole, the gyro knows how it turns in the world.
"""

from nao_lipm_gait.estimation.level_frame import LevelFrame
from nao_lipm_gait.estimation.sole_turn import TurnOverSole
from nao_lipm_gait.points import dot
from nao_lipm_gait.signals import Point3

BIAS_TIME = 1.0
"""[s] of the average that learns the gyro's bias while the robot stands."""


class StanceTurn:
    """Turn of the stance sole from yaw gyro and joint angles."""

    def __init__(self) -> None:
        self._over_sole = TurnOverSole()
        self._bias = 0.0

    def update(
        self,
        support: int,
        support_sole: LevelFrame,
        angular_velocity: Point3,
        dt: float,
        at_rest: bool,
    ) -> float:
        """The sole's turn [rad] in this tick; zero in the one in which the support changes.

        support +1 left or -1 right; gyro [rad/s] in the torso frame; at_rest: the robot stands
        still, so what the gyro shows is its bias.
        """
        rate = dot(angular_velocity, support_sole.up)
        if at_rest:
            self._bias += min(1.0, dt / BIAS_TIME) * (rate - self._bias)
        over_sole = self._over_sole.update(support, support_sole)
        if at_rest or over_sole is None:
            return 0.0
        return (rate - self._bias) * dt - over_sole
