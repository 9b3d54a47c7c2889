"""Which players of a match are heard."""

from collections.abc import Iterable

SILENCE = 2_000_000_000
"""[ns] of match time after a return message, of which robots send two per second, after which a
player is not heard any more."""


class RollCall:
    """Who has answered lately.

    Args:
        players: Team and number of the players in the match; others are ignored.
    """

    def __init__(self, players: Iterable[tuple[int, int]]) -> None:
        self._heard: dict[tuple[int, int], int | None] = dict.fromkeys(players)

    def note(self, team: int, player: int, time: int) -> None:
        """A message of a player has come at a time [ns] of the match."""
        if (team, player) in self._heard:
            self._heard[team, player] = time

    def count(self, time: int) -> int:
        """Number of players who were heard lately, at a time [ns] of the match."""
        return sum(at is not None and time - at < SILENCE for at in self._heard.values())
