"""On which side a robot lies, from the accelerometer alone.

At rest the specific force points upwards; the torso's axis that it lies along says which side is
up. It has to stay so for a while: a robot that still rolls has no side.
"""

from math import sqrt

from nao_lipm_gait.motion.keyframes import Posture
from nao_lipm_gait.types import GRAVITY, Point3

SMOOTHING = 0.1
"""[s] of the specific force."""
REST_TIME = 0.4
"""[s] for which the side has to stay the same and the force to be gravity's."""
FORCE_SLACK = 0.15
"""Share of g by which the force may differ from it at rest."""
UPRIGHT = 0.7
"""Share of g along the torso's z axis from which on the robot does not lie."""


class LyingSideDetector:
    """Says on which side the robot has come to rest."""

    def __init__(self) -> None:
        self._force: Point3 | None = None
        self._side: Posture | None = None
        self._time = 0.0

    @property
    def force(self) -> Point3:
        """Smoothed specific force [m/s^2] in the torso frame."""
        return self._force or (0.0, 0.0, GRAVITY)

    def update(self, specific_force: Point3, dt: float) -> Posture | None:
        """One tick; the side, or None while the robot moves or is upright."""
        if self._force is None:
            self._force = specific_force
        share = min(1.0, dt / SMOOTHING)
        x, y, z = (a + share * (b - a) for a, b in zip(self._force, specific_force, strict=True))
        self._force = (x, y, z)
        side = _side(x, y, z)
        self._time = self._time + dt if side is not None and side is self._side else 0.0
        self._side = side
        return side if self._time >= REST_TIME else None

    def restart(self) -> None:
        """The robot has moved; begin to watch anew."""
        self._side = None
        self._time = 0.0


def _side(x: float, y: float, z: float) -> Posture | None:
    size = sqrt(x * x + y * y + z * z)
    if abs(size - GRAVITY) > FORCE_SLACK * GRAVITY or z > UPRIGHT * GRAVITY:
        return None
    if abs(x) >= abs(y):
        return Posture.LYING_BACK if x > 0.0 else Posture.LYING_FRONT
    return Posture.LYING_RIGHT if y > 0.0 else Posture.LYING_LEFT
