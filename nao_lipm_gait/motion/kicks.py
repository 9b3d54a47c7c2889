"""Which kick for a ball that lies there and shall go that way."""

import math
from collections.abc import Iterable
from dataclasses import dataclass

from nao_lipm_gait.motion.keyframes import Motion

REACH = 0.03
"""[m] by which the ball may be off the spot of a kick."""
ANGLE_WEIGHT = 0.05
"""[m/rad]: a direction that is wrong by 1 rad is as bad as a ball that is off by this."""


@dataclass(frozen=True, slots=True)
class KickChoice:
    """A kick that can be made now."""

    motion: Motion
    offset: float
    """[m] between the ball and the spot of the kick."""
    turn: float
    """[rad] from where the kick sends the ball to where it shall go."""


def choose_kick(
    motions: Iterable[Motion], x: float, y: float, direction: float, reach: float = REACH
) -> KickChoice | None:
    """The kick that suits best, or None if the ball is out of reach of all.

    Args:
        x, y: [m] of the ball, seen from the middle between the soles, x forward.
        direction: [rad] in which the ball shall go, counter-clockwise from forward.
    """
    found: KickChoice | None = None
    least = math.inf
    for motion in motions:
        kick = motion.kick
        if kick is None:
            continue
        offset = math.hypot(x - kick.x, y - kick.y)
        turn = math.remainder(direction - kick.direction, math.tau)
        cost = offset + ANGLE_WEIGHT * abs(turn)
        if offset <= reach and cost < least:
            found, least = KickChoice(motion, offset, turn), cost
    return found
