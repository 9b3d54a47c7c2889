"""What the input symbols and basic behaviours see, and what basic behaviours return."""

import math
from dataclasses import dataclass
from dataclasses import field as dataclass_field

from nao_soccer.behavior.ball_plan import BallPlan
from nao_soccer.behavior.duel import DuelSettings
from nao_soccer.behavior.walking import APART_FROM, Round, WalkLimits
from nao_soccer.game_state import GameState, Phase, Role, SetPlay
from nao_soccer.world.settings import BALL_DECELERATION
from nao_soccer.world.state import HeadMode, Obstacle, TeamMate, WorldState
from robot_core.field import Field, Goals
from robot_core.geometry import relative, rotate_planar
from robot_core.types import STANDSTILL, GaitState, Point2, Pose2, VelocityCommand

PASSING = 0.06
"""[m] by which a path may pass nearer to a robot than `kept_apart` allows; the speed limit then
keeps the robot off."""
AT_BALL = 0.4
"""[m] A nearer ball is played."""
PUSH_BEHIND = 0.05
"""[m] ahead of base_footprint, beyond which a ball is pushed in a duel."""
BEHIND = 0.13
"""[m] against the ball's way, from the place of a kick to the one where the robot lines up."""
PRECEDENCE = 0.08
"""[m] by which a robot may be farther than an opponent from a ball in its own half, and play it."""
BEHIND_BALL = 0.6
"""[rad] from the ball's bearing, up to which a robot is behind the ball."""


@dataclass(frozen=True, slots=True)
class Body:
    """What the gait reports."""

    state: GaitState = GaitState.STAND


@dataclass(frozen=True, slots=True)
class Action:
    """What a basic behaviour wants.

    Attributes:
        motion: Motion to play; it is requested once, when it appears.
        lift: Share of its usual height by which the walking robot lifts its feet.
        kick: Ball x, y [m] and the direction [rad] in which a foot shall kick it in the walk, in
            base_footprint.
    """

    walk: VelocityCommand = STANDSTILL
    motion: str = ""
    head: HeadMode = HeadMode.AUTO
    lift: float = 1.0
    kick: Pose2 | None = None


@dataclass(frozen=True, slots=True)
class Situation:
    """Everything that a decision depends on.

    Attributes:
        plan: What to do with the ball; None while no ball is known.
        rank: The robot's place among the supporters of its team, from 0.
    """

    world: WorldState
    game: GameState
    body: Body
    role: Role
    plan: BallPlan | None
    field: Field
    goals: Goals
    limits: WalkLimits
    striker: TeamMate | None = None
    rank: int = 0
    lost: bool = False
    dives: bool = True
    duel: DuelSettings = dataclass_field(default_factory=DuelSettings)

    @property
    def gives_way(self) -> bool:
        """The other team has a kick-off or a set play that is not over."""
        return self.game.own_kick is False and not self.game.ball_free

    @property
    def defends_penalty(self) -> bool:
        """The other team has a penalty kick."""
        return self.game.set_play is SetPlay.PENALTY_KICK and self.game.own_kick is False

    @property
    def own(self) -> Pose2:
        """The own pose in the field."""
        return self.world.own.pose

    @property
    def ball(self) -> Point2:
        """The ball [m] in base_footprint, where it will come to rest; only with a ball."""
        ball = self.world.ball
        if ball is None:
            return 0.0, 0.0
        speed = math.hypot(*ball.velocity)
        roll = min(0.5 * speed / BALL_DECELERATION, 2.0) if speed > 0.1 else 0.0
        return ball.position[0] + roll * ball.velocity[0], ball.position[1] + roll * ball.velocity[
            1
        ]

    @property
    def ball_distance(self) -> float:
        """[m] to the ball; infinite without one."""
        return math.inf if self.world.ball is None else math.hypot(*self.ball)

    @property
    def contested(self) -> bool:
        """Another robot is at the ball."""
        robots = (each for each in self.world.obstacles if not each.fallen)
        return any(math.dist(each.position, self.ball) < self.duel.contested for each in robots)

    def pushes_ball(self, margin: float) -> bool:
        """Another robot is at the ball, and a few steps straight ahead push it forwards.

        The ball may lie `margin` [m] farther.
        """
        ball, (x, y) = self.world.ball, self.ball
        seen = ball is not None and ball.seen_recently and self.world.own.valid
        near = PUSH_BEHIND < x < self.duel.ahead + margin and abs(y) < self.duel.aside + margin
        return seen and near and math.cos(self.own[2]) > self.duel.heading and self.contested

    @property
    def kick_pose(self) -> Pose2:
        """Where the robot hits the ball, in base_footprint; only with a plan."""
        if self.plan is None:
            return 0.0, 0.0, 0.0
        return self.plan.robot_pose(self.ball, self.own[2])

    @property
    def start_pose(self) -> Pose2:
        """From where the robot walks straight to `kick_pose`: there the ball is not touched."""
        x, y, yaw = self.kick_pose
        if self.plan is None:
            return x, y, yaw
        dx, dy = rotate_planar(BEHIND, 0.0, self.plan.direction - self.own[2])
        return x - dx, y - dy, yaw

    def in_base(self, pose: Pose2) -> Pose2:
        """A pose of the field in base_footprint."""
        x, y, yaw = relative(pose, self.own)
        return x, y, math.remainder(yaw, math.tau)

    def near_robots(self) -> list[Round]:
        """The other robots with the distance to keep from each, in base_footprint.

        Of two robots at the ball the one that is nearer to it plays it, and comes faster to another
        one behind the ball. The other one keeps off. If they are equally near, the ball is that of
        the robot in whose half it lies: both come to the same result.
        """
        return [
            Round(each.position, apart, APART_FROM, gain)
            for each in self.world.obstacles
            for apart, gain in [self._apart(each)]
        ]

    def _apart(self, other: Obstacle) -> tuple[float, float]:
        """The distance [m] to keep from another robot, and the gain [1/s] of the speed up to it."""
        duel = self.duel
        idle = self.role is Role.SUPPORTER or self.game.phase is not Phase.PLAYING
        keep = duel.apart_wide if other.fallen or idle else duel.apart
        if self.world.ball is None:
            return keep, duel.gain
        lead = PRECEDENCE if self.world.ball.position_in_field[0] < 0.0 else -PRECEDENCE
        theirs = math.dist(other.position, self.ball)
        if self.ball_distance >= theirs + lead:  # the other one is first
            plays = theirs < AT_BALL and not other.fallen and self.role is not Role.KEEPER
            return duel.apart_wide if plays else keep, duel.gain
        behind = self.ball_distance < math.hypot(*other.position)
        if self.role is Role.STRIKER and self.ball_distance < AT_BALL and behind:
            bearing = math.atan2(other.position[1], other.position[0])
            turn = bearing - math.atan2(self.ball[1], self.ball[0])
            if abs(math.remainder(turn, math.tau)) < BEHIND_BALL:
                return duel.apart, duel.gain_ball
        return keep, duel.gain

    def obstacles(self, *more: Round) -> list[Round]:
        """The other robots and goal posts to walk around, in base_footprint."""
        robots = [
            Round(each.position, self._apart(each)[0] - PASSING) for each in self.world.obstacles
        ]
        if not self.world.own.valid:
            return [*robots, *more]
        posts = [
            Round(self.in_base((*post, 0.0))[:2], 0.2, 0.1) for post in self.field.posts(self.goals)
        ]
        return [*robots, *posts, *more]
