"""A match in one process, with percepts by the model or from rendered images: for statistics."""

import contextlib
import math
from collections.abc import Iterator, Mapping, Sequence
from contextlib import AbstractContextManager
from dataclasses import dataclass, field
from typing import Any

from gait_lab.soccer.channels import Channels, SilentReferee
from gait_lab.soccer.eyes import in_field
from gait_lab.soccer.match_progress import MatchProgress
from gait_lab.soccer.motion_track import PERIOD, BodyState, MotionTrack
from gait_lab.soccer.pitch import Pitch, PitchSpec, RobotPlayer, identity_of, is_upright
from gait_lab.soccer.snapshots import (
    PlanSnapshot,
    RobotSnapshot,
    Snapshot,
    dribble_strokes,
    is_turned,
    path_of,
    wrong_half,
)
from nao_soccer.behavior.ball_plan import BallPlan
from nao_soccer.behavior.duel import DuelSettings
from nao_soccer.game_state import Phase, Role, SetPlay
from nao_soccer.referee.protocol import Penalty
from nao_soccer.referee.rules import Goal, PutBall, PutRobot, Referee, RobotPlace, Rules
from robot_core.errors import NaoGaitError
from robot_core.field import TEAMS
from robot_core.schema import Kind, Number, Optional
from robot_core.types import Point2, Pose2
from sim_bridge.individual import NOMINAL
from sim_bridge.scene import Scene, SceneRobot, load_scene
from sim_bridge.trials.trial import CONTROL_PERIOD, Tick

REFEREE_TICKS = 10
"""Control periods between two looks of the referee."""
MESSAGE_TICKS = 50
"""Control periods between two messages of the referee."""
FRAME_TICKS = 20
"""Control periods between two frames of the replay."""
MOTION_TICKS = round(PERIOD / CONTROL_PERIOD)
"""Control periods between two moments of the motion."""
RESTS = 0.03
"""[m/s] A slower ball rests."""
AT_BALL, DUEL = 0.5, 1.0
"""[m] from a robot to a ball that it plays; [s] Least duration of a duel, and most of a break in
one."""


@dataclass(frozen=True, slots=True, kw_only=True)
class MatchSpec(PitchSpec):
    """One match.

    Attributes:
        robots: Number of robots in each team; None = as in the scene.
        loss: Share of team messages that are lost.
        without_roles: Teams whose players do not agree who goes to the ball.
        frames: Keep what a replay needs.
        silence: From when to when [s] the referee is not heard; None = never.
    """

    minutes: float = 2.0
    robots: int | None = None
    loss: float = 0.0
    without_roles: tuple[str, ...] = ()
    silence: tuple[float, float] | None = None
    frames: bool = True
    red: DuelSettings = field(default_factory=DuelSettings)
    blue: DuelSettings = field(default_factory=DuelSettings)


@dataclass(slots=True)
class MatchResult:
    """What came of a match.

    Attributes:
        seconds: Simulated time [s].
        kicks: Number of kicks, which are motions of a standing robot: of those that the gait
            accepted, over ROS 2 of those that were requested.
        wrong_half: Goals into the own goal by robots that took one half for the other.
        messages: Team messages that were sent; None if they were not counted.
        one_striker: Share of the playing time in which a team had exactly one striker; NaN if it
            was not watched.
        conflict: Longest time [s] with two strikers in a team; likewise.
        playing: [s] in which the ball was in play; None if it was not watched.
        rest: Share of that in which the ball rested; likewise.
        duels: [s] that each duel lasted: robots of both teams were within `AT_BALL` of the ball.
        motion: How the robots moved between them; None if it was not kept.
    """

    spec: MatchSpec
    score: dict[str, int]
    goals: list[Goal]
    seconds: float
    falls: dict[str, int]
    kicks: int
    strokes: int
    wrong_half: int
    messages: int | None = None
    one_striker: float = math.nan
    conflict: float = math.nan
    playing: float | None = None
    rest: float | None = None
    duels: Sequence[float] = ()
    frames: Sequence[Snapshot] = ()
    motion: MotionTrack | None = None

    @classmethod
    def restored(cls, spec: MatchSpec, goals: Sequence[Any], **values: Any) -> "MatchResult":
        """The result with these fields, as JSON keeps them; raises TypeError."""
        return cls(spec, goals=[Goal(*goal) for goal in goals], **values)

    @property
    def own_goals(self) -> int:
        """Goals that a defender touched last."""
        return sum(goal.own for goal in self.goals)

    def as_json(self) -> dict[str, object]:
        """The result as a JSON object."""
        return {
            "score": self.score,
            "minutes": round(self.seconds / 60.0, 2),
            "falls": sum(self.falls.values()),
            "kicks": self.kicks,
            "strokes": self.strokes,
            "goals": [
                {"t": round(goal.time, 2), "team": goal.team, "player": goal.player}
                for goal in self.goals
            ],
            "own_goals": self.own_goals,
            "wrong_half": self.wrong_half,
            "crashes": 0,  # a match in which a process ends or raises has no result
            "messages": self.messages,
            "one_striker": _rounded(100.0 * self.one_striker),
            "role_conflict_seconds_max": _rounded(self.conflict),
        }


class Match(AbstractContextManager["Match"]):
    """One match; `play` plays it. Use it as a context manager.

    `rendered`: players see rendered images, not percepts by the model; `eyes` further processes
    render and see. `visual`: `pitch.world` can be rendered. `channels` None = without faults but
    the referee's silence of the specification.
    """

    def __init__(
        self,
        spec: MatchSpec,
        *,
        rendered: bool = False,
        visual: bool = False,
        eyes: int = 0,
        channels: Channels | None = None,
    ) -> None:
        scene = match_scene(spec)
        if channels is None and spec.silence is not None:
            channels = SilentReferee(*spec.silence)
        self.spec = spec
        self.pitch = Pitch(
            scene,
            spec.seed,
            spec.engine,
            spec.plant,
            lambda robot: identity_of(
                robot, scene, waits=True, roles=robot.team not in spec.without_roles
            ),
            loss=spec.loss,
            rendered=rendered,
            visual=visual,
            eyes=eyes,
            channels=channels,
            duel={"red": spec.red, "blue": spec.blue},
        )
        self.referee = Referee(
            self.pitch.field,
            self.pitch.goals,
            {robot.name: (robot.team, robot.number) for robot in scene.robots},
            Rules(half=60.0 * spec.minutes),
            self.pitch.ball_radius,
            kick_off=TEAMS[spec.seed % 2],
        )
        self._strikers = _Strikers(self)
        self._ball = BallWatch(self)
        self._motion = MotionTrack() if spec.frames else None

    def play(self) -> Iterator[Snapshot]:
        """Play the match; yields a frame of the replay now and then."""
        for ticks in self.run():
            count = self.pitch.count - 1
            if self._motion is not None and count % MOTION_TICKS == 0:
                time = self.pitch.world.time * 1e-9
                self._motion.add(time, self.pitch.ball_position, [body_of(tick) for tick in ticks])
            if count % FRAME_TICKS == 0:
                yield self._frame(ticks)

    def run(self) -> Iterator[Sequence[Tick]]:
        """Play the match; yields the ticks of all robots in each control period."""
        for ticks in self.pitch.run(self._watch):
            yield ticks
            if self.referee.over:
                return

    def _watch(self, ticks: Sequence[Tick]) -> None:
        """What the referee does, before each control period."""
        pitch = self.pitch
        if pitch.count % REFEREE_TICKS:
            return
        time = pitch.world.time * 1e-9
        places = {
            robot.name: RobotPlace(pose[:2], is_upright(tick))
            for robot, pose, tick in zip(pitch.scene.robots, pitch.poses, ticks, strict=True)
        }
        before = self.referee.phase
        for order in self.referee.update(time, pitch.ball_position, places):
            if isinstance(order, PutBall):
                pitch.world.put_ball(*order.position)
            elif isinstance(order, PutRobot):
                self._put_back(order)
        self._strikers.watch(REFEREE_TICKS * CONTROL_PERIOD)
        self._ball.watch(REFEREE_TICKS * CONTROL_PERIOD, places)
        if self.referee.phase is not before or pitch.count % MESSAGE_TICKS == 0:
            self._broadcast(time)

    def _broadcast(self, time: float) -> None:
        self.referee.messages.update(self.pitch.messages_of)
        data = self.referee.message().encode()
        for index, player in enumerate(self.pitch.players):
            for each in self.pitch.channels.referee_message(index, data, time):
                with contextlib.suppress(NaoGaitError):  # the node logs it
                    player.player.hear_referee(each, time)

    def _put_back(self, order: PutRobot) -> None:
        name = order.name
        for robot, player in zip(self.pitch.scene.robots, self.pitch.players, strict=True):
            if robot.name == name:
                try:
                    self.pitch.world.reset_robot(name, order.pose)
                except NaoGaitError:
                    self.referee.not_put_back(name)  # something is there
                    return
                player.put_back()

    def _frame(self, ticks: Sequence[Tick]) -> Snapshot:
        pitch, referee = self.pitch, self.referee
        robots = {
            robot.name: self._robot_frame(robot, player, pose, tick)
            for robot, player, pose, tick in zip(
                pitch.scene.robots, pitch.players, pitch.poses, ticks, strict=True
            )
        }
        score = referee.score
        x, y = pitch.ball
        return Snapshot(
            round(pitch.world.time * 1e-9, 2),
            (round(x, 3), round(y, 3)),
            robots,
            referee.phase.value,
            (score["red"], score["blue"]),
            "" if referee.set_play is SetPlay.NONE else referee.set_play.value,
            referee.kicking,
        )

    def _robot_frame(
        self, robot: SceneRobot, player: RobotPlayer, pose: Pose2, tick: Tick
    ) -> RobotSnapshot:
        # From the field of the team into the world is the same turn as back.
        state = "stand" if tick.status is None else tick.status.state.value
        x, y, heading = (round(each, 3) for each in pose)
        decision, penalty = player.decision, self.referee.penalty(robot.name)
        frame = RobotSnapshot(
            x,
            y,
            heading,
            state,
            player.player.role.value,
            "",
            penalty="" if penalty is Penalty.NONE else penalty.value,
            kicks=len(player.kicks),
        )
        if decision is None:
            return frame
        own, ball = decision.world.own.pose, decision.world.ball
        believed = in_field(own, robot.team)
        plan = decision.plan
        return frame._replace(
            **path_of(decision.path),
            turned=is_turned(heading, believed[2]),
            believed=believed,
            ball=None if ball is None else in_field((*ball.position_in_field, 0.0), robot.team)[:2],
            others=tuple(
                in_field((*each.position_in_field, 0.0), robot.team)[:2]
                for each in decision.world.obstacles
            ),
            plan=None if plan is None else plan_of(plan, robot.team),
            runner_up=None
            if plan is None or plan.runner_up is None
            else plan_of(plan.runner_up, robot.team),
        )

    def result(self, frames: Sequence[Snapshot]) -> MatchResult:
        """The result, with a replay."""
        self._ball.end_duel()
        goals = self.referee.goals_scored
        return MatchResult(
            self.spec,
            score=self.referee.score,
            goals=list(goals),
            seconds=self.pitch.world.time * 1e-9,
            falls=dict(self.referee.falls),
            kicks=sum(len(player.kicks) for player in self.pitch.players),
            strokes=dribble_strokes(frames),
            messages=self.pitch.messages,
            one_striker=self._strikers.share,
            conflict=self._strikers.longest,
            wrong_half=wrong_half(goals, frames),
            playing=round(self._ball.playing, 2),
            rest=self._ball.rest,
            duels=tuple(self._ball.duels),
            frames=tuple(frames) if self.spec.frames else (),
            motion=self._motion,
        )

    def __exit__(self, *_: object) -> None:
        self.pitch.close()


class _Strikers:
    """How many strikers each team has while the ball is in play."""

    def __init__(self, match: Match) -> None:
        self._match = match
        self._time = self._one = 0.0
        self._conflict = dict.fromkeys(TEAMS, 0.0)
        self.longest = 0.0

    @property
    def share(self) -> float:
        """Share of the time with exactly one striker."""
        return self._one / self._time if self._time else 1.0

    def watch(self, dt: float) -> None:
        """Count for a time [s]."""
        match = self._match
        if match.referee.phase is not Phase.PLAYING:
            self._conflict = dict.fromkeys(TEAMS, 0.0)
            return
        for team in TEAMS:
            if team in match.spec.without_roles:
                continue
            roles = [
                player.player.role
                for robot, player in zip(match.pitch.scene.robots, match.pitch.players, strict=True)
                if robot.team == team and not match.referee.penalized(robot.name)
            ]
            if not roles:
                continue
            count = roles.count(Role.STRIKER)
            self._time += dt
            self._one += dt * (count == 1)
            self._conflict[team] = self._conflict[team] + dt if count > 1 else 0.0
            self.longest = max(self.longest, self._conflict[team])


class BallWatch:
    """How long the ball is in play, rests, and is fought for."""

    def __init__(self, match: Match) -> None:
        self._match = match
        self._last: Point2 | None = None
        self._began: float | None = None
        self._fought = self._still = 0.0
        self.playing = 0.0
        self.duels: list[float] = []

    @property
    def rest(self) -> float:
        """Share of the playing time in which the ball rested."""
        return self._still / self.playing if self.playing else 0.0

    def watch(self, dt: float, places: Mapping[str, RobotPlace]) -> None:
        """Count for a time [s]."""
        ball, last = self._match.pitch.ball, self._last
        if self._match.referee.phase is not Phase.PLAYING:
            self._last = None
            self.end_duel()
            return
        self._last = ball
        if last is None:
            return
        self.playing += dt
        self._still += dt * (math.dist(ball, last) < RESTS * dt)
        teams = {
            robot.team
            for robot in self._match.pitch.scene.robots
            if places[robot.name].upright
            and math.dist(places[robot.name].position, ball) < AT_BALL
        }
        if len(teams) > 1:
            self._began = self.playing if self._began is None else self._began
            self._fought = self.playing
        elif self.playing - self._fought > DUEL:
            self.end_duel()

    def end_duel(self) -> None:
        """Count the duel that is over, if there was one."""
        if self._began is not None and self._fought - self._began >= DUEL:
            self.duels.append(round(self._fought - self._began, 2))
        self._began = None


_NUMBERS: dict[str, Kind] = {
    "seed": Number(NOMINAL, whole=True),
    "minutes": Number(0.1, 60.0, "min"),
    "robots": Optional(Number(1, whole=True)),
    "loss": Number(0.0, 1.0),
}


def match_scene(spec: MatchSpec) -> Scene:
    """The scene of a match, with individuals of its seed.

    Raises:
        NaoGaitError: There is no such scene, it has too few robots, or a number of the match is
            not allowed.
    """
    for name, kind in _NUMBERS.items():
        kind.check(name, getattr(spec, name))
    scene = load_scene(spec.scene)
    robots = []
    for team in TEAMS:
        members = sorted(
            (each for each in scene.robots if each.team == team), key=lambda each: each.number
        )
        if spec.robots is not None and len(members) < spec.robots:
            allowed = f"at most {len(members)} robots of team {team} in {spec.scene}"
            raise NaoGaitError("robots", spec.robots, allowed)
        robots += members[: spec.robots]
    numbered = [
        robot.replace(seed=len(robots) * max(spec.seed, 0) + index, urdf=spec.urdf or robot.urdf)
        for index, robot in enumerate(robots)
    ]
    return scene.replace(robots=tuple(numbered))


def play_match(
    spec: MatchSpec,
    *,
    rendered: bool = False,
    eyes: int = 0,
    show: bool = False,
) -> MatchResult:
    """Play a match to its end; see `Match`. `show`: its progress on stderr."""
    frames = []
    with (
        Match(spec, rendered=rendered, eyes=eyes) as match,
        MatchProgress(shown=show) as progress,
    ):
        for frame in match.play():
            frames.append(frame)
            progress.show(frame, match.referee.rules.duration)
        return match.result(frames)


def body_of(tick: Tick) -> BodyState:
    """The true body of a robot."""
    truth = tick.truth
    return BodyState(truth.torso_position, truth.torso_quaternion, truth.joint_position)


def plan_of(plan: BallPlan, team: str) -> PlanSnapshot:
    """A plan, with its direction in the world."""
    direction = in_field((0.0, 0.0, plan.direction), team)[2]
    return PlanSnapshot(plan.name, direction, plan.seconds)


def _rounded(value: float) -> float | None:
    """For JSON, which has no NaN."""
    return None if math.isnan(value) else round(value, 2)
