"""Technical challenges of the RoboCup Standard Platform League, alone on the field.

Places and referees: `challenge_rules`.

- `walk straight`: from 0.5 m behind one touchline, in line with the penalty mark, to the other
  touchline. The time runs from the touch of the first line to the touch of the second one.
- `walk slalom`: the same around four robots that stand still, past each on the side of the example
  path. The robot must not touch them.
- `ball control`: the ball lies on the touchline. The time runs from the start until robot and ball
  are wholly beyond the other touchline, and 30 s more for each time that the ball is more than
  0.75 m away or touches one of the standing robots.
- `best kick`: from the middle of the goal area's edge to the centre mark, the opposite penalty mark
  and an opposite corner. What is left from the ball at rest to each target is added up. The ball
  must not be touched again once it has moved.

The robot walks by its own world model, with percepts by the model of their errors; the truth judges
only. It knows the places of robots and lines from the rules. It plays towards positive x, and walks
towards positive y. The time starts after it has stood for a while, as it was placed.
"""

import math
from collections.abc import Callable, Iterator, Sequence
from contextlib import AbstractContextManager
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np

from gait_lab.soccer.challenge_rules import (
    LIMIT,
    SIDES,
    ControlReferee,
    Course,
    KickReferee,
    Past,
    WalkReferee,
    Way,
)
from gait_lab.soccer.pitch import PitchSpec, parts_of
from nao_soccer.behavior.ball_plan import BallPlan, Planner
from nao_soccer.behavior.kicks import Kick, KickTable, kicks_of
from nao_soccer.behavior.mind import Decision
from nao_soccer.behavior.situation import Action, Body
from nao_soccer.behavior.walking import WalkLimits
from nao_soccer.game_state import GameState, Phase
from nao_soccer.player import Player
from nao_soccer.world.state import HeadMode, WorldState
from robot_core.errors import NaoGaitError
from robot_core.field import Field, Goals
from robot_core.geometry import relative
from robot_core.types import GaitState, Point2, Pose2
from sim_bridge.engines.backend import BALL
from sim_bridge.scene import load_scene
from sim_bridge.trials.trial import CONTROL_PERIOD, Tick

STAND = 3.0
"""[s] of standing and looking around before the start."""
OUT_OF_THE_WAY = -3.0, 0.0
"""[m] where the ball lies during a walk."""
WALK_SPEED = 0.43
"""[m/s]"""
WALK_STEER = 2.0
"""[1/s] Turning speed over the bearing of the way. Commands act a step later: with 3 / s the robot
swings by 15 degrees."""
WALK_AHEAD = 0.35
"""[m] along the way, to which the robot walks."""
WALK_GAP, WALK_LONG = 0.36, 0.1
"""[m] between the way and the middle of an obstacle, which stands broadside to the way, and by how
much more the way leads around its arms; two obstacles stand beside a goal post."""
BALL_AHEAD = 0.5
"""[m] along the way, to which the ball is dribbled."""
BALL_GAP = 0.5
"""[m] between the ball's way and the middle of an obstacle."""
BALL_PAST = (0, 1.0), (2, -1.0)
"""Obstacles and the sides on which the ball passes them; the others are not in its way."""
BALL_SPEED = 0.24
"""[m/s] of the robot that dribbles: a faster foot sends the ball away."""
KEEP_FOOT = 0.05
"""[m] by which the way to the ball has to be shorter with the other foot."""


# -- players ---------------------------------------------------------------------------------------


class WayFollower(Player):
    """A player that follows a way as fast as it can."""

    def __init__(self, way: Way, *args: Any) -> None:
        super().__init__(*args)
        self._way = way

    def decide_in(self, state: WorldState, body: Body) -> Decision:
        """Walk towards the next piece of the way."""
        decision = super().decide_in(state, body)
        if self.game.phase is not Phase.PLAYING or not state.upright:
            return decision
        target = self._way.ahead(state.own.pose[:2], WALK_AHEAD)
        x, y, _ = relative((*target, 0.0), state.own.pose)
        bearing = math.atan2(y, x)
        ahead = WALK_SPEED * max(0.0, math.cos(bearing))
        walk = WalkLimits(forward=WALK_SPEED).command(ahead, 0.0, WALK_STEER * bearing)
        return decision._replace(action=Action(walk, head=HeadMode.LOCALIZE))


class AlongWay(Planner):
    """Dribbles the ball along a way."""

    def __init__(
        self, way: Way, table: KickTable, limits: WalkLimits, field: Field, goals: Goals
    ) -> None:
        super().__init__(table, limits, field, goals)
        self._way = way

    def choose(
        self,
        own: Pose2,
        ball: Point2,
        robots: Sequence[Point2] = (),
        before: BallPlan | None = None,
        **situation: bool,
    ) -> BallPlan:
        """With the foot that is nearer to its place; see `Planner`."""
        x, y = self._way.ahead(ball, BALL_AHEAD)
        direction = math.atan2(y - ball[1], x - ball[0])

        def walk(foot: Kick) -> float:
            change = before is not None and foot.motion != before.name
            return math.dist(foot.robot_pose(ball, direction)[:2], own[:2]) + KEEP_FOOT * change

        # The toes send the ball straight ahead, the outer edge of a foot nearly anywhere.
        toes = sorted(self._table.dribbles, key=lambda each: each.direction_spread)[:2]
        return BallPlan(min(toes, key=walk), True, direction, 0.0, 0.0)


class Dribbler(Player):
    """A player that keeps the ball at its feet: a kick in the walk would send it too far away."""

    def decide_in(self, state: WorldState, body: Body) -> Decision:
        """Walk against the ball only."""
        decision = super().decide_in(state, body)
        return decision._replace(action=replace(decision.action, kick=None))


class AtTarget(Planner):
    """Kicks the ball as near to a target x, y [m] as it can."""

    def __init__(
        self, target: Point2, table: KickTable, limits: WalkLimits, field: Field, goals: Goals
    ) -> None:
        super().__init__(table, limits, field, goals)
        self._target = target

    def choose(self, own: Pose2, ball: Point2, *more: Any, **situation: Any) -> BallPlan:
        """By the kick that rolls as far as the target; see `Planner`."""
        far = math.dist(ball, self._target)
        kick = min(
            self._table.kicks,
            key=lambda each: math.hypot(far - each.distance, each.distance_spread),
        )
        direction = math.atan2(self._target[1] - ball[1], self._target[0] - ball[0])
        return BallPlan(kick, False, direction, 0.0, 0.0)


class Kicker(Player):
    """A player that stands still after its kick."""

    def decide_in(self, state: WorldState, body: Body) -> Decision:
        """Kick once."""
        if body.state is GaitState.MOTION:
            self.game = GameState(phase=Phase.FINISHED)
        return super().decide_in(state, body)


# -- attempts --------------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True, kw_only=True)
class ChallengeSpec(PitchSpec):
    """One robot at one challenge.

    Attributes:
        name: One of `CHALLENGES`.
        limit: [s] after which an attempt has failed.
    """

    name: str
    scene: str = "pitch"
    limit: float = LIMIT


@dataclass(frozen=True, slots=True)
class ChallengeResult:
    """What came of it.

    Attributes:
        score: [s] or [m], the less the better; None = not done by the rules.
        parts: [m] left to each target of the best kick; None = not by the rules.
    """

    spec: ChallengeSpec
    score: float | None
    penalties: int
    parts: tuple[float | None, ...]
    doing: str


def play_challenge(spec: ChallengeSpec) -> ChallengeResult:
    """Run one attempt."""
    return CHALLENGES[spec.name](spec)


class _Attempt(AbstractContextManager["_Attempt"]):
    """A robot on the field, and those that stand there."""

    def __init__(
        self,
        spec: ChallengeSpec,
        start: Pose2,
        ball: Point2,
        obstacles: Sequence[Point2] = (),
    ) -> None:
        self.spec = spec
        self.pitch = spec.practice([start], [(x, y, math.pi) for x, y in obstacles])
        self.pitch.world.put_ball(*ball)
        self.player = self.pitch.players[0]
        for other in self.pitch.players[1:]:
            other.runs = False

    def run(
        self, kind: Callable[..., Player]
    ) -> Iterator[tuple[float, Tick, set[tuple[int, int]]]]:
        """Let a kind of player play: time [s] from the start on, its tick, what touches what."""
        pitch, begins = self.pitch, round(STAND / CONTROL_PERIOD)
        pitch.restart_player(0, kind)
        player = self.player.player
        player.game = GameState(phase=Phase.SET)
        for ticks in pitch.run():
            if pitch.count == begins:
                player.game = GameState(phase=Phase.PLAYING)
            time = (pitch.count - begins) * CONTROL_PERIOD
            if time < 0.0:
                continue
            yield time, ticks[0], pitch.world.touches
            if time > self.spec.limit:
                return

    def feet(self, tick: Tick, *, loaded: bool) -> list[Point2]:
        """x, y [m] of points of the soles: of those that carry the robot, or of both."""
        truth, body = tick.truth, self.pitch.world.robots[0].body
        found: list[Point2] = []
        for sole, pose, force in zip(body.soles, truth.soles, truth.sole_force, strict=True):
            if force > 0.0 or not loaded:
                points = np.array(sole.points) @ pose.rotation.T + pose.position
                found += [(x, y) for x, y, _ in points.tolist()]
        return found

    def result(self, score: float | None, doing: str, penalties: int = 0) -> ChallengeResult:
        """What came of it."""
        return ChallengeResult(self.spec, score, penalties, (), doing)

    def __exit__(self, *_: object) -> None:
        self.pitch.world.close()


def _walk(spec: ChallengeSpec, *, weaves: bool) -> ChallengeResult:
    course = Course.on(_field(spec))
    others = course.obstacles if weaves else ()
    past = [
        Past((x, y + arm), side * WALK_GAP)
        for (x, y), side in zip(others, SIDES, strict=False)
        for arm in (-WALK_LONG, WALK_LONG)
    ]
    with _Attempt(spec, course.start, OUT_OF_THE_WAY, others) as attempt:
        referee = WalkReferee(course, weaves=weaves)
        for time, tick, pairs in attempt.run(partial(WayFollower, course.way(*past))):
            place = attempt.pitch.poses[0][:2]
            touches = any(0 in pair and BALL not in pair for pair in pairs)
            referee.update(time, place, attempt.feet(tick, loaded=True), touches=touches)
            if referee.ended is not None or referee.touched:
                break
        wrong = "" if referee.passed else ", past an obstacle on the wrong side"
        touched = ", touched an obstacle" if referee.touched else ""
        doing = f"at {place[0]:.2f}, {place[1]:.2f} m{touched}{wrong}"
        return attempt.result(referee.seconds, doing)


def _control(spec: ChallengeSpec) -> ChallengeResult:
    course = Course.on(_field(spec))
    ball = course.x, -course.touchline
    with _Attempt(spec, course.start, ball, course.obstacles) as attempt:
        pitch, limits = attempt.pitch, WalkLimits(forward=BALL_SPEED)
        table = kicks_of(pitch.world.robots[0].description.motions)
        way = course.way(
            *(Past(course.obstacles[index], side * BALL_GAP) for index, side in BALL_PAST)
        )
        planner = AlongWay(way, table, limits, pitch.field, pitch.goals)
        referee = ControlReferee(course, pitch.ball_radius)
        for time, tick, pairs in attempt.run(partial(Dribbler, limits=limits, planner=planner)):
            referee.update(
                time, pitch.ball, pitch.poses[0][:2],
                attempt.feet(tick, loaded=False),
                touches=any(BALL in pair and 0 not in pair for pair in pairs),
            )  # fmt: skip
            if referee.ended is not None:
                break
        x, y = pitch.ball
        doing = (
            f"ball at {x:.2f}, {y:.2f} m; {referee.away.count} times too far away, "
            f"{referee.contacts.count} times at an obstacle"
        )
        return attempt.result(referee.seconds, doing, referee.penalties)


def _kicks(spec: ChallengeSpec) -> ChallengeResult:
    results = [_kick(spec, target) for target in Course.on(_field(spec)).targets]
    parts = tuple(each.score for each in results)
    whole = [each for each in parts if each is not None]
    return ChallengeResult(
        spec, sum(whole) if len(whole) == len(parts) else None, 0, parts,
        "; ".join(each.doing for each in results),
    )  # fmt: skip


def _kick(spec: ChallengeSpec, target: Point2) -> ChallengeResult:
    field = _field(spec)
    ball = Course.on(field).goal_area, 0.0
    with _Attempt(spec, (-field.length / 2.0, 0.0, 0.0), ball) as attempt:
        pitch = attempt.pitch
        robot = pitch.world.robots[0].description
        table = kicks_of(robot.motions)
        if not table.kicks:
            raise NaoGaitError("robot", robot.name, "a robot with kicks")
        planner = AtTarget(target, table, WalkLimits(), pitch.field, pitch.goals)
        referee = KickReferee(ball, target)
        for time, _, pairs in attempt.run(partial(Kicker, planner=planner)):
            state = pitch.world.ball
            assert state is not None
            speed = math.hypot(*state.velocity[:2].tolist())
            referee.update(time, pitch.ball, speed, touches=(BALL, 0) in pairs)
            if referee.over:
                break
        x, y = pitch.ball
        kicks = ", ".join(attempt.player.kicks) or "no kick"
        doing = f"{kicks}: ball at {x:.2f}, {y:.2f} m" + (", touched again" * referee.again)
        return attempt.result(referee.distance, doing)


def _field(spec: ChallengeSpec) -> Field:
    return parts_of(load_scene(spec.scene))[0]


CHALLENGES: dict[str, Callable[[ChallengeSpec], ChallengeResult]] = {
    "walk straight": lambda spec: _walk(spec, weaves=False),
    "walk slalom": lambda spec: _walk(spec, weaves=True),
    "ball control": _control,
    "best kick": _kicks,
}
"""The challenges by their names."""
