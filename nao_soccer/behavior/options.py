"""The options of a player, from the leaves to the root."""

from nao_soccer.behavior import basic, symbols
from nao_soccer.behavior.option_tree import After, Option, State, When
from nao_soccer.behavior.situation import Action, Situation

_State = State[Situation, Action]
_Option = Option[Situation, Action]

SEARCH: _Option = Option(
    "search for the ball",
    _State("look", basic.look_for_ball, [After(1.5, "turn")]),
    _State("turn", basic.turn_around, [After(8.0, "walk")]),
    _State("walk", basic.walk_to_middle, [After(5.0, "look")]),
)

PLAY_BALL: _Option = Option(
    "play the ball",
    _State(
        "walk behind ball",
        basic.walk_behind_ball,
        [When(symbols.may_push, "push"), When(symbols.behind_ball, "line up")],
    ),
    _State("push", basic.push, [When(symbols.push_is_over, "walk behind ball")]),
    _State(
        "line up",
        basic.step_to_ball,
        [
            When(symbols.may_push, "push"),
            When(symbols.plan_is_dribble, "dribble"),
            When(symbols.at_kick_spot, "settle"),
            When(symbols.not_behind_ball, "walk behind ball"),
            After(8.0, "walk behind ball"),
        ],
    ),
    _State(
        "dribble",
        basic.dribble,
        [
            When(symbols.may_push, "push"),
            When(symbols.not_behind_ball, "walk behind ball"),
            When(symbols.plan_is_kick, "line up"),
        ],
    ),
    _State(
        "settle",
        basic.settle,
        [
            When(symbols.ready_to_kick, "kick"),
            When(symbols.off_kick_spot, "line up"),
            After(3.0, "walk behind ball"),
        ],
    ),
    _State(
        "kick",
        basic.kick,
        [When(symbols.in_motion, "follow through"), After(1.5, "walk behind ball")],
    ),
    _State(
        "follow through",
        basic.settle,
        [When(symbols.stands, "walk behind ball"), After(6.0, "walk behind ball")],
    ),
)

STRIKER: _Option = Option(
    "striker",
    _State(
        "search",
        SEARCH,
        [When(symbols.must_give_way, "wait"), When(symbols.ball_known, "play")],
    ),
    _State(
        "play",
        PLAY_BALL,
        [
            When(symbols.must_give_way, "wait"),
            When(symbols.ball_lost, "search"),
            When(symbols.place_lost, "find place"),
        ],
    ),
    _State(
        "find place",
        basic.find_place,
        [
            When(symbols.must_give_way, "wait"),
            When(symbols.place_known, "play"),
            After(3.0, "play all the same"),
        ],
    ),
    _State(
        "play all the same",
        PLAY_BALL,
        [
            When(symbols.must_give_way, "wait"),
            When(symbols.place_known, "play"),
            When(symbols.ball_lost, "search"),
        ],
    ),
    _State(
        "wait",
        basic.keep_distance,
        [When(symbols.may_play, "play")],
    ),
)

SUPPORTER: _Option = Option(
    "supporter",
    _State("search", SEARCH, [When(symbols.ball_known, "support")]),
    _State("support", basic.support, [When(symbols.ball_lost, "search")]),
)

KEEPER: _Option = Option(
    "keeper",
    _State(
        "guard",
        basic.guard_goal,
        [
            When(symbols.shot_at_feet, "stay"),
            When(symbols.shot_to_left, "dive left"),
            When(symbols.shot_to_right, "dive right"),
        ],
    ),
    _State("stay", basic.settle, [After(1.5, "guard")]),
    _State("dive left", basic.dive_left, [When(symbols.in_motion, "hold"), After(1.0, "guard")]),
    _State("dive right", basic.dive_right, [When(symbols.in_motion, "hold"), After(1.0, "guard")]),
    _State("hold", basic.settle, [When(symbols.stands, "guard"), After(6.0, "guard")]),
)

TEAM_PLAY: _Option = Option(
    "play by role",
    _State(
        "striker",
        STRIKER,
        [When(symbols.is_supporter, "supporter"), When(symbols.is_keeper, "keeper")],
    ),
    _State(
        "supporter",
        SUPPORTER,
        [When(symbols.is_striker, "striker"), When(symbols.is_keeper, "keeper")],
    ),
    _State(
        "keeper",
        KEEPER,
        [When(symbols.is_striker, "striker"), When(symbols.is_supporter, "supporter")],
    ),
)

GAME: _Option = Option(
    "obey the referee",
    _State(
        "stand still",
        basic.stand,
        [When(symbols.playing, "play"), When(symbols.ready, "take place")],
    ),
    _State(
        "take place",
        basic.take_place,
        [When(symbols.must_stand, "stand still"), When(symbols.playing, "play")],
    ),
    _State(
        "play",
        TEAM_PLAY,
        [When(symbols.must_stand, "stand still"), When(symbols.ready, "take place")],
    ),
)

PLAYER: _Option = Option(
    "player",
    _State("upright", GAME, [When(symbols.must_get_up, "get up")]),
    _State("get up", basic.get_up, [When(symbols.upright, "upright"), After(20.0, "lie")]),
    # A gait gives up after some attempts, or was started again: each request is a new one.
    _State("lie", basic.stand, [When(symbols.upright, "upright"), When(symbols.lies, "get up")]),
)
"""The root."""
