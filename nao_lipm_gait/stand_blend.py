"""From whatever pose the robot is in into the stand, with no speed at both ends."""

import numpy as np

from nao_lipm_gait.signals import FloatArray


class StandBlend:
    """A way into the pose that is asked for, which itself may move meanwhile."""

    def __init__(self) -> None:
        self._begin: FloatArray | None = None
        self._time = 0.0

    @property
    def active(self) -> bool:
        return self._begin is not None

    def begin(self, position: FloatArray) -> None:
        """position (n,) [rad]: where the way begins."""
        self._begin = np.array(position, dtype=float)
        self._time = 0.0

    def apply(self, position: FloatArray, dt: float, duration: float) -> FloatArray:
        """(n,) [rad] of one tick; `position` is reached `duration` [s] after the beginning."""
        if self._begin is None:
            return position
        self._time += dt
        share = min(1.0, self._time / duration)
        smooth = share * share * (3.0 - 2.0 * share)
        blended: FloatArray = self._begin + smooth * (position - self._begin)
        if share >= 1.0:
            self._begin = None
        return blended
