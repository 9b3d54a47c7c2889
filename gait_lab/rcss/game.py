"""The server's play modes as the state of the game that a player knows."""

from typing import NamedTuple

from nao_soccer.game_state import GameState, Phase, SetPlay
from rcss_bridge.codec import Game

GOAL = "goal"
"""What follows `Goal_`: the team on this side has scored."""
_SET_PLAYS = {
    "kickin": SetPlay.KICK_IN,
    "corner_kick": SetPlay.CORNER_KICK,
    "goal_kick": SetPlay.GOAL_KICK,
    "free_kick": SetPlay.FREE_KICK,
    "direct_free_kick": SetPlay.FREE_KICK,
    "penalty_kick": SetPlay.PENALTY_KICK,
    "penalty_shoot": SetPlay.PENALTY_KICK,
}
HALF = 300.0
"""[s] of a half by the server's rules."""


class Mode(NamedTuple):
    """A play mode.

    Attributes:
        name: What is going on, in lower case.
        ours: It is for the own team; None = for no team.
    """

    name: str
    ours: bool | None

    @property
    def puts_back(self) -> bool:
        """All robots may be put to their places."""
        return self.name in ("beforekickoff", GOAL)


def mode_of(game: Game, team: str) -> Mode:
    """The play mode for a team."""
    name, _, side = game.mode.lower().rpartition("_")
    if side not in ("left", "right"):
        return Mode(game.mode.lower(), None)
    return Mode(name, (side == "right") == (game.right == team))


def game_state(game: Game, team: str, number: int, ball_distance: float) -> GameState:
    """The state of the game for a player.

    Args:
        game: What the server says.
        team: Name of its team.
        number: Its number; 1 is the goalkeeper.
        ball_distance: [m] that the other team keeps from the ball of a set play.
    """
    mode, right = mode_of(game, team), game.right == team
    phase, set_play, ball_free = Phase.PLAYING, SetPlay.NONE, True
    if mode.name in ("beforekickoff", GOAL, "offside"):
        phase = Phase.SET
    elif mode.name == "gameover":
        phase = Phase.FINISHED
    elif mode.name == "kickoff":
        # Until the ball is free, the other team has to stay in its half and outside of the circle.
        phase = Phase.PLAYING if mode.ours else Phase.SET
        ball_free = False
    elif mode.name in _SET_PLAYS:
        set_play, ball_free = _SET_PLAYS[mode.name], False
    left, other = game.score
    return GameState(
        phase=phase,
        set_play=set_play,
        own_kick=mode.ours,
        ball_free=ball_free,
        goalkeeper=number == 1,
        own_score=other if right else left,
        other_score=left if right else other,
        seconds_remaining=HALF - game.time % HALF,
        first_half=game.time < HALF,
        ball_distance=ball_distance,
    )
