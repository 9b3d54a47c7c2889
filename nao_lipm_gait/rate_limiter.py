"""A further lean of the torso while the heading is held.

Without a yaw gyro a turn shows in the roll gyro only as far as the torso leans (see
`estimation/lean_turn.py`). Curves are walked upright: a lean in them costs robots their stand, and
nobody holds a heading there.

Height and lean of the body, which follow a change of the parameters and never jump with it.
"""

from nao_lipm_gait.walks.base import BodyTargets

HEIGHT_RATE = 0.05
"""[m/s] at which the CoM rises and sinks."""
PITCH_RATE = 0.1
"""[rad/s] at which the torso leans."""


class EasedPose:
    """Moves towards what the walk wants."""

    def __init__(self) -> None:
        self._last: tuple[float, float] | None = None

    def begin_anew(self) -> None:
        """The next height and lean are taken as they are."""
        self._last = None

    def towards(self, wanted: BodyTargets, dt: float) -> BodyTargets:
        """The wanted targets, with height and lean as they can be `dt` [s] after the last ones."""
        x, y, height = wanted.com_in_q
        pitch = wanted.torso_pitch
        if self._last is None or self._last == (height, pitch):
            self._last = (height, pitch)
            return wanted
        height = _stepped(self._last[0], height, HEIGHT_RATE * dt)
        pitch = _stepped(self._last[1], pitch, PITCH_RATE * dt)
        self._last = (height, pitch)
        return wanted.posed((x, y, height), pitch)


def _stepped(last: float, wanted: float, step: float) -> float:
    return min(max(wanted, last - step), last + step)


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
