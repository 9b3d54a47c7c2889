"""From whatever pose the robot is in into the stand, with no speed at both ends."""

from collections.abc import Sequence

import numpy as np

from nao_lipm_gait.types import FloatArray

REACHED = 0.005
"""[rad] from the stand for every joint: what is less needs no time."""


class StandBlend:
    """A way into the pose that is asked for, which itself may move meanwhile."""

    def __init__(self) -> None:
        self._begin: FloatArray | None = None
        self._watched: list[int] = []
        self._time = 0.0

    @property
    def active(self) -> bool:
        return self._begin is not None

    def begin(self, position: FloatArray, watched: Sequence[int] = ()) -> None:
        """Position (n,) [rad]: where the way begins; watched: joints that end it early once they
        are there. Without any it takes its whole time, in which a robot comes to rest.
        """
        self._watched = list(watched)
        self._begin = np.array(position, dtype=float)
        self._time = 0.0

    def apply(self, position: FloatArray, dt: float, duration: float) -> FloatArray:
        """(n,) [rad] of one tick; `position` is reached `duration` [s] after the beginning."""
        if self._begin is None:
            return position
        self._time += dt
        share = min(1.0, self._time / duration)
        smooth = share * share * (3.0 - 2.0 * share)
        way = position - self._begin
        blended: FloatArray = self._begin + smooth * way
        if share >= 1.0 or (self._watched and np.abs(way[self._watched]).max() < REACHED):
            self._begin = None
        return blended
