"""The world model: every percept is used at the time of its image, whenever it arrives.

The filters live at the time of the last image that was used. A percept of an older image is carried
on to that time by odometry; one that is newer than the odometry waits for it. A state is the
filters' knowledge, carried on by odometry to the present, which is the last odometry's time.
"""

import math
from collections import deque
from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from nao_soccer.vision.percepts import ROBOTS, Percept, Percepts
from nao_soccer.world.ball import DOUBT, RECENT, BallFilter
from nao_soccer.world.field_map import FieldMap
from nao_soccer.world.likelihood import Evidence
from nao_soccer.world.localization import Localization
from nao_soccer.world.obstacles import ObstacleFilter, near
from nao_soccer.world.odometry import Displacement, OdometryHistory
from nao_soccer.world.planar_track import matrix, point, triple
from nao_soccer.world.settings import WorldSettings
from nao_soccer.world.state import (
    BallEstimate,
    Obstacle,
    PoseEstimate,
    TeamMate,
    TeamRobot,
    WorldState,
)
from nao_soccer.world.team_knowledge import (
    SAME_ROBOT,
    TeamKnowledge,
    half_by_robots,
    in_field,
    own_team_ball,
    with_told,
)
from robot_core.errors import NaoGaitError
from robot_core.geometry import compose, planar_rotation, relative
from robot_core.types import Point2, Pose2

AHEAD_MAX = 500_000_000
"""[ns] How far a percept may be ahead of the odometry."""
LATE_MAX = 500_000_000
"""[ns] How far a percept may be behind one that was used before."""
WAITING = 8
"""Number of percepts that wait for odometry."""
REACH_MAX = 15.0
"""[m] Distance beyond which a percept is refused."""
FALL_TURN, FALL_MOVE = math.radians(110.0), 0.8
"""[rad, m] Largest unknown change of heading and place by a fall and getting up: of 24 robots that
were pushed over, odometry without a yaw gyro was off by 52 degrees and each coordinate by 0.6 m
(rms)."""
JUMP_TURN, JUMP_MOVE = math.radians(30.0), 0.5
"""[rad, m] Assumed largest change of heading and place while the odometry was missing."""
OFF_FIELD = 0.5
"""[m] How far beyond the carpet a ball may seem to be, besides 30 % of its distance."""
VARIANCE_MIN, VARIANCE_MAX = 1e-8, 1e4
"""[m^2] Smaller and larger variances are an error of the sender."""


class WorldModel:
    """Percepts, odometry and team messages in; `WorldState` out.

    Args:
        settings: Field and filters.
        color: `red` or `blue`, as which the own team is seen; empty = not known.

    Attributes:
        localization: The particles.
    """

    def __init__(self, settings: WorldSettings, color: str = "") -> None:
        self._color = color
        self._field = FieldMap(settings.field, settings.goals, settings.poles)
        self.localization = Localization(self._field, settings)
        self._ball = BallFilter(settings.slowdown)
        self._obstacles = ObstacleFilter()
        self._odometry = OdometryHistory(settings.way_noise, settings.heading_noise)
        self._team = TeamKnowledge()
        self._waiting: deque[Percepts] = deque(maxlen=WAITING)
        self._time: int | None = None
        self._last_image = self._last_sight = 0  # [ns]; from the first odometry on
        self._upright = True

    @property
    def map(self) -> FieldMap:
        """The field."""
        return self._field

    # -- input -------------------------------------------------------------------------------------

    def add_odometry(self, stamp: int, pose: Pose2) -> None:
        """Odometry at a time [ns].

        Raises:
            NaoGaitError: It is not finite and was left out, or it jumped or its clock started anew;
                the world model goes on with it, and the pose is not valid until it is found again.
        """
        newest = self._odometry.newest
        try:
            self._odometry.add(stamp, pose)
        except NaoGaitError:
            if self._odometry.newest != newest:
                self._lose(stamp)
            raise
        if self._time is None:
            self._time = self._last_image = self._last_sight = stamp
        if not self._upright:
            self._last_sight = stamp
        self._use_waiting()
        # Without images the filters would fall out of the history of the odometry.
        if stamp - self._time > LATE_MAX:
            self._advance(stamp - LATE_MAX // 2)

    def _lose(self, stamp: int) -> None:
        """Nothing is known of the motion until now."""
        self._time = self._last_image = self._last_sight = stamp
        self._waiting.clear()
        self._ball.forget()
        self._obstacles.forget()
        self.localization.disturb(JUMP_MOVE, JUMP_TURN)

    def add_percepts(self, percepts: Percepts) -> None:
        """What one image shows; unusable parts are left out.

        Raises:
            NaoGaitError: The image is of the future or too old, or an object of it cannot be used;
                the rest of the image is used all the same.
        """
        newest = self._odometry.newest
        where = "percepts header.stamp"
        if newest is None:
            raise NaoGaitError(where, f"{percepts.stamp * 1e-9:.3f} s", "odom before percepts")
        if percepts.stamp > newest + AHEAD_MAX:
            allowed = f"at most {(newest + AHEAD_MAX) * 1e-9:.3f} s: odom is not newer"
            raise NaoGaitError(where, f"{percepts.stamp * 1e-9:.3f} s", allowed)
        if self._time is not None and percepts.stamp < self._time - LATE_MAX:
            allowed = f"at least {(self._time - LATE_MAX) * 1e-9:.3f} s"
            raise NaoGaitError(where, f"{percepts.stamp * 1e-9:.3f} s", allowed)
        usable, refusal = _usable(percepts)
        off_field = self._off_field(usable.ball)
        if off_field is not None:
            usable = replace(usable, ball=None)
        refusal = refusal or off_field
        self._last_image = max(self._last_image, usable.stamp)
        if usable.ball is not None or usable.objects or len(usable.line_points):
            self._last_sight = max(self._last_sight, usable.stamp)
        self._waiting.append(usable)
        self._use_waiting()
        if refusal is not None:
            raise refusal

    def _off_field(self, ball: Percept | None) -> NaoGaitError | None:
        """Why a ball that is clearly beyond the carpet is refused; None if it is not."""
        if ball is None:
            return None
        own = self.localization.estimate()
        if not own.valid:
            return None
        x, y, _ = compose(own.pose, (*ball.position, 0.0))
        limits = [half + OFF_FIELD + 0.3 * math.hypot(*ball.position) for half in self._field.half]
        if abs(x) <= limits[0] and abs(y) <= limits[1]:
            return None
        return NaoGaitError("percepts ball in field", (round(x, 2), round(y, 2)), "on the carpet")

    def set_upright(self, upright: bool) -> None:
        """Whether the robot stands or walks; after a fall its heading is not known well."""
        if upright and not self._upright:
            self.localization.disturb(FALL_MOVE, FALL_TURN)
        if self._upright and not upright:
            self._ball.forget()
            self._obstacles.forget()
        self._upright = upright

    def add_mate(self, mate: TeamMate) -> None:
        """What a team mate told of itself."""
        if self._team.add(mate):
            self._judge_half()
            if self._upright and self._color:
                self._judge_by_robots(mate)

    def start(self, poses: tuple[Pose2, ...], place: float = 0.2, heading: float = 0.2) -> None:
        """The robot now is at one of these poses in `field`; see `Localization.start`."""
        if (now := self._odometry.newest) is not None:
            self._advance(now)  # or its way until now would count from there
            self._waiting.clear()
        self.localization.start(poses, place, heading)

    def forget_place(self) -> None:
        """The robot may be anywhere on the field."""
        self.localization.spread()

    # -- filters -----------------------------------------------------------------------------------

    def _use_waiting(self) -> None:
        newest = self._odometry.newest
        ready = [each for each in self._waiting if newest is not None and each.stamp <= newest]
        for percepts in sorted(ready, key=lambda each: each.stamp):
            self._waiting.remove(percepts)
            self._use(percepts)

    def _use(self, percepts: Percepts) -> None:
        if not self._upright or self._time is None:
            return
        if percepts.stamp >= self._time:
            self._advance(percepts.stamp)
        else:
            percepts = carried(percepts, self._odometry.motion(percepts.stamp, self._time).offset)
        self.localization.see(Evidence.of(percepts, self._field))
        if percepts.ball is not None:
            self._ball.see(percepts.ball)
            self._judge_half()
        else:
            self._ball.miss(percepts.visible)
        self._obstacles.see(percepts.of(*ROBOTS), percepts.visible)

    def _judge_half(self) -> None:
        """Compare the ball that was seen lately with those that team mates told of lately."""
        if self._time is None:
            return
        motion = self._odometry.motion(self._time, self._time)
        own = self.localization.estimate(motion)
        ball = self._own_ball(own, motion, 0.0)
        for log_ratio in self._team.half_evidence(self._time, own, ball):
            self.localization.judge_half(log_ratio)

    def _judge_by_robots(self, mate: TeamMate) -> None:
        """Compare where this robot and a team mate are with where they see robots of their team."""
        own = self.localization.estimate()
        seen = [
            TeamRobot(compose(own.pose, (*point(robot.track.mean), 0.0))[:2], robot.age, True)
            for robot in self._obstacles.robots
            if robot.team == self._color and robot.age < RECENT
        ]
        self.localization.judge_half(half_by_robots(own, mate, seen))

    def _advance(self, stamp: int) -> None:
        """Bring all filters to a time [ns]."""
        if self._time is None or stamp == self._time:
            return
        seconds = (stamp - self._time) * 1e-9
        motion = self._odometry.motion(self._time, stamp)
        self.localization.move(motion, seconds)
        self._ball.advance(motion, seconds)
        self._obstacles.advance(motion, seconds)
        self._time = stamp

    # -- output ------------------------------------------------------------------------------------

    def state(self) -> WorldState | None:
        """What is known at the time of the last odometry; None before the first."""
        now = self._odometry.newest
        if now is None or self._time is None:
            return None
        seconds = (now - self._time) * 1e-9
        motion = self._odometry.motion(self._time, now)
        own = self.localization.estimate(motion)
        own = replace(own, valid=own.valid and self._upright)
        ball = self._own_ball(own, motion, seconds)
        mates = self._team.at(now)
        robots = tuple(self._robots(now, own, motion, mates))
        told = None if ball is None else own_team_ball(ball)
        if ball is None or not ball.seen_recently:
            ball = self._team.ball(now, own, ball) or ball
        return WorldState(
            now, own, ball, robots, mates, self._upright, told,
            (now - self._last_image) * 1e-9, (now - self._last_sight) * 1e-9,
        )  # fmt: skip

    def _own_ball(
        self, own: PoseEstimate, motion: Displacement, seconds: float
    ) -> BallEstimate | None:
        known = self._ball.ball
        if known is None:
            return None
        track = known.copy()
        track.advance(motion, seconds)
        estimate = track.estimate
        position, velocity = point(estimate.mean), point(estimate.mean[2:])
        covariance = estimate.covariance
        return in_field(
            own,
            position,
            velocity,
            triple(covariance[:2, :2]),
            triple(covariance[2:, 2:]),
            age=track.age,
            seen_recently=track.age < RECENT and track.misses < DOUBT,
        )

    def _robots(
        self, now: int, own: PoseEstimate, motion: Displacement, mates: tuple[TeamMate, ...]
    ) -> Iterator[Obstacle]:
        """The robots that were seen, and the team mates that told where they are."""
        # A robot that lies holds no valid pose, but lies where it fell.
        told = [mate for mate in mates if mate.valid or mate.fallen]
        fallen = [mate.pose[:2] for mate in told if mate.fallen]
        found = []
        for robot in self._obstacles.robots:
            track = robot.track.copy()
            track.carry(motion)
            x, y, _ = compose(own.pose, (*point(track.mean), 0.0))
            found.append(
                Obstacle(
                    point(track.mean),
                    (x, y),
                    triple(track.covariance[:2, :2]),
                    point(track.mean[2:]),
                    robot.team,
                    own.valid and near((x, y), fallen, SAME_ROBOT),
                    robot.age,
                )
            )
        if own.valid:
            found = with_told(found, own, told, now)
        yield from sorted(found, key=lambda each: math.hypot(*each.position))


def carried(percepts: Percepts, offset: Pose2) -> Percepts:
    """Percepts in base_footprint after a motion; what they show is taken as at rest."""
    back = planar_rotation(-offset[2])

    def place(position: Point2) -> Point2:
        x, y, _ = relative((*position, 0.0), offset)
        return x, y

    def turned(each: Percept) -> Percept:
        return each._replace(
            position=place(each.position),
            covariance=triple(back @ matrix(each.covariance) @ back.T),
            yaw=each.yaw - offset[2],
        )

    xx, xy, yy = percepts.line_covariances.T
    covariances = back @ np.stack((np.stack((xx, xy)), np.stack((xy, yy)))).transpose(2, 0, 1)
    covariances = covariances @ back.T
    return replace(
        percepts,
        ball=None if percepts.ball is None else turned(percepts.ball),
        objects=tuple(map(turned, percepts.objects)),
        line_points=(percepts.line_points - offset[:2]) @ back.T,
        line_covariances=np.column_stack(
            (covariances[:, 0, 0], covariances[:, 0, 1], covariances[:, 1, 1])
        ),
        visible=(percepts.visible - offset[:2]) @ back.T,
    )


def _usable(percepts: Percepts) -> tuple[Percepts, NaoGaitError | None]:
    """The percepts without those that cannot be used, and why the first of these was left out."""
    refusals: list[NaoGaitError] = []

    def usable(each: Percept) -> bool:
        fault = _fault(each)
        if fault is not None:
            refusals.append(fault)
        return fault is None

    ball = percepts.ball
    if ball is not None and not usable(ball):
        ball = None
    objects = tuple(each for each in percepts.objects if usable(each))
    points, covariances = percepts.line_points, percepts.line_covariances
    xx, xy, yy = covariances.T
    with np.errstate(invalid="ignore"):
        good = (
            np.isfinite(points).all(axis=1)
            & (np.abs(points) < REACH_MAX).all(axis=1)
            & np.isfinite(covariances).all(axis=1)
            & (np.minimum(xx, yy) >= VARIANCE_MIN)
            & (np.maximum(xx, yy) <= VARIANCE_MAX)
            & (xx * yy > xy * xy)
        )
    if not good.all():
        wrong = int(np.argmin(good))
        value = [*points[wrong].tolist(), *covariances[wrong].tolist()]
        refusals.append(NaoGaitError("percepts line point", value, _ALLOWED))
    kept = replace(
        percepts,
        ball=ball,
        objects=objects,
        line_points=points[good],
        line_covariances=covariances[good],
    )
    return kept, refusals[0] if refusals else None


_ALLOWED = (
    f"a place within {REACH_MAX:g} m, and a positive definite covariance of {VARIANCE_MIN:g} to "
    f"{VARIANCE_MAX:g} m^2"
)


def _fault(percept: Percept) -> NaoGaitError | None:
    """Why a percept cannot be used; None if it can."""
    xx, xy, yy = percept.covariance
    numbers = (*percept.position, xx, xy, yy, percept.yaw)
    if (
        all(map(math.isfinite, numbers))
        and math.hypot(*percept.position) < REACH_MAX
        and min(xx, yy) >= VARIANCE_MIN
        and max(xx, yy) <= VARIANCE_MAX
        and xx * yy > xy * xy
    ):
        return None
    return NaoGaitError(f"percepts {percept.kind}", list(numbers), _ALLOWED)
