"""A standing robot that tips: its CoM goes where no stiff stance brings it back from."""

from math import hypot

from nao_lipm_gait.types import Point3
from nao_lipm_gait.walks.pendulum import divergent_component

REST_TIME = 1.0
"""[s] of the mean that is the CoM at rest."""
VELOCITY_TIME = 0.02
"""[s] smoothing of the velocity."""


class Tipping:
    """Watches the measured CoM of a stand."""

    def __init__(self) -> None:
        self.forget()

    def forget(self) -> None:
        """Begin anew with the next measurement."""
        self._rest: tuple[float, float] | None = None
        self._last = (0.0, 0.0)
        self._velocity = (0.0, 0.0)

    def update(
        self, measured: Point3, k: float, limit: float, dt: float
    ) -> tuple[float, float, float, float] | None:
        """x, y [m], vx, vy [m/s] of the CoM beyond its rest once it tips; else None.

        measured: CoM in Q [m]; k [1/s]; limit [m]: on the divergent component, 0 = never.
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
        away_x, away_y = x - self._rest[0], y - self._rest[1]
        reach = hypot(divergent_component(away_x, vx, k), divergent_component(away_y, vy, k))
        if 0.0 < limit < reach:
            return away_x, away_y, vx, vy
        share = min(1.0, dt / REST_TIME)
        self._rest = self._rest[0] + share * away_x, self._rest[1] + share * away_y
        return None
