"""Blends from any pose into the stand, with zero speed at both ends."""

from collections.abc import Sequence

import numpy as np

from robot_core.rate_limiter import eased
from robot_core.types import FloatArray

STAND_TIME = 0.8
"""Time to move from any pose to the stand [s]."""
SET_DOWN_TIME = 0.2
"""The same for a robot that must not take the next step [s]."""
REACHED = 0.005
"""Distance of a joint from the stand that needs no blending [rad]."""


class StandBlend:
    """Blends into a target pose, which may move meanwhile."""

    def __init__(self) -> None:
        self._begin: FloatArray | None = None
        self._watched: list[int] = []
        self._time, self._duration = 0.0, STAND_TIME

    @property
    def active(self) -> bool:
        """Whether a blend is running."""
        return self._begin is not None

    def begin(
        self, position: FloatArray, watched: Sequence[int] = (), time: float = STAND_TIME
    ) -> None:
        """Start a blend.

        Args:
            position: Joint angles to start from (n,) [rad].
            watched: Joints that end the blend early once all of them are at the target; without
                any it lasts its whole duration, so that the robot comes to rest.
            time: Duration [s].
        """
        self._watched = list(watched)
        self._begin = np.array(position, dtype=float)
        self._time, self._duration = 0.0, time

    def apply(self, position: FloatArray, dt: float) -> FloatArray:
        """Joint targets of one tick.

        Args:
            position: Target pose (n,) [rad].
            dt: Time since the last tick [s].

        Returns:
            Blended joint targets (n,) [rad].
        """
        if self._begin is None:
            return position
        self._time += dt
        share = min(1.0, self._time / self._duration)
        way = position - self._begin
        blended: FloatArray = self._begin + eased(share) * way
        if share >= 1.0 or (self._watched and np.abs(way[self._watched]).max() < REACHED):
            self._begin = None
        return blended
