"""The referee: keeps the rules of a short match from the true places of ball and robots.

Pure: it is given the time and where everything is, and returns what is to be done in the world and
what the robots are told. Places are in the frame of the field (see `robot_core.field`); the teams
do not change sides, but before the second half all robots are carried to where they stood before
the first one, and no penalty goes on.

The rules are a short form of those of the Standard Platform League. Different, because a simulated
robot is not carried: a robot that lies for too long or leaves the field is put beside the touch
line and waits out its penalty there; a ball that was out is put a little inside of the line.
"""

import math
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import attrs

from nao_soccer.game_state import Phase, SetPlay
from nao_soccer.referee.protocol import (
    MAX_PLAYERS,
    ControlMessage,
    Penalty,
    PlayerInfo,
    TeamInfo,
)
from robot_core.field import SIDES, TEAMS, BallPlace, Field, Goals
from robot_core.schema import Settings, number
from robot_core.types import Point2, Point3, Pose2

TEAM_NUMBERS = {"red": 1, "blue": 2}
"""Number of each team in messages."""
COLOR_CODES = {"red": 1, "blue": 0}
"""Colour of each team in messages."""
TOUCH = 0.28
"""[m] between the middles of a ball and the robot that is said to have moved it."""
ROOM = 0.25
"""[m] between a robot and a ball that is put down."""
TOUCH_SPEED = 0.15
"""[m/s] by which a touch changes the velocity of the ball; one that only rolls past a robot loses
0.03 m/s between two looks."""
KEEPER_FROM = 3
"""Robots in a team, from which on one of them keeps the goal."""
ENTRY_ROOM = 0.6
"""[m] between two robots that wait beside the touch line."""
MOVED = 0.1
"""[m] by which the ball has to move to be in play, or not to be stuck."""


@attrs.frozen
class Rules(Settings):
    """Times of a match."""

    half: float = number(120.0, 5.0, 3600.0, "s", "Duration of a half.")
    initial: float = number(1.0, 0.0, 120.0, "s", "Before a half.")
    standby: float = number(1.0, 0.0, 120.0, "s", "From then to the sign for the robots to walk.")
    ready: float = number(15.0, 1.0, 120.0, "s", "To walk to the places for a kick-off.")
    set: float = number(3.0, 1.0, 60.0, "s", "Of standing before a kick-off.")
    pause: float = number(2.0, 0.0, 600.0, "s", "Between the halves.")
    free: float = number(10.0, 0.0, 60.0, "s", "After which both teams may play the ball.")
    out: float = number(1.0, 0.0, 10.0, "s", "Until a ball that is out is put back.")
    inside: float = number(0.2, 0.0, 1.0, "m", "From the line to a ball that was put back.")
    fallen: float = number(20.0, 1.0, 120.0, "s", "A robot may lie.")
    leave: float = number(0.35, 0.0, 5.0, "m", "A robot may walk beyond the lines.")
    half_slack: float = number(
        0.3, 0.0, 5.0, "m", "A robot may be in the other half at a kick-off."
    )
    penalty: float = number(15.0, 0.0, 120.0, "s", "Duration of a penalty.")
    stuck: float = number(30.0, 5.0, 600.0, "s", "After which a ball that rests is put away.")
    budget: int = number(1200, 0, 65535, whole=True, meaning="Announced message budget of a team.")

    @property
    def duration(self) -> float:
        """[s] of a match with one kick-off in each half; goals do not make it longer."""
        return 2.0 * (self.initial + self.standby + self.ready + self.set + self.half) + self.pause


class RobotPlace(NamedTuple):
    """Where a robot is.

    Attributes:
        position: x, y [m].
        upright: It stands or walks.
    """

    position: Point2
    upright: bool


class PutBall(NamedTuple):
    """The ball is to be put somewhere.

    Attributes:
        position: x, y [m].
    """

    position: Point2


class PutRobot(NamedTuple):
    """A robot is to be put somewhere; `Referee.not_put_back` if that cannot be done now.

    Attributes:
        name: The robot.
        pose: x, y [m], yaw [rad].
    """

    name: str
    pose: Pose2


Order = PutBall | PutRobot


class Goal(NamedTuple):
    """A goal.

    Attributes:
        time: [s] of the match.
        team: Team that scored.
        player: Name of the robot that touched the ball last; empty if unknown.
        own: A robot of the other team did it.
    """

    time: float
    team: str
    player: str
    own: bool


@dataclass(slots=True)
class _Player:
    team: str
    number: int
    lies_since: float | None = None
    penalty: Penalty = Penalty.NONE
    until: float = 0.0


@dataclass(slots=True)
class _Ball:
    touched_by: str = ""
    moved_from: Point2 = (0.0, 0.0)
    moved_at: float = 0.0
    out_since: float | None = None
    last: Point2 = (0.0, 0.0)
    velocity: Point2 = (0.0, 0.0)
    placed: Point2 | None = None


class Referee:
    """One match.

    Args:
        field: The field.
        goals: The goals.
        players: Team and number of each robot, by name.
        rules: Times of the match.
        ball_radius: [m]
        goalkeepers: Number of each team's goalkeeper; a team that is left out has none. None =
            player 1 of each team of `KEEPER_FROM` or more.
        kick_off: Team that kicks off first.

    Attributes:
        phase: Phase of the game.
        set_play: The set play that is not over.
        goals_scored: The goals so far.
        falls: Number of falls of each robot.
        messages: Team messages that were heard, by team; they reduce the announced budget.
    """

    def __init__(
        self,
        field: Field,
        goals: Goals | None,
        players: Mapping[str, tuple[str, int]],
        rules: Rules | None = None,
        ball_radius: float = 0.05,
        goalkeepers: Mapping[str, int] | None = None,
        kick_off: str = "red",
    ) -> None:
        self.rules = Rules() if rules is None else rules
        self.goals_scored: list[Goal] = []
        self.falls = dict.fromkeys(players, 0)
        self.messages = dict.fromkeys(TEAMS, 0)
        self._field = field
        self._goals = goals
        self._radius = ball_radius
        self._players = {name: _Player(*each) for name, each in players.items()}
        self._not_put_back: set[str] = set()
        self._starts: dict[str, Point2] = {}
        self._carried: set[str] = set()
        if goalkeepers is None:
            sizes = Counter(team for team, _ in players.values())
            goalkeepers = {team: 1 for team, size in sizes.items() if size >= KEEPER_FROM}
        self._keepers = dict(goalkeepers)
        self._first_kick = kick_off
        self._kicks: str | None = kick_off
        self.phase = Phase.INITIAL
        self._since = 0.0
        self._half = 0
        self._half_ends = 0.0
        self.set_play = SetPlay.NONE
        self._free_at = 0.0
        self._ball = _Ball()
        self._packet = 0
        self._time = 0.0

    # -- state -------------------------------------------------------------------------------------

    @property
    def over(self) -> bool:
        """The match has ended."""
        return self.phase is Phase.FINISHED and self._half >= 2

    @property
    def score(self) -> dict[str, int]:
        """Goals by team."""
        return {team: sum(goal.team == team for goal in self.goals_scored) for team in TEAMS}

    @property
    def kicking(self) -> str:
        """The team that has the kick-off or the set play; empty while both may play the ball."""
        return self._kicks or ""

    def penalty(self, name: str) -> Penalty:
        """The penalty of a robot."""
        return self._players[name].penalty

    def penalized(self, name: str) -> bool:
        """Whether a robot may not play."""
        return self._players[name].penalty is not Penalty.NONE

    def message(self, version: int = 18) -> ControlMessage:
        """What the robots are told now; each call counts as a packet."""
        self._packet = (self._packet + 1) % 256
        return ControlMessage(
            teams=(self._team("red"), self._team("blue")),
            phase=self.phase,
            set_play=self.set_play,
            kicking_team=None if self._kicks is None else TEAM_NUMBERS[self._kicks],
            first_half=self._half < 2,
            seconds_remaining=_whole(self._half_ends - self._time)
            if self._half_ends
            else round(self.rules.half),
            secondary_time=_whole(self._secondary()),
            players_per_team=max(Counter(each.team for each in self._players.values()).values()),
            packet=self._packet,
            version=version,
        )

    def _secondary(self) -> float:
        """Time [s] until the phase ends, or until both teams may play the ball."""
        rules, phase = self.rules, self.phase
        if phase is Phase.PLAYING:
            return self._free_at - self._time if self._kicks is not None else 0.0
        lasts = {
            Phase.READY: rules.ready,
            Phase.SET: rules.set,
            Phase.FINISHED: 0.0 if self.over else rules.pause,
        }
        return lasts.get(phase, 0.0) - (self._time - self._since)

    def _team(self, team: str) -> TeamInfo:
        infos = [PlayerInfo(Penalty.SUBSTITUTE)] * MAX_PLAYERS  # of those who are not in the match
        for player in self._players.values():
            if player.team == team:
                left = max(0, min(255, math.ceil(player.until - self._time)))
                away = player.penalty is not Penalty.NONE
                infos[player.number - 1] = PlayerInfo(player.penalty, left if away else 0)
        return TeamInfo(
            TEAM_NUMBERS[team], self.score[team], self._keepers.get(team, 0),
            max(0, self.rules.budget - self.messages[team]),
            COLOR_CODES[team], COLOR_CODES[team], tuple(infos),
        )  # fmt: skip

    # -- update ------------------------------------------------------------------------------------

    def not_put_back(self, name: str) -> None:
        """A robot could not be put back, for example because something is there.

        The next update orders it again, unless the penalty has ended by then. A robot that could
        not be carried to its place for the second half by then is taken off.
        """
        self._not_put_back.add(name)

    def update(
        self, time: float, ball: Point3, robots: Mapping[str, RobotPlace]
    ) -> Sequence[Order]:
        """What is to be done now.

        Args:
            time: [s] since the match began; it increases.
            ball: x, y, z [m].
            robots: Where each robot is; one that is left out is not judged.
        """
        since, self._time = time - self._time, time
        orders: list[Order] = []
        self._watch_ball(ball, robots, since)
        waiting, self._not_put_back = self._not_put_back, set()
        self._watch_robots(robots, orders)
        for name in sorted(waiting):
            if self.penalized(name):
                self._take_off(name, robots, orders)
            elif name in self._carried and self.phase is Phase.READY:
                self._punish(name, Penalty.PICK_UP, robots, orders)
            elif name in self._carried:
                self._carry(name, orders)
        if self._half < 2 and self.phase in (Phase.INITIAL, Phase.STANDBY):
            for name, robot in robots.items():
                self._starts.setdefault(name, robot.position)
        if self.phase is Phase.INITIAL:
            self._half = max(self._half, 1)
            if time - self._since >= self.rules.initial:
                self._enter(Phase.STANDBY)
        elif self.phase is Phase.STANDBY:
            if time - self._since >= self.rules.standby:
                self._enter(Phase.READY)
        elif self.phase is Phase.READY:
            if time - self._since >= self.rules.ready:
                self._enter(Phase.SET)
                self._carried.clear()
                self._clear_places(robots, orders)
                self._put((0.0, 0.0), robots, orders)
        elif self.phase is Phase.SET:
            if time - self._since >= self.rules.set:
                self._begin_play(ball)
        elif self.phase is Phase.PLAYING:
            self._play(ball, robots, orders)
        elif not self.over and time - self._since >= self.rules.pause:
            self._half, self._half_ends = 2, 0.0
            self._kicks = _other(self._first_kick)
            self._enter(Phase.INITIAL)
            for name in self._players:
                self._players[name].penalty = Penalty.NONE
                self._carry(name, orders)
        if self._half_ends and time >= self._half_ends and self.phase is not Phase.FINISHED:
            self._enter(Phase.FINISHED)
            self.set_play, self._kicks = SetPlay.NONE, None
        return orders

    def _carry(self, name: str, orders: list[Order]) -> None:
        """Order a robot to where it stood before the first half."""
        if name in self._starts:
            self._carried.add(name)
            turn = 0.0 if self._players[name].team == TEAMS[0] else math.pi
            orders.append(PutRobot(name, (*self._starts[name], turn)))

    def _clear_places(self, robots: Mapping[str, RobotPlace], orders: list[Order]) -> None:
        """Punish robots that are in the half of the other team at a kick-off."""
        for name, player in self._players.items():
            robot = robots.get(name)
            if robot is None or player.penalty is not Penalty.NONE:
                continue
            own_side = SIDES[TEAMS.index(player.team)]
            if -own_side * robot.position[0] > self.rules.half_slack:
                self._punish(name, Penalty.ILLEGAL_POSITION, robots, orders)

    def _begin_play(self, ball: Point3) -> None:
        if not self._half_ends:
            self._half_ends = self._time + self.rules.half
        self._enter(Phase.PLAYING)
        self._free_at = self._time + self.rules.free
        self._restart_ball(ball)

    def _enter(self, phase: Phase) -> None:
        self.phase, self._since = phase, self._time

    def _restart_ball(self, ball: Point3) -> None:
        self._ball.placed = ball[:2]
        self._ball.moved_from, self._ball.moved_at = ball[:2], self._time
        self._ball.out_since = None

    def _watch_ball(
        self, ball: Point3, robots: Mapping[str, RobotPlace], since: float
    ) -> None:
        here, state = ball[:2], self._ball
        before = state.velocity
        if since > 0.0:
            state.velocity = (
                (here[0] - state.last[0]) / since,
                (here[1] - state.last[1]) / since,
            )
        if math.dist(state.velocity, before) > TOUCH_SPEED:
            hit = state.velocity[0] - before[0], state.velocity[1] - before[1]
            # Where it was hit comes first: a hard kick takes it to another robot at once.
            state.touched_by = (
                self._beside(state.last, robots, hit)
                or self._beside(here, robots, hit)
                or self._beside(state.last, robots)
                or self._beside(here, robots)
                or state.touched_by
            )
        state.last = here
        if math.dist(here, state.moved_from) > MOVED:
            state.moved_from, state.moved_at = here, self._time

    def _beside(
        self, ball: Point2, robots: Mapping[str, RobotPlace], hit: Point2 = (0.0, 0.0)
    ) -> str:
        """Name of the robot that is near enough to have touched a ball; empty if none is.

        `hit` is the change of the ball's velocity [m/s]; it leads away from the robot that did it.
        """
        gap, name = min(
            (
                (math.dist(ball, (x, y)), name)
                for name, ((x, y), _) in robots.items()
                if name in self._players and hit[0] * (ball[0] - x) + hit[1] * (ball[1] - y) >= 0.0
            ),
            default=(math.inf, ""),
        )
        return name if gap < TOUCH else ""

    def _watch_robots(self, robots: Mapping[str, RobotPlace], orders: list[Order]) -> None:
        x, y = self._field.length / 2.0, self._field.width / 2.0
        for name, player in self._players.items():
            robot = robots.get(name)
            if robot is None:
                continue
            if robot.upright:
                player.lies_since = None
            elif player.lies_since is None:
                player.lies_since = self._time
                self.falls[name] += 1
            if player.penalty is not Penalty.NONE:
                if self._time >= player.until:
                    player.penalty = Penalty.NONE
                continue
            beyond = max(abs(robot.position[0]) - x, abs(robot.position[1]) - y)
            lies = player.lies_since is not None
            if lies and self._time - (player.lies_since or 0.0) > self.rules.fallen:
                self._punish(name, Penalty.INCAPABLE, robots, orders)
            elif beyond > self.rules.leave and self.phase is Phase.PLAYING:
                self._punish(name, Penalty.LEAVING, robots, orders)

    def _punish(
        self,
        name: str,
        penalty: Penalty,
        robots: Mapping[str, RobotPlace],
        orders: list[Order],
    ) -> None:
        player = self._players[name]
        player.penalty, player.until = penalty, self._time + self.rules.penalty
        if player.lies_since is not None:
            player.lies_since = player.until  # time to get up begins after it
        self._take_off(name, robots, orders)

    def _take_off(
        self, name: str, robots: Mapping[str, RobotPlace], orders: list[Order]
    ) -> None:
        """Order a robot beside the nearer touch line, at the height of its own penalty mark."""
        turn = 1.0 if self._players[name].team == TEAMS[0] else -1.0
        entries = [
            (turn * x, turn * y, math.remainder(yaw + (math.pi if turn < 0.0 else 0.0), math.tau))
            for x, y, yaw in self._field.entries()
        ]
        here = robots[name].position[1] if name in robots else 0.0
        entries.sort(key=lambda pose: abs(pose[1] - here))
        taken = [place.position for other, place in robots.items() if other != name]
        taken += [order.pose[:2] for order in orders if isinstance(order, PutRobot)]
        # If that is taken, as near as possible, but in its own half.
        tried = [
            (x + step * ENTRY_ROOM, y, yaw)
            for step in (0, turn, -turn)
            for x, y, yaw in entries
            if turn * (x + step * ENTRY_ROOM) < 0.0
        ]
        free = [
            pose for pose in tried
            if all(math.dist(pose[:2], place) > ENTRY_ROOM - 0.1 for place in taken)
        ]  # fmt: skip
        orders.append(PutRobot(name, (free or tried)[0]))

    # -- the ball in play --------------------------------------------------------------------------

    def _play(self, ball: Point3, robots: Mapping[str, RobotPlace], orders: list[Order]) -> None:
        state = self._ball
        if self._kicks is not None:
            moved = state.placed is not None and math.dist(ball[:2], state.placed) > MOVED
            if moved or self._time >= self._free_at:
                self._kicks, self.set_play = None, SetPlay.NONE
        place = self._field.place_of(ball, self._radius, self._goals)
        if place in (BallPlace.IN_RED_GOAL, BallPlace.IN_BLUE_GOAL):
            self._score("blue" if place is BallPlace.IN_RED_GOAL else "red")
        elif place is BallPlace.OUT:
            if state.out_since is None:
                state.out_since = self._time
            if self._time - state.out_since >= self.rules.out:
                self._put_back(ball, robots, orders)
        else:
            state.out_since = None
            if self._time - state.moved_at > self.rules.stuck:
                self._put((0.0, 0.0), robots, orders)

    def _score(self, team: str) -> None:
        name = self._ball.touched_by
        scorer = self._players.get(name)
        own = scorer is not None and scorer.team != team
        self.goals_scored.append(Goal(self._time, team, name, own))
        self._kicks, self.set_play = _other(team), SetPlay.NONE
        self._enter(Phase.READY)

    def _put_back(
        self, ball: Point3, robots: Mapping[str, RobotPlace], orders: list[Order]
    ) -> None:
        x, y = self._field.length / 2.0, self._field.width / 2.0
        touched = self._players.get(self._ball.touched_by)
        last = touched.team if touched is not None else None
        inside = self.rules.inside
        across = math.copysign(y - inside, ball[1])
        if abs(ball[1]) - y > abs(ball[0]) - x:
            kind, to = SetPlay.KICK_IN, None if last is None else _other(last)
            place = (min(max(ball[0], inside - x), x - inside), across)
        else:
            side = math.copysign(1.0, ball[0])
            defender = TEAMS[SIDES.index(side)]
            if last == defender:
                kind, to = SetPlay.CORNER_KICK, _other(defender)
                place = (side * (x - inside), across)
            else:
                kind, to = SetPlay.GOAL_KICK, defender
                depth = self._field.penalty_mark or 0.3 * x
                place = (side * (x - depth), math.copysign(0.3 * y, ball[1]))
        self.set_play, self._kicks = (kind, to) if to is not None else (SetPlay.NONE, None)
        self._free_at = self._time + self.rules.free
        self._put(place, robots, orders)

    def _put(self, place: Point2, robots: Mapping[str, RobotPlace], orders: list[Order]) -> None:
        """Put the ball to a place, or beside it if a robot is there."""
        place = free_place(place, [robot.position for robot in robots.values()])
        orders.append(PutBall(place))
        self._restart_ball((*place, 0.0))
        self._ball.last, self._ball.touched_by = place, ""
        self._ball.velocity = (0.0, 0.0)


def free_place(place: Point2, robots: Sequence[Point2]) -> Point2:
    """The place, or the nearest one towards the centre that is `ROOM` away from all robots."""
    x, y = place
    for step in range(20):
        share = 1.0 - 0.05 * step
        # The centre itself has no way to the centre: beside it, along y.
        tried = (x * share, y * share if place != (0.0, 0.0) else 0.05 * step)
        if all(math.dist(tried, robot) > ROOM for robot in robots):
            return tried
    return place


def _whole(seconds: float) -> int:
    """Seconds to tell: never more than there were, whatever the sum of many short times."""
    return max(0, math.ceil(seconds - 1e-6))


def _other(team: str) -> str:
    return TEAMS[1 - TEAMS.index(team)]
