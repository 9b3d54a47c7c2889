"""One player: what it perceives becomes a world state, a decision and a direction for its head.

It knows neither sockets nor ROS: the node `player` and matches in one process use it alike.

player = Player(identity, robot, settings, start)
player.world.add_odometry(stamp, pose)
player.world.add_percepts(percepts)
player.hear_referee(data, time)                  # bytes of the GameController
player.hear_mate(data, time)                     # bytes of a team mate
player.hear_whistle(time)
player.hear_gesture("ready", time)
decision = player.decide(body, now)
goal = player.look(decision)                     # for the head
data = player.team_message(now * 1e-9)           # what to send now, if anything
"""

import math
from dataclasses import dataclass, replace

from nao_soccer.behavior.ball_plan import Planner
from nao_soccer.behavior.basic import DIVES
from nao_soccer.behavior.duel import DuelSettings
from nao_soccer.behavior.kicks import kicks_of
from nao_soccer.behavior.mind import Decision, Mind
from nao_soccer.behavior.situation import Body
from nao_soccer.behavior.walking import WalkLimits
from nao_soccer.game_state import Competition, GamePhase, GameState, Phase, Role, SetPlay
from nao_soccer.referee.protocol import ReturnMessage, decode, seen_by
from nao_soccer.team.link import GameTime, TeamLink
from nao_soccer.team.message import NEVER, BallMessage, TeamMessage
from nao_soccer.team.roles import Claim, RoleChoice
from nao_soccer.world.looking import Looking
from nao_soccer.world.model import WorldModel
from nao_soccer.world.settings import WorldSettings
from nao_soccer.world.state import IMAGE_AGE_MAX, TeamMate, TeamRobot, WorldState
from robot_core.errors import NaoGaitError
from robot_core.field import Goals
from robot_core.head_goals import Goal
from robot_core.motion.library import shipped_library
from robot_core.robot import RobotDescription
from robot_core.types import Point2, Pose2

SAME_PLACE = 0.1
"""[m] along the field, within which the smaller number of two supporters comes first."""
ROBOT_AGE = 1.0
"""[s] A robot that was not seen for longer is not told."""
BALL_AGE = 3.0
"""[s] since somebody saw the ball, after which nobody claims to be near it."""
GETTING_UP_TIME = 10.0
"""[s] that a robot on the ground needs before it can walk to the ball."""
REFEREE_SILENCE = 3.0
"""[s] without the referee, who speaks twice a second, after which this is reported."""

SIGNAL_HOLD = 15.0
"""[s] for which a whistle or a gesture is believed while the packets do not say it yet; the
GameController tells of a kick-off so much later."""
FREE_BALL = 10.0
"""[s] after the whistle of a kick-off, from which on both teams may play the ball."""
READY_GESTURE = "ready"
"""Gesture of the referee that ends `standby`."""
TOUCHED = 0.35
"""[m] from another robot to the ball, at which it counts as having touched the ball."""
TOUCH_WAIT = 15.0
"""[s] after an indirect free kick, in which nobody else may have touched the ball."""


@dataclass(frozen=True, slots=True)
class Identity:
    """Who a player is.

    Attributes:
        team: Number of its team.
        player: Its number.
        players: Number of players of the team.
        waits: It stands until a referee is heard. If not, it plays at once.
        roles: It agrees with its team mates who goes to the ball. If not, it always goes.
        color: `red` or `blue`, as which its team is seen; empty = not known.
    """

    team: int
    player: int
    players: int = 2
    waits: bool = True
    roles: bool = True
    color: str = ""


class Player:
    """World model, team, decisions and head of one robot.

    Args:
        identity: Who it is.
        robot: The robot; its motions say which kicks and dives it has.
        settings: Of the world model; with the field and the goals.
        start: Pose x, y [m], yaw [rad] in the field of its team at which it begins; None = not
            known. From a penalty it comes back beside the touch line (`Field.entries`).
        limits: Largest speeds; None = the defaults.
        planner: Chooses what to do with the ball; None = the one that plays at the goal.
        duel: How it plays beside other robots; None = the defaults.

    Attributes:
        world: Takes percepts, odometry and falls.
        link: The team's radio.
        role: The present role.
        game: The state of the game.
    """

    def __init__(
        self,
        identity: Identity,
        robot: RobotDescription,
        settings: WorldSettings,
        start: Pose2 | None = None,
        *,
        limits: WalkLimits | None = None,
        planner: Planner | None = None,
        duel: DuelSettings | None = None,
    ) -> None:
        self.identity = identity
        self.world = WorldModel(settings, identity.color)
        self.link = TeamLink(identity.team, identity.player, settings.field, identity.players)
        self.role = Role.SUPPORTER
        self.game = GameState(phase=Phase.INITIAL if identity.waits else Phase.PLAYING)
        self._mind = Mind(
            kicks_of(robot.motions),
            settings.field,
            settings.goals or Goals(),
            limits,
            dives=all(name in shipped_library(robot).motions for name in DIVES),
            planner=planner,
            duel=duel,
        )
        self._looking = Looking(self.world.map, settings.sight)
        self._roles = RoleChoice(identity.player)
        self._decision: Decision | None = None
        self._state: WorldState | None = None
        self._urgent = self._late_start = self._was_penalized = self._was_removed = False
        self._field = settings.field
        self._time_of_game = GameTime()
        self._half: tuple[GamePhase, bool] | None = None
        self._carried = False
        self._took_kick: float | None = None
        self._signal: tuple[Phase, Phase, float] | None = None
        self._packet: int | None = None
        self._packet_time = -math.inf
        self._start = start
        if start is not None:
            self.world.start((start,))

    # -- hearing -----------------------------------------------------------------------------------

    def hear_referee(self, data: bytes, time: float) -> None:
        """Take a control message that came at `time` [s]; one older than the last is left out.

        Raises:
            NaoGaitError: It cannot be read, or is of a game of other teams.
        """
        message = decode(data)
        game = seen_by(message, self.identity.team, self.identity.player)
        # The network may swap packets; after a second of silence any packet is a new beginning.
        old = self._packet is not None and (message.packet - self._packet) % 256 >= 128
        if old and time - self._packet_time < 1.0:
            return
        if self._packet is None:
            self._late_start = game.phase in (Phase.SET, Phase.PLAYING)
        self._time_of_game.hear(game)
        self._watch_halves(game)
        self.game, self._packet, self._packet_time = game, message.packet, time
        self._obey_signal(time)

    def _watch_halves(self, game: GameState) -> None:
        """Before each half people carry the robots to where they stood before the first one."""
        half = game.game_phase, game.first_half
        plays = game.game_phase in (GamePhase.NORMAL, GamePhase.EXTRA_TIME)
        if plays and game.phase is not Phase.FINISHED:
            self._carried = self._carried or self._half not in (None, half)
            self._half = half

    def hear_game(self, game: GameState, time: float) -> None:
        """Take the state of the game from a referee who does not speak in packets."""
        self._packet = 0
        self._time_of_game.hear(game)
        self.game, self._packet_time = game, time

    def hear_whistle(self, time: float) -> None:
        """The whistle at a kick-off: play begins before the packets say so."""
        if self.game.phase is Phase.SET:
            self._signal = Phase.SET, Phase.PLAYING, time
            self._obey_signal(time)

    def hear_gesture(self, name: str, time: float) -> None:
        """A gesture of the referee; only `READY_GESTURE` is known, others raise NaoGaitError."""
        if name != READY_GESTURE:
            raise NaoGaitError("gesture", name, READY_GESTURE)
        if self.game.phase is Phase.STANDBY:
            self._signal = Phase.STANDBY, Phase.READY, time
            self._obey_signal(time)

    def _obey_signal(self, time: float) -> None:
        """Believe a sign for a while; one of another field is forgotten then."""
        if self._signal is None:
            return
        before, after, since = self._signal
        if self.game.phase not in (before, after) or not 0.0 <= time - since < SIGNAL_HOLD:
            self._signal = None
        elif self.game.phase is before:
            free = self.game.own_kick is None or time - since >= FREE_BALL
            self.game = replace(
                self.game, phase=after, ball_free=free and after is Phase.PLAYING
            )

    def hear_mate(self, data: bytes, time: float) -> None:
        """Take a team message; NaoGaitError as `TeamLink.receive`."""
        self.link.receive(data, time)

    # -- deciding ----------------------------------------------------------------------------------

    def decide(self, body: Body, now: int) -> Decision | None:
        """Decide by what the robot and its team mates see, at `now` [ns] of the robot's clock.

        None before the first odometry.
        """
        if self._late_start:  # it began in the middle of a half: it may be anywhere
            self.world.forget_place()
            self._late_start = False
        returns = self._was_penalized and not self.game.penalized and self._was_removed
        if returns or self._carried:
            self.world.start(self._entries())
            self._carried = False
        self._was_penalized = self.game.penalized
        self._was_removed = self.game.penalized and (self._was_removed or self.game.removed)
        for mate in self.link.mates(now * 1e-9):
            self.world.add_mate(mate)
        state = self.world.state()
        return None if state is None else self.decide_in(replace(state, stamp=now), body)

    def decide_in(self, state: WorldState, body: Body) -> Decision:
        """Decide in a state of the world, whose stamp is the present."""
        time = state.stamp * 1e-9
        if self._state is not None and state.stamp < self._state.stamp:
            self._restart(time)
        self._watch_indirect_kick(state, time)
        before = self.role
        claims = self.link.claims(time)
        if self.game.game_phase is GamePhase.SHOOT_OUT:
            self.role = Role.STRIKER if self.game.own_kick else Role.KEEPER
        elif self.identity.roles:
            self.role = self._roles.update(
                time,
                self._seconds_to_ball(state),
                claims,
                ball=self._ball(state),
                goalkeeper=self.game.goalkeeper,
                playing=self.game.phase is Phase.PLAYING,
            )
        else:
            self.role = Role.KEEPER if self.game.goalkeeper else Role.STRIKER
        self._urgent = self._urgent or self.role is not before
        self._decision = self._mind.update(
            state, body, self.game, self.role, self._striker(state, claims),
            self._rank(state, claims),
        )  # fmt: skip
        self._state = state
        return self._decision

    def _watch_indirect_kick(self, state: WorldState, time: float) -> None:
        """Who takes an indirect free kick cannot score before somebody else touches the ball."""
        game, ball = self.game, state.ball
        playing = game.phase is Phase.PLAYING
        if playing and game.set_play is SetPlay.INDIRECT_FREE_KICK:
            takes = game.own_kick is True and self.role is Role.STRIKER
            self._took_kick = time if takes else None
        elif self._took_kick is not None:
            touched = ball is not None and any(
                math.dist(each.position, ball.position) < TOUCHED for each in state.obstacles
            )
            goes_on = playing and game.set_play is SetPlay.NONE and not touched
            if not (goes_on and 0.0 <= time - self._took_kick < TOUCH_WAIT):
                self._took_kick = None
        if game.may_score is not (self._took_kick is None):
            self.game = replace(game, may_score=self._took_kick is None)

    def look(self, decision: Decision) -> Goal | None:
        """Where the head looks after a decision; None leaves it to the gait."""
        return self._looking.goal(decision.action.head, decision.world)

    def _entries(self) -> tuple[Pose2, ...]:
        """Where the robot stands before a half, or after a penalty that took it off the field."""
        game, half = self.game, self._field.length / 2.0
        if game.game_phase is GamePhase.SHOOT_OUT:
            kicks = half - self._field.penalty_area_length, 0.0, 0.0
            return (kicks,) if game.own_kick else ((-half, 0.0, 0.0),)
        if game.phase in (Phase.INITIAL, Phase.STANDBY) and self._start is not None:
            return (self._start,)
        return self._field.entries()

    def _rank(self, state: WorldState, claims: list[Claim]) -> int:
        """The place among the supporters, in the order of their numbers.

        In play the one nearest to the own goal comes first, so that none changes places with
        another one when the striker changes. All compare what was told last.
        """
        own = self.identity.player
        others = [each.number for each in claims if each.role is Role.SUPPORTER]
        numbers = sorted((own, *others))
        if self.game.phase is Phase.PLAYING:
            along = {mate.number: mate.pose[0] for mate in state.mates if mate.valid}
            along[own] = state.own.pose[0]
            if along.keys() >= set(numbers):
                last = min(numbers, key=lambda number: along[number] + SAME_PLACE * number)
                numbers = [last, *(each for each in numbers if each != last)]
        return numbers.index(own)

    def _restart(self, time: float) -> None:
        """The clock has begun again: drop everything that waits for a time of the old one."""
        self._mind.reset()
        self._roles = RoleChoice(self.identity.player)
        self.link.reset()
        self._packet_time = min(self._packet_time, time)

    def _seconds_to_ball(self, state: WorldState) -> float:
        plan = None if self._decision is None else self._decision.plan
        ball = state.ball
        game = self.game
        away = game.penalized or game.stopped or state.blind or self._mind.lost
        # Somebody else has to touch the ball of an indirect free kick.
        away = away or (not game.may_score and game.set_play is SetPlay.NONE)
        if plan is None or ball is None or ball.age > BALL_AGE or away:
            return NEVER
        down = 0.0 if state.upright else GETTING_UP_TIME
        return min(plan.approach + down, NEVER)

    def _ball(self, state: WorldState) -> Point2 | None:
        ball = state.ball
        playing = self.game.phase is Phase.PLAYING and self.game.ball_free
        seen = ball is not None and ball.seen_recently and playing
        return ball.position_in_field if ball is not None and seen else None

    def _striker(self, state: WorldState, claims: list[Claim]) -> TeamMate | None:
        if self.role is Role.STRIKER:
            return None
        numbers = [each.number for each in claims if each.role is Role.STRIKER]
        return next((mate for mate in state.mates if mate.number in numbers), None)

    # -- telling -----------------------------------------------------------------------------------

    @property
    def remark(self) -> str:
        """Why the robot stands or lacks something that it should have; empty if all is well."""
        state, game = self._state, self.game
        if state is None:
            return ""
        if state.image_age > IMAGE_AGE_MAX:
            return f"no usable image for {state.image_age:.0f} s: the robot stands"
        if state.blind:
            return f"nothing seen in the images for {state.sight_age:.0f} s: the robot stands"
        silence = state.stamp * 1e-9 - self._packet_time
        if self.identity.waits and self._packet is None:
            return "no referee heard yet: the robot stands"
        if self.identity.waits and silence > REFEREE_SILENCE:
            return f"referee not heard for {silence:.0f} s: {game.phase.value} goes on"
        plays = state.upright and game.phase is Phase.PLAYING and not game.penalized
        if game.competition in (Competition.MOST_PASSES, Competition.OTHER):
            return f"competition {game.competition.value}: this robot plays for goals all the same"
        if self._mind.lost and plays:
            return "own pose not valid: the robot looks for landmarks"
        alone = self.identity.roles and self.identity.players > 1 and not state.mates
        if alone and game.phase is Phase.PLAYING:
            return "no team mate heard: this robot plays as if alone"
        return ""

    def team_message(self, time: float) -> bytes | None:
        """The team message to send now; None = none. Call it after `decide`."""
        game = self.game
        silent = game.phase in (Phase.INITIAL, Phase.STANDBY, Phase.FINISHED)
        silent = silent or game.game_phase in (GamePhase.TIMEOUT, GamePhase.SHOOT_OUT)
        if self._state is None or silent or not self.identity.roles:
            return None
        data = self.link.send(
            time,
            self._message,
            urgent=self._urgent,
            budget=game.message_budget,
            remaining=self._time_of_game.left(game),
        )
        if data is not None:
            self._urgent = False
        return data

    def _message(self, count: int) -> TeamMessage:
        state = self._state
        assert state is not None
        ball = None
        if state.ball_from_self is not None:
            own = state.ball_from_self
            deviation = math.sqrt(max(0.0, 0.5 * (own.covariance[0] + own.covariance[2])))
            ball = BallMessage(own.position, own.velocity, min(deviation, 30.0), own.age)
        return TeamMessage(
            team=self.identity.team,
            player=self.identity.player,
            count=count,
            time=state.stamp // 1_000_000,
            pose=state.own.pose,
            valid=state.own.valid,
            fallen=not state.upright,
            penalized=self.game.penalized,
            role=self.role,
            seconds_to_ball=self._seconds_to_ball(state),
            ball=ball,
            robots=seen_robots(state, self.identity.color),
        )

    def return_message(self) -> bytes:
        """What the GameController is told."""
        state = self._state
        me = self.identity
        if state is None:
            return ReturnMessage(me.player, me.team).encode()
        ball = state.ball
        return ReturnMessage(
            me.player,
            me.team,
            not state.upright,
            state.own.pose,
            None if ball is None else ball.age,
            (0.0, 0.0) if ball is None else ball.position,
        ).encode()


def seen_robots(state: WorldState, color: str) -> tuple[TeamRobot, ...]:
    """The robots that the own cameras saw lately, for team messages; the nearest first."""
    if not state.own.valid:
        return ()
    return tuple(
        TeamRobot(each.position_in_field, each.age, each.team == color)
        for each in state.obstacles
        if not each.by_team and each.age < ROBOT_AGE
    )
