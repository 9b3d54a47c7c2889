"""A fall that can no longer be met, recognised before the robot lies.

The torso's tilt is led by its rate, tilt + horizon * d(tilt)/dt, and has to stay beyond the limit
for a few ticks: a robot that still recovers also tilts far or fast, but not both for long.
"""

from math import sqrt

from nao_lipm_gait.types import Point3

TICKS = 3
"""Control periods for which the limit has to be exceeded."""
SMALLEST_TILT = 0.05
"""[rad] below which a tilt has no direction."""


class FallDetector:
    """Says whether the torso is falling."""

    def __init__(self) -> None:
        self._count = 0

    def falls(
        self, up_in_torso: Point3, tilt: float, rate: Point3, limit: float, horizon: float
    ) -> bool:
        """One tick: the unit vertical in the torso frame, its angle to the torso's z axis [rad],
        the angular velocity [rad/s] in the torso frame, the limit [rad] and the horizon [s].
        """
        ux, uy, _ = up_in_torso
        wx, wy, _ = rate
        # From du/dt = u x w: the height of the torso's z axis changes by u_x w_y - u_y w_x.
        tilt_rate = (uy * wx - ux * wy) / max(sqrt(ux * ux + uy * uy), SMALLEST_TILT)
        beyond = tilt + horizon * tilt_rate > limit
        self._count = self._count + 1 if beyond else 0
        return self._count >= TICKS
