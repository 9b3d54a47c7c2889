"""The team's radio of one player, without sockets: what is sent when, and what is accepted."""

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

from nao_soccer.game_state import GamePhase, GameState, Phase
from nao_soccer.team.message import TeamMessage, decode
from nao_soccer.team.roles import Claim
from nao_soccer.world.state import TeamBall, TeamMate
from robot_core.errors import NaoGaitError
from robot_core.field import Field
from robot_core.types import Point2

PERIOD = 0.5
"""[s] between two messages, as long as the budget lasts."""
SOONEST = 0.2
"""[s] after the last message, one that tells of a new role may be sent."""
SILENCE = 2.0
"""[s] after which a team mate is not counted on any longer, if it speaks as often as it may."""
SILENT_PERIODS = 2.5
"""Periods between messages after which the same holds when the budget runs short."""
OFF_FIELD = 1.5
"""[m] beyond the lines; a team mate or a ball that is told to be farther away is not believed."""
BEHIND = 32768
"""A message whose count is behind the last one by less than this is old."""
_NEAR = "a place near the field"


HALF = 600.0
"""[s] of a half, if the referee was not heard before its kick-off."""
EXTRA_HALF = 0.5
"""A half of extra time, as a share of one."""
SLACK = 0.4
"""Share of a half for which messages are kept beyond the known end of a game: time to walk to the
places, which is not counted, added time, and extra time, for which a team gets no new messages in
every league."""


class GameTime:
    """How long the messages of a team have to last: not for this half only."""

    def __init__(self) -> None:
        self._half = 0.0

    def hear(self, game: GameState) -> None:
        """Take the state of the game; before a kick-off all of the half is left."""
        waits = game.phase in (Phase.INITIAL, Phase.STANDBY, Phase.READY, Phase.SET)
        if waits and game.game_phase is GamePhase.NORMAL:
            self._half = max(self._half, game.seconds_remaining)

    def left(self, game: GameState) -> float:
        """[s] to the end of the game, both halves and what may follow."""
        half = self._half or HALF
        now = max(0.0, game.seconds_remaining)
        if game.game_phase is GamePhase.EXTRA_TIME:
            return now + (EXTRA_HALF * half if game.first_half else 0.0) + 0.25 * SLACK * half
        return now + (half if game.first_half else 0.0) + SLACK * half


@dataclass(slots=True)
class _Heard:
    """The last message of a team mate, and when it came [s]."""

    message: TeamMessage
    time: float


class TeamLink:
    """What one player tells and hears.

    Args:
        team: Number of the team.
        player: Number of the player.
        field: The field.
        players: Number of players that share the budget.
    """

    def __init__(self, team: int, player: int, field: Field, players: int = 2) -> None:
        self.sent = 0
        self.refused = 0
        self._team = team
        self._player = player
        self._players = max(1, players)
        self._limit = (field.length / 2.0 + OFF_FIELD, field.width / 2.0 + OFF_FIELD)
        self._heard: dict[int, _Heard] = {}
        self._last_sent = -math.inf
        self._silence = SILENCE

    def reset(self) -> None:
        """Begin anew, because the clock did; the count of the own messages goes on."""
        self._heard.clear()
        self._last_sent = -math.inf

    # -- hearing -----------------------------------------------------------------------------------

    def receive(self, data: bytes, time: float) -> None:
        """Take a message that came at `time` [s]; own ones and those of other teams are ignored.

        Raises:
            NaoGaitError: The message cannot be read, is old, or is not plausible. If only its
                ball is far off the field, all the rest is used; robots there are left out.
        """
        try:
            message = decode(data)
            if message.team != self._team or message.player == self._player:
                return
            self._check(message, time)
            ball = message.ball
            believed = ball is None or self._near_field(ball.position)
            robots = tuple(each for each in message.robots if self._near_field(each.position))
            self._heard[message.player] = _Heard(
                replace(message, ball=ball if believed else None, robots=robots), time
            )
            if ball is not None and not believed:
                raise NaoGaitError(f"{_name(message)}: ball", ball.position, _NEAR)
        except NaoGaitError:
            self.refused += 1
            raise

    def _near_field(self, place: Point2) -> bool:
        return abs(place[0]) <= self._limit[0] and abs(place[1]) <= self._limit[1]

    def _check(self, message: TeamMessage, time: float) -> None:
        if not self._near_field(message.pose[:2]):
            raise NaoGaitError(f"{_name(message)}: pose", message.pose, _NEAR)
        last = self._heard.get(message.player)
        if last is not None and time - last.time < self._silence:
            ahead = (message.count - last.message.count) % 65536
            if ahead == 0 or ahead >= BEHIND:
                allowed = f"a count after {last.message.count}"
                raise NaoGaitError(f"{_name(message)}: count", message.count, allowed)

    def claims(self, time: float) -> list[Claim]:
        """What the team mates who were heard lately have told of their roles."""
        return [
            Claim(number, each.message.role, each.message.seconds_to_ball)
            for number, each in sorted(self._heard.items())
            if time - each.time < self._silence and not each.message.penalized
        ]

    def mates(self, time: float) -> tuple[TeamMate, ...]:
        """The team mates who were heard lately, for the world model."""
        found = []
        for number, each in sorted(self._heard.items()):
            if time - each.time >= self._silence:
                continue
            message, ball = each.message, each.message.ball
            seen = None
            if ball is not None:
                var = max(ball.deviation, 0.05) ** 2
                seen = TeamBall(ball.position, ball.velocity, (var, 0.0, var), ball.age)
            found.append(
                TeamMate(
                    number, round(each.time * 1e9), message.pose, message.valid, message.fallen,
                    seen, message.robots,
                )
            )  # fmt: skip
        return tuple(found)

    # -- telling -----------------------------------------------------------------------------------

    def send(
        self,
        time: float,
        make: Callable[[int], TeamMessage],
        *,
        urgent: bool = False,
        budget: int | None = None,
        remaining: float = 0.0,
    ) -> bytes | None:
        """The bytes to send now; None = not now.

        Args:
            time: [s]
            make: Makes the message from its count.
            urgent: The role has changed.
            budget: Messages that the team may still send; None = no limit.
            remaining: [s] for which they have to last; see `GameTime`.
        """
        period, soonest, self._silence = PERIOD, SOONEST, SILENCE
        if budget is not None:
            if budget <= self._players:
                return None
            period = max(period, remaining * self._players / budget)
            if period > PERIOD:
                soonest = period
            self._silence = max(SILENCE, SILENT_PERIODS * period)
        since = time - self._last_sent
        if since < period - 1e-6 and not (urgent and since >= soonest):
            return None
        data = make(self.sent % 65536).encode()
        self._last_sent = time
        self.sent += 1
        return data


def _name(message: TeamMessage) -> str:
    return f"team message of player {message.player}"
