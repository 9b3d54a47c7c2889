"""The CoM observer of the paper: two independent two-dimensional Kalman filters, eqs (12)-(14).

The state of each filter is [position, velocity] of the CoM along one axis of Q. The predicted mean
is the state of the pendulum, so only the covariance is kept here. Both axes use the same
deviations, so one covariance serves both; the paper leaves open whether they differ.
"""

from nao_lipm_gait.walks.lipm.com_observer import ComCorrection
from nao_lipm_gait.walks.lipm.parameters import LipmParameters
from nao_lipm_gait.walks.lipm.state import WalkState

MEASUREMENT_SIGMA = 0.02
"""Deviation of the measured CoM [m]. No parameter: the gain (13) depends on ratios only."""


class KalmanObserver:
    """Kalman filter with covariance P = [[p, c], [c, v]] and measurement matrix C = [1, 0].

    Args:
        position_sigma: Process noise of the position per tick [m].
        velocity_sigma: Process noise of the velocity per tick [m/s].
        measurement_sigma: Deviation of the measured position [m].
    """

    def __init__(self, position_sigma: float, velocity_sigma: float, measurement_sigma: float):
        self._q_position = position_sigma**2
        self._q_velocity = velocity_sigma**2
        self._r = measurement_sigma**2
        self._p = self._q_position
        self._c = 0.0
        self._v = self._q_velocity

    def predict(self, expected: WalkState, dt: float) -> None:
        """P' = A P A^T + Q with A = [[1, dt], [0, 1]], eq (12); the mean is `expected` itself."""
        self._p += dt * (2.0 * self._c + dt * self._v) + self._q_position
        self._c += dt * self._v
        self._v += self._q_velocity

    def correct(self, dx: float, dy: float) -> ComCorrection:
        """K times the innovation dx, dy [m], eq (14); P = P' - K C P'."""
        innovation_variance = self._p + self._r
        k_position = self._p / innovation_variance  # (13)
        k_velocity = self._c / innovation_variance  # (13) [1/s]
        self._v -= k_velocity * self._c
        self._c -= k_velocity * self._p
        self._p -= k_position * self._p
        return ComCorrection(k_position * dx, k_position * dy, k_velocity * dx, k_velocity * dy)


def kalman_observer(parameters: LipmParameters) -> KalmanObserver:
    """The observer with the deviations of the parameters."""
    p = parameters
    return KalmanObserver(p.position_sigma, p.velocity_sigma, MEASUREMENT_SIGMA)
