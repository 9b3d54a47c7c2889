"""The server's fields, at the size of a player whose lengths are those of a NAO.

Behaviour and world model hold lengths that fit a NAO and its field. A robot that is s times as high
plays with the same numbers in a world whose lengths are divided by s.
"""

import math
from typing import NamedTuple

from robot_core.errors import NaoGaitError
from robot_core.field import SIDES, Field, Goals, Pole
from robot_core.types import Point2, Pose2

FIELD = "fifa7vs7"
"""The server's usual field: 55 x 36 m."""
BALL = 0.11
"""[m] radius of the server's ball."""
BORDER = 3.0
"""[m] of ground around the lines; robots come onto the field from its edge."""
_SIDE_NAMES = {-1.0: ("l", "l"), 1.0: ("r", "u")}
"""What the name of a landmark says of the sign of its x and of its y."""


class _Lengths(NamedTuple):
    """Lengths [m] of one of the server's fields."""

    field: Point2
    goal: tuple[float, float, float]  # depth, width, height
    goal_area: Point2
    penalty_area: Point2
    penalty_mark: float
    circle_radius: float


_FIELDS = {
    "fifa7vs7": _Lengths((55.0, 36.0), (1.0, 3.66, 1.83), (4.0, 7.3), (9.0, 16.5), 7.32, 5.5),
    "fifa": _Lengths((105.0, 68.0), (1.6, 7.32, 2.44), (5.5, 18.32), (16.5, 40.32), 11.0, 9.15),
}


class ServerField:
    """A field of the server; x points to the right goal. All lengths are divided by `size`.

    Raises:
        NaoGaitError: The server has no such field.
    """

    def __init__(self, name: str, size: float = 1.0) -> None:
        if name not in _FIELDS:
            raise NaoGaitError("field", name, ", ".join(_FIELDS))
        lengths = _FIELDS[name]
        self.size = size
        self.field = Field(
            length=lengths.field[0] / size,
            width=lengths.field[1] / size,
            line_width=0.1 / size,
            border=BORDER / size,
            goal_area_length=lengths.goal_area[0] / size,
            goal_area_width=lengths.goal_area[1] / size,
            penalty_area_length=lengths.penalty_area[0] / size,
            penalty_area_width=lengths.penalty_area[1] / size,
            penalty_mark=lengths.penalty_mark / size,
            circle_diameter=2.0 * lengths.circle_radius / size,
        )
        depth, width, height = (each / size for each in lengths.goal)
        self.goals = Goals(width=width, height=height, depth=depth, post_diameter=0.1 / size)
        self.marks = {key: (x / size, y / size) for key, (x, y) in _marks(lengths).items()}

    @property
    def poles(self) -> tuple[Pole, ...]:
        """The landmarks on the map of either team."""
        return tuple(Pole(x=x, y=y) for x, y in self.marks.values())

    def places(self, right: bool) -> dict[str, int]:
        """Which of the poles a landmark is for the team that defends the right goal, or the left.

        The field looks the same after half a turn, so that one map serves both teams.
        """
        turn = -1.0 if right else 1.0
        index = {place: index for index, place in enumerate(self.marks.values())}
        return {name: index[turn * x + 0.0, turn * y + 0.0] for name, (x, y) in self.marks.items()}

    def start(self, number: int, kicks_off: bool = False) -> Pose2:
        """Where a player begins, in the field of its team; 2 stands at the ball of a kick-off."""
        length, circle = self.field.length, self.field.circle_diameter / 2.0
        if number == 1:
            return 0.6 - length / 2.0, 0.0, 0.0
        if number == 2:
            return -0.6 if kicks_off else -circle - 0.4, 0.0, 0.0
        row, place = divmod(number - 3, 4)
        across = (0.2, -0.2, 0.36, -0.36)[place]
        return -circle - 0.4 - 0.1 * length * (row % 3), across * self.field.width, 0.0

    def spawn(self, number: int, right: bool) -> Pose2:
        """Where the server puts a player who joins, in the field of its team."""
        side = -1.0 if right else 1.0
        edge = self.field.width / 2.0 + BORDER / self.size
        return -(2.0 * number + 1.0) / self.size, side * edge, -side * math.pi / 2.0

    def entries(self) -> tuple[Pose2, ...]:
        """Where the referee drops a player beside the field, in the field of its team."""
        edge = self.field.width / 2.0 + BORDER / self.size
        return tuple(
            (-2.0 * count / self.size, side * edge, -side * math.pi / 2.0)
            for count in (1, 2, 3)
            for side in SIDES
        )


def _marks(lengths: _Lengths) -> dict[str, Point2]:
    """Landmarks [m]. Those of the areas are where the server has them: at twice their width."""
    half_x, half_y = lengths.field[0] / 2.0, lengths.field[1] / 2.0
    marks: dict[str, Point2] = {}
    for x, (left, _) in _SIDE_NAMES.items():
        marks[f"p_{left}pm"] = x * (half_x - lengths.penalty_mark), 0.0
        for y, (_, upper) in _SIDE_NAMES.items():
            corner = left + upper
            marks[f"l_{corner}f"] = x * half_x, y * half_y
            marks[f"g_{corner}p"] = x * half_x, y * lengths.goal[1] / 2.0
            for letter, (length, width) in (
                ("ga", lengths.goal_area), ("pa", lengths.penalty_area),
            ):  # fmt: skip
                marks[f"l_{corner}{letter}"] = x * (half_x - length), y * width
                marks[f"t_{corner}{letter}"] = x * half_x, y * width
    for y, (_, upper) in _SIDE_NAMES.items():
        marks[f"t_c{upper}f"] = 0.0, y * half_y
        marks[f"x_c{upper}c"] = 0.0, y * lengths.circle_radius
    return marks
