"""The input symbols: what transitions depend on.

Thresholds come in pairs, so that decisions do not flicker.
"""

import math

from nao_soccer.behavior.situation import Situation
from nao_soccer.game_state import GamePhase, Phase, Role
from nao_soccer.world.settings import BALL_DECELERATION
from robot_core.types import FALLEN, IN_MOTION, STAND

BALL_FORGOTTEN = 4.0
"""[s] since anybody saw the ball, after which it is searched."""
BEHIND_ANGLE = 0.35
"""[rad] of the robot's place and heading, seen from the ball, at which it steps to the ball."""
SPOT = 0.025
"""[m] error of the ball's place at which the robot stops before a kick."""
SPOT_HEADING = 0.12
"""[rad] the same for the heading."""
PUSH_MARGIN = 0.05
"""[m] The ball may lie so much farther while it is pushed."""
SHOT_SPEED = 0.4
"""[m/s] towards the keeper, from which on a ball is a shot."""
SHOT_TIME = 1.15
"""[s] before a shot arrives, the keeper dives. It lies after 0.85 s; the speed of a ball that has
just begun to roll is estimated too low."""
SHOT_MARGIN = 0.15
"""[m] beside the goal, by which the place of a shot may be estimated wrongly."""
FEET = 0.05
"""[m] ahead of base_footprint, where a ball meets the keeper."""
FEET_REACH = 0.12
"""[m] to either side, that a standing robot covers; less than this a dive would let through."""
DIVE_REACH = 0.7
"""[m] to one side, that a dive covers."""


# -- the body --------------------------------------------------------------------------------------


def fallen(s: Situation) -> bool:
    """The robot lies or gets up."""
    return not s.world.upright


def must_get_up(s: Situation) -> bool:
    """The robot lies and may get up; while the game is stopped nobody moves."""
    return fallen(s) and not s.game.stopped


def lies(s: Situation) -> bool:
    """The robot lies and does not get up."""
    return s.body.state is FALLEN


def upright(s: Situation) -> bool:
    """The robot is on its feet."""
    return s.world.upright


def stands(s: Situation) -> bool:
    """The robot stands still and could begin a motion."""
    return s.body.state is STAND


def in_motion(s: Situation) -> bool:
    """A motion runs."""
    return s.body.state in IN_MOTION


# -- the game --------------------------------------------------------------------------------------


def must_stand(s: Situation) -> bool:
    """The rules want the robot to stand still, or it does not see where it walks."""
    moves = s.game.phase in (Phase.READY, Phase.PLAYING)
    return not (moves and _may_move(s))


def ready(s: Situation) -> bool:
    """The robots walk to their places for the kick-off."""
    return s.game.phase is Phase.READY and _may_move(s)


def playing(s: Situation) -> bool:
    """The ball is in play."""
    return s.game.phase is Phase.PLAYING and _may_move(s)


def _may_move(s: Situation) -> bool:
    game = s.game
    away = game.penalized or game.stopped or not game.selected
    return not (away or game.game_phase is GamePhase.TIMEOUT or s.world.blind)


def must_give_way(s: Situation) -> bool:
    """The other team has a kick-off or a set play that is not over."""
    return s.gives_way


def may_play(s: Situation) -> bool:
    """The opposite of `must_give_way`."""
    return not s.gives_way


# -- the team --------------------------------------------------------------------------------------


def is_striker(s: Situation) -> bool:
    """This robot goes to the ball."""
    return s.role is Role.STRIKER


def is_supporter(s: Situation) -> bool:
    """A team mate goes to the ball."""
    return s.role is Role.SUPPORTER


def is_keeper(s: Situation) -> bool:
    """This robot keeps the goal."""
    return s.role is Role.KEEPER


# -- the own place ---------------------------------------------------------------------------------


def place_lost(s: Situation) -> bool:
    """The robot does not know where it is, or in which half."""
    return s.lost


def place_known(s: Situation) -> bool:
    """The opposite of `place_lost`."""
    return not s.lost


# -- the ball --------------------------------------------------------------------------------------


def ball_known(s: Situation) -> bool:
    """Somebody saw the ball a short time ago."""
    return s.world.ball is not None and s.world.ball.age < 0.5 * BALL_FORGOTTEN


def ball_lost(s: Situation) -> bool:
    """Nobody has seen the ball for a while."""
    return s.world.ball is None or s.world.ball.age > BALL_FORGOTTEN


def _behind_error(s: Situation) -> tuple[float, float]:
    """Angles [rad]: of the robot's place as seen from the ball, and of its heading."""
    x, y, yaw = s.start_pose
    ball = s.ball
    wanted = math.atan2(ball[1] - y, ball[0] - x)
    place = math.remainder(math.atan2(ball[1], ball[0]) - wanted, math.tau)
    return abs(place), abs(yaw)


def behind_ball(s: Situation) -> bool:
    """The robot is near the ball, on the right side of it, and looks where it has to."""
    place, heading = _behind_error(s)
    near = s.ball_distance < 0.45
    return s.plan is not None and near and place < BEHIND_ANGLE and heading < BEHIND_ANGLE


def not_behind_ball(s: Situation) -> bool:
    """The robot has lost its place behind the ball."""
    place, heading = _behind_error(s)
    lost = s.ball_distance > 0.6 or place > 2.5 * BEHIND_ANGLE or heading > 2.0 * BEHIND_ANGLE
    return s.plan is None or lost


def may_push(s: Situation) -> bool:
    """The ball lies at the feet and another robot is at it: there is no time to aim."""
    return s.pushes_ball(0.0)


def push_is_over(s: Situation) -> bool:
    """The ball is no longer at the feet, or no other robot is at it."""
    return not s.pushes_ball(PUSH_MARGIN)


def plan_is_kick(s: Situation) -> bool:
    """The ball is to be kicked, not dribbled."""
    return s.plan is not None and not s.plan.dribbles


def plan_is_dribble(s: Situation) -> bool:
    """The ball is to be dribbled."""
    return s.plan is not None and s.plan.dribbles


def _spot_error(s: Situation) -> tuple[float, float]:
    """How far [m] the ball is from the kick's spot, and the heading error [rad]."""
    if s.plan is None or s.plan.dribbles:
        return math.inf, math.inf
    spot, ball = s.plan.kick.spot, s.ball
    return math.hypot(ball[0] - spot[0], ball[1] - spot[1]), abs(s.kick_pose[2])


def at_kick_spot(s: Situation) -> bool:
    """The ball lies where the kick needs it."""
    place, heading = _spot_error(s)
    return place < SPOT and heading < SPOT_HEADING


def off_kick_spot(s: Situation) -> bool:
    """The ball does not lie where the kick needs it, and the robot stands."""
    place, heading = _spot_error(s)
    return stands(s) and (place > 1.6 * SPOT or heading > 1.6 * SPOT_HEADING)


def ready_to_kick(s: Situation) -> bool:
    """The robot stands, and the ball lies where the kick needs it."""
    place, heading = _spot_error(s)
    return stands(s) and place < 1.6 * SPOT and heading < 1.6 * SPOT_HEADING


# -- the goal --------------------------------------------------------------------------------------


def _shot(s: Situation) -> float | None:
    """Where a shot at the own goal passes the keeper, y [m] in base_footprint; None = no shot."""
    ball = s.world.ball
    if ball is None or not ball.seen_recently:
        return None
    x, vx = ball.position[0] - FEET, -ball.velocity[0]
    # The time until it has rolled as far as the feet, slowed down on its way.
    rest = vx * vx - 2.0 * BALL_DECELERATION * x
    if vx < SHOT_SPEED or x < 0.0 or rest < 0.0:
        return None
    arrival = (vx - math.sqrt(rest)) / BALL_DECELERATION
    if arrival > SHOT_TIME:
        return None
    bx, by = ball.position_in_field
    wx, wy = ball.velocity_in_field
    behind = bx + s.field.length / 2.0
    if wx >= 0.0 or abs(by - wy / wx * behind) > s.goals.width / 2.0 + SHOT_MARGIN:
        return None
    return ball.position[1] + ball.velocity[1] / vx * x


def shot_at_feet(s: Situation) -> bool:
    """A shot comes within reach of the feet."""
    y = _shot(s)
    return y is not None and abs(y) <= FEET_REACH


def shot_to_left(s: Situation) -> bool:
    """A shot passes on the left, within reach of a dive."""
    y = _shot(s)
    return s.dives and y is not None and FEET_REACH < y < DIVE_REACH


def shot_to_right(s: Situation) -> bool:
    """A shot passes on the right, within reach of a dive."""
    y = _shot(s)
    return s.dives and y is not None and FEET_REACH < -y < DIVE_REACH
