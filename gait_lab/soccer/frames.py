"""The moments of a match that a replay shows."""

from dataclasses import dataclass
from typing import NamedTuple

from nao_lipm_gait.types import Point2


class RobotFrame(NamedTuple):
    """One robot in a moment of the replay.

    Attributes:
        x: [m] in the world.
        y: [m].
        heading: [rad].
        state: Mode of the gait.
        role: Role in its team.
        doing: The last option of its activation path, and the state of that.
    """

    x: float
    y: float
    heading: float
    state: str
    role: str
    doing: str


@dataclass(frozen=True, slots=True)
class Frame:
    """One moment of the replay.

    Attributes:
        time: [s].
        ball: x, y [m] in the world.
        robots: The robots by name.
        phase: Phase of the game.
        score: Goals of red and of blue.
    """

    time: float
    ball: Point2
    robots: dict[str, RobotFrame]
    phase: str
    score: tuple[int, int]
