"""The state of the game as one player sees it, and its role in it."""

from dataclasses import dataclass
from enum import StrEnum


class Phase(StrEnum):
    """Phase of a game.

    Attributes:
        INITIAL: Stand still beside or on the field.
        STANDBY: Stand still and wait for the referee's sign (SPL, versions 17 and 18).
        READY: Walk to the places for the kick-off.
        SET: Stand still; the ball lies on its place.
        PLAYING: Play.
        FINISHED: The half is over.
    """

    INITIAL = "initial"
    STANDBY = "standby"
    READY = "ready"
    SET = "set"
    PLAYING = "playing"
    FINISHED = "finished"


class GamePhase(StrEnum):
    """Part of a game, in which the phases above are gone through."""

    NORMAL = "normal"
    SHOOT_OUT = "shoot_out"
    EXTRA_TIME = "extra_time"
    TIMEOUT = "timeout"


class Competition(StrEnum):
    """What is played: the SPL's kinds of games, and the divisions of the Humanoid Soccer League."""

    NORMAL = "normal"
    MOST_PASSES = "most_passes"
    SMALL = "small"
    MIDDLE = "middle"
    LARGE = "large"
    OTHER = "other"


class SetPlay(StrEnum):
    """How the ball was brought back into play."""

    NONE = "none"
    KICK_IN = "kick_in"
    GOAL_KICK = "goal_kick"
    CORNER_KICK = "corner_kick"
    FREE_KICK = "free_kick"
    INDIRECT_FREE_KICK = "indirect_free_kick"
    PENALTY_KICK = "penalty_kick"


class Role(StrEnum):
    """Role of a player.

    Attributes:
        STRIKER: Goes to the ball.
        SUPPORTER: Keeps out of the striker's way, between ball and own goal.
        KEEPER: Guards the goal.
    """

    STRIKER = "striker"
    SUPPORTER = "supporter"
    KEEPER = "keeper"


@dataclass(frozen=True, slots=True)
class GameState:
    """The game as one player sees it; the default is a game without a referee.

    Attributes:
        phase: Phase of the game.
        set_play: What is going on while playing.
        own_kick: The own team kicks off or has the set play; None = nobody.
        ball_free: A kick-off or set play is over, so that both teams may play the ball.
        penalized: This player has a penalty: it stands still.
        removed: The penalty takes it off the field; others are served where it stands.
        selected: This player takes part; in a penalty shoot-out only kicker and goalkeeper do.
        stopped: The referee has stopped the game: all players stand still.
        goalkeeper: This player is the goalkeeper.
        own_score: Goals of the own team.
        other_score: Goals of the other team.
        seconds_remaining: Time [s] left in the half.
        first_half: It is the first half.
        game_phase: Part of the game.
        competition: What is played.
        message_budget: Number of team messages that the team may still send; None = no limit.
        ball_distance: [m] that the other team keeps from the ball of a kick-off or set play.
        may_score: A goal of this player would count: it has not just taken an indirect free kick.
    """

    phase: Phase = Phase.PLAYING
    set_play: SetPlay = SetPlay.NONE
    own_kick: bool | None = None
    ball_free: bool = True
    penalized: bool = False
    removed: bool = False
    selected: bool = True
    stopped: bool = False
    goalkeeper: bool = False
    own_score: int = 0
    other_score: int = 0
    seconds_remaining: float = 0.0
    first_half: bool = False
    game_phase: GamePhase = GamePhase.NORMAL
    competition: Competition = Competition.NORMAL
    message_budget: int | None = None
    ball_distance: float = 0.75
    may_score: bool = True
