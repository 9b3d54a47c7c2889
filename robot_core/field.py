"""The soccer field: lines, goals and poles, as the rules of a game describe them.

The frame of the field has its origin in the centre of the field, x towards the goal of team blue, y
to the left, z up. Team red defends the goal at negative x. Lengths between lines are those between
the middles of the lines.
"""

import math
from collections.abc import Iterable
from dataclasses import dataclass
from enum import StrEnum

import attrs
import numpy as np

from robot_core.geometry import planar_rotation
from robot_core.schema import Choice, Sequence, Settings, field, number
from robot_core.types import FloatArray, Point2, Point3, Pose2

TEAMS = ("red", "blue")
"""The teams; the goal of the first one is at negative x."""
SIDES = (-1.0, 1.0)
"""Sign of the x of each team's own goal, in the order of `TEAMS`."""
COLORS: dict[str, tuple[float, float, float]] = {
    "white": (0.95, 0.95, 0.95),
    "yellow": (0.95, 0.80, 0.10),
    "blue": (0.10, 0.35, 0.85),
    "red": (0.85, 0.12, 0.12),
    "green": (0.10, 0.45, 0.16),
    "orange": (0.95, 0.45, 0.05),
    "black": (0.08, 0.08, 0.08),
}
"""Red, green and blue, 0 to 1, by name."""
CIRCLE_SEGMENTS = 64
"""Number of straight pieces in which the circle is painted: 1 mm from a circle of 1.5 m."""
MARK_LENGTH = 0.1
"""[m] length and width of the cross that marks the penalty spot and the centre."""
ENTRY_OUT = 0.2
"""[m] beyond the touch line at which a robot waits for the end of its penalty."""

_COLOR = Choice(tuple(COLORS))


class BallPlace(StrEnum):
    """Where a ball is."""

    IN_PLAY = "in_play"
    OUT = "out"
    IN_RED_GOAL = "in_red_goal"
    IN_BLUE_GOAL = "in_blue_goal"


class CrossingKind(StrEnum):
    """How two lines meet."""

    L = "L"
    T = "T"
    X = "X"


@dataclass(frozen=True, slots=True)
class Line:
    """A straight line on the field.

    Attributes:
        start: x, y [m] of the middle of the line at one end.
        end: x, y [m] at the other end.
    """

    start: Point2
    end: Point2


@dataclass(frozen=True, slots=True)
class Crossing:
    """A point where lines meet.

    Attributes:
        kind: `L` = two ends, `T` = an end on a line, `X` = two lines.
        x: [m].
        y: [m].
        heading: [rad] L: of the bisector of the two lines; T: of the line that ends, away from the
            crossing; X: of one of the lines.
    """

    kind: CrossingKind
    x: float
    y: float
    heading: float


@dataclass(frozen=True, slots=True)
class Marking:
    """A painted rectangle.

    Attributes:
        x: [m] of its centre.
        y: [m] of its centre.
        length: [m] along its heading.
        width: [m] across.
        heading: [rad].
    """

    x: float
    y: float
    length: float
    width: float
    heading: float

    def corners(self) -> tuple[Point2, ...]:
        """x, y [m] of the four corners, counter-clockwise."""
        c, s = math.cos(self.heading), math.sin(self.heading)
        half = self.length / 2.0, self.width / 2.0
        return tuple(
            (self.x + i * half[0] * c - j * half[1] * s, self.y + i * half[0] * s + j * half[1] * c)
            for i, j in ((-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0))
        )


@attrs.frozen
class Goals(Settings):
    """The two goals, one in the middle of each goal line."""

    width: float = number(1.5, 0.2, 10.0, "m", "Clear width between the posts.")
    height: float = number(0.8, 0.2, 5.0, "m", "Clear height under the bar.")
    depth: float = number(0.5, 0.1, 3.0, "m", "From the middle of the goal line to the net.")
    post_diameter: float = number(0.1, 0.02, 0.5, "m", "Diameter of posts and bar.")
    colors: tuple[str, str] = field(
        Sequence(_COLOR, 2, 2), ("white", "white"), "Colours of red's and of blue's goal."
    )


@attrs.frozen
class Pole(Settings):
    """A landmark beside the field."""

    x: float = number(minimum=-50.0, maximum=50.0, unit="m", meaning="Centre, x.")
    y: float = number(minimum=-50.0, maximum=50.0, unit="m", meaning="Centre, y.")
    diameter: float = number(0.2, 0.02, 1.0, "m", "Diameter.")
    height: float = number(0.6, 0.1, 5.0, "m", "Height.")
    colors: tuple[str, ...] = field(
        Sequence(_COLOR, 1), ("yellow", "blue", "yellow"), "Colours of its bands, from below."
    )


@attrs.frozen
class Field(Settings):
    """The lines of a field; a length of 0 leaves its line out."""

    length: float = number(9.0, 1.0, 100.0, "m", "Between the goal lines.")
    width: float = number(6.0, 1.0, 100.0, "m", "Between the touch lines.")
    line_width: float = number(0.05, 0.01, 0.2, "m", "Width of the lines.")
    border: float = number(0.7, 0.0, 10.0, "m", "Carpet beyond the outer lines.")
    goal_area_length: float = number(0.6, 0.0, 10.0, "m", "Goal area in x.")
    goal_area_width: float = number(2.2, 0.0, 50.0, "m", "Goal area in y.")
    penalty_area_length: float = number(1.65, 0.0, 20.0, "m", "Penalty area in x.")
    penalty_area_width: float = number(4.0, 0.0, 50.0, "m", "Penalty area in y.")
    penalty_mark: float = number(1.3, 0.0, 20.0, "m", "Penalty mark from the goal line.")
    circle_diameter: float = number(1.5, 0.0, 20.0, "m", "Diameter of the centre circle.")

    def areas(self) -> tuple[Point2, ...]:
        """Length and width [m] of the areas in front of each goal."""
        pairs = (
            (self.goal_area_length, self.goal_area_width),
            (self.penalty_area_length, self.penalty_area_width),
        )
        return tuple((length, width) for length, width in pairs if length > 0.0 and width > 0.0)

    def lines(self) -> tuple[Line, ...]:
        """The straight lines."""
        x, y = self.length / 2.0, self.width / 2.0
        lines = [Line((-x, side * y), (x, side * y)) for side in SIDES]
        lines += [Line((side * x, -y), (side * x, y)) for side in SIDES]
        lines.append(Line((0.0, -y), (0.0, y)))
        for side in SIDES:
            for length, width in self.areas():
                front, half = side * (x - length), width / 2.0
                lines.append(Line((front, -half), (front, half)))
                lines += [Line((side * x, j * half), (front, j * half)) for j in SIDES]
        return tuple(lines)

    def points_on_lines(self, spacing: float) -> FloatArray:
        """(n, 2) [m] Points on all lines and the circle, about `spacing` apart."""
        pieces = []
        for line in self.lines():
            count = max(2, round(math.dist(line.start, line.end) / spacing) + 1)
            pieces.append(np.linspace(line.start, line.end, count))
        if self.circle_diameter:
            count = round(math.pi * self.circle_diameter / spacing)
            angle = math.tau / count * np.arange(count)
            circle = np.column_stack((np.cos(angle), np.sin(angle)))
            pieces.append(0.5 * self.circle_diameter * circle)
        return np.concatenate(pieces)

    def marks(self) -> tuple[Point2, ...]:
        """x, y [m] of the centre mark and the penalty marks."""
        if not self.penalty_mark:
            return ((0.0, 0.0),)
        x = self.length / 2.0 - self.penalty_mark
        return (-x, 0.0), (0.0, 0.0), (x, 0.0)

    def crossings(self) -> tuple[Crossing, ...]:
        """All points where lines meet."""
        x, y = self.length / 2.0, self.width / 2.0
        kind, found = CrossingKind, []
        for i in SIDES:
            for j in SIDES:
                found.append(Crossing(kind.L, i * x, j * y, math.atan2(-j, -i)))
            along = 0.0 if i < 0.0 else math.pi  # into the field
            for length, width in self.areas():
                for j in SIDES:
                    edge = j * width / 2.0
                    found.append(Crossing(kind.T, i * x, edge, along))
                    found.append(Crossing(kind.L, i * (x - length), edge, math.atan2(-j, i)))
            found.append(Crossing(kind.T, 0.0, i * y, -i * math.pi / 2.0))
            if self.circle_diameter:
                circle = Crossing(kind.X, 0.0, i * self.circle_diameter / 2.0, math.pi / 2.0)
                found.append(circle)
        return tuple(found)

    def markings(self) -> tuple[Marking, ...]:
        """All that is painted on the carpet, as rectangles."""
        painted = []
        for line in self.lines():
            (x0, y0), (x1, y1) = line.start, line.end
            painted.append(
                Marking(
                    (x0 + x1) / 2.0,
                    (y0 + y1) / 2.0,
                    math.hypot(x1 - x0, y1 - y0) + self.line_width,
                    self.line_width,
                    math.atan2(y1 - y0, x1 - x0),
                )
            )
        for x, y in self.marks():
            painted.append(Marking(x, y, MARK_LENGTH, self.line_width, 0.0))
            painted.append(Marking(x, y, MARK_LENGTH, self.line_width, math.pi / 2.0))
        radius = self.circle_diameter / 2.0
        if radius:
            step = math.tau / CIRCLE_SEGMENTS
            length = 2.0 * (radius + self.line_width / 2.0) * math.tan(step / 2.0)
            for i in range(CIRCLE_SEGMENTS):
                x, y = radius * math.cos(i * step), radius * math.sin(i * step)
                painted.append(Marking(x, y, length, self.line_width, i * step + math.pi / 2.0))
        return tuple(painted)

    def entries(self) -> tuple[Pose2, Pose2]:
        """x, y [m], yaw [rad] beside the left and the right touch line, in the own team's field.

        There robots come back from a penalty: at the height of the own penalty mark, looking into
        the field.
        """
        x, y = -self.length / 2.0 + (self.penalty_mark or 0.15 * self.length), self.width / 2.0
        return (x, y + ENTRY_OUT, -math.pi / 2.0), (x, -y - ENTRY_OUT, math.pi / 2.0)

    def posts(self, goals: Goals) -> tuple[Point2, ...]:
        """x, y [m] of the middles of the posts: red's right and left, then blue's."""
        half = (goals.width + goals.post_diameter) / 2.0
        return tuple((i * self.length / 2.0, j * half) for i in SIDES for j in SIDES)

    def place_of(self, ball: Point3, radius: float, goals: Goals | None) -> BallPlace:
        """Where a ball is: it has left the field when all of it is beyond the line.

        Args:
            ball: x, y, z [m] of its centre.
            radius: [m].
            goals: The goals; None = there are none.
        """
        x, y, z = ball
        beyond = self.line_width / 2.0 + radius
        ahead = abs(x) - self.length / 2.0
        if ahead <= beyond and abs(y) <= self.width / 2.0 + beyond:
            return BallPlace.IN_PLAY
        inside = goals is not None and (
            ahead > beyond
            and ahead < goals.depth
            and abs(y) < goals.width / 2.0
            and z < goals.height
        )
        if not inside:
            return BallPlace.OUT
        return BallPlace.IN_RED_GOAL if x < 0.0 else BallPlace.IN_BLUE_GOAL


def faults(field: Field, goals: Goals | None) -> Iterable[tuple[str, float, str]]:
    """Lengths that do not fit each other: key, value and what is allowed."""
    half, across = field.length / 2.0, field.width
    for name in ("goal_area", "penalty_area"):
        length, width = getattr(field, f"{name}_length"), getattr(field, f"{name}_width")
        if length >= half:
            yield f"field.{name}_length", length, f"less than half of the field, {half:g} m"
        if width >= across:
            yield f"field.{name}_width", width, f"less than the field's width, {across:g} m"
    if field.penalty_mark >= half:
        yield "field.penalty_mark", field.penalty_mark, f"less than half of the field, {half:g} m"
    if field.circle_diameter >= min(field.length, across):
        yield "field.circle_diameter", field.circle_diameter, "less than the field's width"
    if goals is not None and goals.width + 2.0 * goals.post_diameter >= across:
        yield "goals.width", goals.width, f"less than the field's width, {across:g} m"


def seen_from(pose: Pose2, places: FloatArray) -> FloatArray:
    """Places (n, 2) [m] of the field in a frame at a pose [m, rad], such as base_footprint."""
    result: FloatArray = (places - pose[:2]) @ planar_rotation(pose[2])
    return result
