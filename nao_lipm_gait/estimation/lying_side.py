"""The side on which a robot lies, from the accelerometer alone.

At rest the specific force points up. The torso axis nearest to it gives the side, but only
after it has been constant for some time; a rolling robot has none.
"""

from math import sqrt

from robot_core.motion.keyframes import Posture
from robot_core.types import GRAVITY, Point3

SMOOTHING_TIME = 0.1
"""Time constant [s] by which the specific force is smoothed."""
REST_TIME = 0.4
"""Time [s] for which the side must not change and the force must be gravity."""
FORCE_TOLERANCE = 0.15
"""Largest difference of the force from g at rest, as a share of g."""
UPRIGHT_SHARE = 0.7
"""Share of g along the torso's z axis above which the robot does not lie."""


class LyingSideDetector:
    """Detects on which side the robot has come to rest."""

    def __init__(self) -> None:
        self._force: Point3 | None = None
        self._side: Posture | None = None
        self._time = 0.0

    @property
    def force(self) -> Point3:
        """Smoothed specific force [m/s^2] in the torso frame."""
        return self._force or (0.0, 0.0, GRAVITY)

    def update(self, specific_force: Point3, dt: float) -> Posture | None:
        """One tick: accelerometer [m/s^2] in the torso frame, dt [s] since the last tick.

        Returns:
            The side; None while the robot moves or is upright.
        """
        if self._force is None:
            self._force = specific_force
        share = min(1.0, dt / SMOOTHING_TIME)
        x, y, z = (a + share * (b - a) for a, b in zip(self._force, specific_force, strict=True))
        self._force = (x, y, z)
        side = _side(x, y, z)
        self._time = self._time + dt if side is not None and side is self._side else 0.0
        self._side = side
        return side if self._time >= REST_TIME else None

    def restart(self) -> None:
        """Wait for `REST_TIME` again, because the robot moves."""
        self._side = None
        self._time = 0.0


def _side(x: float, y: float, z: float) -> Posture | None:
    size = sqrt(x * x + y * y + z * z)
    if abs(size - GRAVITY) > FORCE_TOLERANCE * GRAVITY or z > UPRIGHT_SHARE * GRAVITY:
        return None
    if abs(x) >= abs(y):
        return Posture.LYING_BACK if x > 0.0 else Posture.LYING_FRONT
    return Posture.LYING_RIGHT if y > 0.0 else Posture.LYING_LEFT
