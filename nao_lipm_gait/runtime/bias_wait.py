"""The stand before the first walk, in which the gait learns the bias of its gyro."""

from nao_lipm_gait.types import GaitState

BIAS_KNOWN = 3.2e-4
"""Deviation [rad/s] below which the gyro's bias counts as known. At a lean of 0.16 rad it turns the
robot by 0.1 deg/s."""


LONGEST_BIAS_WAIT = 5.0
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

    def update(self, stamp: int, state: GaitState, bias_sigma: float | None) -> bool:
        """Whether to stand in this tick.

        Args:
            stamp: Stamp [ns] of the sensor frame.
            state: Mode of the gait.
            bias_sigma: Deviation [rad/s] of the gyro's bias; None before the first tick.
        """
        if self.over:
            return False
        if state is not GaitState.STAND:
            self._stands_since = None
            return False
        if self._stands_since is None:
            self._stands_since = stamp
        self.known = bias_sigma is not None and bias_sigma < BIAS_KNOWN
        self.over = self.known or stamp - self._stands_since > self.longest * 1e9
        return not self.over
