"""Detects that the robot is lifted.

The specific force times the mass is the sum of all contact forces. A robot whose soles carry next
to nothing and that is not in free fall is carried by something else.
"""

from math import hypot

from nao_lipm_gait.runtime.sole_loads import SoleLoads
from robot_core.types import GRAVITY, FloatArray

LIFT_TIME = 150_000_000
"""[ns] without load after which the robot counts as lifted: twice the time in which a body falls
from the height of a swing foot, sqrt(2 h / g) = 75 ms, so longer than any flight of a walk."""
GROUND_TIME = 200_000_000
"""[ns] of load on both soles after which a lifted robot is back on the ground."""
FREE_FALL = 0.5 * GRAVITY
"""[m/s^2] A smaller specific force is that of a robot in flight."""


class LiftWatch:
    """Decides once per tick.

    Args:
        loads: The loads on the soles.
    """

    def __init__(self, loads: SoleLoads) -> None:
        self._loads = loads
        self.restart()

    def restart(self) -> None:
        """Begin again with other stamps, as the loads have to."""
        self._lifted = False
        self._flight: int | None = None

    def update(self, stamp: int, specific_force: FloatArray) -> bool:
        """Whether the robot is lifted.

        Args:
            stamp: Stamp [ns] of the sensor frame.
            specific_force: (3,) [m/s^2] of the torso.
        """
        loads = self._loads
        if self._lifted:
            self._lifted = loads.are_known(stamp) and loads.both_time(stamp) < GROUND_TIME
            return self._lifted
        light = loads.light_time(stamp)
        if light > 0:
            if hypot(*specific_force.tolist()) < FREE_FALL:
                self._flight = stamp
            carried = light if self._flight is None else min(light, stamp - self._flight)
            self._lifted = carried > LIFT_TIME and loads.sensors_work
        return self._lifted
