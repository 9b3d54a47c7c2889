"""A further lean of the torso while the heading is held.

Without a yaw gyro a turn shows in the roll gyro only as far as the torso leans (see
`estimation/lean_turn.py`). Curves are walked upright: a lean in them costs robots their stand, and
nobody holds a heading there.
"""

RATE = 0.1
"""[rad/s] at which the torso leans forward and comes back."""


class HeadingLean:
    """Moves towards what is wanted."""

    def __init__(self) -> None:
        self._angle = 0.0

    def towards(self, wanted: float, dt: float) -> float:
        """The lean [rad] of this tick."""
        step = RATE * dt
        self._angle += min(max(wanted - self._angle, -step), step)
        return self._angle
