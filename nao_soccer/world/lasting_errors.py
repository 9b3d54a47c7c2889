"""What more images do not improve: the part of the pose's covariance by errors that last.

The tilt and pan of a camera are wrong in the same way for seconds. Images do not average such a
bias, and how far it moves the pose depends on what they show: a line 4 m away moves it far more
than one at the feet. The shift of the estimate by a bias obeys the recursion of the filter itself
(separate-bias estimation, Friedland 1969): with the prior covariance P, the Jacobians H of the
pose and G of the bias, and the weight W of the percepts,

    b' = (P^-1 + H' W H)^-1 (P^-1 b - H' W G).
"""

import numpy as np

from nao_soccer.world.field_map import FieldMap
from nao_soccer.world.likelihood import Evidence, linearized
from robot_core.types import FloatArray

LASTING = 0.67
"""Share of the deviations that vision states for tilt and pan that lasts for seconds."""


class LastingErrors:
    """How far lasting errors of the camera have moved the pose.

    Attributes:
        shift: (3, 2) Change of x, y [m] and yaw [rad] in `field` by a standard deviation of the
            errors along and across the line of sight.
    """

    def __init__(self) -> None:
        self.shift: FloatArray = np.zeros((3, 2))

    def move(self, jacobian: FloatArray) -> None:
        """Carry the shift with the pose; its derivative (3, 3) by the pose before."""
        self.shift = jacobian @ self.shift

    def see(
        self, evidence: Evidence, pose: FloatArray, covariance: FloatArray, field: FieldMap
    ) -> None:
        """Add an image: estimate (3,), covariance (3, 3) of the particles before it."""
        rows = linearized(evidence, pose, field)
        prior = np.linalg.inv(covariance)
        weighted = rows.pose.T * rows.weight
        change: FloatArray = prior @ self.shift - LASTING * weighted @ rows.bias
        self.shift = np.asarray(np.linalg.solve(prior + weighted @ rows.pose, change), dtype=float)

    def mirror(self) -> None:
        """Carry the shift to the mirror pose: x and y are turned by half a turn, yaw is kept."""
        self.shift[:2] *= -1.0

    @property
    def covariance(self) -> FloatArray:
        """(3, 3) of the pose by these errors."""
        return self.shift @ self.shift.T
