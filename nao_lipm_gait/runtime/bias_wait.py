"""The stand before the first walk, in which the gait learns the bias of its gyro."""

from robot_core.types import GaitState

DRIFT_MAX = 9e-4
"""Deviation [rad/s] of the heading's drift below which the gyro's bias counts as known: 1.5 deg in
half a minute. White noise of 0.005 rad/s per sample takes 17 s without a yaw gyro, else 5 s."""
LONGEST_BIAS_WAIT = 20.0
"""Longest time [s] to stand, unless set otherwise."""


class BiasWait:
    """Whether the robot must still stand until its gyro's bias is known.

    Args:
        longest: Longest time [s] to stand; 0 does not wait.

    Attributes:
        longest: Longest time [s] to stand.
        over: The robot may walk.
        known: The wait is over because the bias is known.
    """

    def __init__(self, longest: float) -> None:
        self.longest = longest
        self.restart()

    def restart(self) -> None:
        """Begin again, as after a gap in the sensor frames."""
        self.over = self.longest == 0.0
        self.known = False
        self._stands_since: int | None = None

    def update(self, stamp: int, state: GaitState, drift_sigma: float | None) -> bool:
        """Whether to stand in this tick.

        Args:
            stamp: Stamp [ns] of the sensor frame.
            state: Mode of the gait.
            drift_sigma: Deviation [rad/s] of the drift of a held heading, see
                `Gait.heading_drift_sigma`; None before the first tick.
        """
        if self.over:
            return False
        if state is not GaitState.STAND:
            self._stands_since = None
            return False
        if self._stands_since is None or stamp < self._stands_since:  # or the clock was set back
            self._stands_since = stamp
        self.known = drift_sigma is not None and drift_sigma < DRIFT_MAX
        self.over = self.known or stamp - self._stands_since > self.longest * 1e9
        return not self.over
