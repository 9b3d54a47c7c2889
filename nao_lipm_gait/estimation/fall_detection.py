"""Falls: of a walking robot by CoM and torso; of a standing one that tips, by its CoM."""

from collections.abc import Sequence
from math import hypot, sqrt

from nao_lipm_gait.walks.pendulum import divergent_component
from robot_core.types import LEFT, Point2, Point3

FALL_HORIZON = 0.1
"""Time [s] over which CoM and tilt are predicted."""
FALL_BEYOND = 0.02
"""Distance [m] of the predicted CoM beyond all soles from which on a fall is detected."""
FALL_TILT = 0.65
"""Predicted torso tilt [rad] above which a fall is detected."""
FALL_TICKS = 3
"""Ticks in a row for which a prediction must exceed its limit."""
SMALLEST_TILT = 0.05
"""Tilt [rad] below which its direction is not defined."""
COM_TIME = 0.04
"""Time constant [s] by which the velocity of the CoM is smoothed."""


class ComBeyondSoles:
    """How far the CoM is going to be beyond all that can carry it: the soles, and the next one.

    The pendulum drives a CoM beyond the soles away from them ever faster, and a foot that lands
    short of it cannot turn it back. Those that a step still saves are over the place where their
    swing foot lands.

    Args:
        outline: Outline of the left sole in its frame, x and y [m].
    """

    def __init__(self, outline: Sequence[Point2]) -> None:
        self._toe = max(x for x, _ in outline)
        self._heel = min(x for x, _ in outline)
        self._outer = max(y for _, y in outline)
        self._inner = min(y for _, y in outline)
        self.reset()

    def reset(self) -> None:
        """Take the CoM of the next measurement as at rest."""
        self._support = 0
        self._last = self._velocity = (0.0, 0.0)

    def update(
        self, support: int, com: Point3, other: Point3, landing: Point2 | None, dt: float
    ) -> float:
        """One tick, in the level frame of the supporting sole.

        Args:
            support: Supporting leg, LEFT or RIGHT.
            com: Measured CoM [m].
            other: The other sole [m].
            landing: Where that is going to land [m]; None if not known.
            dt: Time [s] since the last tick.

        Returns:
            Distance [m] of the predicted CoM beyond the soles ahead, back or to a side, whichever
            is larger; negative if it is over them.
        """
        (x, y, _), (vx, vy) = com, self._velocity
        if support == self._support:
            share = dt / (COM_TIME + dt)
            vx += share * ((x - self._last[0]) / dt - vx)
            vy += share * ((y - self._last[1]) / dt - vy)
        self._support, self._last, self._velocity = support, (x, y), (vx, vy)
        first_x = last_x = other[0]
        first_y = last_y = other[1]
        if landing is not None:
            first_x, last_x = min(first_x, landing[0]), max(last_x, landing[0])
            first_y, last_y = min(first_y, landing[1]), max(last_y, landing[1])
        outer, inner = self._outer, self._inner
        if support == LEFT:
            left, right = max(outer, last_y - inner), min(inner, first_y - outer)
        else:
            left, right = max(-inner, last_y + outer), min(-outer, first_y + inner)
        x += FALL_HORIZON * vx
        y += FALL_HORIZON * vy
        ahead, back = max(0.0, last_x) + self._toe, min(0.0, first_x) + self._heel
        return max(x - ahead, back - x, y - left, right - y)


class FallDetector:
    """Detects a fall that can no longer be prevented, before the robot lies.

    CoM and tilt are predicted by their rates. The tilt, tilt + horizon * d(tilt)/dt, also shows the
    falls of a torso that bends over its feet. One of them must exceed its limit for some ticks,
    because a robot that recovers also gets there, but not for long.
    """

    def __init__(self) -> None:
        self._count = 0

    def update(
        self, up_in_torso: Point3, tilt: float, rate: Point3, beyond: float,
        horizon: float = FALL_HORIZON,
    ) -> bool:  # fmt: skip
        """One tick.

        Args:
            up_in_torso: Unit vertical in the torso frame.
            tilt: Angle [rad] between the vertical and the torso's z axis.
            rate: Angular velocity [rad/s] of the torso in the torso frame.
            beyond: See `ComBeyondSoles.update` [m].
            horizon: Time [s] by which the tilt is predicted.

        Returns:
            Whether the robot falls.
        """
        ux, uy, _ = up_in_torso
        wx, wy, _ = rate
        # From du/dt = u x w: the height of the torso's z axis changes by u_x w_y - u_y w_x.
        tilt_rate = (uy * wx - ux * wy) / max(sqrt(ux * ux + uy * uy), SMALLEST_TILT)
        exceeded = beyond > FALL_BEYOND or tilt + horizon * tilt_rate > FALL_TILT
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
