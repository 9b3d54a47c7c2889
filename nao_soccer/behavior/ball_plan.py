"""What to do with the ball: which kick, or dribbling, and in which direction.

The decision follows section 4.4 of Friedmann et al.: by the position of the ball, the direction and
distance of the goal, and the validity of the own pose. What is left is compared by time: the
expected time until the ball is in the goal. A ball whose way is blocked by another robot may also
be sent past that robot, on either side.
"""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import attrs

from nao_soccer.behavior.kicks import Kick, KickTable
from nao_soccer.behavior.walking import WalkLimits
from robot_core.field import SIDES, Field, Goals
from robot_core.schema import Settings, number
from robot_core.types import Point2, Pose2

INTO_GOAL = 0.2
"""[m] behind the goal line to which the ball is sent."""
AT_ONCE = 0.5
"""[s] of walking that are left, at which a standing robot kicks without a step."""
HIT_SHARE = 0.6
"""Share of a kick's time after which the foot hits the ball."""
BEFORE_GOAL = 0.6
"""[m] before the goal line to which a ball is sent that has no way into the goal."""
POST_RADIUS = 0.12
"""[m] of a goal post and a ball that rolls past it."""
ENOUGH_ROOM = 0.15
"""[m] A way with this much room is not left for another one."""
POST_ROOM = 0.28
"""[m] that a robot needs between itself and a goal post."""
POST_TIME = 15.0
"""[s] that a place with less room is worse."""
OUT_TIME = 10.0
"""[s] that a ball outside of the field costs."""
TAKEN = 0.28
"""[m] from another robot to a place that nobody else can stand on."""
DRIBBLE_STEP = 0.5
"""[m] over which a dribble is compared with kicks; a robot that is nearer stops the ball."""
NO_TIME = 0.7
"""[m] from another robot to the ball, below which a robot that walks does not begin to kick."""
PAST = 0.1
"""[rad] by which the ball's way leads past a robot."""
BACKWARDS = -0.2
"""Least cosine of a direction past a robot: the ball is not sent back."""
BLOCKED_SHARE = 0.3
"""Share of the balls that find their way into the goal past a robot."""
SAME_WAY = 0.5
"""[rad] A plan in a direction that differs by less is the same one."""


@attrs.frozen
class PlanSettings(Settings):
    """How plans are compared."""

    dribble_speed: float = number(0.2, 0.01, 1.0, "m/s", "Mean speed of a dribbled ball.")
    settle: float = number(1.2, 0.0, 10.0, "s", "From walking to standing before a kick.")
    aim_spread: float = number(0.12, 0.0, 1.0, "rad", "Standard deviation of the robot's heading.")
    retry: float = number(6.0, 0.0, 60.0, "s", "To walk to the ball again after a kick.")
    duel: float = number(
        15.0, 0.0, 60.0, "s", "To bring the ball past a robot that blocks its way."
    )
    keep: float = number(2.0, 0.0, 30.0, "s", "By how much another plan has to be faster.")
    past: float = number(
        1.0, 0.0, 20.0, "m", "From the ball to a robot in its way, up to which ways past it count."
    )
    orbit: float = number(0.28, 0.1, 1.0, "m", "Radius of the way around the ball.")
    robot_radius: float = number(0.16, 0.05, 0.5, "m", "Radius of a robot in the ball's way.")


@dataclass(frozen=True, slots=True)
class BallPlan:
    """What to do with the ball.

    Attributes:
        kick: The kick, or how a foot of the walking robot hits the ball.
        dribbles: The robot walks on; no motion is played.
        direction: Where the ball has to go [rad] in the frame of the field.
        approach: Estimated time [s] to the place from which it begins.
        seconds: Expected time [s] until the ball is in the goal.
        runner_up: The best plan that does something else; None if there is none.
    """

    kick: Kick
    dribbles: bool
    direction: float
    approach: float
    seconds: float
    runner_up: "BallPlan | None" = None

    @property
    def name(self) -> str:
        """Name of the kick."""
        return self.kick.motion

    def is_like(self, other: "BallPlan") -> bool:
        """The other plan does the same in nearly the same direction."""
        turn = math.remainder(other.direction - self.direction, math.tau)
        return other.name == self.name and abs(turn) < SAME_WAY

    def robot_pose(self, ball: Point2, yaw: float) -> Pose2:
        """Pose at the hit in base_footprint, `yaw` [rad] in the field; the ball is x, y [m]."""
        return self.kick.robot_pose(ball, math.remainder(self.direction - yaw, math.tau))


_Disc = tuple[Point2, float]
"""Place and radius [m] of what a ball may meet."""


class _Opening(NamedTuple):
    """The goal seen from the ball.

    Attributes:
        far: Distance [m] to its middle.
        left: Direction [rad] of the left post in the field.
        right: Direction [rad] of the right post.
    """

    far: float
    left: float
    right: float


class _Way(NamedTuple):
    """A way for the ball.

    Attributes:
        direction: [rad] in the field.
        free: [m] up to the next robot or post.
    """

    direction: float
    free: float

    def end(self, ball: Point2, distance: float) -> Point2:
        """Where a ball comes to rest that could roll for a distance [m]."""
        way = min(distance, self.free)
        return ball[0] + way * math.cos(self.direction), ball[1] + way * math.sin(self.direction)


def _free(ball: Point2, direction: float, things: Sequence[_Disc]) -> float:
    """How far [m] a ball rolls before it meets one of some things."""
    ux, uy = math.cos(direction), math.sin(direction)
    free = math.inf
    for (x, y), radius in things:
        rx, ry = x - ball[0], y - ball[1]
        along, across = rx * ux + ry * uy, rx * uy - ry * ux
        if along > 0.0 and abs(across) < radius:
            free = min(free, max(0.0, along - math.sqrt(radius * radius - across * across)))
    return free


class Planner:
    """Chooses what to do with the ball."""

    def __init__(
        self,
        table: KickTable,
        limits: WalkLimits,
        field: Field,
        goals: Goals,
        settings: PlanSettings | None = None,
    ) -> None:
        self.settings = PlanSettings() if settings is None else settings
        self._table = table
        self._limits = limits
        self._goal = field.length / 2.0
        self._side = field.width / 2.0
        self._half_opening = goals.width / 2.0

    def choose(
        self,
        own: Pose2,
        ball: Point2,
        robots: Sequence[Point2] = (),
        before: BallPlan | None = None,
        *,
        valid: bool = True,
        stands: bool = False,
        scores: bool = True,
    ) -> BallPlan:
        """The plan that brings the ball into the goal soonest; places and poses are in the field.

        Args:
            own: Pose of base_footprint.
            ball: x, y [m].
            robots: x, y [m] of other robots.
            before: The last plan, which is kept unless another one is clearly better.
            valid: The own pose may be trusted. If not, the ball is dribbled, not kicked, and the
                direction of the goal is that of the last known pose.
            stands: The robot stands, and could kick at once.
            scores: A goal of this robot would count. If not, the ball is brought before the goal.
        """
        plans = list(
            self._plans(own, ball, robots, valid=valid, stands=stands, scores=scores)
        )
        best = min(plans, key=lambda plan: plan.seconds)
        if before is not None:
            kept = [plan for plan in plans if before.is_like(plan)]
            again = min(kept, key=lambda plan: plan.seconds, default=best)
            if again.seconds < best.seconds + self.settings.keep:
                best = again
        others = (plan for plan in plans if not best.is_like(plan))
        return replace(best, runner_up=min(others, key=lambda plan: plan.seconds, default=None))

    def _plans(
        self,
        own: Pose2,
        ball: Point2,
        robots: Sequence[Point2],
        *,
        valid: bool,
        stands: bool,
        scores: bool,
    ) -> Iterator[BallPlan]:
        s, table = self.settings, self._table
        contested = any(math.dist(robot, ball) < NO_TIME for robot in robots)
        kicks = [(kick, True) for kick in table.dribbles]
        if valid and (stands or not contested):
            kicks += [(kick, False) for kick in table.kicks]
        things = [(robot, s.robot_radius) for robot in robots]
        goal = self._opening(ball)
        # A goal that does not count leads to a goal kick: all of the field to bring the ball back.
        in_goal = 0.0 if scores else 2.0 * self._goal / s.dribble_speed
        for way in self._ways(ball, robots, things):
            for kick, dribbles in kicks:
                pose = kick.robot_pose(ball, way.direction)
                walk = self._walk_time(own, ball, pose)
                at_once = stands and walk < AT_ONCE
                if contested and not (dribbles or at_once):
                    continue
                hit = self._chance(kick, goal, way)
                gain = kick.distance * math.exp(-0.5 * (kick.direction_spread + s.aim_spread) ** 2)
                end = way.end(ball, gain)
                rest = self._rest(end, things, in_goal) + self._way_time(math.dist(ball, end))
                seconds = walk + self._no_room(pose, robots)
                if not dribbles:
                    # A ball that goes in is in soon after the foot has hit it.
                    seconds += HIT_SHARE * kick.seconds
                    seconds += 0.0 if at_once else s.settle
                    rest += (1.0 - HIT_SHARE) * kick.seconds + s.retry
                won = min(goal.far / kick.speed, 2.0) + in_goal
                seconds += hit * won + (1.0 - hit) * rest
                yield BallPlan(kick, dribbles, way.direction, walk, seconds)

    def _ways(
        self, ball: Point2, robots: Sequence[Point2], things: Sequence[_Disc]
    ) -> list[_Way]:
        """Directions that are worth comparing: into the goal, and past the robot in this way."""
        posts = [((self._goal, side * self._half_opening), POST_RADIUS) for side in SIDES]
        things = [*things, *posts]
        aim, room = self._aim(ball, things)
        ways = [_Way(aim, math.inf if room > 0.0 else _free(ball, aim, things))]
        near = self.settings.past
        if ways[0].free > near:
            return ways
        for x, y in robots:
            dx, dy = x - ball[0], y - ball[1]
            gap = math.hypot(dx, dy)
            if 0.0 < gap < near:
                past = math.asin(min(1.0, self.settings.robot_radius / gap)) + PAST
                for side in SIDES:
                    direction = math.remainder(math.atan2(dy, dx) + side * past, math.tau)
                    if math.cos(direction) > BACKWARDS:
                        ways.append(_Way(direction, _free(ball, direction, things)))
        return ways

    def _way_time(self, distance: float) -> float:
        """Time [s] to walk straight ahead for a distance [m]."""
        return distance / (0.8 * self._limits.forward)

    def _far(self, ball: Point2) -> float:
        """Distance [m] to the middle of the goal."""
        return math.hypot(self._goal - ball[0], ball[1])

    def _opening(self, ball: Point2) -> _Opening:
        """The goal seen from the ball."""
        dx = max(1e-3, self._goal - ball[0])
        left = math.atan2(self._half_opening - ball[1], dx)
        right = math.atan2(-self._half_opening - ball[1], dx)
        return _Opening(self._far(ball), left, right)

    def _rest(self, ball: Point2, robots: Sequence[_Disc], in_goal: float) -> float:
        """Time [s] that a ball at a place still needs to the goal; `in_goal` [s] once it is in."""
        s = self.settings
        x, y = ball
        rest = self._far(ball) / s.dribble_speed
        if x > self._goal and abs(y) < self._half_opening:
            return in_goal
        if abs(x) > self._goal or abs(y) > self._side:
            return rest + OUT_TIME
        to_goal = math.atan2(-y, self._goal - x)
        near = _free(ball, to_goal, robots)
        return rest + (s.duel if near < DRIBBLE_STEP else 0.0)

    def _aim(self, ball: Point2, things: Sequence[_Disc]) -> tuple[float, float]:
        """Direction [rad] for the ball with the most room, and that room [m]; < 0 = blocked.

        The first candidate is the way straight ahead, as far as it leads into the goal: a robot
        that pushes a ball along the goal line walks into the post. The last one leads in front of
        the goal, for a ball that lies at a post.
        """
        best = (0.0, -math.inf)
        half = self._half_opening
        straight = min(max(ball[1], -0.5 * half), 0.5 * half)
        behind = self._goal + INTO_GOAL
        targets = [(behind, across) for across in (straight, 0.0, 0.5 * half, -0.5 * half)]
        targets.append((self._goal - BEFORE_GOAL, 0.0))
        for x, y in targets:
            dx, dy = x - ball[0], y - ball[1]
            length = math.hypot(dx, dy) or 1e-9
            room = 0.5
            for place, radius in things:
                rx, ry = place[0] - ball[0], place[1] - ball[1]
                along = (rx * dx + ry * dy) / length
                if 0.0 < along < length:
                    room = min(room, abs(rx * dy - ry * dx) / length - radius)
            if room > best[1] + 0.05 and best[1] < ENOUGH_ROOM:
                best = (math.atan2(dy, dx), room)
        return best

    def _no_room(self, pose: Pose2, robots: Sequence[Point2]) -> float:
        """Time [s] that a place is worse because a robot, a goal or the carpet's end is there."""
        x, y, _ = pose
        # By symmetry, all four posts at once.
        post = math.hypot(abs(x) - self._goal, abs(y) - self._half_opening)
        net = abs(x) > self._goal + 0.1 and abs(y) < self._half_opening + 0.2
        outside = abs(x) > self._goal + 0.4 or abs(y) > self._side + 0.4
        taken = any(math.hypot(x - each[0], y - each[1]) < TAKEN for each in robots)
        return POST_TIME if post < POST_ROOM or net or outside or taken else 0.0

    def _chance(self, kick: Kick, goal: _Opening, way: _Way) -> float:
        """Chance that the kick goes into the goal."""
        if way.free < DRIBBLE_STEP:
            return 0.0
        open_share = 1.0 if way.free > goal.far else BLOCKED_SHARE
        reach = 0.5 * math.erfc(
            (goal.far - kick.distance) / (math.sqrt(2.0) * (kick.distance_spread + 0.05))
        )
        spread = math.sqrt(2.0) * math.hypot(kick.direction_spread, self.settings.aim_spread)
        inside = math.erf((goal.left - way.direction) / spread)
        inside -= math.erf((goal.right - way.direction) / spread)
        return open_share * reach * 0.5 * inside

    def _walk_time(self, own: Pose2, ball: Point2, target: Pose2) -> float:
        """Time [s] to walk to a pose at the ball, all in one frame."""
        dx, dy = ball[0] - own[0], ball[1] - own[1]
        behind = math.atan2(ball[1] - target[1], ball[0] - target[0])
        around = abs(math.remainder(behind - math.atan2(dy, dx), math.tau))
        turn = abs(math.remainder(target[2] - own[2], math.tau))
        radius, far = self.settings.orbit, math.hypot(dx, dy)
        # A robot at the ball that has to turn steps back first.
        back = max(0.0, radius - far) * min(1.0, around + turn)
        arc = (back + radius * around) / self._limits.side
        return self._way_time(max(0.0, far - radius)) + turn / (0.8 * self._limits.turn) + arc
