"""Who goes to the ball: roles by the estimated time to the ball (Fig. 11 of Friedmann et al.).

Every player decides for itself: it compares what the others told last with what it is about to
tell. A striker is replaced only by a team mate who is clearly sooner at the ball. If messages were
lost and two players are strikers, the one that is later at the ball steps back with its next one.
"""

import math
from collections.abc import Sequence
from typing import NamedTuple

from nao_soccer.game_state import Role
from nao_soccer.team.message import NEVER
from robot_core.types import Point2

MARGIN = 1.5
"""[s] by which a team mate has to be sooner at the ball to become the striker."""
REST = 1.0
"""[s] for which a player that stepped back does not go to the ball again."""
STALL = 12.0
"""[s] A striker that has not moved the ball for this long is not waited for any longer."""
STALL_WAY = 0.3
"""[m] by which the ball has to move in this time."""


class Claim(NamedTuple):
    """What a player has told.

    Attributes:
        seconds: [s] Estimated time to the ball; `NEVER` if it cannot play.
    """

    number: int
    role: Role
    seconds: float

    @property
    def rank(self) -> tuple[float, int]:
        """The smallest one is nearest to the ball; the number decides between equals."""
        return self.seconds, self.number


class RoleChoice:
    """Chooses the role of one player."""

    def __init__(self, number: int) -> None:
        self._number = number
        self._role = Role.SUPPORTER
        self._stepped_back = -math.inf
        self._ball: Point2 | None = None
        self._ball_moved = 0.0

    @property
    def role(self) -> Role:
        """The present role."""
        return self._role

    def update(
        self,
        time: float,
        seconds: float,
        mates: Sequence[Claim],
        *,
        ball: Point2 | None = None,
        goalkeeper: bool = False,
        playing: bool = True,
    ) -> Role:
        """The role.

        Args:
            time: [s]
            seconds: [s] to the ball, as this player is about to tell.
            mates: What the team mates who can be heard have told.
            ball: x, y [m] in the field, as this player sees it.
            goalkeeper: The referee says that this player is the goalkeeper.
            playing: The ball is in play. Before a kick-off a team keeps its striker, so that
                players who walk to their places do not cross.
        """
        if goalkeeper:
            self._role = Role.KEEPER
            return self._role
        stalled = self._stalled(time, ball)
        own = Claim(self._number, self._role, seconds)
        field = [each for each in mates if each.role is not Role.KEEPER]
        strikers = [each for each in field if each.role is Role.STRIKER]
        if self._role is Role.STRIKER:
            if any(each.rank < own.rank for each in strikers):
                self._role, self._stepped_back = Role.SUPPORTER, time
        elif self._claims(own, field, strikers, time, stalled=stalled, playing=playing):
            self._role = Role.STRIKER
            self._ball_moved = time
        else:
            self._role = Role.SUPPORTER
        return self._role

    def _claims(
        self,
        own: Claim,
        field: Sequence[Claim],
        strikers: Sequence[Claim],
        time: float,
        *,
        stalled: bool,
        playing: bool,
    ) -> bool:
        if time - self._stepped_back < REST:
            return False
        if strikers and not playing:
            return False
        if strikers:
            soonest = min(each.seconds for each in strikers)
            return own.seconds + MARGIN < soonest or (stalled and own.seconds < NEVER)
        return all(own.rank < each.rank for each in field)

    def _stalled(self, time: float, ball: Point2 | None) -> bool:
        """Whether the ball that this player sees has rested for long."""
        if ball is None or self._ball is None or math.dist(ball, self._ball) > STALL_WAY:
            self._ball, self._ball_moved = ball, time
        return time - self._ball_moved > STALL
