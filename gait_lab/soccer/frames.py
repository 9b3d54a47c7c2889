"""The moments of a match that a replay shows."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

from nao_lipm_gait.types import Point2
from nao_soccer.referee.rules import Goal


class RobotFrame(NamedTuple):
    """One robot in a moment of the replay.

    Attributes:
        x: [m] in the world.
        y: [m].
        heading: [rad].
        state: Mode of the gait.
        role: Role in its team.
        doing: The last option of its activation path, and the state of that.
        turned: It takes one half of the field for the other.
    """

    x: float
    y: float
    heading: float
    state: str
    role: str
    doing: str
    turned: bool = False


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


def is_turned(heading: float, believed: float) -> bool:
    """Whether a robot that believes to have a heading [rad] takes one half for the other."""
    return math.cos(believed - heading) < 0.0


def wrong_half(goals: Sequence[Goal], frames: Sequence[Frame]) -> int:
    """Number of goals into the own goal by robots that took it for the opponents'.

    A ball that a defender only deflects is an own goal too, but none of these.
    """
    count = 0
    for goal in goals:
        before = next((each for each in reversed(frames) if each.time <= goal.time), None)
        robot = None if before is None else before.robots.get(goal.player)
        count += goal.own and robot is not None and robot.turned
    return count
