"""Extension of the paper: shorter strides while the walk sways.

A walk that is about to fall often sways to the sides for a second or two before: on a hard floor,
or on soles that are not level, long steps make more sway than the next steps take out. The sway
shows in the innovation of the CoM to the side, which varies by a millimetre in a calm walk. The
walk then uses less of its step limit forward, and takes it back the sooner the calmer it is. Steps
to the side and turns sway more, and shorter strides forward would not change that: only long
strides forward are watched.
"""

from math import sqrt

SWAY_TIME = 0.5
"""Averaging time [s] of the sway, about two steps."""
START_TIME = 1.0
"""[s] The first steps from a stand, or after another direction, always sway."""
SHARE_MIN = 0.4
"""Smallest share of the step limit."""
WATCHED_SHARE = 0.35
"""Share of the step limit from which on strides are watched; below the smallest that is left."""
GAIN = 0.6
"""Share that is given up per relative excess of the sway."""
RECOVERY_TIME = 40.0
"""Time [s] in which all of the step limit is taken back at the limit of the sway, or unwatched."""
CALM_TIME = 6.0
"""Time [s] in which it would be taken back without any sway, beside that."""


class SwayLimit:
    """Share of the step limit forward that the walk may use.

    Args:
        limit: Sway [m], a standard deviation, from which on strides become shorter; 0 disables it.

    Attributes:
        share: The share; 1 = all.
    """

    def __init__(self, limit: float) -> None:
        self.share = 1.0
        self._watched = False
        self.set_limit(limit)
        self.begin()

    def set_limit(self, limit: float) -> None:
        """Use another limit [m]; the share that was found stays, unless 0 disables it."""
        self._limit = limit
        if limit <= 0.0:
            self.share = 1.0

    def begin(self) -> None:
        """Begin a walk; the share that was found stays."""
        self._mean = self._square = self._time = 0.0

    def watch(self, forward_share: float) -> None:
        """A step begins that uses this share of the step limit forward."""
        watched = forward_share > WATCHED_SHARE
        if watched and not self._watched:
            self.begin()
        self._watched = watched

    def update(self, innovation: float, dt: float) -> None:
        """One tick.

        Args:
            innovation: Measured minus expected CoM, to the left in Q [m].
            dt: Time since the last tick [s].
        """
        if self._limit <= 0.0:
            return
        self.share += dt / RECOVERY_TIME
        if self._watched:
            self._time += dt
            part = dt / min(self._time, SWAY_TIME)
            self._mean += part * (innovation - self._mean)
            self._square += part * (innovation * innovation - self._square)
            if self._time >= START_TIME:
                variance = max(0.0, self._square - self._mean * self._mean)
                excess = sqrt(variance) / self._limit - 1.0
                self.share += max(0.0, -excess) * dt / CALM_TIME
                self.share = min(self.share, max(SHARE_MIN, 1.0 - GAIN * max(0.0, excess)))
        self.share = min(1.0, self.share)
