"""The basic behaviours: what the robot does in the states at the leaves of the tree."""

import math
from dataclasses import replace

from nao_soccer.behavior.situation import Action, Situation
from nao_soccer.behavior.walking import FACING, Round, turn_by, walk_to
from nao_soccer.game_state import SetPlay
from nao_soccer.world.state import HeadMode
from robot_core.geometry import rotate_planar
from robot_core.types import STAND, Point2, Pose2, VelocityCommand

BALL_ROUND = 0.24
"""[m] that the robot keeps from the ball on its way around it."""
KEEP_FACING = (0.7, 1.2)
"""[m] A nearer place is taken by steps backwards and to the side, with the ball in sight."""
DRIBBLE_ACROSS = 0.08
"""[m] beside the place in front of the foot, at which the robot stops to walk towards the ball."""
PUSH_FOOT = 0.06
"""[m] from the middle of the robot to the middle of a foot that pushes the ball."""
PUSH_NEAR = 0.17
"""[m] ahead: a nearer ball that is beside the foot would be passed or kicked to the side."""
PUSH_ACROSS = 0.045
"""[m] beside that place, up to which a foot that swings askew hits the ball with its middle."""
ASKEW = 0.3
"""[rad] by which a dribbled ball may be kicked beside its way rather than be missed."""
LOST_TURN = 0.3
"""[rad] by which a robot that is lost always wants to turn; slowly, so that images are sharp."""
SEARCH_TURN = 0.7
"""[rad] by which a robot that searches always wants to turn: all things stay in the image for
both looks of the head."""
KEEPER_OUT = 0.2
"""[m] ahead of the goal line at which a keeper stands."""
DIVES = "dive_left", "dive_right"
"""Motions of a goalkeeper; not every kind of robot has them."""

START_PLACES = (
    (-0.3, 0.15), (-0.3, -0.15), (-0.2, 0.33), (-0.2, -0.33), (-0.4, 0.32), (-0.4, -0.32),
)  # fmt: skip
"""Supporters' places at a kick-off, as shares of the field's length and width."""
SUPPORT_PLACES = (
    (0.0, 0.0), (0.05, 0.3), (0.05, -0.3), (-0.05, 0.15), (-0.05, -0.15), (0.1, 0.42),
)  # fmt: skip
"""Supporters' places in play, beside the one between ball and own goal: ahead and to the side, as
shares of the field; the first side is the one where the ball is not."""
RECEIVER = 1
"""The supporter who waits ahead of the ball, on the side where it is not, for what gets through."""
GOAL_ROOM = 0.8
"""[m] from the opponents' goal line to it at least."""
CHANGE_SIDE = 0.3
"""[m] from the middle of the field to a ball for which it changes the side."""


def stand(s: Situation) -> Action:
    """Stand still and look around."""
    return Action()


def get_up(s: Situation) -> Action:
    """Get up."""
    return Action(motion="get_up")


# -- search ----------------------------------------------------------------------------------------


def look_for_ball(s: Situation) -> Action:
    """Stand and turn the head."""
    return Action(head=HeadMode.BALL)


def turn_around(s: Situation) -> Action:
    """Turn on the spot to the right: the sweep of the head before went to the left."""
    return Action(turn_by(-SEARCH_TURN, s.limits), head=HeadMode.SCAN)


def walk_to_middle(s: Situation) -> Action:
    """Walk to the centre of the field, unless the ball there is the other team's."""
    if s.gives_way:
        return turn_around(s)
    target = s.in_base((0.0, 0.0, s.own[2]))
    return Action(walk_to(target, s.limits, s.obstacles()), head=HeadMode.BALL)


def find_place(s: Situation) -> Action:
    """Look for landmarks, and for the ball: that of a team mate tells the half."""
    return Action()


# -- the ball --------------------------------------------------------------------------------------


def walk_behind_ball(s: Situation) -> Action:
    """Walk around the ball to the place from which the plan begins."""
    obstacles = s.obstacles(Round(s.ball, BALL_ROUND, 0.3))
    return Action(walk_to(s.start_pose, s.limits, obstacles))


def step_to_ball(s: Situation) -> Action:
    """Walk the last steps to the place from which the robot kicks."""
    return Action(walk_to(s.kick_pose, s.limits, facing=(1.0, 2.0)), head=HeadMode.BALL)


def settle(s: Situation) -> Action:
    """Stand before the kick."""
    return Action(head=HeadMode.BALL)


def kick(s: Situation) -> Action:
    """Kick."""
    return Action(motion="" if s.plan is None else s.plan.name, head=HeadMode.BALL)


def dribble(s: Situation) -> Action:
    """Walk on with the ball in front of a foot or its outer edge, as the plan wants.

    A ball in the middle between the feet would go 30 degrees to either side.
    """
    if s.plan is None:
        return stand(s)
    direction = math.remainder(
        s.plan.direction - s.plan.kick.direction - s.own[2], math.tau
    )
    across = rotate_planar(*s.ball, -direction)[1] - s.plan.kick.y
    forward = s.limits.forward * max(0.25, 1.0 - abs(across) / DRIBBLE_ACROSS)
    vx, vy = rotate_planar(forward, 2.0 * across, direction)
    head = HeadMode.BALL if s.ball_distance < 0.5 else HeadMode.AUTO
    way = math.remainder(s.plan.direction - s.own[2], math.tau)
    askew = min(max(_through(s.ball) - way, -ASKEW), ASKEW)
    return Action(
        s.limits.command(vx, vy, 1.5 * direction), head=head, kick=(*s.ball, way + askew)
    )


def push(s: Situation) -> Action:
    """Walk ahead and kick with the nearer foot; to the side first if the ball is beside."""
    x, y = s.ball
    across = y - math.copysign(PUSH_FOOT, y)
    across -= min(max(across, -PUSH_ACROSS), PUSH_ACROSS)
    share = max(0.0, 1.0 - abs(across) / DRIBBLE_ACROSS)
    ahead = s.limits.forward * max(share, 0.25 if x > PUSH_NEAR else 0.0)
    return Action(
        s.limits.command(ahead, 2.5 * across, 0.0), head=HeadMode.BALL,
        kick=(x, y, _through(s.ball)),
    )  # fmt: skip


def _through(ball: Point2) -> float:
    """The direction [rad] in which the nearer foot hits the ball with its middle."""
    x, y = ball
    return math.atan2(y - math.copysign(PUSH_FOOT, y), max(x, PUSH_NEAR))


def keep_distance(s: Situation) -> Action:
    """Wait between ball and own goal, at the distance that the rules ask for."""
    ball = s.world.ball
    if ball is None:
        return look_for_ball(s)
    own_goal = (-s.field.length / 2.0, 0.0)
    bx, by = ball.position_in_field
    away = math.atan2(own_goal[1] - by, own_goal[0] - bx)
    gap = s.game.ball_distance + 0.1
    place = (bx + gap * math.cos(away), by + gap * math.sin(away))
    return _stand_at(s, _on_field(s, place), Round(s.ball, s.game.ball_distance))


# -- places ----------------------------------------------------------------------------------------


def take_place(s: Situation) -> Action:
    """Walk to the place for the kick-off."""
    place = _start_place(s)
    # All robots walk at once and none needs the ball: look at landmarks, and ahead in between.
    action = _walk_and_stay(s, (*place, 0.0), Round(s.ball, 0.3, 0.1), facing=FACING)
    return replace(action, head=HeadMode.LOCALIZE)


def _start_place(s: Situation) -> Point2:
    """Place for the kick-off or the penalty kick that is prepared."""
    game, field = s.game, s.field
    half = field.length / 2.0
    along, across = START_PLACES[s.rank % len(START_PLACES)]
    y = across * field.width
    if game.set_play is SetPlay.PENALTY_KICK and game.own_kick:
        if s.striker is None and not game.goalkeeper:
            return half - field.penalty_mark - 0.4, 0.0
        return (half - _penalty_room(s), y) if not game.goalkeeper else (0.3 - half, 0.0)
    if s.defends_penalty:
        y = 0.0 if s.striker is None else y
        return (_penalty_room(s) - half, y) if not game.goalkeeper else (-half, 0.0)
    if game.goalkeeper:
        return 0.3 - half, 0.0
    if s.striker is None:
        return (-0.35 if game.own_kick else -field.circle_diameter / 2.0 - 0.3), 0.0
    return along * field.length, y


def _penalty_room(s: Situation) -> float:
    """[m] from the goal line to who waits for a penalty kick, outside of the area."""
    ball = s.field.penalty_mark + s.game.ball_distance + 0.1
    return max(s.field.penalty_area_length + 0.3, ball)


def support(s: Situation) -> Action:
    """Stand between ball and own goal or ahead of the ball, out of the striker's way."""
    ball = s.world.ball
    if ball is None:
        return look_for_ball(s)
    bx, by = ball.position_in_field
    gx, gy = -s.field.length / 2.0, 0.0
    far = math.hypot(bx - gx, by - gy)
    # Half way to the own goal, but never nearer to the ball than a metre.
    share = min(0.5, max(0.0, (far - 1.0) / far)) if far > 0.0 else 0.0
    ahead, aside = SUPPORT_PLACES[s.rank % len(SUPPORT_PLACES)]
    side = -1.0 if by > 0.0 else 1.0
    x = gx + share * (bx - gx) + ahead * s.field.length
    y = gy + share * (by - gy) + side * aside * s.field.width
    if s.rank == RECEIVER and not s.gives_way:
        x = min(bx + s.duel.receive_ahead, s.field.length / 2.0 - GOAL_ROOM)
        side = side if abs(by) > CHANGE_SIDE else math.copysign(1.0, s.own[1])
        y = side * s.duel.receive_aside * s.field.width
    place = _on_field(s, (x, y))
    gap = math.dist(place, (bx, by))
    if s.rank and 0.0 < gap < 1.0:  # not to the ball, but behind it
        place = _on_field(s, (bx - 1.0, place[1]))
    return _stand_at(s, place, Round(s.ball, 0.7))


def guard_goal(s: Situation) -> Action:
    """Stand between ball and goal, a little ahead of the goal line."""
    ball = s.world.ball
    gx = -s.field.length / 2.0
    bx, by = (0.0, 0.0) if ball is None else ball.position_in_field
    far = math.hypot(bx - gx, by) or 1.0
    reach = 0.7 * s.goals.width / 2.0
    out = 0.0 if s.defends_penalty else KEEPER_OUT
    y = min(max(by * out / far, -reach), reach)
    return _walk_and_stay(s, (gx + out, y, math.atan2(by - y, bx - gx - out)))


def dive_left(s: Situation) -> Action:
    """Dive to the left."""
    return Action(motion=DIVES[0], head=HeadMode.BALL)


def dive_right(s: Situation) -> Action:
    """Dive to the right."""
    return Action(motion=DIVES[1], head=HeadMode.BALL)


def _stand_at(s: Situation, place: Point2, *obstacles: Round) -> Action:
    """Walk to a place in the field and face the ball."""
    ball = s.world.ball
    bx, by = (0.0, 0.0) if ball is None else ball.position_in_field
    heading = math.atan2(by - place[1], bx - place[0])
    return _walk_and_stay(s, (*place, heading), *obstacles)


def _walk_and_stay(
    s: Situation, pose: Pose2, *obstacles: Round, facing: tuple[float, float] = KEEP_FACING
) -> Action:
    """Walk to a pose in the field; stand while it is near enough.

    A robot that does not know where it is finds that out first.
    """
    if s.lost:
        return Action(turn_by(LOST_TURN, s.limits))
    target = s.in_base(pose)
    stands = s.body.state is STAND
    near, turned = (0.25, 0.5) if stands else (0.1, 0.2)
    if math.hypot(*target[:2]) < near and abs(target[2]) < turned:
        return Action(VelocityCommand())
    return Action(walk_to(target, s.limits, s.obstacles(*obstacles), facing=facing))


def _on_field(s: Situation, place: Point2) -> Point2:
    """The nearest place on the field; in some set plays outside of a penalty area."""
    x, y = s.field.length / 2.0 - 0.2, s.field.width / 2.0 - 0.2
    low, high = -x, x
    if s.gives_way and s.game.set_play is SetPlay.GOAL_KICK:
        high = s.field.length / 2.0 - s.field.penalty_area_length - 0.3
    elif s.gives_way and s.defends_penalty:
        low = _penalty_room(s) - s.field.length / 2.0
    return min(max(place[0], low), high), min(max(place[1], -y), y)
