"""Turns the soles with the ground, so that the torso stays upright on it.

The walk is planned for level ground. On a slope each sole is turned by the tilt of the ground under
it: the stance sole by what is measured there, the swing sole by what it will meet. Feet and CoM
move along the slope: a pendulum whose CoM does so has the same horizontal motion.
"""

from nao_lipm_gait.estimation.ground_tilt import GroundTilt
from nao_lipm_gait.walks.base import BodyTargets, SoleTarget
from robot_core.rate_limiter import limited_step
from robot_core.types import LEFT, RIGHT

TURN_RATE = 2.5
"""[rad/s] at which a sole turns in a walk, ..."""
RETURN_RATE = 0.1
"""... and at which it becomes level again in a stand."""


class GroundAdaptation:
    """Turns and moves the targets of a walk on level ground to the ground as it is."""

    def __init__(self) -> None:
        self._left = self._right = self._slope = 0.0

    def apply(
        self, targets: BodyTargets, support: int, ground: GroundTilt, dt: float, *, walks: bool
    ) -> BodyTargets:
        """The targets on this ground; the same ones if it is level.

        Args:
            targets: Targets of the body.
            support: Leg that supports when they take effect, LEFT or RIGHT.
            ground: Tilt of the ground.
            dt: Time [s] since the last tick.
            walks: The robot walks; in a stand the soles become level slowly.
        """
        if ground.stance == ground.slope == self._left == self._right == self._slope == 0.0:
            return targets
        step = (TURN_RATE if walks else RETURN_RATE) * dt
        left = self._left = limited_step(self._left, ground.under(LEFT), step)
        right = self._right = limited_step(self._right, ground.under(RIGHT), step)
        slope = self._slope = limited_step(self._slope, ground.slope, step)
        origin = (targets.left_sole if support == LEFT else targets.right_sole).x
        x, y, z = targets.com_in_q
        return targets.on_soles(
            (x, y, z - slope * (x - origin)),
            _on_slope(targets.left_sole, left, slope, origin),
            _on_slope(targets.right_sole, right, slope, origin),
        )


def _on_slope(sole: SoleTarget, turn: float, slope: float, origin: float) -> SoleTarget:
    rise = -slope * (sole.x - origin)
    return SoleTarget(sole.x, sole.y, sole.z + rise, sole.yaw, sole.pitch + turn, sole.roll)
