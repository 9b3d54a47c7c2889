"""Falls: of a walking robot by the torso's tilt, of a standing one by its CoM."""

from math import hypot, sqrt

from nao_lipm_gait.walks.pendulum import divergent_component
from robot_core.types import Point3

FALL_TILT = 0.5
"""Predicted torso tilt [rad] above which a fall is detected."""
FALL_HORIZON = 0.1
"""Time [s] over which the tilt is predicted."""
FALL_TICKS = 3
"""Ticks in a row for which the predicted tilt must exceed the limit."""
SMALLEST_TILT = 0.05
"""Tilt [rad] below which its direction is not defined."""


class FallDetector:
    """Detects a fall that can no longer be prevented, before the robot lies.

    The tilt is predicted by its rate, tilt + horizon * d(tilt)/dt. It must exceed the limit for
    some ticks, because a robot that recovers also tilts far or fast, but not both for long.
    """

    def __init__(self) -> None:
        self._count = 0

    def update(
        self, up_in_torso: Point3, tilt: float, rate: Point3, horizon: float = FALL_HORIZON
    ) -> bool:
        """One tick.

        Args:
            up_in_torso: Unit vertical in the torso frame.
            tilt: Angle [rad] between the vertical and the torso's z axis.
            rate: Angular velocity [rad/s] of the torso in the torso frame.
            horizon: Time [s] by which the tilt is predicted.

        Returns:
            Whether the robot falls.
        """
        ux, uy, _ = up_in_torso
        wx, wy, _ = rate
        # From du/dt = u x w: the height of the torso's z axis changes by u_x w_y - u_y w_x.
        tilt_rate = (uy * wx - ux * wy) / max(sqrt(ux * ux + uy * uy), SMALLEST_TILT)
        exceeded = tilt + horizon * tilt_rate > FALL_TILT
        self._count = self._count + 1 if exceeded else 0
        return self._count >= FALL_TICKS


REST_TIME = 1.0
"""Time constant [s] of the mean that is the CoM's rest position."""
VELOCITY_TIME = 0.02
"""Time constant [s] by which the CoM's velocity is smoothed."""


class TippingDetector:
    """Detects that a standing robot tips: its stiff legs cannot bring the CoM back any more."""

    def __init__(self) -> None:
        self.reset()

    def reset(self) -> None:
        """Take the next measurement as the rest position."""
        self._rest: tuple[float, float] | None = None
        self._last = (0.0, 0.0)
        self._velocity = (0.0, 0.0)

    def update(
        self, measured: Point3, k: float, limit: float, dt: float
    ) -> tuple[float, float, float, float] | None:
        """One tick of a stand.

        Args:
            measured: Measured CoM [m] in Q.
            k: Natural frequency [1/s] of the pendulum.
            limit: Limit [m] of the divergent component; 0 = no detection.
            dt: Time [s] since the last tick.

        Returns:
            x, y [m], vx, vy [m/s] of the CoM relative to its rest position if the robot tips.
        """
        now = measured[0], measured[1]
        if self._rest is None:
            self._rest = self._last = now
            return None
        share = min(1.0, dt / VELOCITY_TIME)
        (x, y), (last_x, last_y), (vx, vy) = now, self._last, self._velocity
        vx += share * ((x - last_x) / dt - vx)
        vy += share * ((y - last_y) / dt - vy)
        self._last, self._velocity = now, (vx, vy)
        offset_x, offset_y = x - self._rest[0], y - self._rest[1]
        divergent = hypot(
            divergent_component(offset_x, vx, k), divergent_component(offset_y, vy, k)
        )
        if 0.0 < limit < divergent:
            return offset_x, offset_y, vx, vy
        share = min(1.0, dt / REST_TIME)
        self._rest = self._rest[0] + share * offset_x, self._rest[1] + share * offset_y
        return None
