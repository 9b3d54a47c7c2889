"""Messages of the RoboCup GameController: bytes to values and back.

Sizes, order and codes are those of `RoboCupGameControlData.h`: versions 15 to 18 of the Standard
Platform League (github.com/RoboCup-SPL/GameController3, folder game_controller_msgs/headers), which
differ in the last state and the last penalties only, and versions 19 and 20 of the Humanoid Soccer
League (github.com/RoboCup-HumanoidSoccerLeague/GameController, the same folder, releases 6 and 7).
All numbers are little-endian. Bytes of a control message:

| bytes | 15 to 18 | 19 and 20 |
|---|---|---|
| 0-3 | `RGme` | the same |
| 4 5 6 | version, packet number, players per team | the same |
| 7 8 | competition phase, competition type | competition type, stopped |
| 9-13 | game phase, state, set play, first half, kicking team | the same |
| 14-17 | int16 seconds remaining, int16 secondary time | the same |
| 2 teams, 10 each | see below | the same |
| and 20 players each | penalty, seconds | 19: + warnings, cautions; 20: + cautions |

A team: number, two colours, goalkeeper, score, penalty shot, uint16 single shots, uint16 message
budget.

The return message (version 4, 32 bytes) has `RGrt`, version, player, team, fallen, then six
float32: pose (mm, mm, rad), age of the ball (s, -1 = never seen), ball relative to the robot (mm).
"""

import math
import struct
from dataclasses import dataclass, field
from enum import StrEnum

from nao_soccer.game_state import Competition, GamePhase, GameState, Phase, SetPlay
from robot_core.errors import NaoGaitError
from robot_core.types import Point2, Pose2

CONTROL_PORT = 3838
RETURN_PORT = 3939
MAX_PLAYERS = 20
"""Number of players of a team in a message."""
NOBODY = 255
"""Kicking team if nobody kicks."""

_MAGIC = b"RGme"
_RETURN_MAGIC = b"RGrt"
_RETURN_VERSION = 4
_HEADER = struct.Struct("<4s10B2h")
_TEAM = struct.Struct("<6B2H")
_RETURN = struct.Struct("<4s4B6f")
_PLAYER_BYTES = {15: 2, 16: 2, 17: 2, 18: 2, 19: 4, 20: 3}
VERSIONS = tuple(_PLAYER_BYTES)
"""Versions of the control message that can be read and written."""
SIZES = {
    version: _HEADER.size + 2 * (_TEAM.size + MAX_PLAYERS * size)
    for version, size in _PLAYER_BYTES.items()
}
"""Length [bytes] of a control message by version."""

_PHASES = (Phase.INITIAL, Phase.READY, Phase.SET, Phase.PLAYING, Phase.FINISHED, Phase.STANDBY)
"""By state code; 5 is there in versions 17, where it is called setup, and 18."""
_STANDBY = (17, 18)
_GAME_PHASES = tuple(GamePhase)
_SPL_COMPETITIONS = (Competition.NORMAL, Competition.MOST_PASSES)
_HSL_COMPETITIONS = (Competition.SMALL, Competition.MIDDLE, Competition.LARGE)
_SPL_SET_PLAYS = (
    SetPlay.NONE, SetPlay.GOAL_KICK, SetPlay.FREE_KICK, SetPlay.CORNER_KICK, SetPlay.KICK_IN,
    SetPlay.PENALTY_KICK,
)  # fmt: skip
_HSL_SET_PLAYS = (
    SetPlay.NONE, SetPlay.FREE_KICK, SetPlay.INDIRECT_FREE_KICK, SetPlay.PENALTY_KICK,
    SetPlay.KICK_IN, SetPlay.GOAL_KICK, SetPlay.CORNER_KICK,
)  # fmt: skip


def _spl(version: int) -> bool:
    """The version is one of the Standard Platform League."""
    return version <= 18


def _set_plays(version: int) -> tuple[SetPlay, ...]:
    return _SPL_SET_PLAYS if _spl(version) else _HSL_SET_PLAYS


def _competitions(version: int) -> tuple[Competition, ...]:
    return _SPL_COMPETITIONS if _spl(version) else _HSL_COMPETITIONS


class Penalty(StrEnum):
    """Why a player may not play; what the versions number differently."""

    NONE = "none"
    ILLEGAL_POSITION = "illegal_position"
    MOTION_IN_SET = "motion_in_set"
    MOTION_IN_STANDBY = "motion_in_standby"
    MOTION_IN_STOP = "motion_in_stop"
    POSITION_IN_SET = "position_in_set"
    STANCE = "stance"
    GAME_STUCK = "game_stuck"
    INCAPABLE = "incapable"
    PICK_UP = "pick_up"
    BALL_HOLDING = "ball_holding"
    LEAVING = "leaving"
    ARMS = "arms"
    PUSHING = "pushing"
    CAUTIONED = "cautioned"
    SENT_OFF = "sent_off"
    SUBSTITUTE = "substitute"
    OTHER = "other"


IN_PLACE = frozenset((Penalty.MOTION_IN_SET, Penalty.MOTION_IN_STANDBY, Penalty.MOTION_IN_STOP))
"""Penalties that are served where the robot stands; for all others it is taken off the field."""

_SPL_PENALTIES = {
    Penalty.NONE: 0, Penalty.BALL_HOLDING: 1, Penalty.PUSHING: 2, Penalty.MOTION_IN_SET: 3,
    Penalty.INCAPABLE: 4, Penalty.ILLEGAL_POSITION: 5, Penalty.LEAVING: 6, Penalty.PICK_UP: 7,
    Penalty.GAME_STUCK: 8, Penalty.POSITION_IN_SET: 9, Penalty.STANCE: 10, Penalty.SUBSTITUTE: 14,
    Penalty.OTHER: 15,
}  # fmt: skip
_MOVED = {Penalty.MOTION_IN_STANDBY: 11}
"""From version 16 on; it is called motion in initial before version 18."""
_PENALTIES = {
    15: _SPL_PENALTIES, 16: _SPL_PENALTIES | _MOVED, 17: _SPL_PENALTIES | _MOVED,
    18: _SPL_PENALTIES | _MOVED,
    19: {
        Penalty.NONE: 0, Penalty.ILLEGAL_POSITION: 1, Penalty.MOTION_IN_SET: 2,
        Penalty.GAME_STUCK: 3, Penalty.INCAPABLE: 4, Penalty.PICK_UP: 5, Penalty.BALL_HOLDING: 6,
        Penalty.LEAVING: 7, Penalty.ARMS: 8, Penalty.PUSHING: 9, Penalty.SENT_OFF: 10,
        Penalty.SUBSTITUTE: 11,
    },
    20: {
        Penalty.NONE: 0, Penalty.ILLEGAL_POSITION: 1, Penalty.MOTION_IN_SET: 2,
        Penalty.MOTION_IN_STOP: 3, Penalty.GAME_STUCK: 4, Penalty.INCAPABLE: 5,
        Penalty.PICK_UP: 6, Penalty.BALL_HOLDING: 7, Penalty.LEAVING: 8, Penalty.ARMS: 9,
        Penalty.PUSHING: 10, Penalty.CAUTIONED: 11, Penalty.SENT_OFF: 12, Penalty.SUBSTITUTE: 13,
    },
}  # fmt: skip
_PENALTY_OF = {
    version: {code: penalty for penalty, code in codes.items()}
    for version, codes in _PENALTIES.items()
}


@dataclass(frozen=True, slots=True)
class PlayerInfo:
    """A player as the referee sees it.

    Attributes:
        penalty: Why it may not play. A code that is not known is read as `OTHER`.
        seconds: [s] until it may play again.
    """

    penalty: Penalty = Penalty.NONE
    seconds: int = 0


@dataclass(frozen=True, slots=True)
class TeamInfo:
    """A team as the referee sees it.

    Attributes:
        number: Number of the team.
        score: Its goals.
        goalkeeper: Number of its goalkeeper; 0 = none.
        message_budget: Team messages that it may still send.
        field_color: Code of the field players' colour: 0 blue, 1 red.
        goalkeeper_color: Code of the goalkeeper's colour.
        players: The players, from number 1 on, at most `MAX_PLAYERS`; all of them if it was read.
    """

    number: int
    score: int = 0
    goalkeeper: int = 0
    message_budget: int = 1200
    field_color: int = 0
    goalkeeper_color: int = 0
    players: tuple[PlayerInfo, ...] = ()


@dataclass(frozen=True, slots=True)
class ControlMessage:
    """What the referee tells the robots.

    Attributes:
        teams: The teams.
        phase: Phase of the game. Versions without `STANDBY` write it as `INITIAL`.
        game_phase: Part of the game.
        competition: What is played. A code that is not known is read as `OTHER`.
        competition_phase: 0 = round robin, 1 = play-off; to version 18.
        set_play: The set play.
        kicking_team: Number of the team that kicks off or has the set play; None = nobody.
        first_half: It is the first half.
        seconds_remaining: [s] of the half.
        secondary_time: [s] of ready, until the ball is free, and the like.
        players_per_team: Number of players of each team on the field. Their numbers go up to
            `MAX_PLAYERS` all the same, because substitutes have numbers of their own.
        packet: Number of the message, modulo 256.
        stopped: Play is stopped; from version 19 on.
        version: Version of the message.
    """

    teams: tuple[TeamInfo, TeamInfo]
    phase: Phase = Phase.INITIAL
    set_play: SetPlay = SetPlay.NONE
    kicking_team: int | None = None
    first_half: bool = True
    seconds_remaining: int = 0
    secondary_time: int = 0
    players_per_team: int = MAX_PLAYERS
    packet: int = 0
    stopped: bool = False
    version: int = 18
    game_phase: GamePhase = GamePhase.NORMAL
    competition: Competition = Competition.NORMAL
    competition_phase: int = 0

    def encode(self) -> bytes:
        """The bytes of the message; NaoGaitError if a value does not fit."""
        if self.version not in VERSIONS:
            raise NaoGaitError("control message version", self.version, f"one of {VERSIONS}")
        _check_players(self.players_per_team)
        kinds = _competitions(self.version)
        kind = kinds.index(self.competition) if self.competition in kinds else 0
        if _spl(self.version):
            first, second = self.competition_phase, kind
        else:
            first, second = kind, int(self.stopped)
        state = _PHASES.index(self.phase)
        if self.phase is Phase.STANDBY and self.version not in _STANDBY:
            state = _PHASES.index(Phase.INITIAL)
        try:
            parts = [
                _HEADER.pack(
                    _MAGIC, self.version, self.packet, self.players_per_team, first, second,
                    _GAME_PHASES.index(self.game_phase), state,
                    _set_plays(self.version).index(self.set_play), int(self.first_half),
                    NOBODY if self.kicking_team is None else self.kicking_team,
                    self.seconds_remaining, self.secondary_time,
                )
            ]  # fmt: skip
            parts += [self._team(team) for team in self.teams]
        except (struct.error, ValueError) as error:
            raise NaoGaitError(
                "control message", str(self), f"values that fit ({error})"
            ) from error
        return b"".join(parts)

    def _team(self, team: TeamInfo) -> bytes:
        codes, size = _PENALTIES[self.version], _PLAYER_BYTES[self.version]
        if len(team.players) > MAX_PLAYERS:
            raise ValueError(f"at most {MAX_PLAYERS} players")
        head = _TEAM.pack(
            team.number, team.field_color, team.goalkeeper_color, team.goalkeeper, team.score, 0, 0,
            team.message_budget,
        )  # fmt: skip
        other = codes.get(Penalty.OTHER, codes[Penalty.INCAPABLE])
        rows = [
            bytes((codes.get(each.penalty, other), each.seconds)).ljust(size, b"\0")
            for each in team.players
        ]
        return head + b"".join(rows).ljust(MAX_PLAYERS * size, b"\0")


def decode(data: bytes) -> ControlMessage:
    """Read a control message of any known version.

    Raises:
        NaoGaitError: It is no control message, too short or too long, of an unknown version, or one
            of its codes is unknown.
    """
    where = "control message"
    if data[:4] != _MAGIC or len(data) < 5:
        got = f"{len(data)} bytes, {data[:4]!r}"
        raise NaoGaitError(where, got, f"{_MAGIC!r}, a version and its content")
    version = data[4]
    if version not in VERSIONS:
        raise NaoGaitError(f"{where} version", version, f"one of {VERSIONS}")
    if len(data) != SIZES[version]:
        allowed = f"{SIZES[version]} bytes in version {version}"
        raise NaoGaitError(where, f"{len(data)} bytes", allowed)
    (
        _, _, packet, per_team, seventh, eighth, part, state, set_play, first, kicking, left,
        secondary,
    ) = _HEADER.unpack_from(data)  # fmt: skip
    last = len(_PHASES) - 1 if version in _STANDBY else 4
    if state > last:
        raise NaoGaitError(f"{where} state", state, f"0 to {last} in version {version}")
    if part >= len(_GAME_PHASES):
        raise NaoGaitError(f"{where} game phase", part, f"0 to {len(_GAME_PHASES) - 1}")
    set_plays, kinds = _set_plays(version), _competitions(version)
    kind = eighth if _spl(version) else seventh
    if set_play >= len(set_plays):
        raise NaoGaitError(f"{where} set play", set_play, f"0 to {len(set_plays) - 1}")
    _check_players(per_team)
    size = _TEAM.size + MAX_PLAYERS * _PLAYER_BYTES[version]
    return ControlMessage(
        teams=(
            _decoded_team(data, _HEADER.size, version),
            _decoded_team(data, _HEADER.size + size, version),
        ),
        phase=_PHASES[state],
        set_play=set_plays[set_play],
        kicking_team=None if kicking == NOBODY else kicking,
        first_half=bool(first),
        seconds_remaining=left,
        secondary_time=secondary,
        players_per_team=per_team,
        packet=packet,
        stopped=not _spl(version) and bool(eighth),
        version=version,
        game_phase=_GAME_PHASES[part],
        competition=kinds[kind] if kind < len(kinds) else Competition.OTHER,
        competition_phase=seventh if _spl(version) else 0,
    )


def _check_players(per_team: int) -> None:
    if per_team > MAX_PLAYERS:
        raise NaoGaitError("control message players per team", per_team, f"at most {MAX_PLAYERS}")


def _decoded_team(data: bytes, start: int, version: int) -> TeamInfo:
    number, color, keeper_color, keeper, score, _, _, budget = _TEAM.unpack_from(data, start)
    known, size = _PENALTY_OF[version], _PLAYER_BYTES[version]
    first = start + _TEAM.size
    rows = (data[first + i * size : first + (i + 1) * size] for i in range(MAX_PLAYERS))
    infos = tuple(PlayerInfo(known.get(row[0], Penalty.OTHER), row[1]) for row in rows)
    return TeamInfo(number, score, keeper, budget, color, keeper_color, infos)


@dataclass(frozen=True, slots=True)
class ReturnMessage:
    """What a robot tells the GameController.

    Attributes:
        player: Number of the player.
        team: Number of its team.
        fallen: It lies on the ground.
        pose: x, y [m], yaw [rad] in its frame of the field.
        ball_age: [s] since it saw the ball; None = never.
        ball: The ball [m] relative to the robot.
    """

    player: int
    team: int
    fallen: bool = False
    pose: Pose2 = field(default=(0.0, 0.0, 0.0))
    ball_age: float | None = None
    ball: Point2 = (0.0, 0.0)

    def encode(self) -> bytes:
        """The bytes of the message; NaoGaitError if a value does not fit."""
        x, y, yaw = self.pose
        age = -1.0 if self.ball_age is None else self.ball_age
        try:
            return _RETURN.pack(
                _RETURN_MAGIC, _RETURN_VERSION, self.player, self.team, int(self.fallen),
                1000.0 * x, 1000.0 * y, yaw, age, 1000.0 * self.ball[0], 1000.0 * self.ball[1],
            )  # fmt: skip
        except (struct.error, OverflowError) as error:
            raise NaoGaitError("return message", str(self), f"values that fit ({error})") from error


def decode_return(data: bytes) -> ReturnMessage:
    """Read a return message; NaoGaitError if it is none."""
    where = "return message"
    if len(data) != _RETURN.size:
        raise NaoGaitError(where, f"{len(data)} bytes", f"{_RETURN.size} bytes")
    magic, version, player, team, fallen, x, y, yaw, age, bx, by = _RETURN.unpack(data)
    if magic != _RETURN_MAGIC or version != _RETURN_VERSION:
        raise NaoGaitError(where, (magic, version), f"{_RETURN_MAGIC!r}, version {_RETURN_VERSION}")
    if not all(math.isfinite(each) for each in (x, y, yaw, age, bx, by)):
        raise NaoGaitError(where, (x, y, yaw, age, bx, by), "finite numbers")
    return ReturnMessage(
        player,
        team,
        fallen == 1,
        (x / 1000.0, y / 1000.0, yaw),
        None if age < 0.0 else age,
        (bx / 1000.0, by / 1000.0),
    )


def seen_by(message: ControlMessage, team: int, player: int) -> GameState:
    """The game as one player sees it.

    Raises:
        NaoGaitError: The message is for other teams, or no player can have this number.
    """
    numbers = tuple(each.number for each in message.teams)
    if team not in numbers:
        raise NaoGaitError("control message teams", numbers, f"a game of team {team}")
    own, other = message.teams if numbers[0] == team else message.teams[::-1]
    if not 1 <= player <= len(own.players):
        raise NaoGaitError("player", player, f"1 to {len(own.players)}, as the referee says")
    kicking = message.kicking_team
    playing = message.phase is Phase.PLAYING
    own_kick = None if kicking is None else kicking == team
    penalty = own.players[player - 1].penalty
    return GameState(
        phase=message.phase,
        set_play=message.set_play,
        own_kick=own_kick,
        # After a kick-off the secondary time runs until the other team may play the ball.
        ball_free=kicking is None
        or (playing and message.set_play is SetPlay.NONE and message.secondary_time <= 0),
        penalized=penalty is not Penalty.NONE,
        removed=penalty is not Penalty.NONE and penalty not in IN_PLACE,
        selected=message.game_phase is not GamePhase.SHOOT_OUT
        or (own_kick is not None and player == _selected(own, kicks=own_kick)),
        stopped=message.stopped,
        goalkeeper=own.goalkeeper == player,
        own_score=own.score,
        other_score=other.score,
        seconds_remaining=float(message.seconds_remaining),
        first_half=message.first_half,
        game_phase=message.game_phase,
        competition=message.competition,
        message_budget=own.message_budget,
    )


def _selected(team: TeamInfo, *, kicks: bool) -> int | None:
    """Who plays for a team in a penalty shoot-out; the GameController makes the others substitutes.

    If several are left, the goalkeeper keeps and the first of the others kicks.
    """
    free = [n for n, each in enumerate(team.players, start=1) if each.penalty is Penalty.NONE]
    fit = [number for number in free if (number == team.goalkeeper) is not kicks]
    return next(iter(fit or free), None)
