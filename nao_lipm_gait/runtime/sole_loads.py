"""Whether the soles still carry the robot: asked only while there is no IMU to tell a fall."""

from nao_lipm_gait.types import GRAVITY

SHARE = 0.3
"""Of the robot's weight; soles that carry less do not carry it."""
PATIENCE = 100_000_000
"""[ns] Longer than a walking robot is in the air."""
OLDEST = 300_000_000
"""[ns] An older load says nothing."""


class SoleLoads:
    """The normal forces on both soles."""

    def __init__(self, mass: float) -> None:
        """Mass [kg] of the robot."""
        self._least = SHARE * mass * GRAVITY
        self._force: list[tuple[int, float] | None] = [None, None]
        self._light_since: int | None = None

    def begin_anew(self) -> None:
        self._force = [None, None]
        self._light_since = None

    def see(self, side: int, stamp: int, force: float) -> None:
        """side: 0 left, 1 right; force [N] along the normal of the sole."""
        self._force[side] = stamp, force
        left, right = self._force
        if left is None or right is None:
            return
        light = left[1] + right[1] < self._least
        if not light:
            self._light_since = None
        elif self._light_since is None:
            self._light_since = stamp

    def carry_nothing(self, stamp: int) -> bool:
        """At `stamp` [ns]; false where nobody can tell."""
        since = self._light_since
        known = all(each is not None and stamp - each[0] < OLDEST for each in self._force)
        return known and since is not None and stamp - since >= PATIENCE
