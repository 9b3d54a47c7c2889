"""Where the head looks: at the ball, or at what improves the own pose most. The body plays no part.

Gait and joints turn the head; here only points in base_footprint are chosen.
"""

import math

import numpy as np

from nao_soccer.world.field_map import FieldMap
from nao_soccer.world.settings import SIGHT
from nao_soccer.world.state import BallEstimate, HeadMode, PoseEstimate, WorldState
from robot_core.field import seen_from
from robot_core.geometry import rotation_from_rpy
from robot_core.head_goals import Follow, Frame, Goal, LookAt, Search
from robot_core.types import FloatArray, Point3, PoseCovariance

DWELL = 0.8
"""[s] The head looks at a landmark for at least this long: the turn of the head and two images."""
GLANCE_EVERY = 3.0
"""[s] Between two glances at landmarks while the ball is followed."""
GLANCE_DEVIATION = 0.05, math.radians(2.0)
"""[m, rad] Deviations of the own pose above which a glance is worth it."""
GLANCE_DISTANCE = 0.6
"""[m] No glances while the ball is nearer."""
LOST_SHARE = 0.6
"""Share of the time in which the head searches for landmarks while the pose is not valid."""
LOST_PERIOD = 4.0
"""[s] Period of this change between ball and landmarks."""
NEAREST = 0.4
"""[m] A nearer landmark does not help."""
PAN_MAX = 1.4
"""[rad] Bearing up to which a landmark can be looked at."""
HALF_VIEW = 0.35
"""[rad] Half of the angle of view."""
CAMERA_HEIGHT = 0.46
"""[m] Typical height of a camera; it sets how errors grow with the distance."""
TILT_ERROR, PAN_ERROR = 0.01, 0.02
"""[rad] Typical errors of what is seen."""
YAW_SCALE = 1.0
"""[m/rad] Weight of the heading against the place."""
BETTER = 1.3
"""Another landmark has to improve the pose by this factor more than the one that is looked at."""
AHEAD = 1.2, 0.0, 0.1
"""[m] What the head looks at that watches the robot's way: robots from 0.6 m on are in view."""
ASIDE = (0.6, 1.0, 0.1), (0.6, -1.0, 0.1)
"""[m] The same for robots beside it."""
WAY_DWELL = 0.55
"""[s] The head looks ahead, to the left, ahead, to the right, for so long each."""
ROBOT_NEAR, ROBOT_AGE = 0.9, 0.6
"""[m, s] A robot that is so near and was not seen for so long is looked at first."""
ROBOT_PAN_MAX = 1.9
"""[rad] Bearing up to which the neck lets it look for a robot."""
ROBOT_HEIGHT = 0.2
"""[m] Height of the point to look at."""
SCAN = 1.0, 4.5
"""[m] How far away the head looks in turn while the robot turns to search. The cameras of a NAO
leave a gap between them, 0.9 to 1.1 m away in the far look, 0.4 to 0.5 m in the near one."""
SCAN_BEARING = -1.0
"""[rad] where it looks then: ahead of the turn, so that what lies behind is seen sooner."""
SCAN_PERIOD = 0.8
"""[s] of one near and one far look."""
BALL_RADIUS = 0.05
"""[m] Height of the point to look at."""


class Looking:
    """Chooses what the head looks at; `sight` [m] is how far away a landmark helps."""

    def __init__(self, field: FieldMap, sight: float = SIGHT) -> None:
        self._sight = sight
        self._landmarks = np.unique(
            np.concatenate([rows[:, :2] for rows in field.landmarks.values()]).round(3), axis=0
        )
        self._target: int | None = None
        self._since = -math.inf
        self._glance_end = -math.inf

    def goal(self, mode: HeadMode, state: WorldState) -> Goal | None:
        """Where to look now, to be renewed with each state; None leaves it to the gait."""
        if mode is HeadMode.FREE or not state.upright:
            return None
        now = state.stamp * 1e-9
        if mode is HeadMode.AHEAD:
            return LookAt(_on_way(state, now), Frame.FOOTPRINT)
        if mode is HeadMode.SCAN:
            far = SCAN[now % SCAN_PERIOD < 0.5 * SCAN_PERIOD]
            place = far * math.cos(SCAN_BEARING), far * math.sin(SCAN_BEARING), 0.0
            return LookAt(place, Frame.FOOTPRINT)
        if now < self._since or now < self._glance_end - 60.0:  # the clock started anew
            self._since = self._glance_end = -math.inf
        ball = _at_ball(state.ball)
        if mode is HeadMode.BALL:
            return ball or Search()
        landmark = self._at_landmark(state.own, now)
        if mode is HeadMode.LOCALIZE:
            return landmark or Search()
        if ball is None or state.ball is None:
            return Search()  # the sweep over the field shows lines as well
        if not state.own.valid:
            return Search() if now % LOST_PERIOD < LOST_SHARE * LOST_PERIOD else ball
        return landmark if landmark and self._glances(state.ball, state.own, now) else ball

    def _glances(self, ball: BallEstimate, own: PoseEstimate, now: float) -> bool:
        """Whether the head leaves the ball for a moment."""
        if now < self._glance_end:
            return True
        place, heading = deviations(own.covariance)
        unsure = place > GLANCE_DEVIATION[0] or heading > GLANCE_DEVIATION[1]
        if (
            unsure
            and ball.seen_recently
            and math.hypot(*ball.position) > GLANCE_DISTANCE
            and now - self._glance_end > GLANCE_EVERY
        ):
            self._glance_end = now + DWELL
            return True
        return False

    def _at_landmark(self, own: PoseEstimate, now: float) -> LookAt | None:
        """The landmark that improves the pose most; None if none is near or the pose unknown."""
        if not own.valid:
            return None
        places = seen_from(own.pose, self._landmarks)
        gain = gains(places, turned(own), self._sight)
        best = int(np.argmax(gain))
        if gain[best] <= 0.0:
            return None
        target = self._target
        gone = target is None or gain[target] <= 0.0
        if gone or (now - self._since > DWELL and gain[best] > BETTER * gain[target]):
            self._target, self._since = best, now
        x, y = places[self._target].tolist()
        return LookAt((x, y, 0.0), Frame.FOOTPRINT)


def gains(places: FloatArray, prior: FloatArray, sight: float = SIGHT) -> FloatArray:
    """Decrease [m^2] (n,) of the pose's variance by all in view, if looking at each landmark.

    Landmarks (n, 2) [m] are in base_footprint, the covariance (3, 3) of the pose in its own axes; 0
    for landmarks that cannot be seen.
    """
    distance, bearing = np.hypot(*places.T), np.arctan2(places[:, 1], places[:, 0])
    seen = (distance > NEAREST) & (distance < sight) & (np.abs(bearing) < PAN_MAX)
    information = _information(distance, bearing) * seen[:, None, None]
    together = (np.abs(bearing[:, None] - bearing) < HALF_VIEW) & seen
    by_view = np.einsum("ij,jkl->ikl", together.astype(float), information)
    after = np.linalg.inv(np.linalg.inv(prior) + by_view)
    scale = np.array((1.0, 1.0, YAW_SCALE**2))
    gain = scale @ np.diag(prior) - np.einsum("ijj,j->i", after, scale)
    result: FloatArray = np.where(seen, gain, 0.0)
    return result


def _information(distance: FloatArray, bearing: FloatArray) -> FloatArray:
    """(n, 3, 3) H' R^-1 H of a sighting of each landmark, for the pose in its own axes."""
    radial = TILT_ERROR * (CAMERA_HEIGHT**2 + distance**2) / CAMERA_HEIGHT
    across = PAN_ERROR * np.maximum(distance, 0.1)
    c, s = np.cos(bearing), np.sin(bearing)
    zero = np.zeros_like(c)
    # Rows: how radial and lateral place change with x, y, yaw of the robot.
    rows = np.array(((-c, -s, zero), (s, -c, -distance))).transpose(2, 0, 1)
    weights = np.array((1.0 / radial**2, 1.0 / across**2)).T
    result: FloatArray = np.einsum("nik,ni,nil->nkl", rows, weights, rows)
    return result


def turned(own: PoseEstimate) -> FloatArray:
    """(3, 3) covariance of a pose in its own axes."""
    turn = np.array(rotation_from_rpy(0.0, 0.0, -own.pose[2]))
    result: FloatArray = turn @ own.covariance.matrix @ turn.T + 1e-9 * np.eye(3)
    return result


def deviations(covariance: PoseCovariance) -> tuple[float, float]:
    """Deviations of the place [m], along its largest axis, and of the heading [rad]."""
    c = covariance
    half = math.hypot(0.5 * (c.xx - c.yy), c.xy)
    return math.sqrt(max(0.0, 0.5 * (c.xx + c.yy) + half)), math.sqrt(max(0.0, c.yaw))


def unseen_robot(state: WorldState) -> Point3 | None:
    """Where to look for a robot near by that may have moved since it was seen; None = none."""
    for robot in state.obstacles:
        x, y = robot.position
        unseen = robot.age > ROBOT_AGE and math.hypot(x, y) < ROBOT_NEAR
        if unseen and abs(math.atan2(y, x)) < ROBOT_PAN_MAX:
            return x, y, ROBOT_HEIGHT
    return None


def _on_way(state: WorldState, now: float) -> Point3:
    """What to look at to see other robots: one that is near and may have moved, or all around."""
    turn = int(now / WAY_DWELL) % 4
    return unseen_robot(state) or (ASIDE[turn // 2] if turn % 2 else AHEAD)


def _at_ball(ball: BallEstimate | None) -> Goal | None:
    """Follow a ball that is known; one that was missed is searched around its last place."""
    if ball is None or not (ball.seen_recently or ball.by_team or ball.age < 3.0):
        return None
    return Follow((*ball.position, BALL_RADIUS), Frame.FOOTPRINT)
