"""Rules of the technical challenges of the RoboCup Standard Platform League: places and referees.

The rules are those of the league's "Hall of Fame Leaderboards" of 2025 (repository SPL-Rules,
leaderboards/leaderboard_challenges.tex; places as in figs/leaderboards/generate_leaderboards.py).
Robots play towards positive x, and walk towards positive y.
"""

import math
from collections.abc import Iterable, Sequence
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from robot_core.field import Field
from robot_core.types import Point2, Pose2

BEHIND_LINE = 0.5
"""[m] from the touchline to the front of the feet at the start."""
FOOT_FRONT = 0.09
"""[m] from base_footprint to the front of a NAO's feet."""
SIDES = (-1.0, 1.0, -1.0, 1.0)
"""On which side of each obstacle the example path passes, along x."""
AWAY = 0.75
"""[m] between ball and robot, the middle of its feet, above which there is a penalty."""
PENALTY = 30.0
"""[s]"""
QUIET = 0.5
"""[s] A ball that touches again sooner, or leaves again sooner, is still the same penalty."""
MOVED = 0.1
"""[m] A ball that has moved so far has clearly moved."""
KICK_TIME = 30.0
"""[s] for one kick."""
AT_REST = 0.02
"""[m/s] A slower ball is at rest."""
LIMIT = 120.0
"""[s] after which an attempt has failed."""
BEYOND = 1.0
"""[m] beyond the target touchline, to which the way leads: the robot does not slow down before."""
ARC = 0.3
"""[rad] of an arc that is walked as a straight piece."""


# -- the field ------------------------------------------------------------------------------------


class Course(NamedTuple):
    """Where everything is, in the field.

    Attributes:
        x: [m] of the line from penalty mark to penalty mark, on which robot and ball start.
        touchline: [m] y of the target touchline; the robot starts beyond the other one.
        line: [m] Half of the width of a line.
        obstacles: x, y [m] of the robots that stand still, in the order in which they are passed.
        goal_area: [m] x of the edge of the own goal area.
        targets: x, y [m] to which the ball is kicked.
    """

    x: float
    touchline: float
    line: float
    obstacles: tuple[Point2, ...]
    goal_area: float
    targets: tuple[Point2, ...]

    @classmethod
    def on(cls, field: Field) -> "Course":
        """On a field."""
        goal, side = field.length / 2.0, field.width / 2.0
        mark, edge = goal - field.penalty_mark, goal - field.goal_area_length
        corner = field.goal_area_width / 2.0
        obstacles = (
            (goal - field.penalty_area_length, -field.penalty_area_width / 2.0),
            (edge, -corner), (mark, 0.0), (edge, corner),
        )  # fmt: skip
        targets = (0.0, 0.0), (mark, 0.0), (goal, side)
        return cls(mark, side, field.line_width / 2.0, obstacles, -edge, targets)

    @property
    def start(self) -> Pose2:
        """Of the robot before it walks across the field."""
        return self.x, -self.touchline - BEHIND_LINE - FOOT_FRONT, math.pi / 2.0

    def way(self, *past: "Past") -> "Way":
        """Across the field, as short as it can be on the given sides of some circles."""
        end = self.x, self.touchline
        circles = Past(self.start[:2], 0.0), *past, Past(end, 0.0)
        headings = [_tangent(first, second) for first, second in pairwise(circles)]
        points = [self.start[:2]]
        for ((x, y), radius), (before, after) in zip(past, pairwise(headings), strict=True):
            turn = math.remainder(after - before, math.tau)
            count = 1 + math.ceil(abs(turn) / ARC)
            for heading in (before + share * turn for share in np.linspace(0.0, 1.0, count)):
                points.append((x + radius * math.sin(heading), y - radius * math.cos(heading)))
        return Way((*points, end, (self.x, self.touchline + BEYOND)))


class Past(NamedTuple):
    """A circle that a way leads past.

    Attributes:
        middle: x, y [m].
        radius: [m], positive if the circle is on the left of the way.
    """

    middle: Point2
    radius: float


def _tangent(first: Past, second: Past) -> float:
    """Heading [rad] of the straight line from one circle to the next."""
    dx, dy = second.middle[0] - first.middle[0], second.middle[1] - first.middle[1]
    across = (second.radius - first.radius) / math.hypot(dx, dy)
    return math.atan2(dy, dx) - math.asin(across)


class Way:
    """A way of straight pieces between at least two points x, y [m] in the field."""

    def __init__(self, points: Sequence[Point2]) -> None:
        self.points = tuple(points)

    def ahead(self, place: Point2, distance: float) -> Point2:
        """The point of the way that is ahead of what is next to a place by a distance [m]."""
        nearest, index, rest = math.inf, 0, 0.0
        for number, (start, end) in enumerate(pairwise(self.points)):
            length = math.dist(start, end)
            ux, uy = (end[0] - start[0]) / length, (end[1] - start[1]) / length
            along = (place[0] - start[0]) * ux + (place[1] - start[1]) * uy
            along = min(max(along, 0.0), length)
            gap = math.dist(place, (start[0] + along * ux, start[1] + along * uy))
            if gap < nearest:
                nearest, index, rest = gap, number, along + distance
        for start, end in pairwise(self.points[index:]):
            length = math.dist(start, end)
            if rest <= length:
                share = rest / length
                return (
                    start[0] + share * (end[0] - start[0]), start[1] + share * (end[1] - start[1])
                )  # fmt: skip
            rest -= length
        return self.points[-1]


# -- referees --------------------------------------------------------------------------------------


class Events:
    """Counts how often something begins."""

    def __init__(self) -> None:
        self.count = 0
        self._last = -math.inf

    def update(self, time: float, *, happens: bool) -> None:
        """Whether it happens now [s]; within `QUIET` it is still the same event."""
        if happens:
            self.count += time > self._last + QUIET
            self._last = time


class WalkReferee:
    """Takes the time of a walk across the field.

    Args:
        course: Where everything is.
        weaves: The robot has to pass the obstacles on the sides of the example path.

    Attributes:
        began: [s] at which the robot touched the first touchline; None = not yet.
        ended: [s] at which it touched the target; None = not yet.
    """

    def __init__(self, course: Course, *, weaves: bool) -> None:
        self.began: float | None = None
        self.ended: float | None = None
        self.touched = False
        self.passed = True
        self._course = course
        self._obstacles = course.obstacles if weaves else ()
        self._place = course.start[:2]

    def update(
        self, time: float, place: Point2, feet: Iterable[Point2], *, touches: bool = False
    ) -> None:
        """At `time` [s]: robot, points of the soles that stand, whether it touches an obstacle."""
        course = self._course
        front = max((y for _, y in feet), default=-math.inf)
        if self.began is None and front >= -course.touchline - course.line:
            self.began = time
        if self.ended is None and front >= course.touchline - course.line:
            self.ended = time
        self.touched = self.touched or touches
        for (x, y), side in zip(self._obstacles, SIDES, strict=False):
            if self._place[1] < y <= place[1] and (place[0] - x) * side < 0.0:
                self.passed = False
        self._place = place

    @property
    def seconds(self) -> float | None:
        """[s] from line to line; None if it is not there, or not by the rules."""
        if self.began is None or self.ended is None or self.touched or not self.passed:
            return None
        return self.ended - self.began


class ControlReferee:
    """Takes the time of a dribbling robot, and its penalties.

    Args:
        course: Where everything is.
        radius: Of the ball [m].

    Attributes:
        ended: [s] at which ball and robot were beyond the target; None = not yet.
    """

    def __init__(self, course: Course, radius: float) -> None:
        self.away, self.contacts = Events(), Events()
        self.ended: float | None = None
        self._beyond = course.touchline + course.line
        self._radius = radius

    def update(
        self, time: float, ball: Point2, place: Point2, feet: Iterable[Point2], *, touches: bool
    ) -> None:
        """At `time` [s]: ball, robot, points of soles, whether the ball touches an obstacle."""
        self.away.update(time, happens=math.dist(ball, place) > AWAY)
        self.contacts.update(time, happens=touches)
        last = min(ball[1] - self._radius, *(y for _, y in feet))
        if self.ended is None and last > self._beyond:
            self.ended = time

    @property
    def penalties(self) -> int:
        """Their number."""
        return self.away.count + self.contacts.count

    @property
    def seconds(self) -> float | None:
        """[s] with penalties; None if ball and robot are not there."""
        return None if self.ended is None else self.ended + PENALTY * self.penalties


class KickReferee:
    """Measures how near to its target a kicked ball comes to rest.

    Attributes:
        distance: [m] to the target; None = not at rest, or not kicked in time.
    """

    def __init__(self, ball: Point2, target: Point2) -> None:
        self.distance: float | None = None
        self.again = self.over = False
        self._start, self._target = ball, target
        self._moved = self._free = False

    def update(self, time: float, ball: Point2, speed: float, *, touches: bool) -> None:
        """At `time` [s]: ball and its speed [m/s], whether the robot touches it."""
        self._moved = self._moved or math.dist(ball, self._start) > MOVED
        if not self._moved:
            self.over = time > KICK_TIME
            return
        self.again = self._free and touches
        self._free = self._free or not touches
        rests = self._free and speed < AT_REST
        if rests and not self.again:
            self.distance = math.dist(ball, self._target)
        self.over = rests or self.again or time > LIMIT
