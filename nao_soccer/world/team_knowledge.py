"""What team mates tell: their balls, fused with the own one, robots, and which half is ours.

A message holds only what its sender has seen with its own cameras, so a ball never comes back to
its origin by way of a team mate.
"""

import math
from dataclasses import replace

import numpy as np

from nao_soccer.vision.percepts import Covariance2
from nao_soccer.world.planar_track import matrix, point, triple
from nao_soccer.world.state import (
    BallEstimate,
    Obstacle,
    PoseEstimate,
    TeamBall,
    TeamMate,
    TeamRobot,
)
from robot_core.geometry import compose, planar_rotation, relative, rotate_planar
from robot_core.types import FloatArray, Point2

SILENT = 5.0
"""[s] A team mate that is silent for longer is not reported."""
BALL_AGE = 3.0
"""[s] A team mate's ball is not used when it is older."""
TOLD_DRIFT = 0.3
"""[m/s] Deviation by which a place that was told grows wrong."""
TEAM_ERROR = 0.15
"""[m] Deviation of a told place besides its covariance."""
GATE = 12.0
"""Squared standard deviations up to which two balls are the same."""
WRONG = 0.1
"""Share of told balls that are wrong."""
RATIO_SHARE = 0.5
"""Weight of one comparison of balls or robots; those of two messages are not independent."""
ROBOT_MAX = 2.0
"""[s] For which another robot is where a team mate told."""
SAME_ROBOT = 0.5
"""[m] Places of a robot that are nearer than this are of the same one."""
SELF = 0.3
"""[m] A robot that a team mate sees so near to the own place is this one."""
PLACE_MAX = 0.5
"""[m] The half is judged only while the own place has a smaller deviation."""


class TeamKnowledge:
    """The last message of each team mate."""

    def __init__(self) -> None:
        self._mates: dict[int, TeamMate] = {}
        self._judged: dict[int, int] = {}

    def add(self, mate: TeamMate) -> bool:
        """Keep what a team mate told, and say whether it is new.

        An older message does not replace a newer one.
        """
        before = self._mates.get(mate.number)
        since = math.inf if before is None else (mate.stamp - before.stamp) * 1e-9
        is_new = since > 0.0 or since < -SILENT
        if is_new:
            self._mates[mate.number] = mate
        return is_new

    def at(self, now: int) -> tuple[TeamMate, ...]:
        """Team mates who spoke lately, by their numbers."""
        return tuple(
            mate for _, mate in sorted(self._mates.items()) if abs(now - mate.stamp) <= SILENT * 1e9
        )

    def _balls(self, now: int) -> list[tuple[TeamMate, FloatArray, FloatArray, float]]:
        """Mate, place (2,), covariance (2, 2) and age [s] of each ball that is told, at `now`."""
        found = []
        for mate in self.at(now):
            if mate.ball is None or not mate.valid:
                continue
            since = max(0.0, (now - mate.stamp) * 1e-9)
            age = mate.ball.age + since
            if age <= BALL_AGE:
                growth = TEAM_ERROR**2 + (TOLD_DRIFT * age) ** 2
                covariance = matrix(mate.ball.covariance) + growth * np.eye(2)
                found.append((mate, np.array(mate.ball.position), covariance, age))
        return found

    def half_evidence(self, now: int, own: PoseEstimate, ball: BallEstimate | None) -> list[float]:
        """Log-likelihood ratios of the own pose over its mirror pose, one for each new message."""
        spread = max(own.covariance.xx, own.covariance.yy)
        if ball is None or not ball.seen_recently or spread > PLACE_MAX**2:
            return []
        place = np.array(ball.position_in_field)
        ratios = []
        for mate, told, covariance, _ in self._balls(now):
            if self._judged.get(mate.number) == mate.stamp:
                continue
            self._judged[mate.number] = mate.stamp
            total = matrix(ball.position_covariance_in_field) + covariance
            here, mirrored = (_log_fit(each - told, total) for each in (place, -place))
            ratios.append(RATIO_SHARE * (here - mirrored))
        return ratios

    def ball(self, now: int, own: PoseEstimate, seen: BallEstimate | None) -> BallEstimate | None:
        """The weighted mean of all balls that agree with the surest one, the own memory too.

        None if no team mate knows of one, or the own pose is not valid.
        """
        told = self._balls(now)
        if not told or not own.valid:
            return None
        places = [(place, covariance, age) for _, place, covariance, age in told]
        if seen is not None:
            covariance = matrix(seen.position_covariance_in_field)
            places.append((np.array(seen.position_in_field), covariance, seen.age))
        places.sort(key=lambda each: float(np.trace(each[1])))
        first = places[0]
        information = np.linalg.inv(first[1])
        weighted = information @ first[0]
        for place, covariance, _ in places[1:]:
            error = place - first[0]
            if error @ np.linalg.solve(first[1] + covariance, error) < GATE:
                part = np.linalg.inv(covariance)
                information, weighted = information + part, weighted + part @ place
        covariance = np.linalg.inv(information)
        place = covariance @ weighted
        moving = min(told, key=lambda each: each[3])[0].ball
        velocity = (0.0, 0.0) if moving is None else moving.velocity
        return _from_field(own, place, covariance, velocity, min(each[2] for each in places))


def half_by_robots(own: PoseEstimate, mate: TeamMate, seen: list[TeamRobot]) -> float:
    """Log-likelihood ratio of the own pose over its mirror pose, by who sees whom.

    Robots of the own colour that this robot has `seen` are compared with where the team mate is,
    those that the team mate saw with where this robot is. Other colours would mislead: before a
    kick-off opponents stand where the own mirror pose is.
    """
    spread = max(own.covariance.xx, own.covariance.yy)
    if not mate.valid or spread > PLACE_MAX**2:
        return 0.0

    def ratio(robots: list[TeamRobot], place: Point2) -> float:
        if not robots:
            return 0.0
        fits = [
            [
                _log_fit(
                    np.array(each.position) - side * np.array(place),
                    (spread + TEAM_ERROR**2 + (TOLD_DRIFT * each.age) ** 2) * np.eye(2),
                )
                for each in robots
            ]
            for side in (1.0, -1.0)
        ]
        return max(fits[0]) - max(fits[1])

    told = [each for each in mate.robots if each.mate]
    return RATIO_SHARE * (ratio(told, own.pose[:2]) + ratio(seen, mate.pose[:2]))


def in_field(
    own: PoseEstimate,
    position: Point2,
    velocity: Point2,
    covariance: Covariance2,
    velocity_covariance: Covariance2,
    *,
    age: float,
    seen_recently: bool,
) -> BallEstimate:
    """A ball in base_footprint, and in `field` by the own pose and its covariance."""
    x, y, yaw = own.pose
    px, py, _ = compose(own.pose, (*position, 0.0))
    turn = planar_rotation(yaw)
    by_pose = np.array(((1.0, 0.0, y - py), (0.0, 1.0, px - x)))
    total = turn @ matrix(covariance) @ turn.T + by_pose @ own.covariance.matrix @ by_pose.T
    return BallEstimate(
        position,
        velocity,
        covariance,
        (px, py),
        rotate_planar(*velocity, yaw),
        triple(total),
        triple(turn @ matrix(velocity_covariance) @ turn.T),
        age,
        seen_recently,
    )


def own_team_ball(ball: BallEstimate) -> TeamBall:
    """The ball as it is told to team mates."""
    return TeamBall(
        ball.position_in_field, ball.velocity_in_field, ball.position_covariance_in_field, ball.age
    )


def _from_field(
    own: PoseEstimate, place: FloatArray, covariance: FloatArray, velocity: Point2, age: float
) -> BallEstimate:
    """A ball of which only team mates know."""
    x, y, yaw = own.pose
    back = planar_rotation(-yaw)
    p = own.covariance
    position = back @ (place - (x, y))
    # An error of the own heading moves the ball about the robot.
    swing = p.yaw * np.outer((-position[1], position[0]), (-position[1], position[0]))
    near = back @ (covariance + ((p.xx, p.xy), (p.xy, p.yy))) @ back.T + swing
    return BallEstimate(
        point(position),
        rotate_planar(*velocity, -yaw),
        triple(near),
        point(place),
        velocity,
        triple(covariance),
        (1.0, 0.0, 1.0),
        age,
        seen_recently=False,
        by_team=True,
    )


def _log_fit(error: FloatArray, covariance: FloatArray) -> float:
    square = float(error @ np.linalg.solve(covariance, error))
    return math.log((1.0 - WRONG) * math.exp(-0.5 * square) + WRONG)


def with_told(
    seen: list[Obstacle], own: PoseEstimate, mates: list[TeamMate], now: int
) -> list[Obstacle]:
    """The robots that were seen, and those that team mates told of, at `now` [ns].

    Team mates tell where they are, and where they saw others. Of one robot the newest place counts,
    but that of a team mate that lies only if nothing else is known of it.
    """
    told = []
    for mate in mates:
        since = (now - mate.stamp) * 1e-9
        told.append(_told_obstacle(own, mate.pose[:2], since, mate.fallen))
        told += [
            _told_obstacle(own, each.position, since + each.age)
            for each in mate.robots
            if math.dist(each.position, own.pose[:2]) > SELF
        ]
    found = list(seen)
    for each in sorted(told, key=lambda robot: robot.age):
        apart = [math.dist(other.position, each.position) for other in found]
        if min(apart, default=math.inf) >= SAME_ROBOT:
            if each.age < ROBOT_MAX:
                found.append(each)
            continue
        nearest = apart.index(min(apart))
        known = found[nearest]
        if each.age < known.age and not each.fallen:
            found[nearest] = replace(each, team=known.team, fallen=known.fallen)
    return found


def _told_obstacle(
    own: PoseEstimate, place: Point2, age: float, fallen: bool = False
) -> Obstacle:
    """A robot to walk around, where a team mate told some time [s] ago that it is."""
    var = TEAM_ERROR**2
    x, y, _ = relative((*place, 0.0), own.pose)
    return Obstacle((x, y), place, (var, 0.0, var), (0.0, 0.0), None, fallen, age, by_team=True)
