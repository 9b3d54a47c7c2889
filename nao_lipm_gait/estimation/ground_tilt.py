"""The tilt of the ground under the stance sole: slopes, and steps under a part of the sole.

The stance sole lies on the ground, so its pitch against the vertical is that of the ground. On
level ground it is small: constant errors (joint zeros, IMU mounting) and what the sole rocks. Only
what it grows beyond all that level walks show is the ground's; then all of the growth, until less
than half of that is left. So nothing changes on level ground. A robot that tips rocks on its heels
or toes, and its sole tilts more than the ground: where the ZMP is so far from the middle of the
sole, the tilt does not grow.
"""

from typing import final

from robot_core.types import LEFT

DEADBAND = 0.035
"""[rad] Growth in a steady walk on level ground, robots 0 to 5 at full speed: up to 0.017."""
RELEASE = 0.5
"""Share of the deadband below which the ground is level again."""
TILT_MAX = 0.13
"""[rad] Largest tilt."""
FOLLOW_TIME = 0.06
"""[s] in which the tilt follows that of the sole."""
SLOPE_TIME, LEVEL_TIME = 0.3, 0.1
"""[s] over which the tilt under both soles is averaged while the slope grows, and while it ends."""
SLOPE_MIN = 0.002
"""[rad] A smaller slope is none once the stance sole is level."""
USUAL_TIME = 4.0
"""[s] over which the pitch on level ground is averaged."""
SETTLE_TIME = 1.0
"""[s] The first steps from a stand tell the pitch on level ground."""
ZMP_TIME = 0.03
"""[s] over which the ZMP is averaged."""
FLAT_SHARE = 0.53
"""Share of the half length of a sole from its middle: where a walk puts its pendulum origins."""


@final
class GroundTilt:
    """Tilt of the ground along the walk; positive lowers the toes. It is 0 on level ground.

    Args:
        rear: End of the sole [m] in its frame.
        front: Its other end [m].

    Attributes:
        stance: Tilt [rad] under the stance sole.
        slope: Its average [rad] over some steps, which the next foot will meet.
    """

    __slots__ = (
        "_age", "_flat", "_middle", "_pitch", "_support", "_uneven", "_usual", "_zmp", "slope",
        "stance",
    )  # fmt: skip

    def __init__(self, rear: float, front: float) -> None:
        self._middle, self._flat = 0.5 * (front + rear), FLAT_SHARE * 0.5 * (front - rear)
        self.restart()

    def restart(self) -> None:
        """The robot does not walk."""
        self.stance = self.slope = 0.0
        self._age = self._pitch = self._usual = 0.0
        self._zmp = self._middle
        self._uneven = False
        self._support = LEFT

    def under(self, leg: int) -> float:
        """Tilt [rad] of the ground under a leg (LEFT or RIGHT), or where its foot will land."""
        return self.stance if leg == self._support else self.slope

    def update(self, support: int, pitch: float, zmp: float, widening: float, dt: float) -> None:
        """One tick of a walk.

        Args:
            support: Stance leg, LEFT or RIGHT.
            pitch: Pitch [rad] of its sole against the vertical, by joint angles and IMU.
            zmp: ZMP in the level frame of that sole, forward [m].
            widening: What the deadband is wider [rad] because the walk changes.
            dt: Time [s] since the last tick.
        """
        self._support = support
        self._age += dt
        self._zmp += dt / (ZMP_TIME + dt) * (zmp - self._zmp)
        rocks = abs(self._zmp - self._middle) > self._flat
        grows = (pitch - self._pitch) * (self._pitch - self._usual) > 0.0
        if not (rocks and grows):
            self._pitch += dt / min(FOLLOW_TIME + dt, self._age) * (pitch - self._pitch)
        growth = self._pitch - self._usual
        limit = DEADBAND + widening
        limit = RELEASE * limit if self._uneven else limit
        self._uneven = abs(growth) > limit and self._age > SETTLE_TIME
        if not self._uneven:
            self._usual += dt / min(USUAL_TIME, self._age) * (pitch - self._usual)
        self.stance = min(max(growth, -TILT_MAX), TILT_MAX) if self._uneven else 0.0
        ends = (self.stance - self.slope) * self.slope < 0.0
        self.slope += dt / (LEVEL_TIME if ends else SLOPE_TIME) * (self.stance - self.slope)
        if not self._uneven and abs(self.slope) < SLOPE_MIN:
            self.slope = 0.0
